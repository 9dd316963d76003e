"""Where rays meet flat and round shapes, in float64 and without tessellation.

Every function takes ray origins and directions of shape (N, 3) and returns, for each ray, the smallest ray parameter
t > t_min at which it meets the shape, or infinity. Directions need not have unit length: t counts in them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from oracle.arrays import Floats, Integers, dot

_NEVER = np.inf


def _plane(origins: Floats, directions: Floats, point: Floats, normal: Floats, t_min: float) -> Floats:
    """Ray parameter of the plane through `point`; infinity for parallel rays and for hits before `t_min`."""
    along = directions @ normal
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = dot(point - origins, np.broadcast_to(normal, origins.shape)) / along
    result: Floats = np.where((along != 0) & np.isfinite(t) & (t > t_min), t, _NEVER)
    return result


def _positions(origins: Floats, directions: Floats, t: Floats) -> Floats:
    """Points on the rays, with the origin in place of a point at infinity."""
    result: Floats = origins + np.where(np.isfinite(t), t, 0.0)[:, None] * directions
    return result


def rectangle(
    origins: Floats, directions: Floats, center: Floats, half_u: Floats, half_v: Floats, t_min: float = 0.0
) -> Floats:
    """Rectangle ``center + a half_u + b half_v`` with a, b in [-1, 1] and orthogonal half axes [m]."""
    normal = np.cross(half_u, half_v)
    t = _plane(origins, directions, center, normal, t_min)
    local = _positions(origins, directions, t) - center
    inside = (np.abs(local @ half_u) <= half_u @ half_u) & (np.abs(local @ half_v) <= half_v @ half_v)
    result: Floats = np.where(inside, t, _NEVER)
    return result


def disk(
    origins: Floats, directions: Floats, center: Floats, normal: Floats, radius: float, t_min: float = 0.0
) -> Floats:
    """Flat disk with `center` [m], unit `normal` and `radius` [m]."""
    t = _plane(origins, directions, center, normal, t_min)
    local = _positions(origins, directions, t) - center
    result: Floats = np.where(dot(local, local) <= radius**2, t, _NEVER)
    return result


def sphere(origins: Floats, directions: Floats, center: Floats, radius: float, t_min: float = 0.0) -> Floats:
    """Sphere with `center` and `radius` [m].

    The discriminant is computed from the distance between center and ray, which keeps its digits for far spheres
    [Haines et al. 2019, Ray Tracing Gems, chapter 7].
    """
    offset = origins - center
    a = dot(directions, directions)
    b = -dot(offset, directions)
    nearest = offset + (b / a)[:, None] * directions
    discriminant = radius**2 - dot(nearest, nearest)
    root = np.sqrt(np.maximum(discriminant, 0) * a)
    c = dot(offset, offset) - radius**2
    # Both roots without cancellation: one from the sum, the other from their product.
    q = b + np.where(b >= 0, root, -root)
    with np.errstate(divide="ignore", invalid="ignore"):
        other = np.where(q != 0, c / np.where(q == 0, 1.0, q), 0.0)
    near, far = np.minimum(q / a, other), np.maximum(q / a, other)
    t = np.where(near > t_min, near, np.where(far > t_min, far, _NEVER))
    result: Floats = np.where(discriminant >= 0, t, _NEVER)
    return result


def mesh(
    origins: Floats, directions: Floats, vertices: Floats, triangles: Integers, t_min: float = 0.0
) -> tuple[Floats, Integers]:
    """Triangles (M, 3) over vertices (V, 3) [m]; also returns which triangle is hit (-1 for none).

    Each corner is projected along the ray to a plane, once and for all its triangles alike; on which side of an edge
    the ray passes is then the sign of a difference of two products, which rounding may make 0 but never wrong. So no
    ray slips through between triangles that share corners [Woop, Benthin and Wald 2013].
    """
    nearest = np.full(len(origins), _NEVER)
    which = np.full(len(origins), -1, dtype=np.int64)
    # The axis along which the ray is longest comes last; along it the corners are projected.
    axes = (np.abs(directions).argmax(axis=1)[:, None] + np.array([1, 2, 0])) % 3
    start, way = np.take_along_axis(origins, axes, axis=1), np.take_along_axis(directions, axes, axis=1)
    slope = way[:, :2] / way[:, 2:]

    def projected(corner: Floats) -> Floats:
        offset = corner[axes] - start
        result: Floats = offset[:, :2] - slope * offset[:, 2:]
        return result

    for index, (a, b, c) in enumerate(vertices[triangles]):
        corners = [projected(corner) for corner in (a, b, c)]
        sides = np.stack([p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in pairwise([*corners, corners[0]])])
        t = _plane(origins, directions, a, np.cross(b - a, c - a), t_min)
        hit = ((sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)) & (t < nearest)
        nearest = np.where(hit, t, nearest)
        which = np.where(hit, index, which)
    return nearest, which
