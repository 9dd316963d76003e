"""The array types of this package and how arguments become them."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Booleans: TypeAlias = NDArray[np.bool_]


class InvalidArgument(ValueError):
    """An argument that no light can have; the message names it, its index and the reason."""


def finite(name: str, value: ArrayLike, trailing: tuple[int, ...] = ()) -> Floats:
    """Return `value` as a read-only float64 array whose last axes have the shape `trailing`.

    Raises
    ------
    InvalidArgument
        If a number is NaN or infinite, or the last axes differ.
    """
    array = np.array(value, dtype=np.float64)
    if trailing and array.shape[-len(trailing) :] != trailing:
        raise InvalidArgument(f"{name} has shape {array.shape}, its last axes must be {trailing}")
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        index = tuple(int(i) for i in bad[0])
        raise InvalidArgument(f"{name}{list(index)} is {array[index]}, not a finite number")
    array.flags.writeable = False
    return array


def non_negative(name: str, value: ArrayLike) -> Floats:
    """Like `finite`, for quantities of light, which are at least 0."""
    array = finite(name, value)
    bad = np.argwhere(array < 0)
    if bad.size:
        index = tuple(int(i) for i in bad[0])
        raise InvalidArgument(f"{name}{list(index)} is {array[index]}, light is at least 0")
    return array


def direction(name: str, value: ArrayLike) -> Floats:
    """Like `finite` for vectors (..., 3), scaled to unit length."""
    array = finite(name, value, (3,))
    length = np.linalg.norm(array, axis=-1, keepdims=True)
    bad = np.argwhere(length[..., 0] == 0)
    if bad.size:
        raise InvalidArgument(f"{name}{[int(i) for i in bad[0]]} has no length")
    unit: Floats = array / length
    unit.flags.writeable = False
    return unit


def dot(a: Floats, b: Floats) -> Floats:
    """Inner product over the last axis."""
    result: Floats = np.einsum("...i,...i->...", a, b)
    return result
