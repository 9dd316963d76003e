"""Checks of the arguments that this folder's functions share."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, finite


def within(name: str, value: ArrayLike, low: float, high: float, why: str) -> Floats:
    """Return `value` as a read-only float64 array, each number from `low` to `high`.

    Raises
    ------
    InvalidArgument
        If a number lies elsewhere; the message ends with `why`.
    """
    array = finite(name, value)
    outside = np.argwhere((array < low) | (array > high))
    if len(outside):
        position = [int(i) for i in outside[0]]
        where = str(position) if position else ""
        raise InvalidArgument(f"{name}{where} is {array[tuple(position)]}, {why}")
    return array


def together(**arrays: Floats) -> tuple[Floats, ...]:
    """Broadcast arrays to one shape.

    Raises
    ------
    InvalidArgument
        If their shapes do not fit together.
    """
    try:
        return np.broadcast_arrays(*arrays.values())
    except ValueError:
        shapes = " and ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InvalidArgument(f"{shapes} do not fit together") from None
