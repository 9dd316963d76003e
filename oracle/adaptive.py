"""Adaptive Gauss quadrature over unit squares or intervals, many integrals at once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product
from typing import TypeAlias

import numpy as np

from oracle.arrays import Booleans, Floats, Integers
from oracle.bounded import Bounded
from oracle.chunks import chunks

# A part that still fails after so many halvings is as small as its corner's rounding.
_DEEPEST = 40
# After so many parts the quadrature ends, and what is not known goes into the bound.
_MOST = 1 << 20
# So many parts are evaluated at once, each in 200 places.
_AT_ONCE = 4096
# Gauss points along each side. The differences to the last rule tell how good it is: two of them, since a single one
# may be small by chance.
_ORDERS = (6, 8, 10)

# Takes indices of squares (K,) and, for each dimension, coordinates in (0, 1), (K, Q). Returns the integrand and a
# bound on its own error, (K, Q) both.
Integrand: TypeAlias = Callable[..., tuple[Floats, Floats]]


def integrate(
    integrand: Integrand, owner: Integers, count: int, tolerance: float, dimensions: int = 2, most: int = _MOST
) -> Bounded:
    """Sums of integrals over unit squares; those that need it are quartered.

    Parameters
    ----------
    integrand : Integrand
        Of any sign. It may have singularities in single points, of which each costs some squares for each digit; along
        a whole line each digit costs ten times as many.
    owner : ndarray
        To which sum each square belongs, shape (K,), each in [0, count).
    count : int
        How many sums there are.
    tolerance : float
        A square is done when its rules differ by less than this part of its whole sum, or by what is rounding.
    dimensions : int
        2, or 1 for unit intervals in place of squares.
    most : int
        After so many squares it ends, whatever the bound is then.

    Returns
    -------
    Bounded
        Sums, shape (count,). The bound adds up rounding and the differences between 6, 8 and 10 Gauss points along
        each side. It is an estimate, hundreds of times the error where the integrand is smooth, but no proof: a feature
        that falls between all points is not seen.
    """
    value, error = np.zeros(count), np.zeros(count)
    index = np.arange(len(owner))
    corner, size = np.zeros((len(index), dimensions)), 1.0
    evaluated = 0
    for depth in range(_DEEPEST + 1):
        if not len(index):
            break
        evaluated += len(index)
        coarse, middle, fine, noise = _evaluated(integrand, index, corner, size)
        difference = np.maximum(np.abs(fine - coarse), np.abs(fine - middle))
        # Squares may cancel one another: what counts is how much there is of either sign.
        total = np.bincount(owner[index], np.abs(fine), count) + np.abs(value)
        done: Booleans = difference <= tolerance * total[owner[index]] + noise
        if depth == _DEEPEST or evaluated + np.count_nonzero(~done) * 2**dimensions > most:
            done = np.ones_like(done)
        value += np.bincount(owner[index[done]], fine[done], count)
        error += np.bincount(owner[index[done]], (difference + noise)[done], count)
        size /= 2
        parts = size * np.array(list(product((0, 1), repeat=dimensions)))
        index = np.repeat(index[~done], len(parts))
        corner = (corner[~done, None] + parts).reshape(-1, dimensions)
    return Bounded(value, error)


def _evaluated(integrand: Integrand, index: Integers, corner: Floats, size: float) -> Floats:
    """Integrals (K,) by each rule, and the error of the last one's terms, (rules + 1, K)."""
    results = np.empty((len(_ORDERS) + 1, len(index)))
    for part in chunks((len(index),), _AT_ONCE):
        for row, order in enumerate(_ORDERS):
            places, weights = _rule(order, corner.shape[1])
            coordinates = corner[part].T[..., None] + size * places[:, None]
            here, noise = integrand(index[part], *coordinates)
            volume = size ** len(coordinates)
            results[row][part] = volume * (here @ weights)
            results[-1][part] = volume * (noise @ weights)
    return results


@cache
def _rule(order: int, dimensions: int) -> tuple[Floats, Floats]:
    """Places (D, Q) of a tensor rule on the unit square, and their weights (Q,)."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    places = np.stack([axis.ravel() for axis in np.meshgrid(*dimensions * [(nodes + 1) / 2])])
    along = np.stack([axis.ravel() for axis in np.meshgrid(*dimensions * [weights / 2])])
    return places, along.prod(axis=0)
