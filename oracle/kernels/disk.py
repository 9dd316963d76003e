"""Projected solid angle of disks, clipped at the receiver's horizon."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Booleans, Floats
from oracle.bounded import Bounded
from oracle.compensated import cross, dot, scaled_offsets
from oracle.kernels.segment import Segment, segment
from oracle.shapes import Disk

_EPSILON = float(np.finfo(np.float64).eps)


def disk(shape: Disk, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Projected solid angle of a disk [sr].

    Parameters
    ----------
    shape : Disk
        Its front counts, and its back if `two_sided`. The disk's own plane sees neither: there the result is 0, though
        on the disk itself the limits from both sides are not, and on its rim there is no limit.
    points, normals : ndarray
        Receivers, shape (N, 3) each.

    Returns
    -------
    Bounded
        Shape (N,). The error is a few ulp of the value while the whole disk is above the horizon, however far, near or
        edge-on it is, and below 1e-12 of the value if the horizon cuts it. It grows beyond that, like eps R / d, at a
        distance d from the rim if the horizon cuts the disk, and where the horizon leaves only a sliver of it. For
        disks that are cut it is in part an estimate, see `segment`, and no proof.

    Notes
    -----
    With the centre o relative to the receiver, distance H from the disk's plane, X = o^2 - R^2, S^2 = X^2 + (2 R H)^2
    and the cosine c between the receiver's normal n and the direction to the plane, a disk above the horizon has

        2 pi R^2 / (S (S + X + 2 R^2)) [H n.o + c Q],    Q = 2 R^2 H^2 / (S + X) = (S - X) / 2,

    the catalogue's factors from a differential element to a parallel and to a perpendicular disk [Howell, A Catalog of
    Radiation Heat Transfer Configuration Factors] added as components of a vector, with all differences of roots
    rationalised. H, n.o and X are computed in twice the precision. `segment` treats disks that the horizon cuts.
    """
    n = np.ascontiguousarray(normals.T)
    offset, low, scale = scaled_offsets(shape.center, points, shape.radius)
    radius = shape.radius * scale

    height = dot(shape.normal, 0.0, offset.T, low.T)
    shines = height != 0 if two_sided else height < 0
    # From here on, w points to the disk's plane.
    c = (n.T @ shape.normal) * np.sign(height)
    height = np.abs(height)
    above = dot(n.T, 0.0, offset.T, low.T)
    power = dot(offset.T, low.T, offset.T, low.T, minus=radius)

    diameter_squared = 4 * radius**2 * height**2
    s = np.sqrt(power**2 + diameter_squared)
    s = np.where(s == 0, 1.0, s)
    q = np.where(power > 0, diameter_squared / (2 * (s + np.abs(power))), (s + np.abs(power)) / 2)
    weight = 2 * np.pi * radius**2 / (s * (s + power + 2 * radius**2))
    first, second = weight * height * above, weight * c * q
    value = first + second
    # Rounding; the cosine's is absolute; and what is lost although computed in twice the precision.
    error = 8 * _EPSILON * (np.abs(first) + np.abs(second) + weight * q)
    error += 8 * _EPSILON**2 * (weight * (height + np.abs(above)) + np.abs(value) / s)
    # On the rim, as far as these numbers can tell, every value is possible.
    error = np.where(s < 1e4 * _EPSILON**2, np.pi, error)

    wx, wy, wz = shape.normal
    sine = np.sqrt((n[1] * wz - n[2] * wy) ** 2 + (n[2] * wx - n[0] * wz) ** 2 + (n[0] * wy - n[1] * wx) ** 2)
    cut = shines & (np.abs(above) < radius * (sine * (1 + 1e-14) + 1e-15))
    dark = ~shines | (~cut & (above < 0))
    value, error = np.where(dark, 0.0, value), np.where(dark, 0.0, error)
    if cut.any():
        _cut(shape, n, offset, low, (radius, height, c, above, power), cut, Bounded(value, error))
    return Bounded(value, error)


def _cut(
    shape: Disk,
    n: Floats,
    offset: Floats,
    low: Floats,
    lengths: tuple[Floats, Floats, Floats, Floats, Floats],
    cut: Booleans,
    result: Bounded,
) -> None:
    """Replace the results of disks that the horizon cuts."""
    n, offset, low = n[:, cut], offset[:, cut], low[:, cut]
    radius, height, c, above, power = (length[cut] for length in lengths)
    # Along the chord, precise even if the receiver is nearly parallel to the disk.
    along = np.array(cross(n.T, shape.normal))
    sine = np.sqrt((along**2).sum(axis=0))
    reach = radius * sine
    is_cut = np.abs(above) < reach
    is_dark = above <= -reach
    value = np.where(is_dark, 0.0, result.value[cut])
    error = np.where(is_dark, 0.0, result.error[cut])
    if is_cut.any():
        sine, middle = sine[is_cut], above[is_cut] / sine[is_cut]
        part = segment(
            Segment(
                # Nearer ones are next to the plane as far as float64 is concerned.
                distance=np.maximum(height[is_cut], 1e-80),
                cosine=c[is_cut],
                sine=sine,
                above=radius[is_cut] + middle,
                below=radius[is_cut] - middle,
                aside=(along[:, is_cut] * offset[:, is_cut]).sum(axis=0) / sine,
                power=power[is_cut],
            )
        )
        # Of a sliver, as much of its width is uncertain as the chord's position.
        sliver = 4 * _EPSILON * radius[is_cut] / (radius[is_cut] + middle)
        value[is_cut], error[is_cut] = part.value, part.error + sliver * part.value
    result.value[cut], result.error[cut] = value, error
