"""What the closed forms return: a value and how far float64 may have led it astray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats


@dataclass(frozen=True, eq=False)
class Bounded:
    """A value and a bound on its absolute error, in the same unit and of the same shape.

    The bound covers rounding and quadrature, for arguments taken as exact; it is often a hundred times the error. For
    rounding it follows from how the value is computed; what adaptive or iterated quadrature leaves is estimated from
    rules of different order, and the functions that do so say it.
    Sums, and products with exact numbers, carry their bounds along.
    """

    value: Floats
    error: Floats

    @property
    def relative_error(self) -> Floats:
        """The bound divided by the value's magnitude; infinite where only the value is 0, and 0 where both are."""
        magnitude = np.abs(self.value)
        zero = magnitude == 0
        unknown = np.where(self.error == 0, 0.0, np.inf)
        result: Floats = np.where(zero, unknown, self.error / np.where(zero, 1.0, magnitude))
        return result

    def __add__(self, other: Bounded) -> Bounded:
        value = np.asarray(self.value + other.value)
        return Bounded(value, np.asarray(self.error + other.error + np.abs(value) * _HALF_ULP))

    def __mul__(self, factor: float | Floats) -> Bounded:
        """Product with an exact number or array."""
        value = np.asarray(self.value * factor)
        return Bounded(value, np.asarray(self.error * np.abs(factor) + np.abs(value) * _HALF_ULP))


_HALF_ULP = float(np.finfo(np.float64).eps) / 2
