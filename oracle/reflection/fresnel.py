"""Reflection and refraction at a smooth interface: Fresnel's equations, Snell's law and what follows from them.

Conventions. `cosine` is that of the angle between the surface's normal and the direction towards the light: positive
in front of the surface, negative behind it. `eta` is the refractive index behind the surface divided by that in front;
light from behind sees the inverse. A conductor adds the extinction coefficient `k >= 0` relative to the same index;
eta + i k belongs to waves exp(-i omega t), the one sign for which an absorbing medium absorbs. Magnetism is ignored.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Booleans, Floats, InvalidArgument, direction, dot
from oracle.bounded import Bounded
from oracle.reflection.domain import together, within
from oracle.reflection.interface import Polarised, interface

_EPSILON = float(np.finfo(np.float64).eps)

# From vacuum to the largest index anyone has measured there is plenty of room, and no product leaves float64.
_LOWEST, _HIGHEST = 1e-6, 1e6


def dielectric_reflectance(cosine: ArrayLike, eta: ArrayLike) -> Polarised:
    """Fraction of light that a smooth dielectric interface reflects, from either side.

    Parameters
    ----------
    cosine : array_like, shape (...)
        Cosine of the angle of incidence, from -1 to 1; negative for light from behind.
    eta : array_like, shape (...)
        Refractive index behind the surface relative to that in front, from 1e-6 to 1e6. With 1 there is no interface
        and no reflection, not even of light along it.

    Returns
    -------
    Polarised
        Reflectances with bounds, each of the broadcast shape; exactly 1 in total internal reflection.

    Raises
    ------
    InvalidArgument
        If an argument is not finite, outside its domain, or shapes do not fit together.

    Notes
    -----
    Fresnel [1823; Born and Wolf 1999, section 1.5.2], with both numerators rationalised,
    ``r_s = -(n_t^2 - n_i^2) / (n_i cos_i + n_t cos_t)^2`` and
    ``r_p = (n_t^2 - n_i^2) ((n_t^2 + n_i^2) cos_i^2 - n_i^2) / (n_t^2 cos_i + n_i n_t cos_t)^2``,
    so that nothing cancels for eta near 1. The differences that vanish at the critical angle and at Brewster's are
    taken with twice the digits.
    """
    return _dielectric(cosine, eta)[0]


def dielectric_transmittance(cosine: ArrayLike, eta: ArrayLike) -> Polarised:
    """Fraction of light that a smooth dielectric interface lets through, from either side.

    1 minus the reflectance, but with a small error relative to itself also at grazing incidence. It is a fraction of
    power; radiance is besides multiplied by the squared ratio of the indices, that of the far side over the near.
    Arguments, errors and source are those of `dielectric_reflectance`.
    """
    return _dielectric(cosine, eta)[1]


def conductor_reflectance(cosine: ArrayLike, eta: ArrayLike, k: ArrayLike) -> Polarised:
    """Fraction of light that a smooth conductor reflects.

    Parameters
    ----------
    cosine : array_like, shape (...)
        Cosine of the angle of incidence, from 0 to 1.
    eta, k : array_like, shape (...)
        Real and imaginary part of the conductor's index relative to the medium in front, from 0 to 1e6; not both
        below 1e-6.

    Returns
    -------
    Polarised
        Reflectances with bounds, each of the broadcast shape.

    Raises
    ------
    InvalidArgument
        If an argument is not finite, outside its domain, or shapes do not fit together.

    Notes
    -----
    The equations of `dielectric_reflectance` with a complex n_t [Born and Wolf 1999, section 14.2].
    """
    c = within("cosine", cosine, 0, 1, "a cosine before a conductor is from 0 to 1")
    n, extinction = checked_conductor(eta, k)
    c, n, extinction = together(cosine=c, eta=n, k=extinction)
    return interface(c, np.zeros_like(c), np.ones_like(c), n, extinction).reflectance


def refracted_cosine(cosine: ArrayLike, eta: ArrayLike) -> Bounded:
    """Cosine of the angle between the normal's line and the refracted ray, at least 0; 0 in total internal reflection.

    Arguments and errors are those of `dielectric_reflectance`.

    Notes
    -----
    Snell's law, ``n_t cos_t = sqrt(n_t^2 - n_i^2 + n_i^2 cos_i^2)``.
    """
    c, near, far = _sides(cosine, eta)
    found = interface(c, np.zeros_like(c), near, far, np.zeros_like(c))
    value = np.minimum(found.q.real / far, 1.0)
    return Bounded(value, found.q_error / far + 2 * _EPSILON * value)


def reflect(directions: ArrayLike, normals: ArrayLike) -> Floats:
    """Mirror unit vectors that point away from a surface at its normals; right to a few ulp of 1.

    Parameters
    ----------
    directions, normals : array_like, shape (..., 3)
        Unit vectors; the directions may lie on either side.

    Returns
    -------
    ndarray, shape (..., 3)
        ``2 (n . w) n - w``, where light from `directions` goes.

    Raises
    ------
    InvalidArgument
        If a vector is not a unit vector or shapes do not fit together.
    """
    w, n = _vectors(directions, normals)
    result: Floats = 2 * dot(n, w)[..., None] * n - w
    return result


def refract(directions: ArrayLike, normals: ArrayLike, eta: ArrayLike) -> Floats:
    """Where light goes that arrives from `directions` and is transmitted; right to a few ulp of 1.

    Parameters
    ----------
    directions, normals : array_like, shape (..., 3)
        Unit vectors that point away from the surface; the directions may lie on either side.
    eta : array_like, shape (...)
        As in `dielectric_reflectance`.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors; 0 in total internal reflection. Towards the critical angle they lose up to half of their digits
        to the rounding of the directions.

    Raises
    ------
    InvalidArgument
        If a vector is not a unit vector, eta outside its domain, or shapes do not fit together.

    Notes
    -----
    Snell's law in vector form, ``t = -w n_i/n_t + (n_i/n_t cos_i - cos_t) n`` for w in front.
    """
    w, n = _vectors(directions, normals)
    cosine = np.clip(dot(n, w), -1.0, 1.0)
    c, near, far = _sides(cosine, eta)
    found = interface(c, np.zeros_like(c), near, far, np.zeros_like(c))
    ratio = near / far
    along = np.where(cosine >= 0, 1.0, -1.0) * (ratio * c - found.q.real / far)
    result: Floats = along[..., None] * n - ratio[..., None] * w
    result[~(found.q.real > 0)] = 0
    return result


def brewster_angle(eta: ArrayLike) -> Floats:
    """Angle of incidence [rad] from the front at which parallel polarised light is not reflected; a few ulp.

    ``arctan(eta)`` [Brewster 1815], shape (...); from behind it is the complement to pi/2.
    """
    return np.arctan(checked_eta(eta))


def critical_angle(eta: ArrayLike) -> Floats:
    """Angle [rad] on the denser side beyond which all light is reflected; pi/2 for eta = 1; a few ulp.

    ``arcsin(min(eta, 1/eta))``, shape (...), without its loss of digits near pi/2.
    """
    n = checked_eta(eta)
    lower, higher = np.minimum(n, 1.0), np.maximum(n, 1.0)
    angle: Floats = np.arctan2(lower, np.sqrt((higher - lower) * (higher + lower)))
    return angle


def diffuse_reflectance(eta: ArrayLike) -> Bounded:
    """Fraction of unpolarised, perfectly diffuse light from the front that a smooth dielectric interface reflects.

    Parameters
    ----------
    eta : array_like, shape (...)
        As in `dielectric_reflectance`; above 1 for external reflection, below for internal; from behind
        light sees 1/eta.

    Returns
    -------
    Bounded
        ``2 * integral of F(c) c dc`` over cosines c from 0 to 1, shape (...).

    Raises
    ------
    InvalidArgument
        If eta is not finite or outside its domain.

    Notes
    -----
    Walsh's closed form [1926] cancels near eta = 1. Here n = max(eta, 1/eta), a = (n^2-1)/(n^2+1) and u = -r_s, which
    runs from (n-1)/(n+1) to 1: then ``r_p = (a - u)/(1 - a u)`` and ``2 c dc = (n^2-1)/4 (1/u^2 - 1) du``. The part of
    r_s^2 is ``(n-1)(3n+1)/(3 (n+1)^2)``; that of r_p^2 is integrated by Gauss in ln(u/(1 - a u)), where its poles are
    no closer than pi. Internal reflection follows from reciprocity, ``1 - F_internal = (1 - F_external)/n^2``.
    """
    n = checked_eta(eta)
    lower, higher = np.minimum(n, 1.0), np.maximum(n, 1.0)
    # Differences and sums are homogeneous in the two indices, so that no inverse of eta is rounded.
    minus, plus = higher - lower, higher + lower
    squares = higher**2 + lower**2
    a, rest = minus * plus / squares, 2 * lower**2 / squares
    perpendicular = minus * (2 * higher + plus) / (3 * plus**2)

    # v = ln(u/(1 - a u)) runs up to -ln(1 - a), where u = 1; x is the way back from there.
    nonzero = minus > 0
    extent = np.where(nonzero, np.log(higher * plus / (lower * np.where(nonzero, minus, 1.0))), 0.0)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    panels = np.arange(12)
    positions = ((nodes + 1) / 2 + panels[:, None]).ravel() / len(panels)
    factors = np.tile(weights / 2, len(panels)) / len(panels)
    x = extent[..., None] * positions
    a, rest = a[..., None], rest[..., None]
    growth = np.exp(-x) / rest
    u = growth / (1 + a * growth)
    one_minus_u = -np.expm1(-x) / (1 + a * growth)
    # With dv = du / (u (1 - a u)) one factor of each pole is gone.
    integrand = (one_minus_u - rest) ** 2 * one_minus_u * (1 + u) / u * (1 + a * growth)
    total = extent * np.sum(integrand * factors, axis=-1)
    parallel = minus * plus / (4 * lower**2) * total

    external = np.where(nonzero, (perpendicular + parallel) / 2, 0.0)
    internal = (minus * plus + lower**2 * external) / higher**2
    value = np.where(n >= 1, external, internal)
    return Bounded(value, 200 * _EPSILON * value)


# ----------------------------------------------------------------------------------------------- checked arguments


def checked_conductor(eta: ArrayLike, k: ArrayLike) -> tuple[Floats, Floats]:
    """Both parts of a conductor's index, as arrays that broadcast."""
    n = within("eta", eta, 0, _HIGHEST, f"the index of a conductor is from 0 to {_HIGHEST:g}")
    extinction = within("k", k, 0, _HIGHEST, f"the extinction coefficient is from 0 to {_HIGHEST:g}")
    both = np.hypot(*together(eta=n, k=extinction))
    if (both < _LOWEST).any():
        raise InvalidArgument(f"eta and k are both below {_LOWEST:g}, no conductor has such an index")
    return n, extinction


