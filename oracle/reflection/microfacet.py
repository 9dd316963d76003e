"""Rough surfaces made of mirrors too small to see: densities of their normals, masking and shadowing.

Directions are unit vectors that point away from the surface in its local frame: z is the surface's normal, x and y are
the axes of its roughness. `alpha` is the parameter of the distributions themselves; a renderer's "roughness" is often
its square root. A microfacet's slopes have the root mean square alpha/sqrt(2) along each axis for Beckmann, and an
infinite one for GGX.

Masking is Smith's. Seen together, two directions are by default height-correlated, ``G2 = 1/(1 + Lambda_i + Lambda_o)``
[Ross, Sikkens and Reece 2005; Heitz 2014]; `separable` chooses ``G2 = G1_i G1_o`` instead [Walter et al. 2007], as
many renderers do. Both are also used through the surface. The Beckmann masking is exact; renderers mostly use Walter's
rational fit, which differs by up to 0.4 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, direction, dot, replace
from oracle.bounded import Bounded
from oracle.reflection.domain import together, within

_EPSILON = float(np.finfo(np.float64).eps)

# Unit vectors come out of their check with every component right to so much, relative to itself.
COMPONENT = 4 * _EPSILON


@dataclass(frozen=True, eq=False)
class _Distribution:
    alpha: Floats
    alpha_y: Floats | None = None

    def __post_init__(self) -> None:
        why = "alpha is from 1e-4 to 10"
        alpha = within("alpha", self.alpha, 1e-4, 10, why)
        alpha_y = alpha if self.alpha_y is None else within("alpha_y", self.alpha_y, 1e-4, 10, why)
        alpha, alpha_y = together(alpha=alpha, alpha_y=alpha_y)
        replace(self, alpha=alpha, alpha_y=alpha_y)

    @property
    def alphas(self) -> tuple[Floats, Floats]:
        """Roughness along x and along y."""
        assert self.alpha_y is not None
        return self.alpha, self.alpha_y


class GGX(_Distribution):
    """Normals of a stretched ellipsoid, ``D = 1 / (pi a_x a_y (m_x^2/a_x^2 + m_y^2/a_y^2 + m_z^2)^2)``.

    Trowbridge and Reitz [1975], Walter et al. [2007]. Roughness `alpha` from 1e-4 to 10, shape (...), along x, and also
    along y unless `alpha_y` is given.
    """


class Beckmann(_Distribution):
    """Gaussian slopes, ``D = exp(-(m_x^2/a_x^2 + m_y^2/a_y^2) / m_z^2) / (pi a_x a_y m_z^4)``.

    Beckmann and Spizzichino [1963]. Roughness `alpha` from 1e-4 to 10, shape (...), along x, and also along y unless
    `alpha_y` is given.
    """


Distribution: TypeAlias = GGX | Beckmann


def normal_density(distribution: Distribution, normals: ArrayLike) -> Bounded:
    """Area of microfacets for each solid angle of their normals and area of the surface, D [1/sr].

    Parameters
    ----------
    distribution : GGX or Beckmann
        Roughness of a shape that broadcasts with (...).
    normals : array_like, shape (..., 3)
        Unit vectors; D is 0 for those with z <= 0.

    Returns
    -------
    Bounded
        D with its bound, shape (...). Its integral over solid angle, times the normals' z, is 1.

    Raises
    ------
    InvalidArgument
        If a vector is not a unit vector or shapes do not fit together.
    """
    m, alphas = local(distribution, normals)
    return density(distribution, m, COMPONENT * np.abs(m), alphas)


def masking(distribution: Distribution, directions: ArrayLike) -> Bounded:
    """Part of the microfacets facing a direction that is seen from it, Smith's G1; 0 along the surface.

    Arguments and errors are those of `normal_density`; the surface looks alike from both sides:
    only |z| counts.

    Notes
    -----
    ``G1 = z / sigma``, where sigma is the projected area of the microfacets that face the direction [Smith 1967;
    Heitz 2014]. For GGX sigma is ``(z + sqrt(z^2 + a_x^2 x^2 + a_y^2 y^2))/2``, for Beckmann
    ``(z (1 + erf a) + r exp(-a^2)/sqrt(pi))/2`` with ``r^2 = a_x^2 x^2 + a_y^2 y^2`` and ``a = z/r``. Nothing cancels.
    """
    w, alphas = local(distribution, directions)
    area, z = seen(distribution, w, alphas)
    value = z / area
    return Bounded(value, 20 * _EPSILON * value)


def masking_shadowing(
    distribution: Distribution, first: ArrayLike, second: ArrayLike, separable: bool = False
) -> Bounded:
    """Part of the microfacets facing two directions that is seen from both, Smith's G2; 0 along the surface.

    Arguments and errors are those of `normal_density`, for two directions; only their |z| count.
    """
    w, alphas = local(distribution, first)
    v, _ = local(distribution, second)
    both = np.abs(w[..., 2] * v[..., 2])
    reach = covered(*seen(distribution, w, alphas), *seen(distribution, v, alphas), separable)
    value = np.where(both > 0, both / np.where(both > 0, reach, 1.0), 0.0)
    return Bounded(value, 100 * _EPSILON * value)


def visible_normal_density(distribution: Distribution, directions: ArrayLike, normals: ArrayLike) -> Bounded:
    """Density [1/sr] of the normals seen from a direction, ``D_w(m) = G1(w) max(0, w . m) D(m) / w_z``.

    Parameters
    ----------
    distribution : GGX or Beckmann
        Roughness of a shape that broadcasts with (...).
    directions, normals : array_like, shape (..., 3)
        Unit vectors with z >= 0 for the directions; 0 for normals with z <= 0 or turned away.

    Returns
    -------
    Bounded
        The density with its bound, shape (...). Its integral over solid angle is 1, and so it is what a renderer
        divides by that samples visible normals [Heitz and d'Eon 2014].

    Raises
    ------
    InvalidArgument
        If a vector is not a unit vector, a direction comes from below, or shapes do not fit together.
    """
    w, alphas = local(distribution, directions)
    within("directions[..., 2]", w[..., 2], 0, 1, "microfacets are looked at from above")
    m, _ = local(distribution, normals)
    facets = density(distribution, m, COMPONENT * np.abs(m), alphas)
    facing = np.maximum(dot(w, m), 0.0)
    area, _ = seen(distribution, w, alphas)
    factor = facing / area
    doubt = 4 * COMPONENT * dot(np.abs(w), np.abs(m)) / area
    value = facets.value * factor
    return Bounded(value, facets.error * factor + facets.value * doubt + 20 * _EPSILON * value)


# ------------------------------------------------------------------------------------------------------- kernels


def projected_area(distribution: Distribution, z: Floats, rough: Floats) -> Floats:
    """Area of the microfacets that face a direction, projected along it, for each area of the surface.

    `z` >= 0 is the direction's cosine and `rough` its ``hypot(a_x x, a_y y)``. The result is never below z.
    """
    match distribution:
        case GGX():
            ggx: Floats = (z + np.hypot(z, rough)) / 2
            return ggx
        case Beckmann():
            from scipy.special import erf

            # Beyond 30 nothing is left of the exponential.
            smooth = rough <= z / 30
            a = np.where(smooth, 30.0, z / np.where(smooth, 1.0, rough))
            beckmann: Floats = (z * (1 + erf(a)) + rough * np.exp(-(a**2)) / np.sqrt(np.pi)) / 2
            return beckmann


def covered(area_w: Floats, z_w: Floats, area_v: Floats, z_v: Floats, separable: bool) -> Floats:
    """``z_w z_v / G2`` of two directions from their projected areas; 0 only if both lie in the surface."""
    if separable:
        return area_w * area_v
    result: Floats = area_w * z_v + area_v * z_w - z_w * z_v
    return result


def seen(distribution: Distribution, w: Floats, alphas: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Projected area and |z| of directions."""
    z, rough = np.abs(w[..., 2]), np.hypot(alphas[0] * w[..., 0], alphas[1] * w[..., 1])
    return projected_area(distribution, z, rough), z


def density(distribution: Distribution, m: Floats, m_error: Floats, alphas: tuple[Floats, Floats]) -> Bounded:
    """D of vectors of any length with errors in their components; 0 for z <= 0."""
    up = m[..., 2] > 0
    # Beckmann has nothing left long before, and GGX no longer changes.
    z = np.where(up, np.maximum(m[..., 2], 1e-100), 1.0)
    a_x, a_y = alphas
    x, y = m[..., 0] / a_x, m[..., 1] / a_y
    length_squared = dot(m, m)
    length_squared = np.where(length_squared > 0, length_squared, 1.0)
    scale = length_squared**2 / (np.pi * a_x * a_y)
    tilt = x**2 + y**2
    tilt_error = 2 * (np.abs(x) * m_error[..., 0] / a_x + np.abs(y) * m_error[..., 1] / a_y) + 6 * _EPSILON * tilt
    doubt = 4 * dot(np.abs(m), m_error) / length_squared + 20 * _EPSILON
    least = np.full_like(scale, np.finfo(np.float64).tiny)
    match distribution:
        case GGX():
            total = z**2 + tilt
            value = scale / total**2
            doubt = doubt + 2 * (tilt_error + 2 * z * m_error[..., 2]) / total
        case Beckmann():
            exponent = tilt / z**2
            # Beyond 700 the exponential leaves float64.
            kept = np.minimum(exponent, 700.0)
            value = np.where(exponent < 700, scale * np.exp(-kept) / np.where(exponent < 700, z, 1.0) ** 4, 0.0)
            shift = tilt_error / z**2 + 2 * kept * m_error[..., 2] / z
            doubt = doubt + np.expm1(np.minimum(shift, 100.0)) + 4 * m_error[..., 2] / z
            # There D = scale e^2 exp(-e) / tilt^2 is below what it would be at an exponent e of 698.
            beyond = exponent >= 700
            least = np.where(beyond, scale * 4e-298 / np.where(beyond, tilt, 1.0) ** 2 + least, least)
    return Bounded(np.where(up, value, 0.0), np.where(up, value * doubt + least, 0.0))


def local(distribution: Distribution, directions: ArrayLike) -> tuple[Floats, tuple[Floats, Floats]]:
    """Checked directions, and the roughness along x and y, which must broadcast with them."""
    w = direction("directions", directions)
    a_x, a_y = distribution.alphas
    together(directions=w[..., 0], alpha=a_x)
    return w, (a_x, a_y)
