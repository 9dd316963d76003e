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
    (p, q), (r, s) = _in_front(a, b), _in_front(b, a)
    # Both fronts being on the left, p r and q s are the crossed strings. With m between r and s and d = s - r,
    # |pr| - |ps| = 2 d.(p - m) / sum_p and |qs| - |qr| = 2 d.(m - q) / sum_q; their sum is again a difference.
    pr, ps, qr, qs = _length(r - p), _length(s - p), _length(r - q), _length(s - q)
    sum_p, sum_q = pr + ps, qr + qs
    from_p, across, along = p - (r + s) / 2, s - r, q - p
    change_r, lost_r = _ratio(along, p + q - 2 * r, qr + pr)
    change_s, lost_s = _ratio(along, p + q - 2 * s, qs + ps)
    first, lost_first = _ratio(across, from_p, sum_p * sum_q)
    second, lost_second = _ratio(across, along, sum_q)
    difference = first * (change_r + change_s) - second
    lost = lost_first * (lost_r + lost_s) + lost_second
    return Bounded(np.asarray(np.maximum(difference, 0.0) / length), np.asarray(16 * _EPSILON * lost / length))


def _in_front(segment: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Start and end (..., 2) of the part of a segment in front of the other's line; twice the same if there is none."""
    start, end = segment[..., 0, :], segment[..., 1, :]
    line = other[..., 1, :] - other[..., 0, :]
    heights = [
        line[..., 0] * (point - other[..., 0, :])[..., 1] - line[..., 1] * (point - other[..., 0, :])[..., 0]
        for point in (start, end)
    ]
    low, high = heights
    change = np.where(low == high, 1.0, low - high)
    first = np.where((low < 0) & (high > 0), low / change, 0.0)
    last = np.where((high < 0) & (low > 0), low / change, 1.0)
    last = np.where((low <= 0) & (high <= 0), first, last)
    way = end - start
    # The very end, where nothing is cut off.
    return start + first[..., None] * way, np.where((last == 1)[..., None], end, start + last[..., None] * way)


def _length(vectors: Floats) -> Floats:
    result: Floats = np.hypot(vectors[..., 0], vectors[..., 1])
    return result


def _ratio(a: Floats, b: Floats, divisor: Floats) -> tuple[Floats, Floats]:
    """``a . b / divisor``, 0 where both vanish, and the sum of the magnitudes of its terms."""
    terms = a * b / np.where(divisor > 0, divisor, 1.0)[..., None]
    return terms.sum(axis=-1), np.abs(terms).sum(axis=-1)
