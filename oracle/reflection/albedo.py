"""Albedos of rough surfaces: the part of the light from one direction, or from all, that leaves them again.

Microfacets here reflect or refract once. What they would send to each other is missing from the model, and so even
perfect mirrors (`RoughMirror`) lose light: `furnace_loss` is the loss that a furnace test of a correct implementation
of single scattering shows. Roughness must be isotropic. Light from outside is averaged like light that goes out: by
reciprocity an albedo is also the radiance of the surface in a furnace of radiance 1 (for transmission, in a medium's
own furnace: radiance n^2).

The double integral over outgoing directions is done in azimuth first, in closed form if everything is reflected, and
then in elevation; both with Gauss quadrature graded towards every feature. Bounds are four times the difference of two
orders, plus rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace as changed

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, Integers, InvalidArgument
from oracle.bounded import Bounded
from oracle.reflection.domain import together, within
from oracle.reflection.graded import COARSE, FINE, between
from oracle.reflection.lobes import Elevations, mirrored, panel_of, reflected, transmitted
from oracle.reflection.rough import Material, RoughConductor, RoughDielectric, RoughMirror

_EPSILON = float(np.finfo(np.float64).eps)

# Nodes of the inner quadrature for so many configurations stay below some 100 MB.
_AT_ONCE = 16

# Kinks and ends where the integrand vanishes or breaks like a power are approached down to here.
_KINK = 1e-7


def directional_reflectance(material: Material, cosine: ArrayLike) -> Bounded:
    """Part of the light from one direction that a rough surface reflects, to all directions together.

    Parameters
    ----------
    material : RoughMirror, RoughConductor or RoughDielectric
        With isotropic roughness; roughness and indices of shapes that broadcast with (...).
    cosine : array_like, shape (...)
        Cosine of the angle of incidence, from 1e-6 to 1; for dielectrics also from -1 to -1e-6, from behind.

    Returns
    -------
    Bounded
        ``integral of f(i, o) |o_z|`` over the directions o on the side of i, with its bound, of the broadcast shape.

    Raises
    ------
    InvalidArgument
        If the roughness is anisotropic, a cosine lies outside its domain, or shapes do not fit together.
    """
    alpha, c, near, far, k = _checked(material, cosine)

    def values(of: tuple[Floats, ...], order: int) -> Floats:
        return _reflection(material, order, *of)

    return _in_chunks(values, (alpha, np.arcsin(np.abs(c)), near, far, k), np.zeros_like(alpha))


def directional_transmittance(material: RoughDielectric, cosine: ArrayLike) -> Bounded:
    """Part of the light from one direction that passes a rough dielectric; as `directional_reflectance`."""
    alpha, c, near, far, _ = _checked(material, cosine)
    chi = np.arcsin(np.abs(c))
    _, tilt = _refracted(chi, near, far)
    # What rounding does to the distance from the refracted direction, compared with the lobe's width.
    doubt = 8 * _EPSILON * np.maximum(near, far) / (alpha * tilt)

    def values(of: tuple[Floats, ...], order: int) -> Floats:
        return _transmission(material, order, *of)

    return _in_chunks(values, (alpha, chi, near, far), doubt)


def directional_albedo(material: Material, cosine: ArrayLike) -> Bounded:
    """Part of the light from one direction that leaves a rough surface; as `directional_reflectance`.

    Reflection, and for dielectrics transmission as well.
    """
    result = directional_reflectance(material, cosine)
    return result + directional_transmittance(material, cosine) if isinstance(material, RoughDielectric) else result


def furnace_loss(material: Material, cosine: ArrayLike) -> Bounded:
    """What a rough surface darkens a furnace by: 1 - `directional_albedo`, absorption and what the model leaves out."""
    albedo = directional_albedo(material, cosine)
    return Bounded(1 - albedo.value, albedo.error + _EPSILON)


def average_albedo(material: Material) -> Bounded:
    """Part of diffuse light from the front that leaves a rough surface, ``2 * integral of albedo(c) c dc``.

    Parameters
    ----------
    material : RoughMirror, RoughConductor or RoughDielectric
        With isotropic roughness; roughness and indices of shapes that broadcast to (...).

    Returns
    -------
    Bounded
        Average with its bound, shape (...).

    Raises
    ------
    InvalidArgument
        If the roughness is anisotropic, or shapes do not fit together.
    """
    alpha, _, near, far, _ = _checked(material, 1.0)
    zero, right = np.zeros_like(alpha), np.full_like(alpha, np.pi / 2)
    # Albedos have no derivative of some order along the surface, and where the critical angle comes into play.
    critical = right
    if isinstance(material, RoughDielectric):
        critical = np.arccos(np.minimum(near, far) / np.maximum(near, far))
    places = np.stack([zero, critical, right], axis=-1)
    scales = np.stack([zero + _KINK, np.minimum(alpha, 1e-2), np.minimum(alpha, 0.1 / alpha)], axis=-1)
    averages = []
    for order in (FINE, COARSE):
        origins, offsets, weights = between(places, scales, order, 2.0)
        # Below the lowest cosine that albedos are known for lies less than 1e-12 of the light.
        cosines = np.maximum(np.sin(origins + offsets), 1e-6)
        albedo = directional_albedo(_with_last_axis(material), cosines)
        weights = 2 * weights * np.sin(origins + offsets) * np.cos(origins + offsets)
        averages.append((np.sum(albedo.value * weights, axis=-1), np.sum(albedo.error * weights, axis=-1)))
    (value, error), (coarse, _) = averages
    return Bounded(value, 4 * np.abs(value - coarse) + error + 1e-12 + 20 * _EPSILON * value)


def _reflection(
    material: Material, order: int, alpha: Floats, chi: Floats, near: Floats, far: Floats, k: Floats
) -> Floats:
    """Integral over the elevation of what is reflected; `chi` is the co-angle of incidence. All of shape (N,)."""
    panel = panel_of(material.distribution)
    zero, scale = np.zeros_like(chi), np.minimum(alpha, np.sin(chi))
    # Beckmann's masking falls off like exp(-1/(a theta)^2) towards the normal, which is smooth but hard to integrate.
    upright = np.minimum(1.0, 0.1 / alpha)
    places, scales = [zero, chi, zero + np.pi / 2], [scale, np.minimum(scale, upright), upright]
    if (far < near).any() and not isinstance(material, RoughConductor):
        # The curve of half vectors at the critical angle begins and ends in the plane of incidence.
        critical = np.where(far < near, np.arccos(np.minimum(far / near, 1.0)), 0.0)
        theta = np.pi / 2 - critical
        places += [2 * critical - chi, chi + 2 * theta, chi - 2 * theta]
        scales += [zero + _KINK] * 3
    at, weights, of = _elevations(material, alpha, chi, zero, zero + np.pi / 2, places, scales, order, panel)
    mirrors = isinstance(material, RoughMirror)
    lobe = mirrored(at) if mirrors else reflected(at, near[of], far[of], k[of], order)
    return np.bincount(of, lobe * weights, len(chi)).astype(np.float64)


def _transmission(
    material: RoughDielectric, order: int, alpha: Floats, chi: Floats, near: Floats, far: Floats
) -> Floats:
    """Integral over the elevation of what is transmitted, as `_reflection`."""
    peak, tilt = _refracted(chi, near, far)
    # No microfacet deflects light by more, nor does one that faces upwards.
    most = np.arccos(np.minimum(near, far) / np.maximum(near, far))
    level = np.arcsin(np.minimum(near * np.sin(chi) / far, 1.0))
    low = np.maximum(np.where(near < far, level, 0.0), chi - most)
    high = np.minimum(np.where(near < far, np.pi / 2, level), chi + most)
    high = np.minimum(high, np.pi / 2)
    scale = np.minimum(np.minimum(alpha, np.sin(chi)), 1e-2) / 10
    narrow = np.maximum(np.minimum(scale, alpha * tilt / far), 1e-9)
    # Where the last azimuth becomes possible.
    full = np.pi - most - chi
    panel = panel_of(material.distribution) / 2
    places, scales = [low, high, peak, full], [scale, scale, narrow, scale]
    at, weights, of = _elevations(material, alpha, chi, low, high, places, scales, order, panel)
    return np.bincount(of, transmitted(at, near[of], far[of], order) * weights, len(chi)).astype(np.float64)


def _refracted(chi: Floats, near: Floats, far: Floats) -> tuple[Floats, Floats]:
    """Co-angle of the refracted direction, 0 if there is none, and ``|n_i cos_i - n_o cos_o|`` there."""
    along = near * np.cos(chi)
    root = np.sqrt(np.maximum((far - near) * (far + near) + (near * np.sin(chi)) ** 2, 0.0))
    return np.arctan2(root, along), np.abs(near * np.sin(chi) - root)


def _elevations(
    material: Material,
    alpha: Floats,
    chi: Floats,
    low: Floats,
    high: Floats,
    places: list[Floats],
    scales: list[Floats],
    order: int,
    panel: float,
) -> tuple[Elevations, Floats, Integers]:
    """Nodes from `low` to `high`, graded towards `places` and there as fine as `scales`; places in any order.

    Returns the nodes of all configurations in one row, their weights, and to which configuration each belongs.
    """
    stacked = np.clip(np.stack(places, axis=-1), low[:, None], high[:, None])
    sorting = np.argsort(stacked, axis=-1)
    ordered, fine = (np.take_along_axis(a, sorting, axis=-1) for a in (stacked, np.stack(scales, axis=-1)))
    origins, offsets, weights = between(ordered, fine, order, panel)
    # Places outside the range have become intervals without length.
    of, node = np.nonzero(weights)
    origin, offset = origins[of, node], offsets[of, node]
    at = Elevations(
        material.distribution, alpha[of], material.separable, chi[of], origin + offset, (origin - chi[of]) + offset
    )
    return at, weights[of, node], of


def _in_chunks(
    values: Callable[[tuple[Floats, ...], int], Floats], arrays: tuple[Floats, ...], doubt: Floats
) -> Bounded:
    """Evaluate with both orders, for a few configurations at a time; `doubt` is a further relative error."""
    shape = arrays[0].shape
    flat = [array.ravel() for array in arrays]
    fine, coarse = np.empty(flat[0].size), np.empty(flat[0].size)
    for start in range(0, len(fine), _AT_ONCE):
        part = tuple(array[start : start + _AT_ONCE] for array in flat)
        fine[start : start + _AT_ONCE] = values(part, FINE)
        coarse[start : start + _AT_ONCE] = values(part, COARSE)
    error = 4 * np.abs(fine - coarse) + (1e-13 + doubt.ravel()) * fine
    return Bounded(fine.reshape(shape), error.reshape(shape))


def _checked(material: Material, cosine: ArrayLike) -> tuple[Floats, ...]:
    """Roughness, cosine, and the indices on the side of the light and on the other, of one shape."""
    alpha, alpha_y = material.distribution.alphas
    if (alpha != alpha_y).any():
        raise InvalidArgument("alpha and alpha_y differ, albedos are known for isotropic roughness only")
    two_sided = isinstance(material, RoughDielectric)
    c = within("cosine", cosine, -1 if two_sided else 0, 1, "it must be a cosine on the side of the light")
    within("cosine", np.abs(c), 1e-6, 1, "albedos are known from 1e-6 on")
    eta = np.ones(()) if isinstance(material, RoughMirror) else material.eta
    k = material.k if isinstance(material, RoughConductor) else np.zeros(())
    alpha, c, eta, k = together(alpha=alpha, cosine=c, eta=eta, k=k)
    one = np.ones_like(eta)
    return alpha, c, np.where(c > 0, one, eta), np.where(c > 0, eta, one), k


def _with_last_axis(material: Material) -> Material:
    """The same with one more axis, for quadrature."""
    alpha = material.distribution.alpha[..., None]
    distribution = type(material.distribution)(alpha)
    match material:
        case RoughMirror():
            return changed(material, distribution=distribution)
        case RoughConductor():
            return changed(material, distribution=distribution, eta=material.eta[..., None], k=material.k[..., None])
        case RoughDielectric():
            return changed(material, distribution=distribution, eta=material.eta[..., None])
