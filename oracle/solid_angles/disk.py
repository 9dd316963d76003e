"""Solid angle of disks: complete elliptic integrals near by, a series far away."""

from __future__ import annotations

import numpy as np
from scipy.special import elliprf, elliprj

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.compensated import dot, scaled_offsets
from oracle.shapes import Disk

_EPSILON = float(np.finfo(np.float64).eps)

# 1 - (1 + x)^(-1/2) in powers of x.
_SERIES = [0.5]
for _k in range(2, 19):
    _SERIES.append(-_SERIES[-1] * (2 * _k - 1) / (2 * _k))


def disk(shape: Disk, points: Floats) -> Bounded:
    """Solid angle (N,) [sr] of a disk at points (N, 3)."""
    offset, low, scale = scaled_offsets(shape.center, points, shape.radius)
    offset, low, radius = offset.T, low.T, shape.radius * scale
    height = np.abs(dot(shape.normal, 0.0, offset, low))
    power = dot(offset, low, offset, low, minus=radius)
    far = power > 8 * radius**2
    value, error = np.empty(len(points)), np.empty(len(points))
    if far.any():
        value[far] = _far_disk(height[far], power[far], radius[far])
        error[far] = 16 * _EPSILON * value[far]
    if not far.all():
        near = ~far
        aside = np.linalg.norm(np.cross(offset[near], shape.normal), axis=-1)
        part = _near_disk(height[near], aside, power[near], radius[near])
        value[near], error[near] = part.value, part.error
    return Bounded(value, error)


def _far_disk(height: Floats, power: Floats, radius: Floats) -> Floats:
    """Off the axis each power of R/r of the series on the axis takes an odd Legendre polynomial of the cosine."""
    squared = power + radius**2
    cosine, ratio = height / np.sqrt(squared), radius**2 / squared
    before, odd = np.ones_like(cosine), cosine
    total, weight = np.zeros_like(cosine), ratio
    for k, coefficient in enumerate(_SERIES):
        total += coefficient * weight * odd
        weight = weight * ratio
        n = 2 * k + 1
        even = ((2 * n + 1) * cosine * odd - n * before) / (n + 1)
        before, odd = even, ((2 * n + 3) * cosine * even - (n + 1) * odd) / (n + 2)
    return 2 * np.pi * total


def _near_disk(height: Floats, aside: Floats, power: Floats, radius: Floats) -> Bounded:
    """Complete elliptic integrals K and Pi by Carlson's R_F and R_J, where c = (a - R)/(a + R)."""
    reach = aside + radius
    furthest_squared = height**2 + reach**2
    # Squared ratio of the smallest to the largest distance from the rim.
    ratio = (power**2 + (2 * radius * height) ** 2) / furthest_squared**2
    on_rim = ratio < 1e4 * _EPSILON**4
    ratio = np.where(on_rim, 1.0, ratio)
    # a - R, from the precise power of the point with respect to the disk's sphere.
    c = (power - height**2) / reach**2
    over_rim = np.abs(c) < 1e-100
    k = elliprf(0, ratio, 1)
    j = elliprj(0, ratio, 1, np.where(over_rim, 1.0, c**2))
    # c alpha^2 R_J / 3; its limit over the rim jumps with the sign of c, together with 2 pi.
    third = np.where(over_rim, 0.0, c * 4 * aside * radius / reach**2 * j / 3)
    steep = 2 * height / np.sqrt(furthest_squared)
    base = np.where(over_rim, np.pi, np.where(c < 0, 2 * np.pi, 0.0))
    first, second = steep * third, steep * (2 * radius / reach) * k
    value = np.clip(base + first - second, 0, 2 * np.pi)
    error = 8 * _EPSILON * (base + np.abs(first) + np.abs(second))
    return Bounded(np.where(on_rim, np.pi, value), np.where(on_rim, np.pi, error))
