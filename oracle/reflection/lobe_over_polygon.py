"""Cosine powers around an axis, integrated over polygons clipped at two horizons: what `phong` is computed with.

Receivers close to the polygon's plane see slivers, whose contours cancel, and edges that pass them so closely that an
ulp of a vertex turns them. What float64 loses there, the processor's longer floats keep, where it has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from oracle.arrays import Floats, dot
from oracle.bounded import Bounded
from oracle.shapes import Polygon

_EPSILON = float(np.finfo(np.float64).eps)
# A power of the cosine that has decayed by this exponent along an edge is lost in float64.
GONE = 38.0
# With a larger relative error than this, results are computed once more in longer floats.
_GOOD = 1e-11
# Points of a Gauss rule along an edge, along each side of a small triangle, and where the power is gone.
_FLOAT64 = (48, 12, GONE)
_LONGER = (72, 20, 46.0)
# Polygons no larger than this as an angle, and over which the power varies no more than this exponent, are integrated
# over their area; the contour would cancel.
_SMALL = 0.12
_VARIATION = 4.0
# Where the power stays below this on the whole contour, the constant of the potential is left out.
_TAIL = 1e-3


@dataclass(frozen=True, eq=False)
class _Seen:
    """What N receivers see of a polygon, as K vertices, some of them repeated."""

    offsets: Floats
    """From the receiver [m], shape (N, K, 3)."""
    relative: Floats
    """From the polygon's first vertex [m], which is more precise when far away."""
    doubt: Floats
    """By how much clipping may have moved a vertex along its edge [m], where that tells, shape (N, K)."""
    rounding: Floats
    """By how much clipping may have moved it across [m], shape (N, K)."""
    missed: Floats
    """Solid angle that may be left where no vertex is above a horizon by more than rounding [sr], shape (N,)."""

    def clipped(self, normals: Floats, doubtful: bool) -> _Seen:
        """The part above the horizon of `normals` (N, 3), after Sutherland and Hodgman [1974]."""
        n, count, _ = self.offsets.shape
        heights = np.einsum("nki,ni->nk", self.offsets, normals)
        following = np.roll(heights, -1, axis=1)
        edges = np.roll(self.relative, -1, axis=1) - self.relative
        inside = heights > 0
        crossing = inside != (following > 0)
        fall = np.where(crossing, heights - following, 1.0)
        # Step from the end that is nearer to the horizon.
        near = np.abs(heights) <= np.abs(following)
        step = np.where(near, heights, following) / fall
        start = np.where(near[..., None], self.offsets, np.roll(self.offsets, -1, axis=1))
        begin = np.where(near[..., None], self.relative, np.roll(self.relative, -1, axis=1))
        step_vector = step[..., None] * edges
        reach = np.sqrt(dot(self.offsets, self.offsets))
        reach = np.maximum(reach, np.roll(reach, -1, axis=1))
        along = np.sqrt(dot(edges, edges))
        rounding = 4 * float(np.finfo(reach.dtype).eps) * reach
        doubt = rounding * np.minimum(along / np.abs(fall), 1e6) if doubtful else np.zeros_like(reach)

        # What sticks out by less than rounding, if anything does, is within so much of the horizon.
        nearest = np.maximum(np.sqrt(dot(self.offsets, self.offsets).min(axis=1)), np.finfo(np.float64).tiny)
        highest, turn = heights.max(axis=1), np.minimum(rounding.max(axis=1) / nearest, np.pi)
        strip = turn * (np.minimum(along.sum(axis=1) / nearest, 2 * np.pi) + turn)
        grazes = np.abs(highest) < rounding.max(axis=1)

        # Each vertex is followed by the crossing of its edge; those that exist come first, the last one is repeated.
        exists = np.stack([inside, crossing], axis=2).reshape(n, 2 * count)
        order = np.argsort(~exists, axis=1, kind="stable")
        kept = exists.sum(axis=1)
        slots = max(int(kept.max(initial=0)), 1)
        place = np.minimum(np.arange(slots), np.maximum(kept - 1, 0)[:, None])
        chosen = np.take_along_axis(order, place, axis=1)

        def choose(vertex: Floats, cut: Floats) -> Floats:
            both = np.stack([vertex, cut], axis=2).reshape(n, 2 * count, *vertex.shape[2:])
            return np.take_along_axis(both, chosen.reshape(*chosen.shape, *(1,) * (both.ndim - 2)), axis=1)

        return _Seen(
            choose(self.offsets, start + step_vector),
            choose(self.relative, begin + step_vector),
            choose(self.doubt, doubt),
            choose(self.rounding, rounding),
            self.missed + np.where(grazes, strip, 0),
        )


