"""Projected solid angle of polygons, clipped at the receiver's horizon.

Stokes' theorem turns the integral of the receiver's cosine over the polygon's solid angle into one along its edges,
``1/2 sum_i Theta_i (n . Gamma_i)``, with the angle Theta_i that edge i subtends and the unit normal Gamma_i of the
plane through edge and receiver [Lambert 1760; Nishita and Nakamae 1985; Arvo 1994]. Two things keep its digits:

- The angle comes from atan2 of sine and cosine; the arc cosine loses half of its digits for small angles.
- The contributions of a far polygon's edges cancel but for the square of its angular size. The constant part of
  ``Theta_i / |v_i x v_j|`` is therefore split off and summed as an area; what is left of it, g_i, is small and computed
  without cancellation.

Arrays of vectors have the shape (3, ...) here: numpy works fastest on long last axes. Outlines are closed: their last
vertex is the first once more, so that slices hold the starts and the ends of all edges. All edges are computed as if
whole; those that pass through the horizon are then replaced by their part above it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracle.arrays import Booleans, Floats, Integers
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.shapes import Polygon

# float64, and longer where that is not enough.
Reals: TypeAlias = NDArray[np.floating[Any]]

_EPSILON = float(np.finfo(np.float64).eps)
# Below this angular size (radius over distance, squared) the difference form is the more precise one.
_FAR = 0.15**2
# Where the bound exceeds this part of the value, longer numbers are tried.
_POOR = 2e-11
# Rounding errors in units of eps times the magnitude of what is added up; the largest found in verification was 3.
_ROUNDINGS = 8.0
# Vertices at once, of all receivers together: intermediate results stay within the processor's cache.
_AT_ONCE = 24000
# Added to a cosine of 0 it avoids a division by 0; next to those of other angles it is nothing.
_NOTHING = 1e-150


def polygon(shape: Polygon, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Projected solid angle of a polygon [sr].

    Parameters
    ----------
    shape : Polygon
        Its front counts, and its back if `two_sided`. The polygon's own plane sees neither: there the result is 0,
        though on the polygon itself the limits from both sides are not.
    points, normals : ndarray
        Receivers, shape (N, 3) each.

    Returns
    -------
    Bounded
        Shape (N,). The error is a few ulp of the value where cosines of light and receiver are not small. Divide by the
        smaller one elsewhere: for a light seen nearly edge-on, or a sliver above the horizon.
    """
    vertices, p = shape.vertices.T[:, :, None], np.ascontiguousarray(points.T)
    seen = _precise_contour(vertices, p[:, None, :], vertices, normals.T)

    w = shape.normal
    away = p - vertices[:, 0]
    height = _dot(w, away)
    # From behind, the vertices go round the other way.
    value = np.abs(seen.value) if two_sided else np.maximum(seen.value, 0.0)
    # So near to the plane that the side is uncertain, all may be wrong.
    uncertain = np.abs(height) < _ROUNDINGS * _EPSILON * _dot(np.abs(w) + (w != 0), np.abs(away))
    # The normal of a needle may be wrong by more; what is seen for certain is seen from the front.
    certain = (seen.value > seen.error) & ~uncertain
    sees = height != 0 if two_sided else (height > 0) | (height < 0) & certain
    missed = np.where(uncertain, np.abs(seen.value), np.where(sees | (height == 0), 0.0, value))
    return Bounded(np.where(sees, value, 0.0), seen.error + missed)


def contour(offsets: Floats, normals: Floats, relative: Floats) -> Bounded:
    """Signed projected solid angle of polygons that differ from receiver to receiver.

    Parameters
    ----------
    offsets : ndarray
        Vertices as seen from the receivers [m], shape (N, V, 3); repeated ones do no harm. Positive are polygons that
        go round counter-clockwise as seen from the side on which the receiver is.
    normals : ndarray
        Unit normals of the receivers, shape (N, 3).
    relative : ndarray
        The same vertices relative to any point nearby, shape (N, V, 3): for far polygons these carry the digits.

    Returns
    -------
    Bounded
        Shape (N,) [sr], clipped at the receivers' horizons.
    """
    return _precise_contour(offsets.transpose(2, 1, 0), np.zeros((3, 1, 1)), relative.transpose(2, 1, 0), normals.T)


