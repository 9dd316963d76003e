"""Integrals over a shape with another integrand than that of irradiance, adaptively and with a bound.

The integrand is ``cos^a(theta) cos^b(theta_light) / r^k``; of the shape counts what lies above the receiver's horizon
and shows its shining side. With a = b = 1, k = 2 that is the irradiance of unit radiance, in closed form elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from oracle.adaptive import integrate
from oracle.arrays import Booleans, Floats, Integers, InvalidArgument, dot
from oracle.bounded import Bounded
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere

_EPSILON = float(np.finfo(np.float64).eps)

# A patch is done when its two quadratures differ by less than this part of the receiver's integral.
_TOLERANCE = 1e-9

# Takes indices of patches (K,) and places s, t (K, Q) in their unit square, or s along a line. Returns offsets from the
# receiver to the light (K, Q, 3), cosine at the light (K, Q), and area per unit square (K, Q), all of one sign.
Places: TypeAlias = Callable[..., tuple[Floats, Floats, Floats]]


@dataclass(frozen=True)
class Kernel:
    """Powers of the receiver's cosine, of the light's cosine, and of the inverse distance."""

    receiver: int
    light: int
    distance: int


@dataclass(frozen=True, eq=False)
class Patches:
    """Parts of a light's surface: the receiver (K,) that each belongs to, its sign (K,), and where its points lie."""

    owner: Integers
    sign: Floats
    places: Places


def over_shape(kernel: Kernel, shape: Shape, two_sided: bool, points: Floats, normals: Floats) -> Bounded:
    """Integral (N,) of a kernel over the visible part of a shape, for receivers (N, 3).

    The bound is an estimate, as `oracle.adaptive` tells; the relative error aimed at is 1e-8, more where rounding does
    not allow it.
    """
    match shape:
        case Sphere():
            patches = _sphere(shape, two_sided, points, normals)
        case Disk():
            patches = _disk(shape, two_sided, points, normals)
        case Rectangle():
            patches = _triangles(_fan(shape.polygon), shape.normal[None], two_sided, points, normals)
        case Polygon():
            fan = _fan(shape)
            patches = _triangles(fan, np.broadcast_to(shape.normal, (len(fan), 3)), two_sided, points, normals)
        case Mesh():
            facing = np.array([polygon.normal for polygon in shape.polygons])
            patches = _triangles(shape.vertices[shape.triangles], facing, two_sided, points, normals)
    return _integrate(kernel, patches, normals)


def over_line(kernel: Kernel, start: Floats, end: Floats, points: Floats, normals: Floats) -> Bounded:
    """Like `over_shape` along a line, whose cosine is the sine of the angle to it; it must not hold a receiver."""
    a, b = start - points, end - points
    axis = (end - start) / np.linalg.norm(end - start)
    beside = np.linalg.norm(np.cross(a, axis), axis=-1)
    refuse_on_light(points, (beside == 0) & (dot(a, b) <= 0))
    za, zb = dot(normals, a), dot(normals, b)
    crossing = np.where(za * zb < 0, za / np.where(za == zb, 1.0, za - zb), 0.0)
    first, last = np.where(za < 0, crossing, 0.0), np.where(zb < 0, crossing, 1.0)
    owner = np.flatnonzero((np.maximum(za, zb) > 0) & (last > first))
    along = end - start
    length = float(np.linalg.norm(along))

    def places(k: Integers, s: Floats) -> tuple[Floats, Floats, Floats]:
        part = (last - first)[owner[k], None]
        offset = a[owner[k], None] + (first[owner[k], None] + part * s)[..., None] * along
        sine = np.linalg.norm(np.cross(offset, along), axis=-1) / (np.linalg.norm(offset, axis=-1) * length)
        return offset, sine, length * part * np.ones_like(s)

    return _integrate(kernel, Patches(owner, np.ones(len(owner)), places), normals, dimensions=1)


def refuse_on_light(points: Floats, there: Booleans) -> None:
    """Raise `InvalidArgument` for the first of the points (N, 3) that is `there`, on a light without area."""
    if there.any():
        raise InvalidArgument(
            f"receivers: {points[int(there.argmax())].tolist()} is on the light, in no direction from it"
        )


