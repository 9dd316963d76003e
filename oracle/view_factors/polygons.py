"""Exchange areas of two flat polygons in any position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, dot
from oracle.kernels.polygon import polygon
from oracle.shapes import Polygon
from oracle.view_factors.quadrature import APART, POINTS, gauss, graded

_EPSILON = float(np.finfo(np.float64).eps)

# Distance of two polygons in radii of the larger, and the Gauss points that then leave less than 1e-17 of the integral.
_RULES = ((30.0, 6), (6.0, 10), (APART, POINTS))

# A polygon below this part of the other's size is small.
_SMALL = 0.1

# Intermediate results of so many numbers stay within the processor's cache.
_AT_ONCE = 32768


@dataclass(frozen=True, eq=False)
class _Side:
    """The part of a polygon that faces another one.

    An origin (3,), vertices relative to it (N, 3), so that the shape of a small and distant polygon keeps its digits,
    and the front's unit normal.
    """

    origin: Floats
    relative: Floats
    normal: Floats

    @property
    def vertices(self) -> Floats:
        return self.origin + self.relative

    @property
    def middle(self) -> Floats:
        result: Floats = self.vertices.mean(axis=0)
        return result

    @property
    def radius(self) -> float:
        """Of a ball around the middle that holds all vertices."""
        return float(np.linalg.norm(self.relative - self.relative.mean(axis=0), axis=1).max())


def exchange_area(first: Polygon, second: Polygon) -> tuple[float, float]:
    """Exchange area ``A1 F12 = A2 F21`` [m^2] of two one-sided polygons, and a bound on its error.

    What lies behind the other's plane is clipped away first. Polygons may touch; they must not cut each other's front.

    Notes
    -----
    Far apart, Gauss quadrature of the definition over both polygons, whose integrand is positive. Else Stokes' theorem
    turns it into ``A1 F12 = 1/(2 pi) sum_ij d_i . e_j int int log r ds dt`` over all pairs of edges [Lambert 1760;
    Schroeder and Hanrahan 1993], here with the inner integral in closed form.
    """
    # A power of 2, by which one divides without loss.
    extent = max(np.abs(second.vertices - first.vertices[0]).max(), np.abs(first.vertices - first.vertices[0]).max())
    scale = 2.0 ** np.ceil(np.log2(extent))
    a, b = (
        _Side((one.vertices[0] - first.vertices[0]) / scale, (one.vertices - one.vertices[0]) / scale, one.normal)
        for one in (first, second)
    )
    facing_a, facing_b = _in_front(a, b), _in_front(b, a)
    if facing_a is None or facing_b is None:
        return 0.0, 0.0
    distance = float(np.linalg.norm(facing_a.middle - facing_b.middle)) - facing_a.radius - facing_b.radius
    apart = distance / max(facing_a.radius, facing_b.radius)
    if apart >= APART:
        value, error = _by_areas(facing_a, facing_b, apart)
    else:
        small, large = sorted((facing_a, facing_b), key=lambda side: side.radius)
        clear = _distance_from_contour(small.middle, large) / small.radius - 1
        # A small polygon's contours would cancel; the exact irradiance that it receives is smooth over it.
        dwarfed = small.radius < _SMALL * large.radius and clear >= APART
        value, error = _by_irradiance(small, large, clear) if dwarfed else _by_contours(facing_a, facing_b)
    return max(value, 0.0) * float(scale**2), error * float(scale**2)


def _in_front(side: _Side, other: _Side) -> _Side | None:
    """The part of a polygon in front of the other's plane; None if nothing is.

    Parts of a non-convex polygon stay connected by edges within the plane that are passed in both directions, on which
    all integrals cancel.
    """
    offset = side.vertices - other.vertices[0]
    heights = dot(offset, other.normal)
    # What rounding cannot tell from the plane is in it: polygons that share an edge are not cut by noise.
    noise = 8 * _EPSILON * (np.abs(offset) @ np.abs(other.normal) + 1.0)
    heights[np.abs(heights) <= noise] = 0.0
    if heights.max() <= 0:
        return None
    if heights.min() >= 0:
        return side
    corners = []
    for i, j in zip(range(len(heights)), [*range(1, len(heights)), 0], strict=True):
        if heights[i] >= 0:
            corners.append(side.relative[i])
        if heights[i] * heights[j] < 0:
            along = heights[i] / (heights[i] - heights[j])
            corners.append(side.relative[i] + along * (side.relative[j] - side.relative[i]))
    return _Side(side.origin, np.array(corners), side.normal)


# ---------------------------------------------------------------------------------------------- over the areas


def _by_areas(a: _Side, b: _Side, apart: float) -> tuple[float, float]:
    count = next(count for least, count in _RULES if apart >= least)
    (x, wx), (y, wy) = _over_fan(a, count), _over_fan(b, count)
    total = size = lost = 0.0
    heights_y, noise_y = _heights(y, a)
    heights_x, noise_x = _heights(x, b)
    step = max(1, _AT_ONCE // len(y))
    for start in range(0, len(x), step):
        part = slice(start, start + step)
        towards = y - x[part, None]
        squared = dot(towards, towards)
        kernel = heights_x[part, None] * heights_y / (np.pi * squared**2)
        noise = (heights_x[part, None] * noise_y + noise_x[part, None] * heights_y) / (np.pi * squared**2)
        total += float(wx[part] @ (kernel @ wy))
        size += float(np.abs(wx[part]) @ (kernel @ np.abs(wy)))
        lost += float(np.abs(wx[part]) @ (noise @ np.abs(wy)))
    return total, 64 * _EPSILON * size + lost


def _over_fan(side: _Side, count: int) -> tuple[Floats, Floats]:
    """Points (K, 3) and weights that integrate over a polygon: the signed triangles at its first vertex."""
    t, w = gauss(count)
    t, w = (1 + t) / 2, w / 2
    origin = side.vertices[0]
    b, c = side.relative[1:-1] - side.relative[0], side.relative[2:] - side.relative[0]
    doubled = np.cross(b, c) @ side.normal
    along, across = t[:, None], t[None, :]
    points = origin + along[None, ..., None] * (b[:, None, None] + across[None, ..., None] * (c - b)[:, None, None])
    weights = doubled[:, None, None] * (w * t)[:, None] * w
    return points.reshape(-1, 3), weights.ravel()


def _heights(points: Floats, side: _Side) -> tuple[Floats, Floats]:
    """Heights (K,) of points above a polygon's plane, at least 0, and a bound on their errors."""
    offset = points - side.vertices[0]
    heights: Floats = np.maximum(dot(offset, side.normal), 0.0)
    return heights, 8 * _EPSILON * (np.abs(offset) @ np.abs(side.normal))


