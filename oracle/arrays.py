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
    _refuse(name, array, ~np.isfinite(array), "is {}, not a finite number")
    array.flags.writeable = False
    return array


def vector(name: str, value: ArrayLike) -> Floats:
    """Like `finite`, for a single vector of shape (3,)."""
    array = finite(name, value)
    if array.shape != (3,):
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (3,)")
    return array


def spectrum(name: str, value: ArrayLike) -> Floats:
    """Like `finite`, for a quantity of light: one number for each colour channel, at least 0."""
    array = finite(name, value)
    if array.ndim != 1:
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (C,) with one number for each channel")
    _refuse(name, array, array < 0, "is {}, light is at least 0")
    return array


def direction(name: str, value: ArrayLike) -> Floats:
    """Like `finite` for vectors (..., 3), scaled to unit length."""
    array = finite(name, value, (3,))
    # Scaled first, so that the squares of neither huge nor tiny components leave the range of float64.
    largest = np.abs(array).max(axis=-1, keepdims=True)
    _refuse(name, largest[..., 0], largest[..., 0] == 0, "has no length")
    scaled = array / largest
    unit: Floats = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    unit.flags.writeable = False
    return unit


def _refuse(name: str, array: Floats, bad: Booleans, reason: str) -> None:
    where = np.argwhere(bad)
    if len(where):
        raise InvalidArgument(f"{name}{_index(where[0])} {reason.format(array[tuple(where[0])])}")


def _index(position: Integers) -> str:
    """Position in an array as Python would write it; nothing for a single number."""
    return str([int(i) for i in position]) if position.size else ""


def dot(a: Floats, b: Floats) -> Floats:
    """Inner product over the last axis."""
    result: Floats = np.einsum("...i,...i->...", a, b)
    return result
