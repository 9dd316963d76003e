"""Sums and products of pairs (high, low) of float64 with twice the digits, for differences that cancel.

An operation errs by less than ``EPSILON`` times the sum of its operands' magnitudes, or times the product's magnitude.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from oracle.arrays import Floats

Pair: TypeAlias = tuple[Floats, Floats]

EPSILON = 2.0**-100

_SPLITTER = 2.0**27 + 1


def exact(number: Floats | float) -> Pair:
    """A float64 as a pair."""
    array = np.asarray(number, dtype=np.float64)
    return array, np.zeros_like(array)


def add(x: Pair, y: Pair) -> Pair:
    """Sum of two pairs."""
    high, low = _two_sum(x[0], y[0])
    return _two_sum(high, low + (x[1] + y[1]))


def multiply(x: Pair, y: Pair) -> Pair:
    """Product of two pairs whose magnitudes stay between 1e-140 and 1e140, or are 0."""
    high, low = _two_product(x[0], y[0])
    return _two_sum(high, low + (x[0] * y[1] + x[1] * y[0]))


def _two_sum(a: Floats, b: Floats) -> Pair:
    """Sum and its rounding error [Knuth 1969]."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _two_product(a: Floats, b: Floats) -> Pair:
    """Product and its rounding error, from factors split into halves of 26 bits [Dekker 1971]."""
    product = a * b
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Floats) -> Pair:
    scaled = _SPLITTER * a
    high = scaled - (scaled - a)
    return high, a - high
