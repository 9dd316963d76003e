"""Irradiance, for unit intensity or irradiance, of emitters without size."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats, dot
from oracle.bounded import Bounded
from oracle.emitters import Directional, Point, Spot

_EPSILON = float(np.finfo(np.float64).eps)


def point(emitter: Point, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of an isotropic point of unit intensity: ``cos(theta) / r^2`` [1/m^2], shape (N,).

    Notes
    -----
    Inverse-square and cosine law [Lambert 1760, Photometria; Pharr, Jakob and Humphreys 2023, eq. 4.11].
    """
    towards = emitter.position - points
    squared = dot(towards, towards)
    # n . towards is r cos(theta), hence the third power of the distance.
    factor = np.maximum(dot(normals, towards), 0) / (squared * np.sqrt(squared))
    return Bounded(factor, 8 * _EPSILON / squared)


def spot(emitter: Spot, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of a spot of unit intensity: a point whose intensity falls linearly with the angle from its axis.

    Notes
    -----
    ``I(a) = I clip((cutoff - a) / (cutoff - beam), 0, 1)``; the falloff is a convention, here that of Mitsuba 3's
    ``spot`` plug-in. The angle comes from atan2 of sine and cosine, exact near the axis.
    """
    away = points - emitter.position
    sine = np.linalg.norm(np.cross(away, emitter.direction), axis=-1)
    angle = np.arctan2(sine, dot(away, emitter.direction))
    falloff = np.clip((emitter.cutoff_angle - angle) / (emitter.cutoff_angle - emitter.beam_width), 0, 1)
    bare = point(Point(emitter.position, emitter.intensity), points, normals)
    return bare * falloff


def directional(emitter: Directional, normals: Floats) -> Bounded:
    """Irradiance of parallel light of unit irradiance: ``cos(theta)`` [Lambert 1760], shape (N,)."""
    cosine = np.maximum(-dot(normals, emitter.direction), 0)
    return Bounded(cosine, np.full_like(cosine, 4 * _EPSILON))
