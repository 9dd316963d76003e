"""Emitters and receivers as frozen data: where light leaves and arrives, in SI units.

``C`` is the number of colour channels; arrays are float64 and read-only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, InvalidArgument, direction, finite, spectrum, vector


def _set(instance: object, **values: object) -> None:
    """Replace fields of a frozen dataclass by their checked form, during its construction only."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


@dataclass(frozen=True, eq=False)
class Receivers:
    """Oriented points that light falls on: points [m] and normals (any length), broadcast to one shape (..., 3)."""

    points: Floats
    normals: Floats

    def __post_init__(self) -> None:
        points, normals = finite("points", self.points, (3,)), direction("normals", self.normals)
        try:
            shape = np.broadcast_shapes(points.shape, normals.shape)
        except ValueError:
            raise InvalidArgument(f"points {points.shape} and normals {normals.shape} do not fit together") from None
        _set(self, points=np.broadcast_to(points, shape), normals=np.broadcast_to(normals, shape))


@dataclass(frozen=True, eq=False)
class Point:
    """A point at `position` [m] with the same intensity [W/sr], shape (C,), in every direction."""

    position: Floats
    intensity: Floats

    def __post_init__(self) -> None:
        _set(
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
        _set(
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
        _set(
            self,
            direction=direction("direction", vector("direction", self.direction)),
            irradiance=spectrum("irradiance", self.irradiance),
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
        _set(self, vertices=vertices, radiance=spectrum("radiance", self.radiance))
        relative = vertices - vertices[0]
        size = float(np.abs(relative).max())
        doubled_area = self._area_vector()
        if np.linalg.norm(doubled_area) <= 1e-14 * size**2:
            raise InvalidArgument("vertices enclose no area")
        off_plane = np.abs(relative @ self.normal)
        if off_plane.max() > 1e-9 * size:
            raise InvalidArgument(f"vertices[{int(off_plane.argmax())}] lies {off_plane.max():g} m off the plane")
        crossing = self._first_crossing()
        if crossing:
            raise InvalidArgument("vertices: the edges that begin at [{}] and [{}] cross".format(*crossing))

    def _area_vector(self) -> Floats:
        relative = self.vertices - self.vertices[0]
        total: Floats = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0)
        return total

    def _first_crossing(self) -> tuple[int, int] | None:
        """The first two edges that pass through each other; edges that only touch do not count."""
        a = self.vertices - self.vertices[0]
        b = np.roll(a, -1, axis=0)
        # side[i, j]: on which side of edge i vertex j lies, and with `across` whether edge i separates the ends of j.
        side = np.einsum("k,ijk->ij", self.normal, np.cross((b - a)[:, None], a[None] - a[:, None]))
        side[np.abs(side) <= 1e-12 * np.abs(a).max() ** 2] = 0
        across = side * np.roll(side, -1, axis=1) < 0
        crossings = np.argwhere(across & across.T)
        return (int(crossings[0, 0]), int(crossings[0, 1])) if crossings.size else None

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
            center=vector("center", self.center),
            normal=direction("normal", vector("normal", self.normal)),
            radiance=spectrum("radiance", self.radiance),
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
        _set(self, center=vector("center", self.center), radiance=spectrum("radiance", self.radiance))
        if not 0 < self.radius < np.inf:
            raise InvalidArgument(f"radius is {self.radius}, a sphere needs a positive one")


@dataclass(frozen=True, eq=False)
class Constant:
    """An infinitely distant environment with the same radiance [W/(m^2 sr)], shape (C,), everywhere."""

    radiance: Floats

    def __post_init__(self) -> None:
        _set(self, radiance=spectrum("radiance", self.radiance))