def _dielectric(cosine: ArrayLike, eta: ArrayLike) -> tuple[Polarised, Polarised]:
    c, near, far = _sides(cosine, eta)
    found = interface(c, np.zeros_like(c), near, far, np.zeros_like(c))
    # In total internal reflection q is imaginary, and not by mistake if it is longer than its error.
    total = (found.q.real == 0) & (found.q.imag > found.q_error)
    reflected, transmitted = found.reflectance, found.transmittance
    return (
        Polarised(_exactly(1.0, total, reflected.s), _exactly(1.0, total, reflected.p)),
        # Without an interface everything passes, even light along it.
        Polarised(_exactly(1.0, near == far, transmitted.s), _exactly(1.0, near == far, transmitted.p)),
    )


def _exactly(value: float, where: Booleans, otherwise: Bounded) -> Bounded:
    return Bounded(np.where(where, value, otherwise.value), np.where(where, 0.0, otherwise.error))


def _sides(cosine: ArrayLike, eta: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Absolute cosine, and the indices on the light's side and on the other, without a division."""
    c, n = together(
        cosine=within("cosine", cosine, -1, 1, "a cosine is from -1 to 1"),
        eta=checked_eta(eta),
    )
    front = c >= 0
    return np.abs(c), np.where(front, 1.0, n), np.where(front, n, 1.0)


def checked_eta(eta: ArrayLike) -> Floats:
    """The index of a dielectric."""
    return within("eta", eta, _LOWEST, _HIGHEST, f"a relative index is from {_LOWEST:g} to {_HIGHEST:g}")


def _vectors(directions: ArrayLike, normals: ArrayLike) -> tuple[Floats, Floats]:
    w, n = together(directions=direction("directions", directions), normals=direction("normals", normals))
    return w, n
