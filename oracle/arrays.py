"""The array types of this package and how arguments become them."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Booleans: TypeAlias = NDArray[np.bool_]


# Coordinates and lengths [m] are at most 1e18, lengths of shapes at least 1e-18, and amounts of light at most 1e36, in
# whatever unit: products of all that formulas multiply stay within float64.
LARGEST, SMALLEST, BRIGHTEST = 1e18, 1e-18, 1e36


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


def position(name: str, value: ArrayLike, trailing: tuple[int, ...] = (3,)) -> Floats:
    """Like `finite`, for coordinates [m]: none beyond `LARGEST`."""
    array = finite(name, value, trailing)
    # Magnitudes would take as much memory as the points of a map once more.
    beyond = (array > LARGEST) | (array < -LARGEST)
    _refuse(name, array, beyond, f"is {{}}, coordinates lie within {LARGEST:g} m")
    return array


def vector(name: str, value: ArrayLike) -> Floats:
    """Like `position`, for a single vector of shape (3,)."""
    array = position(name, value, ())
    if array.shape != (3,):
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (3,)")
    return array


def light(name: str, value: ArrayLike) -> Floats:
    """Like `finite`, for a quantity of light of any shape: at least 0, at most `BRIGHTEST`."""
    array = finite(name, value)
    _refuse(name, array, array < 0, "is {}, light is at least 0")
    _refuse(name, array, array > BRIGHTEST, f"is {{}}, light is at most {BRIGHTEST:g}")
    return array


def way(name: str, value: ArrayLike) -> Floats:
    """Like `position`, for distances [m] of any shape: at least 0."""
    array = position(name, value, ())
    _refuse(name, array, array < 0, "is {}, a distance is at least 0")
    return array


def spectrum(name: str, value: ArrayLike) -> Floats:
    """Like `light`, for one number for each colour channel."""
    array = light(name, value)
    if array.ndim != 1 or not len(array):
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (C,) with one number for each channel")
    return array


def length(name: str, value: float) -> float:
    """Return `value` as a float; it has to be positive, and a length [m] between `SMALLEST` and `LARGEST`.

    Raises
    ------
    InvalidArgument
        If it is anything else.
    """
    number = finite(name, value)
    if number.ndim:
        raise InvalidArgument(f"{name} has shape {number.shape}, it must be a single number")
    if number <= 0:
        raise InvalidArgument(f"{name} is {number}, it must be positive")
    demand_size(name, float(number))
    return float(number)


def demand_size(name: str, size: float) -> None:
    """Raise `InvalidArgument` if a size [m] is neither between `SMALLEST` and `LARGEST` nor 0."""
    if 0 < size < SMALLEST or size > LARGEST:
        raise InvalidArgument(f"{name} is {size:.7g} m, lengths lie between {SMALLEST:g} and {LARGEST:g} m")


def indices(name: str, value: ArrayLike, count: int) -> Integers:
    """Return `value` as read-only integers of shape (M, 3), M >= 1, each in [0, count)."""
    array = np.array(value)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (M, 3) with M >= 1")
    if not np.issubdtype(array.dtype, np.integer):
        raise InvalidArgument(f"{name} holds {array.dtype}, it must hold integers")
    _refuse(name, array, (array < 0) | (array >= count), f"is {{}}, there are {count} vertices")
    result = array.astype(np.int64)
    result.flags.writeable = False
    return result


def direction(name: str, value: ArrayLike, any_length: bool = False) -> Floats:
    """Like `finite` for unit vectors (..., 3), scaled to length 1 where they differ from it by more than rounding.

    Raises
    ------
    InvalidArgument
        If a vector has no length or, unless `any_length`, one that differs from 1 by more than 1e-6.
    """
    array = finite(name, value, (3,))
    # Scaled first, so that the squares of neither huge nor tiny components leave the range of float64.
    largest = np.abs(array).max(axis=-1, keepdims=True)
    _refuse(name, largest[..., 0], largest[..., 0] == 0, "has no length")
    scaled = array / largest
    lengths = np.linalg.norm(scaled, axis=-1, keepdims=True)
    if not any_length:
        total = (largest * lengths)[..., 0]
        _refuse(name, total, np.abs(total - 1) > 1e-6, "has length {}, it must be a unit vector")
    unit: Floats = scaled / lengths
    # What is as long as rounding allows stays as it is: scaling would turn it by an ulp.
    unit = np.where(np.abs(largest * lengths - 1) < 4 * np.finfo(np.float64).eps, array, unit)
    unit.flags.writeable = False
    return unit


def replace(instance: object, **values: object) -> None:
    """Replace fields of a frozen dataclass by their checked form, during its construction only."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


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
