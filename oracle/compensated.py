"""Differences, inner and cross products of float64 vectors as if computed in twice the precision.

What cancels here decides whether a grazing or distant light keeps its digits. Vectors have shape (N, 3) or (3,); those
called ``low`` hold what rounding took from their partner. Numbers must stay between 1e-140 and 1e140, zero aside.

Sources: the exact error of a sum is Knuth's, that of a product Dekker's (1971); the inner product is Dot2 of Ogita,
Rump and Oishi (2005), whose result is as accurate as if computed in twice the precision and then rounded.
"""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats


def two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The sum and its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The product and its rounding error."""
    product = a * b
    a_high, a_low = _split(a)
    b_high, b_low = _split(b)
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def dot(a: Floats, a_low: Floats | float, b: Floats, b_low: Floats | float, minus: Floats | None = None) -> Floats:
    """``(a + a_low) . (b + b_low) - minus^2``."""
    return dot_in_parts(a, a_low, b, b_low, minus)[0]


def dot_in_parts(
    a: Floats, a_low: Floats | float, b: Floats, b_low: Floats | float, minus: Floats | None = None
) -> tuple[Floats, Floats]:
    """The sum that `dot` returns, and the rounding error of that last addition."""
    total, rest = two_product(a[..., 0], b[..., 0])
    for axis in (1, 2):
        product, low = two_product(a[..., axis], b[..., axis])
        total, lost = two_sum(total, product)
        rest = rest + (low + lost)
    if minus is not None:
        product, low = two_product(minus, minus)
        total, lost = two_sum(total, -product)
        rest = rest + (lost - low)
    for x, y in ((a_low, b), (a, b_low)):
        if not isinstance(x, float) and not isinstance(y, float):
            rest = rest + (x[..., 0] * y[..., 0] + x[..., 1] * y[..., 1] + x[..., 2] * y[..., 2])
    return two_sum(total, rest)


def cross(a: Floats, b: Floats) -> list[Floats]:
    """The three components of ``a x b``."""
    components = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        first, first_low = two_product(a[..., i], b[..., j])
        second, second_low = two_product(a[..., j], b[..., i])
        total, lost = two_sum(first, -second)
        components.append(total + (lost + (first_low - second_low)))
    return components


def scaled_offsets(center: Floats, points: Floats, size: float) -> tuple[Floats, Floats, Floats]:
    """``center - points`` and what rounding took from it, (3, N), scaled by powers of two (N,), which come last.

    The larger one of offset and `size` becomes about 1, so that no square of a length leaves the range of float64.
    """
    offset, low = two_sum(center[:, None], -points.T)
    largest = np.maximum(np.abs(offset).max(axis=0), size)
    scale = np.ldexp(1.0, np.clip(-np.frexp(largest)[1], -1000, 1000))
    return offset * scale, low * scale, scale


def _split(a: Floats) -> tuple[Floats, Floats]:
    """Two numbers of 26 bits each that add up to `a`."""
    scaled = 134217729.0 * a
    high = scaled - (scaled - a)
    return high, a - high
