"""Gauss quadrature on pieces that become shorter towards singularities."""

from __future__ import annotations

from functools import cache

import numpy as np

from oracle.arrays import Floats

# On a piece whose middle is 3 half lengths from the nearest singularity, 16 Gauss points leave less than 1e-17 of the
# integrand's size: on the ellipse with rho = 4 the factor that vanishes at the singularity keeps 0.29 of its size.
POINTS = 16
APART = 3.0

# Pieces this much shorter than the whole are not divided, even if a thin rectangle's peak is all that counts.
_SHORTEST = 2.0**-90


@cache
def gauss(count: int) -> tuple[Floats, Floats]:
    """Points and weights of the Gauss-Legendre rule on [-1, 1]."""
    points, weights = np.polynomial.legendre.leggauss(count)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


def graded(kinks: Floats, centers: Floats, distances: Floats) -> tuple[Floats, Floats]:
    """Points and weights, shape (K,), between the first and the last of the sorted `kinks`.

    The integrand is smooth between kinks, and its singularities lie at ``centers +- i distances``.
    """
    low, high = kinks[:-1], kinks[1:]
    kept = high > low
    low, high = low[kept], high[kept]
    shortest = _SHORTEST * (kinks[-1] - kinks[0])
    done: list[tuple[Floats, Floats]] = []
    while len(low):
        middle, half = (low + high) / 2, (high - low) / 2
        nearest = np.hypot(middle[:, None] - centers, distances).min(axis=1)
        good = (nearest >= APART * half) | (half <= shortest) | (middle <= low) | (middle >= high)
        done.append((middle[good], half[good]))
        low, middle, high = low[~good], middle[~good], high[~good]
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    middle, half = (np.concatenate(column) for column in zip(*done, strict=True))
    t, w = gauss(POINTS)
    return (middle[:, None] + half[:, None] * t).ravel(), (half[:, None] * w).ravel()
