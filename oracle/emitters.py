"""Emitters and receivers as frozen data: where light leaves and arrives, in SI units.

``C`` is the number of colour channels; arrays are float64 and read-only. Coordinates lie within 1e18 m, and light, in
whatever unit, is at most 1e36.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from oracle.arrays import Floats, InvalidArgument, demand_size, direction, light, position, replace, spectrum, vector
from oracle.shapes import Shape


@dataclass(frozen=True, eq=False)
class Receivers:
    """Oriented points that light falls on: points [m] and unit normals, broadcast to one shape (..., 3)."""

    points: Floats
    normals: Floats

    def __post_init__(self) -> None:
        points, normals = position("points", self.points), direction("normals", self.normals)
        try:
            shape = np.broadcast_shapes(points.shape, normals.shape)
        except ValueError:
            raise InvalidArgument(f"points {points.shape} and normals {normals.shape} do not fit together") from None
        replace(self, points=np.broadcast_to(points, shape), normals=np.broadcast_to(normals, shape))

    @property
    def shape(self) -> tuple[int, ...]:
        """How many receivers along each axis."""
        return self.points.shape[:-1]


@dataclass(frozen=True, eq=False)
class Point:
    """A point at `position` [m] with the same intensity [W/sr], shape (C,), in every direction."""

    position: Floats
    intensity: Floats

    def __post_init__(self) -> None:
        replace(
            self,
            position=vector("position", self.position),
            intensity=spectrum("intensity", self.intensity),
        )


@dataclass(frozen=True, eq=False)
class Spot:
    """A point that shines into a cone.

    Its intensity [W/sr], shape (C,), is full within `beam_width` of `direction` and falls linearly with the angle
    to 0 at `cutoff_angle` (half angles in radians).
    """

    position: Floats
    direction: Floats
    intensity: Floats
    beam_width: float
    cutoff_angle: float

    def __post_init__(self) -> None:
        replace(
            self,
            position=vector("position", self.position),
            direction=direction("direction", vector("direction", self.direction)),
            intensity=spectrum("intensity", self.intensity),
        )
        if not 0 < self.beam_width < self.cutoff_angle < np.pi:
            raise InvalidArgument(
                f"beam_width {self.beam_width} and cutoff_angle {self.cutoff_angle} must satisfy "
                "0 < beam_width < cutoff_angle < pi"
            )


@dataclass(frozen=True, eq=False)
class Directional:
    """Parallel light along `direction`; `irradiance` [W/m^2], shape (C,), is that of a surface facing it."""

    direction: Floats
    irradiance: Floats

    def __post_init__(self) -> None:
        replace(
            self,
            direction=direction("direction", vector("direction", self.direction)),
            irradiance=spectrum("irradiance", self.irradiance),
        )


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line from `start` to `end` [m] that shines like a thin diffuse tube.

    Each metre has the intensity `intensity_per_length` [W/(sr m)], shape (C,), across the line, and the sine of the
    angle to the line times as much elsewhere. A tube of radius r and radiance L has 2 r L.
    """

    start: Floats
    end: Floats
    intensity_per_length: Floats

    def __post_init__(self) -> None:
        replace(
            self,
            start=vector("start", self.start),
            end=vector("end", self.end),
            intensity_per_length=spectrum("intensity_per_length", self.intensity_per_length),
        )
        if (self.start == self.end).all():
            raise InvalidArgument("start and end are the same point")
        demand_size("the length from start to end", float(np.abs(self.end - self.start).max()))


@dataclass(frozen=True, eq=False)
class Area:
    """A shape with uniform diffuse radiance [W/(m^2 sr)], shape (C,), on its front, or on both of its sides."""

    shape: Shape
    radiance: Floats
    two_sided: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Shape):
            raise InvalidArgument(f"shape is a {type(self.shape).__name__}, not one of oracle.shapes")
        replace(self, radiance=spectrum("radiance", self.radiance))


@dataclass(frozen=True, eq=False)
class Constant:
    """An infinitely distant environment with the same radiance [W/(m^2 sr)], shape (C,), everywhere."""

    radiance: Floats

    def __post_init__(self) -> None:
        replace(self, radiance=spectrum("radiance", self.radiance))


@dataclass(frozen=True, eq=False)
class CosineSky:
    """An infinitely distant hemisphere around `up` whose radiance is linear in the sine of the elevation.

    It goes from `horizon` to `zenith` [W/(m^2 sr)], shape (C,) each; the other hemisphere, the ground, is black.
    """

    up: Floats
    horizon: Floats
    zenith: Floats

    def __post_init__(self) -> None:
        replace(
            self,
            up=direction("up", vector("up", self.up)),
            horizon=spectrum("horizon", self.horizon),
            zenith=spectrum("zenith", self.zenith),
        )
        if self.horizon.shape != self.zenith.shape:
            raise InvalidArgument(f"horizon {self.horizon.shape} and zenith {self.zenith.shape} differ in shape")

    @classmethod
    def cie_overcast(cls, up: Floats, zenith: Floats) -> CosineSky:
        """The CIE standard overcast sky, three times as bright at the zenith as at the horizon [ISO 15469:2004]."""
        return cls(up, spectrum("zenith", zenith) / 3, zenith)


@dataclass(frozen=True, eq=False)
class Equirectangular:
    """An infinitely distant environment given as a map of texels, each of uniform radiance.

    Radiance [W/(m^2 sr)], shape (H, W, C). Row 0 begins at the pole `up`, the last row ends at the other pole; column
    0 begins at the meridian through the unit vector `front`, orthogonal to `up`, and columns go round `up`
    counter-clockwise seen from above. All rows are equally high in angle, all columns equally wide.
    """

    radiance: Floats
    up: Floats
    front: Floats

    def __post_init__(self) -> None:
        radiance = light("radiance", self.radiance)
        if radiance.ndim != 3 or 0 in radiance.shape:
            raise InvalidArgument(f"radiance has shape {radiance.shape}, a map needs (H, W, C)")
        replace(
            self,
            radiance=radiance,
            up=direction("up", vector("up", self.up)),
            front=direction("front", vector("front", self.front)),
        )
        if abs(self.up @ self.front) > 1e-9:
            raise InvalidArgument("up and front are not orthogonal")


Emitter: TypeAlias = Point | Spot | Directional | Line | Area | Constant | CosineSky | Equirectangular