def _precise_contour(vertices: Floats, points: Floats, relative: Floats, normals: Floats) -> Bounded:
    """As `contour`, for vertices and relative ones (3, V, N or 1), seen from points (3, 1, N or 1)."""
    arguments = [np.ascontiguousarray(array) for array in (_closed(vertices), points, _closed(relative), normals)]
    count = normals.shape[1]
    value, error = np.empty(count), np.empty(count)
    for part in chunks((count,), _AT_ONCE // (vertices.shape[1] + 1)):
        here = _contour(*(array if array.shape[-1] == 1 else array[(..., *part)] for array in arguments))
        value[part], error[part] = here
    poor = np.flatnonzero(error > _POOR * np.abs(value))
    poor = poor[value[poor] != 0]
    if not len(poor) or np.finfo(np.longdouble).eps >= _EPSILON:
        return Bounded(value, error)

    # Once more, with the longer numbers that many processors have; from the subtractions on, which round as well.
    longer = [_some(array, poor).astype(np.longdouble) for array in arguments]
    longer[-1] /= np.sqrt(_dot(longer[-1], longer[-1]))
    value[poor], still = _contour(*longer)
    error[poor] = still + _EPSILON / 2 * np.abs(value[poor])
    return Bounded(value, error)


def _contour(vertices: Reals, points: Reals, relative: Reals, n: Reals) -> tuple[Reals, Reals]:
    """Values and bounds (N,) as of `_precise_contour`, for closed outlines and in the numbers that it gets."""
    offsets = vertices - points
    heights = _dot(n[:, None], offsets)
    centered = relative - relative[:, :-1].sum(axis=1, keepdims=True) / (relative.shape[1] - 1)
    center = offsets[:, 0] - centered[:, 0]
    above = heights.max(axis=0) > 0
    far = _dot(centered, centered).max(axis=0) < _FAR * _dot(center, center)

    value, error = np.zeros(n.shape[1], n.dtype), np.zeros(n.shape[1], n.dtype)
    for form, shape, which in ((_near_contour, relative, above & ~far), (_far_contour, centered, above & far)):
        index = np.flatnonzero(which)
        if len(index) == len(which):
            return form(offsets, shape, heights, n)
        if len(index):
            value[index], error[index] = form(*(_some(array, index) for array in (offsets, shape, heights, n)))
    return value, error


def _near_contour(offsets: Reals, relative: Reals, heights: Reals, n: Reals) -> tuple[Reals, Reals]:
    """Sum over the edges of angle times axis."""
    count = n.shape[1]
    start, end, edges = offsets[:, :-1], offsets[:, 1:], relative[:, 1:] - relative[:, :-1]
    squared = _dot(offsets, offsets)
    axes = _cross(start, edges)
    # Both ends give the same axis; one that is much nearer loses fewer digits.
    nearer = np.flatnonzero(squared[:-1] > 4 * squared[1:])
    if len(nearer):
        axes.reshape(3, -1)[:, nearer] = _cross(_take(offsets, nearer + count, count), _take(edges, nearer, count))
    moments, sines, cosines = _dot(n[:, None], axes), np.sqrt(_dot(axes, axes)), _dot(start, end)
    magnitudes = np.sqrt(np.minimum(squared[:-1], squared[1:]))
    magnitudes *= np.sqrt(_dot(edges, edges))

    above = heights >= 0
    cut = None if above.all() else _Crossings.of(offsets, heights, above)
    if cut is not None:
        whole = sines.take(cut.edge)
        sines.reshape(-1)[cut.edge] = cut.part * whole
        cosines.reshape(-1)[cut.edge] = _dot(cut.inside, cut.points)
    factors = _angles(sines, cosines)
    if cut is not None:
        sines.reshape(-1)[cut.edge] = whole
        factors *= above[:-1] | above[1:]
    # An edge that points at the receiver, or has no length, subtends no angle.
    factors /= sines + (sines == 0)
    moments *= factors
    magnitudes *= factors
    total, magnitude = moments.sum(axis=0), magnitudes.sum(axis=0)
    if cut is not None:
        owner, x, y, sign = cut.along_horizon()
        sine = _dot(_some(n, owner), _cross(x, y))
        np.add.at(total, owner, np.copysign(_angles(np.abs(sine), _dot(x, y)), sign * sine))
        # Rounding displaces the crossings by ulps of the edge's distance.
        farthest = np.sqrt(np.maximum(squared.take(cut.edge), squared.take(cut.edge + count)))
        distance = np.sqrt(_dot(cut.points, cut.points))
        np.add.at(magnitude, cut.owner, 0.5 + 0.5 * farthest / (distance + (distance == 0)))
    return total / -2, _ROUNDINGS * np.finfo(n.dtype).eps / 2 * magnitude


def _far_contour(offsets: Reals, centered: Reals, heights: Reals, n: Reals) -> tuple[Reals, Reals]:
    """Difference form: 1/r_c^2 times the projected area, and a sum over the edges of g_i times their axes."""
    seen = _Distant.of(offsets[:, 0] - centered[:, 0], n)
    distances, differences = seen.distances(centered)
    starts, ends = (distances[:-1], differences[:-1]), (distances[1:], differences[1:])
    terms, magnitudes = seen.terms(centered[:, :-1], centered[:, 1:] - centered[:, :-1], starts, ends)

    above = heights >= 0
    cut = None if above.all() else _Crossings.of(centered, heights, above)
    if cut is not None:
        visible = above[:-1] | above[1:]
        terms, magnitudes = terms * visible, magnitudes * visible
        part, size = seen.of_receivers(cut.owner).segments(cut.inside, cut.points)
        terms.reshape(-1)[cut.edge] = np.where(cut.rises, -part, part)
        magnitudes.reshape(-1)[cut.edge] = size
    total, magnitude = terms.sum(axis=0), magnitudes.sum(axis=0)
    if cut is not None:
        owner, x, y, sign = cut.along_horizon()
        part, size = seen.of_receivers(owner).segments(x, y)
        np.add.at(total, owner, sign * part)
        np.add.at(magnitude, owner, size)
    return total / -2, _ROUNDINGS * np.finfo(n.dtype).eps / 2 * magnitude / seen.squared


@dataclass(frozen=True, eq=False)
class _Crossings:
    """Where outlines pass through the horizon."""

    edge: Integers
    """The edges that do so, as indices into flattened arrays (V, N); shape (K,)."""
    owner: Integers
    """The receivers whose horizons they are, shape (K,)."""
    rises: Booleans
    """Whether the edge leads upwards, shape (K,)."""
    inside: Reals
    """The edge's end above the horizon, shape (3, K)."""
    points: Reals
    """The crossings, shape (3, K)."""
    part: Reals
    """How much of the edge is above the horizon, shape (K,)."""

    @classmethod
    def of(cls, vertices: Reals, heights: Reals, above: Booleans) -> _Crossings:
        """Crossings of closed outlines (3, V + 1, N or 1)."""
        count = heights.shape[1]
        edge = np.flatnonzero(above[:-1] != above[1:])
        rises = ~above.take(edge)
        upper = edge + count * rises
        lower = 2 * edge + count - upper
        inside, points = _take(vertices, upper, count), _take(vertices, lower, count)
        high, low = heights.take(upper), heights.take(lower)
        part = high / (high - low)
        points -= inside
        points *= part
        points += inside
        return cls(edge, edge - edge // count * count, rises, inside, points, part)

    def along_horizon(self) -> tuple[Integers, Reals, Reals, Reals]:
        """What closes the outlines: receivers (M,), from where to where along their horizons (3, M), and signs (M,).

        Instead of going from each point of descent to the next ascent, the ways lead from one point of descent to each
        ascent, and with the sign -1 to each other descent. All crossings of a receiver lie on one line, so that the
        angles stay below pi.
        """
        descents = np.flatnonzero(~self.rises)
        chosen = np.empty(self.owner.max() + 1, np.intp)
        chosen[self.owner.take(descents)] = descents
        first = chosen.take(self.owner)
        second = np.flatnonzero(first != np.arange(len(first)))
        first = first.take(second)
        sign = np.where(self.rises.take(second), 1.0, -1.0)
        return self.owner.take(second), self.points.take(first, axis=1), self.points.take(second, axis=1), sign


@dataclass(frozen=True, eq=False)
class _Distant:
    """Polygons' centres as distant receivers see them, shape (3, N), and what is derived from them."""

    center: Reals
    squared: Reals
    distance: Reals
    n: Reals
    across: Reals
    """The receivers' normals times the centres."""

    @classmethod
    def of(cls, center: Reals, n: Reals) -> _Distant:
        squared = _dot(center, center)
        return cls(center, squared, np.sqrt(squared), n, _cross(n, center))

    def of_receivers(self, which: Integers) -> _Distant:
        return _Distant(*(_some(a, which) for a in (self.center, self.squared, self.distance, self.n, self.across)))

    def distances(self, relative: Reals) -> tuple[Reals, Reals]:
        """Distances (V, N) of points (3, V, N or 1) given from the centre, and how much larger than its they are."""
        more = 2 * _dot(relative, self.center[:, None])
        more += _dot(relative, relative)
        distance = np.sqrt(self.squared + more)
        return distance, more / (distance + self.distance)

    def terms(
        self, start: Reals, edges: Reals, starts: tuple[Reals, Reals], ends: tuple[Reals, Reals]
    ) -> tuple[Reals, Reals]:
        """The edges' parts (V, N) of the sum and their magnitudes; `starts` and `ends` are their ends' `distances`."""
        (r, d), (s, e) = starts, ends
        lengths_squared = _dot(edges, edges)
        product = r * s
        # By the chord, the sine of half the angle is precise; |e|^2 = (r_i - r_j)^2 + 4 r_i r_j sin^2(theta/2).
        half_sine_squared = (lengths_squared - (d - e) ** 2) / (4 * product)
        g = _angle_over_sine(half_sine_squared)
        g -= (self.distance * (d + e) + d * e) / self.squared
        g /= product
        area = _dot(self.n[:, None], _cross(start, edges))
        g *= area + _dot(self.across[:, None], edges)
        g += area / self.squared
        return g, np.sqrt(lengths_squared * _dot(start, start))

    def segments(self, start: Reals, end: Reals) -> tuple[Reals, Reals]:
        """`terms` (N,) of one edge (3, N) for each receiver."""
        start, end = start[:, None], end[:, None]
        terms, magnitudes = self.terms(start, end - start, self.distances(start), self.distances(end))
        return terms[0], magnitudes[0]


# theta/sin(theta) - 1 in powers of q = sin^2(theta/2): with asin(s)/(s sqrt(1-s^2)) = sum (4 q)^k / ((2k+1) C(2k,k)).
_TWICE = 2 * np.arange(1, 13).astype(np.longdouble)
_SERIES = np.cumprod(_TWICE / (_TWICE + 1))


def _angle_over_sine(q: Reals) -> Reals:
    """``theta/sin(theta) - 1`` of angles with ``q = sin^2(theta/2)``, up to 0.35 rad."""
    *lower, highest = _SERIES.astype(q.dtype)
    result: Reals = q * highest
    for coefficient in reversed(lower):
        result += coefficient
        result *= q
    return result


def _angles(sines: Reals, cosines: Reals) -> Reals:
    """Angles from 0 to pi by multiples of their sines and cosines: as arctan2, in half its time."""
    result: Reals = np.arctan(sines / (cosines + _NOTHING))
    result += (cosines < 0) * np.arccos(result.dtype.type(-1))
    return result


def _closed(outlines: Floats) -> Floats:
    return np.concatenate([outlines, outlines[:, :1]], axis=1)


def _some(array: Reals, receivers: Integers) -> Reals:
    """What belongs to some receivers, of an array with the last axis N or 1."""
    return array if array.shape[-1] == 1 else array.take(receivers, axis=-1)


def _take(vectors: Reals, index: Integers, count: int) -> Reals:
    """Vectors (3, K) from an array (3, V, N or 1), by indices into flattened arrays (V, N)."""
    return vectors.reshape(3, -1).take(index // count if vectors.shape[2] == 1 else index, axis=1)


def _dot(a: Reals, b: Reals) -> Reals:
    """Scalar product over the first axis."""
    result: Reals = a[0] * b[0]
    result += a[1] * b[1]
    result += a[2] * b[2]
    return result


def _cross(a: Reals, b: Reals) -> Reals:
    """Cross product over the first axis."""
    (ax, ay, az), (bx, by, bz) = a, b
    x = ay * bz
    result = np.empty((3, *x.shape), x.dtype)
    np.subtract(x, az * by, out=result[0])
    np.subtract(az * bx, ax * bz, out=result[1])
    np.subtract(ax * by, ay * bx, out=result[2])
    return result
