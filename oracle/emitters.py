"""Emitters and receivers as frozen data: where light leaves and arrives, in SI units.

``C`` is the number of colour channels; arrays are float64 and read-only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, InvalidArgument, direction, finite, non_negative


def _set(instance: object, **values: object) -> None:
    """Replace fields of a frozen dataclass by their checked form, during its construction only."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


@dataclass(frozen=True, eq=False)
class Receivers:
    """Oriented points that light falls on: points [m] and unit normals, each of shape (..., 3)."""

    points: Floats
    normals: Floats

    def __post_init__(self) -> None:
        _set(self, points=finite("points", self.points, (3,)), normals=direction("normals", self.normals))


@dataclass(frozen=True, eq=False)
class Point:
    """A point at `position` [m] with the same intensity [W/sr], shape (C,), in every direction."""

    position: Floats
    intensity: Floats

    def __post_init__(self) -> None:
        _set(
            self,
            position=finite("position", self.position, (3,)),
            intensity=non_negative("intensity", self.intensity),
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
        _set(
            self,
            position=finite("position", self.position, (3,)),
            direction=direction("direction", self.direction),
            intensity=non_negative("intensity", self.intensity),
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
        _set(
            self,
            direction=direction("direction", self.direction),
            irradiance=non_negative("irradiance", self.irradiance),
        )


@dataclass(frozen=True, eq=False)
class Polygon:
    """A flat polygon with uniform diffuse radiance on its front.

    Vertices [m], shape (N, 3), N >= 3, counter-clockwise seen from the front; non-convex is allowed.
    Radiance [W/(m^2 sr)], shape (C,).
    """

    vertices: Floats
    radiance: Floats

    def __post_init__(self) -> None:
        vertices = finite("vertices", self.vertices, (3,))
        if vertices.ndim != 2 or len(vertices) < 3:
            raise InvalidArgument(f"vertices has shape {vertices.shape}, a polygon needs (N, 3) with N >= 3")
        _set(self, vertices=vertices, radiance=non_negative("radiance", self.radiance))
        relative = vertices - vertices[0]
        size = float(np.abs(relative).max())
        doubled_area = self._area_vector()
        if np.linalg.norm(doubled_area) <= 1e-14 * size**2:
            raise InvalidArgument("vertices enclose no area")
        off_plane = np.abs(relative @ self.normal)
        if off_plane.max() > 1e-9 * size:
            raise InvalidArgument(f"vertices[{int(off_plane.argmax())}] lies {off_plane.max():g} m off the plane")

    def _area_vector(self) -> Floats:
        relative = self.vertices - self.vertices[0]
        total: Floats = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0)
        return total

    @property
    def normal(self) -> Floats:
        """Unit normal of the front."""
        return direction("normal", self._area_vector())


@dataclass(frozen=True, eq=False)
class Disk:
    """A flat disk with uniform diffuse radiance [W/(m^2 sr)], shape (C,), on the side that `normal` points to."""

    center: Floats
    normal: Floats
    radius: float
    radiance: Floats

    def __post_init__(self) -> None:
        _set(
            self,
            center=finite("center", self.center, (3,)),
            normal=direction("normal", self.normal),
            radiance=non_negative("radiance", self.radiance),
        )
        if not 0 < self.radius < np.inf:
            raise InvalidArgument(f"radius is {self.radius}, a disk needs a positive one")


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere with uniform diffuse radiance [W/(m^2 sr)], shape (C,), on its outside."""

    center: Floats
    radius: float
    radiance: Floats

    def __post_init__(self) -> None:
        _set(self, center=finite("center", self.center, (3,)), radiance=non_negative("radiance", self.radiance))
        if not 0 < self.radius < np.inf:
            raise InvalidArgument(f"radius is {self.radius}, a sphere needs a positive one")


@dataclass(frozen=True, eq=False)
class Constant:
    """An infinitely distant environment with the same radiance [W/(m^2 sr)], shape (C,), everywhere."""

    radiance: Floats

    def __post_init__(self) -> None:
        _set(self, radiance=non_negative("radiance", self.radiance))