def _fan(polygon: Polygon) -> Floats:
    """Triangles (N - 2, 3, 3) from the first corner; those of a non-convex polygon may wind the other way round."""
    v = polygon.vertices
    return np.stack([np.broadcast_to(v[0], v[1:-1].shape), v[1:-1], v[2:]], axis=1)


def _triangles(corners: Floats, facing: Floats, two_sided: bool, points: Floats, normals: Floats) -> Patches:
    """Triangles (M, 3, 3) with their front's normals (M, 3), clipped at the horizons of receivers."""
    offsets = corners - points[:, None, None]
    height = dot(offsets, normals[:, None, None, :])
    front = -dot(offsets[:, :, 0], facing)
    shines = (front > 0) | (two_sided & (front < 0))
    # Clipped, a triangle has up to four corners. Each edge gives its start, if above, and its crossing of the horizon;
    # corners that are missing repeat the one before and enclose nothing.
    ring: list[tuple[Booleans, Floats]] = []
    for i in range(3):
        a, b, za, zb = offsets[..., i, :], offsets[..., i - 2, :], height[..., i], height[..., i - 2]
        crosses: Booleans = np.asarray((za > 0) != (zb > 0))
        t = np.where(crosses, za / np.where(crosses, za - zb, 1.0), 0.0)
        ring += [(np.asarray(za > 0), a), (crosses, a + t[..., None] * (b - a))]
    last = ring[0][1]
    for there, corner in ring:
        last = np.where(there[..., None], corner, last)
    kept = []
    for there, corner in ring:
        last = np.where(there[..., None], corner, last)
        kept.append(last)
    # A fan from the first corner that is there.
    apex = kept[0]
    pieces = [np.stack([apex, kept[i], kept[i + 1]], axis=-2) for i in range(1, 5)]
    every = np.stack(pieces, axis=2)
    doubled = np.cross(every[..., 1, :] - every[..., 0, :], every[..., 2, :] - every[..., 0, :])
    signed = dot(doubled, facing[None, :, None, :])
    anything = shines & np.any(height > 0, axis=-1)
    owner, which, part = np.nonzero((signed != 0) & anything[..., None])
    piece, area = every[owner, which, part], np.abs(signed[owner, which, part])
    above = np.abs(front[owner, which])

    def places(k: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
        # The square collapses into the triangle: s goes from its first corner to the opposite edge, t along that.
        x = piece[k][:, None]
        offset = x[..., 0, :] + s[..., None] * (
            x[..., 1, :] - x[..., 0, :] + t[..., None] * (x[..., 2, :] - x[..., 1, :])
        )
        return offset, above[k, None] / np.linalg.norm(offset, axis=-1), area[k, None] * s

    return Patches(owner, np.sign(signed[owner, which, part]), places)


def _disk(shape: Disk, two_sided: bool, points: Floats, normals: Floats) -> Patches:
    """A disk in strips along its chords, as far as they are above the horizon."""
    w, radius = shape.normal, shape.radius
    center = shape.center - points
    front = -(center @ w)
    # Upwards within the disk's plane; any direction where that is horizontal.
    up = normals - (normals @ w)[:, None] * w
    slope = np.linalg.norm(up, axis=-1)
    level = slope < 1e-12
    any_direction = np.cross(w, np.eye(3)[np.abs(w).argmin()])
    up = np.where(
        level[:, None], any_direction / np.linalg.norm(any_direction), up / np.where(level, 1.0, slope)[:, None]
    )
    across = np.cross(w, up)
    height = dot(normals, center)
    # Strips at the height of `radius` sin(f): above the horizon from sin(f) = -height / (radius slope) on.
    sine = np.where(level, -2 * np.sign(height), -height / (radius * np.where(level, 1.0, slope)))
    lowest = np.arcsin(np.clip(sine, -1, 1))
    owner = np.flatnonzero((sine < 1) & ((front > 0) | (two_sided & (front < 0))))

    def places(k: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
        i = owner[k]
        span = (np.pi / 2 - lowest[i])[:, None]
        f = lowest[i][:, None] + span * s
        half = radius * np.cos(f)
        in_plane = (radius * np.sin(f))[..., None] * up[i][:, None] + (half * (2 * t - 1))[..., None] * across[i][
            :, None
        ]
        offset = center[i][:, None] + in_plane
        return offset, np.abs(front[i])[:, None] / np.linalg.norm(offset, axis=-1), 2 * half * half * span

    return Patches(owner, np.ones(len(owner)), places)


def _sphere(shape: Sphere, two_sided: bool, points: Floats, normals: Floats) -> Patches:
    """The cap of a sphere that a receiver sees, in polar coordinates around the line to its center."""
    radius = shape.radius
    away = points - shape.center
    distance = np.linalg.norm(away, axis=-1)
    inside = distance < radius
    # In the center every axis will do.
    axis = np.where((distance > 0)[:, None], away / np.where(distance > 0, distance, 1.0)[:, None], normals)
    along = dot(normals, axis)
    side = normals - along[:, None] * axis
    tilt = np.linalg.norm(side, axis=-1)
    any_side = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=-1)])
    any_side /= np.linalg.norm(any_side, axis=-1, keepdims=True)
    side = np.where((tilt > 1e-12)[:, None], side / np.where(tilt > 1e-12, tilt, 1.0)[:, None], any_side)
    third = np.cross(axis, side)
    rim = np.arctan2(np.sqrt(np.maximum(distance**2 - radius**2, 0)), radius)
    end = np.where(inside, np.pi if two_sided else 0.0, rim)

    # The height above the horizon is (cos(a) - D) along + sin(a) tilt cos(f) in units of the radius, D the distance.
    # Circles of latitude change from all above to partly to all below where f = 0 or pi has height 0.
    far = distance / radius
    beta, gamma = np.arctan2(tilt, along), np.arccos(np.clip(far * along, -1, 1))
    changes = [np.abs(beta - gamma), beta + gamma, 2 * np.pi - beta - gamma]
    cuts = np.sort(np.stack([0 * end, *(np.clip(change, 0, end) for change in changes), end]), axis=0)
    owner, piece = np.nonzero((cuts[1:] > cuts[:-1]).T)
    low, high = cuts[piece, owner], cuts[piece + 1, owner]

    def places(k: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
        i = owner[k][:, None]
        # The half width of the part above behaves like a square root at the cuts, which sin^2 makes smooth.
        span = (high - low)[k][:, None]
        a = low[k][:, None] + span * np.sin(np.pi / 2 * s) ** 2
        per_s = span * np.pi / 2 * np.sin(np.pi * s)
        sine, cosine = np.sin(a), np.cos(a)
        # cos(a) - D, without what cancels near the sphere.
        below = -2 * np.sin(a / 2) ** 2 - (far[i] - 1)
        reach = sine * tilt[i]
        bound = np.where(reach > 0, -below * along[i] / np.where(reach > 0, reach, 1.0), -2 * np.sign(below * along[i]))
        half = np.arccos(np.clip(bound, -1, 1))
        f = half * t
        lateral = (sine * np.cos(f))[..., None] * side[i] + (sine * np.sin(f))[..., None] * third[i]
        offset = radius * (below[..., None] * axis[i] + lateral)
        toward = np.abs(1 - far[i] * cosine) * radius / np.linalg.norm(offset, axis=-1)
        # The two halves, left and right of the receiver's normal, are alike.
        return offset, toward, 2 * radius**2 * sine * per_s * half

    return Patches(owner, np.ones(len(owner)), places)


def _integrate(kernel: Kernel, patches: Patches, normals: Floats, dimensions: int = 2) -> Bounded:
    """Sum of the integrals over all patches of each receiver."""

    def integrand(index: Integers, *coordinates: Floats) -> tuple[Floats, Floats]:
        offset, light, area = patches.places(index, *coordinates)
        distance = np.linalg.norm(offset, axis=-1)
        cosine = np.clip(dot(offset, normals[patches.owner[index]][:, None]) / distance, 0, 1)
        scale = area / distance**kernel.distance
        # Rounding moves a point by parts of the patch's extent, which matters in proportion to the distance.
        extent = distance.max(axis=-1, keepdims=True)
        noise = 16 * _EPSILON * scale * extent / distance
        return patches.sign[index, None] * scale * cosine**kernel.receiver * light**kernel.light, noise

    return integrate(integrand, patches.owner, len(normals), _TOLERANCE, dimensions)
