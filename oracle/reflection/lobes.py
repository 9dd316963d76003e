"""Power that leaves a rough surface at one elevation, integrated over azimuth, for the albedos of isotropic roughness.

Elevations are given by co-angles, pi/2 minus the angle to the normal, which keep their digits near the horizon.
Masking depends on elevation only, which is why azimuth is integrated first. In azimuth, ``v = 1 - cos(psi)`` counts
from the mirrored or refracted direction, and everything about the half vector H is linear in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats
from oracle.reflection.graded import one_sided
from oracle.reflection.interface import mean_reflectance
from oracle.reflection.microfacet import GGX, Distribution, covered, projected_area


def panel_of(distribution: Distribution) -> float:
    """Length of quadrature panels: a Gaussian has no poles, but grows in imaginary directions."""
    return 2.0 if isinstance(distribution, GGX) else 1.0


@dataclass(frozen=True, eq=False)
class Elevations:
    """Co-angles of a fixed direction and of those integrated over, of one shape; `delta` is their exact difference."""

    distribution: Distribution
    alpha: Floats
    separable: bool
    fixed: Floats
    free: Floats
    delta: Floats

    def over(self) -> Floats:
        """``G2 / |cos_fixed|``, times what turns an integral over `free` into one over solid angle."""
        z, z_free = np.sin(self.fixed), np.sin(self.free)
        s, s_free = np.cos(self.fixed), np.cos(self.free)
        area = projected_area(self.distribution, z, self.alpha * s)
        area_free = projected_area(self.distribution, z_free, self.alpha * s_free)
        both = covered(area, z, area_free, z_free, self.separable)
        result: Floats = z_free * s_free / both
        return result


@dataclass(frozen=True, eq=False)
class Halves:
    """H = i + o: ``H_z``, ``|H|^2 = low + slope v``, ``|H_xy|^2 = across + slope v``."""

    z: Floats
    low: Floats
    across: Floats
    slope: Floats


def mirror_halves(at: Elevations) -> Halves:
    """Sums of cosines and sines as products, from which nothing is lost."""
    ridge = np.sin((at.fixed + at.free) / 2)
    return Halves(
        2 * ridge * np.cos(at.delta / 2),
        4 * ridge**2,
        (2 * ridge * np.sin(at.delta / 2)) ** 2,
        2 * np.cos(at.fixed) * np.cos(at.free),
    )


def mirrored(at: Elevations) -> Floats:
    """Reflected power for each radian of `free` if microfacets reflect everything, in closed form."""
    h = mirror_halves(at)
    a2 = at.alpha**2
    if isinstance(at.distribution, GGX):
        # D is ((low + slope v) / (m + e v))^2 / (pi a^2).
        m, e = h.z**2 + h.across / a2, h.slope / a2
        product = m * (m + 2 * e)
        rest = (1 - a2) * h.z**2
        azimuths = 2 * np.pi * (a2**2 + 2 * a2 * rest / np.sqrt(product) + rest**2 * (m + e) / product**1.5)
    else:
        # D is (low + slope v)^2 / z^4 exp(-across/(a z)^2 - kappa v) / (pi a^2).
        z2 = h.z**2
        kappa = h.slope / (a2 * z2)
        base, slope = h.low / z2, h.slope / z2
        first, second, third = _moments(kappa)
        azimuths = np.exp(-h.across / (a2 * z2)) * (base**2 * first + 2 * base * slope * second + slope**2 * third)
    result: Floats = azimuths / (np.pi * a2) / 4 * at.over()
    return result


def reflected(at: Elevations, near: Floats, far: Floats, k: Floats, order: int) -> Floats:
    """Reflected power for each radian of `free` at microfacets with Fresnel's reflectance; indices broadcast."""
    panel = panel_of(at.distribution)
    h = mirror_halves(at)
    scale = _scale(at, h.z, h.across, h.slope)
    # Where the half vector meets the critical angle, for light in the denser medium.
    critical = np.where((k == 0) & (far < near), (near - far) * (near + far) / near**2, 0.0)
    inside = critical > 0
    v = np.where(inside, (4 * critical - h.low) / np.where(h.slope > 0, h.slope, 1.0), 0.0)
    v = np.where(inside & (h.slope == 0), np.where(4 * critical > h.low, 2.0, 0.0), v)
    scale = np.where(v < 0, np.minimum(scale, np.sqrt(np.maximum(-2 * v, 1e-20))), scale)
    edge = 2 * np.arcsin(np.sqrt(np.clip(v, 0.0, 2.0) / 2))

    def total(psi: Floats, weights: Floats) -> Floats:
        facets, cosine = _facets(at, h, psi)
        fresnel = mean_reflectance(cosine, near[..., None], far[..., None], k[..., None])
        summed: Floats = np.sum(facets * fresnel * weights, axis=-1)
        return summed

    result = np.zeros_like(edge)
    if (edge > 0).any():
        psi, weights = one_sided(edge, scale, order, panel)
        facets, _ = _facets(at, h, psi)
        result = np.sum(facets * weights, axis=-1)
        # Beyond the edge the transmitted part begins like a square root.
        root_scale = np.sqrt(np.maximum(np.minimum(2 * edge, scale), 1e-16))
        w, root_weights = one_sided(np.sqrt(np.pi - edge), root_scale, order, panel=1.0)
        onwards = np.where(edge > 0, 1.0, 0.0)
        result = result + onwards * total(edge[..., None] + w**2, 2 * w * root_weights)
    if (edge == 0).any():
        psi, weights = one_sided(np.full_like(edge, np.pi), scale, order, panel)
        result = result + np.where(edge == 0, total(psi, weights), 0.0)
    return 2 * result / 4 * at.over()


