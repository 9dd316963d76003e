"""Exchange areas of pairs without a closed form: what one shape receives of the other, integrated over its surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracle.adaptive import integrate
from oracle.arrays import Floats, Integers, dot
from oracle.emitters import Receivers
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Disk, Polygon, Sphere
from oracle.visibility.convex import convex_parts

_EPSILON = float(np.finfo(np.float64).eps)

# Parts of the surface whose two quadratures differ by less than this part of the whole are not divided further.
_TOLERANCE = 1e-12
# After so many parts it ends, in some seconds, and the bound tells what is missing.
_MOST = 1 << 14
# Distances below so many roundings count as touching.
_TOUCH = 16 * _EPSILON


def exchange_over_surface(first: Polygon | Disk, second: Polygon | Disk | Sphere) -> tuple[float, float]:
    """Exchange area ``A1 F12 = A2 F21`` [m^2] of a flat shape and any other, and a bound on its error.

    What lies behind the plane of a flat one does not count. Shapes may touch, but no sphere may pass through the flat
    one. The bound is that of `oracle.adaptive`, an estimate.

    Notes
    -----
    The projected solid angle of the one, clipped at the other's plane, divided by pi and integrated over the other. All
    points of a flat shape share their horizon, so that the integrand is smooth where the outlines do not touch.
    """
    flat: Polygon | Disk = first
    other: Polygon | Disk | Sphere = second
    if not isinstance(second, Sphere) and _radius(first) > _radius(second):
        # Over a small shape, what a larger one sends is smooth.
        flat, other = second, first
    # Seen from the other one's middle, whose shape so keeps its digits.
    origin = _middle(other)
    surface = _disk(flat, other, origin) if isinstance(flat, Disk) else _polygon(flat, other, origin)
    if surface is None:
        return 0.0, 0.0
    seen, normal = _moved(other, -origin), flat.normal
    reach = float(np.linalg.norm(_middle(flat) - origin)) + _radius(flat) + _radius(other)
    gap = max(reach - 2 * (_radius(flat) + _radius(other)), 0.0)
    # The normal's rounding tilts the receivers.
    tilt = 4 * _EPSILON * min(2 * np.pi, _radius(other) ** 2 * np.pi / gap**2 if gap > 0 else np.inf)

    def integrand(index: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        points, area = surface.places(index, s, t)
        here = projected_solid_angle(seen, Receivers(points, normal))
        return here.value * area, (here.error + 4 * _EPSILON * here.value + tilt) * area

    total = integrate(integrand, np.zeros(surface.count, dtype=np.int64), 1, _TOLERANCE, most=_MOST)
    value, error = float(total.value[0]) / np.pi, float(total.error[0]) / np.pi
    return value, error + misplaced(value, _TOUCH * reach, gap, min(_radius(flat), _radius(other)))


def misplaced(value: float, shift: float, gap: float, radius: float) -> float:
    """Change of an exchange area when one shape moves by a small `shift`.

    It is 1/(2 pi) times the integral of 1/r along both outlines, at most 2 asinh of the ratio of the lengths for each
    point of the shorter one; and by less than 4 shifts relative to the distance.
    """
    along_outlines = shift * 2 * radius * np.log(1 / _EPSILON)
    return float(min(along_outlines, 4 * value * shift / gap) if gap > 0 else along_outlines)


# ---------------------------------------------------------------------------------------------- surfaces


@dataclass(frozen=True, eq=False)
class _Surface:
    """So many images of the unit square; places s, t (K, Q) to points (K, Q, 3) and area per unit square (K, Q)."""

    count: int
    places: Callable[[Integers, Floats, Floats], tuple[Floats, Floats]]


def _polygon(flat: Polygon, other: Polygon | Disk | Sphere, origin: Floats) -> _Surface | None:
    """The part of a polygon in front of the other shape's plane, in triangles."""
    triangles = []
    for part in convex_parts(flat):
        corners = part
        if not isinstance(other, Sphere):
            corners = _in_front(part, _middle(other), other.normal)
        triangles += [corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)]
    if not triangles:
        return None
    corners = np.array(triangles)
    first, b, c = corners[:, 0] - origin, corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1]
    doubled = np.linalg.norm(np.cross(b, c), axis=1)

    def places(index: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        # s goes from the first corner to the opposite edge, t along that.
        b_s, c_st = s[..., None] * b[index, None], (s * t)[..., None] * c[index, None]
        return first[index, None] + (b_s + c_st), doubled[index, None] * s

    return _Surface(len(triangles), places)


def _in_front(corners: Floats, on_plane: Floats, normal: Floats) -> Floats:
    """The part (K, 3) of a convex polygon above a plane."""
    offsets = corners - on_plane
    heights = dot(offsets, normal)
    heights[np.abs(heights) <= _TOUCH * np.abs(offsets).max()] = 0.0
    kept = []
    for i, here in enumerate(heights):
        beyond = heights[i - 1]
        if here * beyond < 0:
            kept.append(corners[i - 1] + beyond / (beyond - here) * (corners[i] - corners[i - 1]))
        if here >= 0:
            kept.append(corners[i])
    return np.array(kept) if (heights > 0).any() else corners[:0]


def _disk(flat: Disk, other: Polygon | Disk | Sphere, origin: Floats) -> _Surface | None:
    """The part of a disk in front of the other shape's plane, in strips along its chords."""
    lowest, up = -np.pi / 2, np.eye(3)[np.abs(flat.normal).argmin()]
    if not isinstance(other, Sphere):
        offset = flat.center - _middle(other)
        height = float(dot(offset, other.normal))
        slope = other.normal - (other.normal @ flat.normal) * flat.normal
        steep = float(np.linalg.norm(slope))
        if abs(height) <= _TOUCH * np.abs(offset).max():
            height = 0.0
        if height <= -flat.radius * steep:
            return None
        if height < flat.radius * steep:
            lowest, up = -np.arcsin(height / (flat.radius * steep)), slope
    up = up - (up @ flat.normal) * flat.normal
    up = up / np.linalg.norm(up)
    across, span = np.cross(flat.normal, up), np.pi / 2 - lowest

    def places(index: Integers, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        angle = lowest + span * s
        half = flat.radius * np.cos(angle)
        along = (flat.radius * np.sin(angle))[..., None] * up + (half * (2 * t - 1))[..., None] * across
        return (flat.center - origin) + along, 2 * half * half * span

    return _Surface(1, places)


# ------------------------------------------------------------------------------------------------ shapes


def _middle(shape: Polygon | Disk | Sphere) -> Floats:
    result: Floats = shape.vertices.mean(axis=0) if isinstance(shape, Polygon) else shape.center
    return result


def _radius(shape: Polygon | Disk | Sphere) -> float:
    """Of a ball around the middle that holds the shape."""
    if isinstance(shape, Polygon):
        return float(np.linalg.norm(shape.vertices - _middle(shape), axis=1).max())
    return shape.radius


def _moved(shape: Polygon | Disk | Sphere, shift: Floats) -> Polygon | Disk | Sphere:
    match shape:
        case Polygon():
            return Polygon(shape.vertices + shift)
        case Disk():
            return Disk(shape.center + shift, shape.normal, shape.radius)
        case Sphere():
            return Sphere(shape.center + shift, shape.radius)
