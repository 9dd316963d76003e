"""Sums and products of pairs (high, low) of float64 with twice the digits, for differences that cancel.

An operation errs by less than ``EPSILON`` times the sum of its operands' magnitudes, or times the product's magnitude.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from oracle.arrays import Floats
from oracle.compensated import two_product, two_sum

Pair: TypeAlias = tuple[Floats, Floats]

EPSILON = 2.0**-100


def exact(number: Floats | float) -> Pair:
    """A float64 as a pair."""
    array = np.asarray(number, dtype=np.float64)
    return array, np.zeros_like(array)


def add(x: Pair, y: Pair) -> Pair:
    """Sum of two pairs."""
    high, low = two_sum(x[0], y[0])
    return two_sum(high, low + (x[1] + y[1]))


def multiply(x: Pair, y: Pair) -> Pair:
    """Product of two pairs whose magnitudes stay between 1e-140 and 1e140, or are 0."""
    high, low = two_product(x[0], y[0])
    return two_sum(high, low + (x[0] * y[1] + x[1] * y[0]))
