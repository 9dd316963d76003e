"""Irradiance of straight lines."""

from __future__ import annotations

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.emitters import Line


def line(emitter: Line, points: Floats, normals: Floats) -> Bounded:
    """To be written."""
    raise NotImplementedError
