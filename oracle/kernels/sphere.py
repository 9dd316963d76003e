"""Projected solid angle of spheres, clipped at the receiver's horizon."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.compensated import cross, dot, dot_in_parts, scaled_offsets
from oracle.kernels.segment import Segment, segment
from oracle.shapes import Sphere

_EPSILON = float(np.finfo(np.float64).eps)


def sphere(shape: Sphere, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Projected solid angle of a sphere [sr].

    Parameters
    ----------
    shape : Sphere
        Its outside counts, and its inside if `two_sided`: a receiver inside then sees pi, otherwise 0. A receiver on
        the surface counts as outside.
    points, normals : ndarray
        Receivers, shape (N, 3) each.

    Returns
    -------
    Bounded
        Shape (N,). The error is a few ulp of the value, and below 1e-12 of it if the horizon cuts the sphere, but for
        slivers: with a fraction f of the diameter above the horizon it grows like eps / f. For spheres that are cut it
        is in part an estimate, see `segment`, and no proof.

    Notes
    -----
    ``pi (R/d)^2 cos(theta)`` above the horizon [Lambert 1760]. A sphere that the horizon cuts covers the same
    directions as the disk with its visible rim, and `segment` treats it as such. Distances from the surface and from
    the horizon are computed in twice the precision, so that receivers next to either keep their digits.
    """
    n = np.ascontiguousarray(normals.T)
    offset, low, scale = scaled_offsets(shape.center, points, shape.radius)
    radius = shape.radius * scale

    above = dot(n.T, 0.0, offset.T, low.T)
    power = dot(offset.T, low.T, offset.T, low.T, minus=radius)
    inside = power < 0
    squared = np.where(inside, 1.0, power + radius**2)
    value = np.pi * radius**2 * np.maximum(above, 0) / (squared * np.sqrt(squared))
    value = np.where(inside, np.pi if two_sided else 0.0, value)
    error = 8 * _EPSILON * value + 8 * _EPSILON**2 * np.where(inside, 0.0, radius**2)

    cut = ~inside & (np.abs(above) < radius)
    error[(above < 0) & ~cut] = 0
    if cut.any():
        part = _cut(n[:, cut], offset[:, cut], low[:, cut], power[cut], radius[cut])
        value[cut], error[cut] = part.value, part.error
    return Bounded(value, error)


def _cut(n: Floats, offset: Floats, low: Floats, power: Floats, radius: Floats) -> Bounded:
    """Spheres that the horizon cuts."""
    # How far the sphere reaches over the horizon; so precise that a normal's length must be seen to differ from 1.
    above, rest = dot_in_parts(n.T, 0.0, offset.T, low.T)
    rest = rest - above * dot(n.T, 0.0, n.T, 0.0, minus=np.ones_like(radius)) / 2
    gap = (radius - np.abs(above)) - np.where(above > 0, rest, -rest)

    # The rim, on the sphere of directions: a disk of radius sin(sigma) at a distance cos(sigma).
    distance = np.sqrt(power + radius**2)
    cos_sigma, sin_sigma = np.sqrt(power) / distance, radius / distance
    cosine = above / distance
    perpendicular = np.array(cross(n.T, offset.T)) + np.cross(n, low, axis=0)
    sine = np.sqrt((perpendicular**2).sum(axis=0)) / distance
    # sin^2(sigma) - cos^2(theta), without cancellation, is the product of what lies on both sides of the chord.
    larger = sin_sigma + np.abs(cosine) * cos_sigma / sine
    smaller = np.maximum(gap, 0) * (radius + np.abs(above)) / distance**2 / sine**2 / larger
    return segment(
        Segment(
            # Nearer ones touch the sphere as far as float64 is concerned.
            distance=np.maximum(cos_sigma, 1e-80),
            cosine=cosine,
            sine=sine,
            above=np.where(cosine > 0, larger, smaller),
            below=np.where(cosine > 0, smaller, larger),
            aside=np.zeros_like(sine),
            power=(cos_sigma - sin_sigma) * (cos_sigma + sin_sigma),
        )
    )