def _by_irradiance(small: _Side, large: _Side, clear: float) -> tuple[float, float]:
    count = next(count for least, count in _RULES if clear >= least)
    points, weights = _over_fan(small, count)
    seen = polygon(Polygon(large.vertices), points, np.broadcast_to(small.normal, points.shape), False)
    # The normal's rounding tilts the receivers.
    error = float(np.abs(weights) @ (seen.error + 64 * _EPSILON * seen.value + 8 * _EPSILON)) / np.pi
    return float(weights @ seen.value) / np.pi, error


def _distance_from_contour(point: Floats, side: _Side) -> float:
    start, directions, lengths = _edges(side)
    along = np.clip(dot(point - start, directions), 0.0, lengths)
    return float(np.linalg.norm(point - start - along[:, None] * directions, axis=1).min())


# ------------------------------------------------------------------------------------------- along the contours


def _by_contours(a: _Side, b: _Side) -> tuple[float, float]:
    p, d, lengths = _edges(a)
    q, e, _ = _edges(b)
    cosines = d @ e.T
    total = size = 0.0
    for i in range(len(p)):
        start, end, weight, along = q - p[i], np.roll(q, -1, axis=0) - p[i], cosines[i], lengths[i]
        # Where the foot of the perpendicular on an inner edge's line passes an end of that edge.
        with_foot = np.abs(weight) > _EPSILON
        feet = np.concatenate([dot(v, e)[with_foot] / weight[with_foot] for v in (start, end)])
        kinks = np.unique(np.concatenate([[0.0, along], feet[(feet > 0) & (feet < along)]]))
        s, w = graded(kinks, start @ d[i], np.linalg.norm(np.cross(start, d[i]), axis=1))
        at = s[:, None] * d[i]
        value, magnitude = _along_edges(start - at[:, None], end - at[:, None], e)
        total += float(w @ (value @ weight))
        size += float(w @ (magnitude @ np.abs(weight)))
        for j in np.flatnonzero(with_foot):
            low, high = sorted(float(np.clip(v[j] @ e[j] / weight[j], 0.0, along)) for v in (start, end))
            if high > low:
                mean = _mean_distance(start[j] - low * d[i], start[j] - high * d[i], e[j])
                total += weight[j] * np.pi * mean * (high - low)
                size += abs(weight[j]) * np.pi * mean * (high - low)
    return total / (2 * np.pi), size * 16 * _EPSILON / (2 * np.pi)


