"""BSDFs of rough surfaces: reflection and refraction at microfacets, once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Booleans, Floats, InvalidArgument, dot, replace
from oracle.bounded import Bounded
from oracle.reflection.fresnel import checked_conductor, checked_eta
from oracle.reflection.interface import interface
from oracle.reflection.microfacet import COMPONENT, Distribution, covered, density, local, seen

_EPSILON = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class RoughMirror:
    """Microfacets that reflect everything, F = 1, as in a furnace test."""

    distribution: Distribution
    separable: bool = False


@dataclass(frozen=True, eq=False)
class RoughConductor:
    """Microfacets of a conductor whose index relative to the medium in front is ``eta + i k``, each of shape (...)."""

    distribution: Distribution
    eta: Floats
    k: Floats
    separable: bool = False

    def __post_init__(self) -> None:
        eta, k = checked_conductor(self.eta, self.k)
        replace(self, eta=eta, k=k)


@dataclass(frozen=True, eq=False)
class RoughDielectric:
    """Microfacets of a dielectric with the index `eta`, shape (...), behind relative to in front; not 1."""

    distribution: Distribution
    eta: Floats
    separable: bool = False

    def __post_init__(self) -> None:
        eta = checked_eta(self.eta)
        if (eta == 1).any():
            raise InvalidArgument("eta is 1: without an interface light goes on straight, which no BSDF can hold")
        replace(self, eta=eta)


Material: TypeAlias = RoughMirror | RoughConductor | RoughDielectric


def bsdf(material: Material, incoming: ArrayLike, outgoing: ArrayLike) -> Bounded:
    """BSDF [1/sr] of single reflection or refraction at microfacets, for radiance.

    Parameters
    ----------
    material : RoughMirror, RoughConductor or RoughDielectric
        Roughness and indices of shapes that broadcast with (...).
    incoming : array_like, shape (..., 3)
        Unit vectors towards where the light comes from.
    outgoing : array_like, shape (..., 3)
        Unit vectors towards where it goes, the eye.

    Returns
    -------
    Bounded
        The BSDF with its bound, shape (...), without the cosine. 0 along the surface and, but for
        dielectrics, behind it.

    Raises
    ------
    InvalidArgument
        If a vector is not a unit vector or shapes do not fit together.

    Notes
    -----
    Reflection: ``F D G2 / (4 |i_z o_z|)`` [Cook and Torrance 1982]. Transmission, of light from a medium with index
    n_i to one with n_o, with ``H = -(n_i i + n_o o)`` along the microfacet's normal:
    ``n_o^2 (1-F) D G2 |i.h| |o.h| / (|i_z o_z| |H|^2)`` [Walter et al. 2007]. It holds the factor (n_o/n_i)^2 by which
    refraction compresses radiance: its integral with |o_z| over `outgoing` is the fraction of power that passes, and
    ``n_i^2 f(i, o) = n_o^2 f(o, i)``.
    """
    distribution = material.distribution
    i, alphas = local(distribution, incoming)
    o, _ = local(distribution, outgoing)
    reach = covered(*seen(distribution, i, alphas), *seen(distribution, o, alphas), material.separable)
    over = np.where(reach > 0, 1 / np.where(reach > 0, reach, 1.0), 0.0)
    match material:
        case RoughMirror():
            return _where((i[..., 2] > 0) & (o[..., 2] > 0), _reflected(distribution, i, o, alphas, over, None))
        case RoughConductor():
            one = np.ones(np.shape(material.eta))
            result = _reflected(distribution, i, o, alphas, over, (one, material.eta, material.k))
            return _where((i[..., 2] > 0) & (o[..., 2] > 0), result)
        case RoughDielectric():
            above = i[..., 2] > 0
            one, k = np.ones(np.shape(material.eta)), np.zeros(np.shape(material.eta))
            near, far = np.where(above, one, material.eta), np.where(above, material.eta, one)
            same_side = i[..., 2] * o[..., 2]
            reflected = _where(same_side > 0, _reflected(distribution, i, o, alphas, over, (near, far, k)))
            transmitted = _where(same_side < 0, _transmitted(distribution, i, o, alphas, over, near, far))
            return Bounded(reflected.value + transmitted.value, reflected.error + transmitted.error)


def _reflected(
    distribution: Distribution,
    i: Floats,
    o: Floats,
    alphas: tuple[Floats, Floats],
    over: Floats,
    indices: tuple[Floats, Floats, Floats] | None,
) -> Bounded:
    """Reflection of light within one side, at mirrors without `indices`; `over` is G2 / |i_z o_z|."""
    h, h_error = _upwards(i + o), COMPONENT * (np.abs(i) + np.abs(o))
    facets = density(distribution, h, h_error, alphas)
    factor = over / 4
    if indices is None:
        mirrored = facets.value * factor
        return Bounded(mirrored, facets.error * factor + 120 * _EPSILON * mirrored)
    length = np.sqrt(dot(h, h))
    # The half vector's length is twice the cosine.
    c = np.minimum(length / 2, 1.0)
    c_error = dot(np.abs(h), h_error) / np.where(length > 0, length, 1.0) + 4 * _EPSILON * c
    c, c_error, near, far, k = np.broadcast_arrays(c, c_error, *indices)
    fresnel = interface(c, c_error, near, far, k).reflectance.unpolarised
    value = fresnel.value * facets.value * factor
    error = (fresnel.error * facets.value + (fresnel.value + fresnel.error) * facets.error) * factor
    return Bounded(value, 2 * error + 120 * _EPSILON * value)


def _transmitted(
    distribution: Distribution,
    i: Floats,
    o: Floats,
    alphas: tuple[Floats, Floats],
    over: Floats,
    near: Floats,
    far: Floats,
) -> Bounded:
    """Transmission from one side, with index `near`, to the other; `over` is G2 / |i_z o_z|."""
    n_i, n_o = near[..., None], far[..., None]
    h = _upwards(n_i * i + n_o * o)
    h_error = 2 * COMPONENT * (n_i * np.abs(i) + n_o * np.abs(o))
    squared = dot(h, h)
    squared = np.where(squared > 0, squared, 1.0)
    length = np.sqrt(squared)
    relative = dot(np.abs(h), h_error) / squared + 4 * _EPSILON
    # Both cosines, positive where light can go this way.
    side = np.sign(i[..., 2])
    cosines = [side * dot(i, h) / length, -side * dot(o, h) / length]
    errors = [
        (dot(np.abs(w), h_error) + 2 * COMPONENT * dot(np.abs(w), np.abs(h))) / length + np.abs(c) * relative
        for w, c in zip((i, o), cosines, strict=True)
    ]
    possible = (cosines[0] > 0) & (cosines[1] > 0)
    cosines = [np.clip(c, 0.0, 1.0) for c in cosines]
    # What passes is the same both ways; seen from the rarer side there is no critical angle to lose digits at.
    rarer = near < far
    c, c_error = np.where(rarer, cosines[0], cosines[1]), np.where(rarer, errors[0], errors[1])
    low, high = np.minimum(near, far), np.maximum(near, far)
    c, c_error, low, high = np.broadcast_arrays(c, c_error, low, high)
    passed = interface(c, c_error, low, high, np.zeros_like(c)).transmittance.unpolarised
    facets = density(distribution, h, h_error, alphas)
    factor = far**2 * over / squared
    both = cosines[0] * cosines[1]
    value = passed.value * facets.value * both * factor
    both_error = cosines[0] * errors[1] + cosines[1] * errors[0] + errors[0] * errors[1]
    error = factor * (
        passed.error * facets.value * (both + both_error)
        + passed.value * facets.error * (both + both_error)
        + passed.value * facets.value * both_error
    )
    result = Bounded(value, 2 * error + value * (4 * relative + 120 * _EPSILON))
    return _where(possible, result)


def _upwards(h: Floats) -> Floats:
    """Vectors turned to the upper side."""
    return np.where(h[..., 2:] < 0, -h, h)


def _where(condition: Booleans, bounded: Bounded) -> Bounded:
    """The bounded value where the condition holds and exactly 0 elsewhere."""
    return Bounded(np.where(condition, bounded.value, 0.0), np.where(condition, bounded.error, 0.0))
