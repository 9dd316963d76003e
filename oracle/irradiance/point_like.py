"""Irradiance, for unit intensity or irradiance, of emitters without size."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Booleans, Floats, InvalidArgument, dot
from oracle.bounded import Bounded
from oracle.emitters import Directional, Point, Spot

_EPSILON = float(np.finfo(np.float64).eps)

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


def towards(position: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Vectors (N, 3) from receivers to a position and their squared lengths, each right to a few ulp.

    Raises
    ------
    OnEmitter
        If a receiver is at the position.
    """
    offsets = position - points
    squared = dot(offsets, offsets)
    refuse_on_emitter(points, squared <= _NEAREST**2, "at the emitter's position")
    return offsets, squared


def point(emitter: Point, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of an isotropic point of unit intensity: ``cos(theta) / r^2`` [1/m^2], shape (N,).

    Raises
    ------
    OnEmitter
        If a receiver is at the emitter's position.

    Notes
    -----
    Inverse-square and cosine law [Lambert 1760, Photometria]. The cosine is right to a few ulp of 1, not of itself.
    """
    offsets, squared = towards(emitter.position, points)
    cube = squared * np.sqrt(squared)
    height = _clipped_dot(normals, offsets)
    # n . offset is r cos(theta), hence the third power of the distance, which is right to 6 ulp.
    return Bounded(height.value / cube, height.error / cube + 6 * _EPSILON * height.value / cube)


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
    bare, part = point(Point(emitter.position, emitter.intensity), points, normals), falloff(emitter, points)
    value = bare.value * part.value
    return Bounded(value, bare.error * part.value + (bare.value + bare.error) * part.error + _EPSILON * value)


def falloff(emitter: Spot, points: Floats) -> Bounded:
    """Part (N,) of a spot's full intensity that leaves towards each point (N, 3)."""
    away = points - emitter.position
    # Not the arc cosine, which loses half of the digits near the axis.
    sine = np.linalg.norm(np.cross(away, emitter.direction), axis=-1)
    angle = np.arctan2(sine, dot(away, np.broadcast_to(emitter.direction, away.shape)))
    ramp = (emitter.cutoff_angle - angle) / (emitter.cutoff_angle - emitter.beam_width)
    # The angle is right to a few ulp of 1; a narrow ramp magnifies that.
    error = 8 * _EPSILON / (emitter.cutoff_angle - emitter.beam_width) + 2 * _EPSILON * np.abs(ramp)
    certain = (ramp < -error) | (ramp > 1 + error)
    return Bounded(np.clip(ramp, 0, 1), np.where(certain, 0.0, error))


def directional(emitter: Directional, normals: Floats) -> Bounded:
    """Irradiance of parallel light of unit irradiance: ``cos(theta)`` [Lambert 1760], shape (N,)."""
    return _clipped_dot(normals, np.broadcast_to(-emitter.direction, normals.shape))


def _clipped_dot(normals: Floats, vectors: Floats) -> Bounded:
    """Height (N,) of vectors above the horizon, 0 below it; `vectors` and unit normals are right to an ulp."""
    height = dot(normals, vectors)
    error = 4 * _EPSILON * dot(np.abs(normals), np.abs(vectors))
    return Bounded(np.maximum(height, 0.0), np.where(height < -error, 0.0, error))
