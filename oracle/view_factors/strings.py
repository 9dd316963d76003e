"""View factors between infinitely long strips, in two dimensions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, demand_size, position
from oracle.bounded import Bounded

_EPSILON = float(np.finfo(np.float64).eps)


def crossed_strings(source: ArrayLike, target: ArrayLike) -> Bounded:
    """View factor between strips of unlimited length, given by their cross-sections in a plane.

    Parameters
    ----------
    source, target : array_like
        Start and end [m] of a segment, shape (..., 2, 2). Its front is on the left of the way from start to end; what
        lies behind the other's line does not count.

    Returns
    -------
    Bounded
        Fraction of the power that leaves the source and reaches the target, and a bound on its error, shape (...).

    Raises
    ------
    InvalidArgument
        If a segment has no length, or the shapes do not fit together.

    Notes
    -----
    Crossed minus uncrossed strings over twice the source's length [Hottel 1954]. Each difference of lengths is that of
    their squares over their sum, so that distant strips keep their digits.
    """
    a, b = position("source", source, (2, 2)), position("target", target, (2, 2))
    for name, segment in (("source", a), ("target", b)):
        if (segment[..., 0, :] == segment[..., 1, :]).all(axis=-1).any():
            raise InvalidArgument(f"{name} has a segment without length")
        demand_size(
            f"the shortest segment of {name}", float(np.abs(np.diff(segment, axis=-2)).max(axis=(-2, -1)).min())
        )
    try:
        a, b = np.broadcast_arrays(a, b)
    except ValueError:
        raise InvalidArgument(f"source {a.shape} and target {b.shape} do not fit together") from None
    length = _length(a[..., 1, :] - a[..., 0, :])
    (p, q, moved_a), (r, s, moved_b) = _in_front(a, b), _in_front(b, a)
    # Both fronts being on the left, p r and q s are the crossed strings. With m between r and s and d = s - r,
    # |pr| - |ps| = 2 d.(p - m) / sum_p and |qs| - |qr| = 2 d.(m - q) / sum_q; their sum is again a difference.
    pr, ps, qr, qs = _length(r - p), _length(s - p), _length(r - q), _length(s - q)
    sum_p, sum_q = pr + ps, qr + qs
    across, along = s - r, q - p
    change_r, lost_r = _ratio(along, (p - r, q - r), qr + pr)
    change_s, lost_s = _ratio(along, (p - s, q - s), qs + ps)
    first, lost_first = _ratio(across, (p - r, p - s), 2 * sum_p * sum_q)
    second, lost_second = _ratio(across, (along,), sum_q)
    difference = first * (change_r + change_s) - second
    lost = lost_first * (lost_r + lost_s) + lost_second
    # Where an end is off by something, its two strings change by that times the difference of their directions.
    error = 16 * _EPSILON * lost
    error = error + moved_a * (_turn(across, sum_p) + _turn(across, sum_q))
    error = error + moved_b * (_turn(along, pr + qr) + _turn(along, ps + qs))
    return Bounded(np.asarray(np.maximum(difference, 0.0) / length), np.asarray(error / length))


def _in_front(segment: Floats, other: Floats) -> tuple[Floats, Floats, Floats]:
    """Start and end (..., 2) of the part of a segment in front of the other's line; twice the same if there is none.

    Last comes by how much rounding may have moved what is cut off [m], shape (...).
    """
    start, end = segment[..., 0, :], segment[..., 1, :]
    line = other[..., 1, :] - other[..., 0, :]
    heights, rounding = [], np.zeros(line.shape[:-1])
    for point in (start, end):
        offset = point - other[..., 0, :]
        first_term, second_term = line[..., 0] * offset[..., 1], line[..., 1] * offset[..., 0]
        heights.append(first_term - second_term)
        rounding = rounding + 4 * _EPSILON * (np.abs(first_term) + np.abs(second_term))
    low, high = heights
    change = np.where(low == high, 1.0, low - high)
    first = np.where((low < 0) & (high > 0), low / change, 0.0)
    last = np.where((high < 0) & (low > 0), low / change, 1.0)
    last = np.where((low <= 0) & (high <= 0), first, last)
    way = end - start
    moved = rounding / np.abs(change) * _length(way) + 2 * _EPSILON * (_length(start) + _length(way))
    cut = (first > 0) | (last < 1)
    # The very end, where nothing is cut off.
    finish = np.where((last == 1)[..., None], end, start + last[..., None] * way)
    return start + first[..., None] * way, finish, np.where(cut, moved, 0.0)


def _turn(ends: Floats, lengths: Floats) -> Floats:
    """Bound on the difference of the directions in which both ends of a segment are seen, given the distances' sum.

    |a/|a| - b/|b|| <= 2 |a - b| / (|a| + |b|) [Dunkl and Williams 1964].
    """
    result: Floats = 2 * np.minimum(_length(ends) / np.where(lengths > 0, lengths, 1.0), 1.0)
    return result


def _length(vectors: Floats) -> Floats:
    result: Floats = np.hypot(vectors[..., 0], vectors[..., 1])
    return result


def _ratio(a: Floats, parts: tuple[Floats, ...], divisor: Floats) -> tuple[Floats, Floats]:
    """``a . (sum of parts) / divisor``, 0 where both vanish, and the sum of the magnitudes of its terms.

    The parts are differences of coordinates, which keep their digits next to a point as their sum would not.
    """
    terms = a * sum(parts) / np.where(divisor > 0, divisor, 1.0)[..., None]
    magnitudes = np.abs(a) * sum(np.abs(part) for part in parts) / np.where(divisor > 0, divisor, 1.0)[..., None]
    return terms.sum(axis=-1), magnitudes.sum(axis=-1)