def transmitted(at: Elevations, near: Floats, far: Floats, order: int) -> Floats:
    """Transmitted power for each radian of `free`, below the surface; light comes from the side with index `near`."""
    z, z_free = np.sin(at.fixed), np.sin(at.free)
    s, s_free = np.cos(at.fixed), np.cos(at.free)
    h_z = near * z - far * z_free
    across, slope = (near * s - far * s_free) ** 2, 2 * near * far * s * s_free
    ratio = np.minimum(near, far) / np.maximum(near, far)
    # Light can go this way up to the azimuth where the microfacet is seen edge-on from the rarer side.
    beyond = np.cos(at.delta) - ratio
    v = np.where(s * s_free > 0, beyond / np.where(s * s_free > 0, s * s_free, 1.0), np.where(beyond > 0, 2.0, 0.0))
    edge = 2 * np.arcsin(np.sqrt(np.clip(v, 0.0, 2.0) / 2))
    scale = _scale(at, h_z, across, slope)
    psi, weights = one_sided(edge, scale, order, panel_of(at.distribution))
    v = 2 * np.sin(psi / 2) ** 2

    near, far, h_z, alpha = near[..., None], far[..., None], h_z[..., None], at.alpha[..., None]
    x = -(np.cos(at.delta)[..., None]) + (s * s_free)[..., None] * v
    # Both cosines, times the length of H.
    c_i, c_o = np.abs(near + far * x), np.abs(near * x + far)
    passed = (1 / (near * c_i + far * c_o) ** 2 + 1 / (far * c_i + near * c_o) ** 2) * 2 * near * far * c_i * c_o
    flat = across[..., None] + slope[..., None] * v
    if isinstance(at.distribution, GGX):
        facets = 1 / (h_z**2 + flat / alpha**2) ** 2
    else:
        safe = np.where(h_z == 0, 1.0, h_z) ** 2
        exponent = np.where(h_z == 0, np.inf, flat / (alpha**2 * safe))
        facets = np.where(exponent < 700, np.exp(-np.minimum(exponent, 700.0)) / safe**2, 0.0)
    power = np.sum(passed * c_i * c_o * facets * weights, axis=-1)
    result: Floats = 2 * far[..., 0] ** 2 * power / (np.pi * at.alpha**2) * at.over()
    return result


def _facets(at: Elevations, h: Halves, psi: Floats) -> tuple[Floats, Floats]:
    """D of the half vector and its cosine with both directions."""
    v = 2 * np.sin(psi / 2) ** 2
    alpha, h_z = at.alpha[..., None], h.z[..., None]
    length_squared = h.low[..., None] + h.slope[..., None] * v
    flat = h.across[..., None] + h.slope[..., None] * v
    if isinstance(at.distribution, GGX):
        density = (length_squared / (h_z**2 + flat / alpha**2)) ** 2
    else:
        density = (length_squared / h_z**2) ** 2 * np.exp(-np.minimum(flat / (alpha * h_z) ** 2, 745.0))
    return density / (np.pi * alpha**2), np.minimum(np.sqrt(length_squared) / 2, 1.0)


def _scale(at: Elevations, h_z: Floats, across: Floats, slope: Floats) -> Floats:
    """Distance in azimuth to the side of the ridge at which D has its poles or, for Beckmann, falls off; at most 1."""
    least = (at.alpha * h_z) ** 2
    if isinstance(at.distribution, GGX):
        least = least + across
    flat = slope <= 2 * least
    result: Floats = np.where(flat, 1.0, np.sqrt(2 * least / np.where(flat, 1.0, slope)))
    return np.maximum(result, 1e-12)


def _moments(kappa: Floats) -> tuple[Floats, Floats, Floats]:
    """Integrals of v^m exp(-kappa v) over all azimuths for m = 0, 1, 2: Bessel functions, or series for large kappa."""
    from scipy.special import ive

    small = np.minimum(kappa, 25.0)
    zeroth, first = ive(0, small), ive(1, small)
    tiny = small < 1e-8
    second = np.where(tiny, 0.0, zeroth - 2 * first / np.where(tiny, 1.0, small))
    bessel = [zeroth, zeroth - first, 1.5 * zeroth - 2 * first + second / 2]

    # With v = 2 t: t^(m-1/2) (1-t)^(-1/2) exp(-2 kappa t), the root expanded and each term integrated to infinity.
    large = 2 * np.maximum(kappa, 25.0)
    results = []
    for m in range(3):
        # Gamma(m + 1/2) / large^(m + 1/2), and from each term of the series to the next.
        term = np.sqrt(np.pi / large) * [1.0, 0.5 / large, 0.75 / large**2][m]
        series = np.zeros_like(large)
        for j in range(20):
            series = series + term
            term = term * (j + 0.5) / (j + 1) * (j + m + 0.5) / large
        results.append(np.where(kappa < 25, 2 * np.pi * bessel[m], 2.0 ** (m + 1) * series))
    return results[0], results[1], results[2]