def moment(polygon: Polygon, points: Floats, normals: Floats, axes: Floats, n: int, double: bool) -> Bounded:
    """Moments (N,) at receivers (N, 3): axial ones, or double-axis ones with the receiver's normal."""
    found = _moment(np.float64, polygon, points, normals, axes, n, double)
    poor = found.error > _GOOD * found.value
    if np.finfo(np.longdouble).eps < _EPSILON and poor.any():
        longer = _moment(np.longdouble, polygon, points[poor], normals[poor], axes[poor], n, double)
        found.value[poor] = longer.value
        found.error[poor] = longer.error + _EPSILON * found.value[poor]
    return found


def _moment(
    kind: Any, polygon: Polygon, points: Floats, normals: Floats, axes: Floats, n: int, double: bool
) -> Bounded:
    """Moments in floats of the given kind."""
    epsilon = float(np.finfo(kind).eps)
    vertices, points = np.asarray(polygon.vertices, dtype=kind), np.asarray(points, dtype=kind)
    normals, axes = (v / np.sqrt(dot(v, v))[:, None] for v in (np.asarray(w, dtype=kind) for w in (normals, axes)))
    relative = vertices - vertices[0]
    front = np.cross(relative[1:-1], relative[2:]).sum(axis=0)
    front = front / np.sqrt(dot(front, front))
    offsets = vertices[None] - points[:, None]
    height = -np.einsum("ni,i->n", offsets[:, 0], front)
    # The normal is rounded too, more so that of a thin polygon.
    size = float(np.abs(relative).max())
    doubt = epsilon * (4 + 4 * size**2 / polygon.area) * np.sqrt(dot(offsets[:, 0], offsets[:, 0]))

    exact = np.zeros(offsets.shape[:2], dtype=kind)
    seen = _Seen(offsets, np.broadcast_to(relative, offsets.shape), exact, exact, exact[:, 0])
    # On the clipped horizon the double-axis integrand is 0, and on the lobe's any power is: errors there do not tell.
    seen = seen.clipped(normals, doubtful=not double).clipped(axes, doubtful=n == 0)

    centre = seen.offsets.mean(axis=1)
    distance = np.sqrt(dot(centre, centre))
    spread = seen.relative - seen.relative.mean(axis=1, keepdims=True)
    angle = np.sqrt(dot(spread, spread).max(axis=1)) / np.maximum(distance, np.finfo(np.float64).tiny)
    z = dot(centre, axes) / np.maximum(distance, np.finfo(np.float64).tiny)
    sine = np.sqrt(np.clip(1 - z**2, 0, 1))
    tame = (z > 3 * angle) & (n * angle * (sine + angle) <= _VARIATION * (z - angle))
    small = (angle <= _SMALL) & ((n <= 6) | tame)

    value, error = np.zeros(len(points), dtype=kind), np.zeros(len(points), dtype=kind)
    for here, method in ((small, _over_area), (~small, _over_contour)):
        if here.any():
            what = _Seen(*(a[here] for a in (seen.offsets, seen.relative, seen.doubt, seen.rounding, seen.missed)))
            found = method(what, front, height[here], doubt[here], normals[here], axes[here], n, double)
            value[here], error[here] = found.value, found.error
    value = np.maximum(value, 0)
    # So near to the plane that the side is uncertain, all may be wrong.
    error = error + np.where(np.abs(height) <= doubt, value, 0) + seen.missed
    return Bounded(np.where(height > 0, value, 0), np.where(height > -doubt, error, 0))


def _precision(numbers: Floats) -> tuple[float, tuple[int, int, float]]:
    """What rounding may do to such numbers, and how exact quadrature has to be for them."""
    return float(np.finfo(numbers.dtype).eps), _FLOAT64 if numbers.dtype == np.float64 else _LONGER


