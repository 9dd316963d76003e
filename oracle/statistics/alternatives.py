"""The mirror image of suspicion: ways in which a renderer could be wrong, each to be ruled out before "right" is said.

For every alternative there is a betting process whose null hypothesis is "the image deviates at least so much in this
way". A renderer of which that is true lets its wealth ever reach 1/beta with a probability of at most beta.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from oracle.arrays import Booleans, Floats
from oracle.statistics.directions import Deviation, patterns, shifts

# A quarter of the image must be off by this many times as much, so that it takes as many samples to see.
_IN_A_QUARTER = 2.0
_SHIFT = 0.5
# Deviations with a smaller root of their mean square, in parts of the bias, are no alternatives: a smooth image moved.
_AS_LARGE = 0.9
# Nor are those of which less is left once the expectation's own error is taken off.
_STILL = 0.25


def alternatives(
    channels: tuple[str, ...], mean: Floats, error: Floats, lit: Booleans, bias: float
) -> Iterator[Deviation]:
    """Global deviations, of each channel too, patterns, quarters and shifts, as far as they are as large as the bias.

    Parameters
    ----------
    channels : tuple of str
        Names of the P planes.
    mean, error, lit : ndarray
        The expected image, its relative error, and where it is lit, (P, height, width).
    bias : float
        Relative size of the deviations, as the root of their mean square, but for shifts.
    """
    for name, plane, deviations in _all(channels, mean, lit, bias):
        # What the expectation itself may be wrong by is no deviation.
        kept = np.sign(deviations) * np.maximum(np.abs(deviations) - error[plane] * (1 + np.abs(deviations)), 0)
        large, left = (_root_mean_square(off[lit[plane]]) for off in (deviations, kept))
        if large >= _AS_LARGE * bias and left >= _STILL * bias:
            yield name, plane, kept


def _all(channels: tuple[str, ...], mean: Floats, lit: Booleans, bias: float) -> Iterator[Deviation]:
    for plane, channel in enumerate(channels):
        for name, sign in (("brighter", 1), ("darker", -1)):
            yield name if channel == "all" else f"{channel} {name}", plane, np.full(lit.shape[1:], sign * bias)
    for name, pattern in patterns(lit[0]):
        for sign in (1, -1):
            yield name if sign > 0 else f"{name}, reversed", 0, sign * bias * pattern
    for name, quarter in _quarters(lit[0]):
        for word, sign in (("brighter", 1), ("darker", -1)):
            yield f"the {name} {word}", 0, sign * _IN_A_QUARTER * bias * quarter
    for name, moved in shifts(mean[0], lit[0], _SHIFT):
        yield name, 0, moved


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt((values**2).mean())) if values.size else 0.0


def _quarters(lit: Booleans) -> list[tuple[str, Floats]]:
    rows, columns = np.flatnonzero(lit.any(axis=1)), np.flatnonzero(lit.any(axis=0))
    if len(rows) < 2 or len(columns) < 2:
        return []
    lower = (np.arange(len(lit)) > rows.mean())[:, None]
    right = np.arange(lit.shape[1]) > columns.mean()
    return [
        ("upper left", ~lower & ~right),
        ("upper right", ~lower & right),
        ("lower left", lower & ~right),
        ("lower right", lower & right),
    ]