def _edges(side: _Side) -> tuple[Floats, Floats, Floats]:
    """Starts (N, 3), unit directions (N, 3) and lengths (N,) of the edges that have a length."""
    vectors = np.roll(side.relative, -1, axis=0) - side.relative
    lengths = np.linalg.norm(vectors, axis=1)
    kept = lengths > 0
    return side.vertices[kept], vectors[kept] / lengths[kept, None], lengths[kept]


def _along_edges(start: Floats, end: Floats, e: Floats) -> tuple[Floats, Floats]:
    """Integral of log r along each edge, from points whose offsets to its ends are (K, M, 3); and its magnitude.

    Left out are the edge's length, of which the closed contour's sum is 0, and ``pi q``, q being the distance from the
    edge's line, where the foot of the perpendicular lies on the edge.
    """
    begin, finish = dot(start, e), dot(end, e)
    q = np.linalg.norm(np.cross(start, e), axis=-1)
    logs = [0.5 * t * np.log(_positive(dot(v, v))) for t, v in ((begin, start), (finish, end))]
    # Both are the plain difference of arc tangents, the second short by pi.
    on_edge = (begin < 0) & (finish > 0)
    beside = np.arctan2(q * (finish - begin), q**2 + begin * finish)
    within = -np.arctan2(q, finish) - np.arctan2(q, -begin)
    angle = np.where(on_edge, within, beside)
    return logs[1] - logs[0] + q * angle, np.abs(logs[0]) + np.abs(logs[1]) + np.abs(q * angle) + (finish - begin)


def _mean_distance(a: Floats, b: Floats, e: Floats) -> float:
    """Mean distance, from a line through the origin along `e`, of the points between a and b."""
    a, b = a - (a @ e) * e, b - (b @ e) * e
    along = b - a
    length = float(np.linalg.norm(along))
    middle = (a + b) / 2
    if np.linalg.norm(middle) >= APART * length / 2:
        t, w = gauss(POINTS)
        return float(w @ np.linalg.norm(middle + t[:, None] * (along / 2), axis=1)) / 2
    t_a, t_b = float(a @ along) / length, float(b @ along) / length
    h = float(np.linalg.norm(np.cross(a, along))) / length
    logarithm = h * h * (np.arcsinh(t_b / h) - np.arcsinh(t_a / h)) if h > 0 else 0.0
    return float(t_b * np.linalg.norm(b) - t_a * np.linalg.norm(a) + logarithm) / (2 * length)


def _positive(x: Floats) -> Floats:
    """The same without zeros, for the logarithm of what is multiplied with 0 there."""
    result: Floats = np.where(x > 0, x, 1.0)
    return result