@cache
def _rule(order: int, kind: np.dtype[Any]) -> tuple[Floats, Floats]:
    """Gauss's nodes and weights on [-1, 1] in floats of the given kind, by Newton's method from those in float64."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    if kind == np.float64:
        return nodes, weights
    nodes = nodes.astype(kind)
    for _ in range(2):
        last, value = np.ones_like(nodes), nodes
        for k in range(2, order + 1):
            last, value = value, ((2 * k - 1) * nodes * value - (k - 1) * last) / k
        slope = order * (nodes * value - last) / (nodes**2 - 1)
        nodes = nodes - value / slope
    return nodes, 2 / ((1 - nodes**2) * slope**2)


def _misplaced(seen: _Seen, moved: Floats, peak: Floats) -> Floats:
    """Error (N,) by vertices that are `moved` (N, K) by so many metres, where the integrand is at most `peak` (N,)."""
    following = np.roll(seen.offsets, -1, axis=1)
    cross = np.cross(seen.offsets, following)
    arcs = np.arctan2(np.sqrt(dot(cross, cross)), dot(seen.offsets, following))
    length = np.sqrt(dot(seen.offsets, seen.offsets))
    turn = np.minimum(moved / np.maximum(length, np.finfo(np.float64).tiny), np.pi)
    # An arc without length still has the one that the displacement gives it.
    total: Floats = peak * (turn * (arcs + np.roll(arcs, 1, axis=1) + turn)).sum(axis=1)
    return total


# -------------------------------------------------------------------------------------------------- small ones


def _over_area(
    seen: _Seen, front: Floats, height: Floats, doubt: Floats, normals: Floats, axes: Floats, n: int, double: bool
) -> Bounded:
    """Gauss rule over each triangle of a fan, whose signed areas make up for a non-convex contour."""
    first = seen.relative[:, :1]
    a, b = seen.relative[:, 1:-1] - first, seen.relative[:, 2:] - first
    if not a.shape[1]:
        return Bounded(np.zeros(len(height)), np.zeros(len(height)))
    epsilon, (_, order, _) = _precision(height)
    nodes, along_side = _rule(order, height.dtype)
    doubled = np.einsum("nti,i->nt", np.cross(a, b), front)
    x, y = (1 + nodes) / 2, (1 + nodes) / 2
    weights = np.outer(x * along_side, along_side) / 4
    sides = a[:, :, None, None] + y[:, None] * (b - a)[:, :, None, None]
    place = seen.offsets[:, :1, None, None] + x[:, None, None] * sides
    squared = dot(place, place)
    length = np.sqrt(squared)
    along = np.einsum("ntxyi,ni->ntxy", place, axes)
    z = np.maximum(along / length, 0)
    # From the sine near the axis, where a rounded cosine would spoil high powers.
    across = place - along[..., None] * axes[:, None, None, None]
    lost = np.minimum(dot(across, across) / squared, 0.5)
    power = np.where(lost < 0.5, np.exp(n / 2 * np.log1p(-lost)), z**n)
    cosine = np.maximum(np.einsum("ntxyi,ni->ntxy", place, normals) / length, 0) if double else 1.0
    element = weights * doubled[..., None, None] * height[:, None, None, None] / (squared * length)
    value = (element * power * cosine).sum(axis=(1, 2, 3))
    # Directions are off by some ulp: the power changes by n tan(angle) of itself, the cosine by an ulp of 1.
    turned = n * np.sqrt(np.clip(1 - z**2, 0, 1)) * z ** max(n - 1, 0) * cosine + (power if double else 0)
    size = np.abs(element)
    error = (size * (16 * power * cosine + 4 * turned)).sum(axis=(1, 2, 3)) * epsilon
    error += np.abs(value) * doubt / np.maximum(np.abs(height), np.finfo(np.float64).tiny)
    # The area of what is left of an edge-on triangle is a difference.
    scale = np.sqrt(dot(a, a) * dot(b, b)) * weights.sum()
    rough = 4 * epsilon * scale * np.abs(height)[:, None] / (squared * length).min(axis=(2, 3))
    error += (rough * (power * cosine).max(axis=(2, 3))).sum(axis=1)
    return Bounded(value, error + _misplaced(seen, seen.doubt, (power * cosine).max(axis=(1, 2, 3))))


# ----------------------------------------------------------------------------------------------------- contour


def potential(b: Floats, c: Floats, s: Floats, p: int, whole: bool | Floats) -> tuple[Floats, Floats]:
    """``(1 - z^p) / (1 - z^2)`` on an arc ``z = c cos(s)``, without the 1 unless `whole`; and ``log z``."""
    z = np.maximum(c * np.cos(s), np.finfo(np.float64).tiny)
    # 1 - z^2 from what is small near the axis.
    squared = np.minimum(b**2 + (c * np.sin(s)) ** 2, 1.0)
    logarithm = np.where(squared < 0.5, np.log1p(-np.minimum(squared, 0.5)) / 2, np.log(z))
    numerator = np.where(whole, -np.expm1(p * logarithm), -np.exp(p * logarithm))
    # On the axis itself dphi is 0 on both sides of it.
    ratio = np.where(squared > 0, numerator / np.where(squared > 0, squared, 1.0), p / 2)
    return ratio, logarithm


def _over_contour(
    seen: _Seen, front: Floats, height: Floats, doubt: Floats, normals: Floats, axes: Floats, n: int, double: bool
) -> Bounded:
    """Gauss rule over each edge's arc."""
    epsilon, (order, _, gone) = _precision(height)
    nodes, along_edge = _rule(order, height.dtype)
    pi = 4 * np.arctan(height.dtype.type(1))
    start, end = seen.offsets, np.roll(seen.offsets, -1, axis=1)
    edge = np.roll(seen.relative, -1, axis=1) - seen.relative
    lengths = [np.sqrt(dot(v, v)) for v in (start, end, edge)]
    # Three products are the same vector; the one of the two shortest is the most precise.
    longest = np.argmax(lengths, axis=0)[..., None]
    cross = np.where(longest == 0, np.cross(end, edge), np.cross(start, np.where(longest == 1, edge, end)))
    area = np.sqrt(dot(cross, cross))
    exists = area > 0
    shorter = np.sort(lengths, axis=0)
    blur = 4 * epsilon * shorter[0] * shorter[1] / np.where(exists, area, 1.0)
    # A cut vertex that is off turns the plane, the more so if the other end is nearly opposite.
    off = seen.doubt + seen.rounding
    blur += (off * lengths[1] + np.roll(off, -1, axis=1) * lengths[0]) / np.where(exists, area, 1.0)
    blur = np.minimum(blur, 2.0)
    blur = np.where(exists, blur, np.where(shorter[0] > 0, 2.0, 0.0))

    # The arc's plane, and in it the direction nearest to the axis.
    m = cross / np.where(exists, area, 1.0)[..., None]
    axis = np.broadcast_to(axes[:, None], m.shape)
    b = dot(m, axis)
    across = np.cross(m, axis)
    c = np.sqrt(dot(across, across))
    fallback = np.cross(m, start)
    flat = c < 1e-150
    e2 = np.where(flat[..., None], fallback, across) / np.where(flat, np.maximum(lengths[0], 1e-300), c)[..., None]
    e1 = np.cross(e2, m)
    first = np.arctan2(dot(start, e2), dot(start, e1))
    arc = np.where(exists, np.arctan2(area, dot(start, end)), 0.0)
    last = first + arc

    p = n + 2 if double else n + 1
    top = np.clip(0, first, last)
    highest = np.where(exists, c * np.maximum(np.cos(top), 0), 0.0)
    core = np.arccos(np.maximum(np.cos(top), 0) * np.exp(-gone / max(n, 1)))
    low, high = np.clip(-core, first, last), np.clip(core, first, last)

    def around(one: Floats, other: Floats) -> Floats:
        """Angle around the axis between two places on the arc."""
        size = np.abs(b)
        even = b**2 * np.cos(one) * np.cos(other) + np.sin(one) * np.sin(other)
        angle: Floats = np.sign(b) * np.arctan2(size * np.sin(other - one), even)
        return angle

    peak = highest.max(axis=1)
    whole = peak ** float(p) > _TAIL
    half = (high - low)[..., None] / 2
    s = low[..., None] + half * (1 + nodes)
    ratio, logarithm = potential(b[..., None], c[..., None], s, p, whole[:, None, None])
    weights = half * along_edge
    gamma = dot(axes, normals)[:, None] if double else np.ones((len(axes), 1), dtype=height.dtype)
    turning = (weights * ratio).sum(axis=-1)
    inside = np.where(whole[:, None], around(first, low) + around(high, last), 0.0)
    winding = np.round(around(first, last).sum(axis=1) / (2 * pi))
    enclosed = np.where(whole, 0.0, 2 * pi * winding)
    total = (gamma * (b * turning + inside)).sum(axis=1) / p + gamma[:, 0] * enclosed / p

    power = np.exp(n * logarithm)
    sideways = np.sqrt(np.clip(1 - np.exp(2 * logarithm), 0, 1))
    # Rounding: of what is added up, of the arcs' planes, of directions by which powers change.
    magnitude = np.abs(gamma) * (np.abs(b * turning) + np.abs(inside)) / p
    error = 16 * epsilon * (magnitude.sum(axis=1) + np.abs(gamma[:, 0] * enclosed) / p)
    error += (blur * np.abs(gamma) * (np.abs(turning) + np.where(whole[:, None], arc, 0.0)) / p).sum(axis=1)
    error += 8 * epsilon * (weights * power * (1 + n * sideways * np.abs(b[..., None]))).sum(axis=(1, 2))
    if double:
        q = np.cross(axes, normals)[:, None]
        q1, q2 = dot(e1, np.broadcast_to(q, e1.shape)), dot(e2, np.broadcast_to(q, e2.shape))
        tilt = np.cos(s) * q1[..., None] + np.sin(s) * q2[..., None]
        climb = -c[..., None] * np.sin(s) * power
        total += (weights * climb * tilt).sum(axis=(1, 2))
        turned = n * sideways * np.exp(max(n - 1, 0) * logarithm) * np.abs(c[..., None] * np.sin(s))
        error += 8 * epsilon * (weights * (2 * np.abs(climb) + turned) * np.abs(tilt)).sum(axis=(1, 2))
        steep = np.abs(climb) + power * np.abs(tilt)
        error += (blur * (weights * steep).sum(axis=-1)).sum(axis=1)
    error += _misplaced(seen, seen.doubt + seen.rounding, peak ** float(n))
    # From the front the vertices go round counter-clockwise as seen from inside of the sphere of directions.
    return Bounded(np.where(height > 0, -total, total), error)
