"""Irradiance of what is infinitely far away, with shape (N, C)."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.emitters import Constant, CosineSky, Equirectangular

_EPSILON = float(np.finfo(np.float64).eps)


def constant(emitter: Constant, normals: Floats) -> Bounded:
    """Irradiance of an unobstructed constant environment: ``E = pi L``."""
    value = np.broadcast_to(np.pi * emitter.radiance, (len(normals), len(emitter.radiance)))
    return Bounded(value, _EPSILON * value)


def cosine_sky(emitter: CosineSky, normals: Floats) -> Bounded:
    """To be written."""
    raise NotImplementedError


def equirectangular(emitter: Equirectangular, normals: Floats) -> Bounded:
    """To be written."""
    raise NotImplementedError
