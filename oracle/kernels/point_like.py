"""Irradiance, for unit intensity or irradiance, of emitters without size."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Booleans, Floats, InvalidArgument
from oracle.bounded import Bounded
from oracle.compensated import dot, two_sum
from oracle.emitters import Directional, Point, Spot

_EPSILON = float(np.finfo(np.float64).eps)
_LONG_EPSILON = float(np.finfo(np.longdouble).eps)

# Nearer receivers [m] count as being at the emitter: the inverse square would soon leave the range of float64.
_NEAREST = 1e-100


class OnEmitter(InvalidArgument):
    """A receiver where the irradiance is infinite; `row` is its index among the flat receivers (N, 3) of a kernel."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(f"points[{row}] {reason}")
        self.row = row
        self.reason = reason

    def within(self, shape: tuple[int, ...], part: tuple[int | slice, ...]) -> InvalidArgument:
        """The same complaint with the index in an array of receivers, of which only `part` was seen."""
        index = [int(i) for i in np.unravel_index(self.row, shape[max(len(part) - 1, 0) :])]
        if part:
            *outer, last = (one.start if isinstance(one, slice) else one for one in part)
            index = [*outer, last + index[0], *index[1:]]
        return InvalidArgument(f"points{index if index else ''} {self.reason}")


def refuse_on_emitter(points: Floats, there: Booleans, where: str) -> None:
    """Raise `OnEmitter` for the first of the receivers (N, 3) that is `there`."""
    if there.any():
        row = int(there.argmax())
        raise OnEmitter(row, f"= {points[row].tolist()} is {where}, where the irradiance is infinite")


def towards(position: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Vectors (N, 3) from receivers to a position, what rounding took from them, and their squared lengths.

    Raises
    ------
    OnEmitter
        If a receiver is at the position.
    """
    offsets, low = two_sum(position, -points)
    squared = (offsets * offsets).sum(axis=-1)
    refuse_on_emitter(points, squared <= _NEAREST**2, "at the emitter's position")
    return offsets, low, squared


def point(emitter: Point, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of an isotropic point of unit intensity: ``cos(theta) / r^2`` [1/m^2], shape (N,).

    Raises
    ------
    OnEmitter
        If a receiver is at the emitter's position.

    Notes
    -----
    Inverse-square and cosine law [Lambert 1760, Photometria]. The error is a few ulp of the value down to cosines of
    1e-16.
    """
    return _of_unit(emitter.position, points, normals)


def spot(emitter: Spot, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of a spot of unit intensity: a point whose intensity falls linearly with the angle from its axis.

    Raises
    ------
    OnEmitter
        If a receiver is at the emitter's position.

    Notes
    -----
    ``I(a) = I clip((cutoff - a) / (cutoff - beam), 0, 1)``; the falloff is a convention, here that of Mitsuba 3's
    ``spot`` plug-in.
    """
    bare, part = _of_unit(emitter.position, points, normals), falloff(emitter, points)
    value = bare.value * part.value
    return Bounded(value, bare.error * part.value + (bare.value + bare.error) * part.error + _EPSILON * value)


def falloff(emitter: Spot, points: Floats) -> Bounded:
    """Part (N,) of a spot's full intensity that leaves towards each point (N, 3).

    The angle is computed in the processor's longest numbers, because near the cutoff little is left of it.
    """
    away = points.astype(np.longdouble) - emitter.position
    axis = np.broadcast_to(emitter.direction.astype(np.longdouble), away.shape)
    across = np.cross(away, axis)
    # Not the arc cosine, which loses half of the digits near the axis.
    angle = np.arctan2(np.sqrt((across * across).sum(axis=-1)), (away * axis).sum(axis=-1))
    width = np.longdouble(emitter.cutoff_angle) - emitter.beam_width
    ramp = (emitter.cutoff_angle - angle) / width
    error = 16 * _LONG_EPSILON / width + _EPSILON * np.abs(ramp)
    certain = (ramp < -error) | (ramp > 1 + error)
    return Bounded(np.clip(ramp, 0, 1).astype(np.float64), np.where(certain, 0, error).astype(np.float64))


def directional(emitter: Directional, normals: Floats) -> Bounded:
    """Irradiance of parallel light of unit irradiance: ``cos(theta)`` [Lambert 1760], shape (N,)."""
    return _height(normals, np.broadcast_to(-emitter.direction, normals.shape), 0.0)


def _of_unit(position: Floats, points: Floats, normals: Floats) -> Bounded:
    offsets, low, squared = towards(position, points)
    cube = squared * np.sqrt(squared)
    height = _height(normals, offsets, low)
    # n . offset is r cos(theta), hence the third power of the distance, which is right to 6 ulp.
    return Bounded(height.value / cube, height.error / cube + 6 * _EPSILON * height.value / cube)


def _height(normals: Floats, vectors: Floats, low: Floats | float) -> Bounded:
    """Height (N,) of vectors above the horizon, 0 below it, as if computed in twice the precision."""
    height = dot(normals, 0.0, vectors, low)
    doubled = 16 * _EPSILON**2 * np.abs(vectors).max(axis=-1)
    error = np.where(height < -doubled, 0.0, _EPSILON * np.abs(height) + doubled)
    return Bounded(np.maximum(height, 0.0), error)
