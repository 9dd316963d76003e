"""Shapes as frozen data: what can shine, hide or receive.

Arrays are float64 and read-only. Coordinates lie within 1e18 m, sizes between 1e-18 and 1e18 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from oracle.arrays import (
    Floats,
    Integers,
    InvalidArgument,
    demand_size,
    direction,
    finite,
    indices,
    length,
    position,
    replace,
    vector,
)


@dataclass(frozen=True, eq=False)
class Polygon:
    """A flat polygon; its front is the side from which its vertices go round counter-clockwise.

    Vertices [m], shape (N, 3), N >= 3. Non-convex is allowed, edges that cross are not.
    """

    vertices: Floats

    def __post_init__(self) -> None:
        vertices = position("vertices", self.vertices)
        if vertices.ndim != 2 or len(vertices) < 3:
            raise InvalidArgument(f"vertices has shape {vertices.shape}, a polygon needs (N, 3) with N >= 3")
        replace(self, vertices=vertices)
        relative = vertices - vertices[0]
        size = float(np.abs(relative).max())
        demand_size("the extent of vertices", size)
        if np.linalg.norm(self._doubled_area()) <= 1e-14 * size**2:
            raise InvalidArgument("vertices enclose no area")
        off_plane = np.abs(relative @ self.normal)
        if off_plane.max() > 1e-9 * size:
            raise InvalidArgument(f"vertices[{int(off_plane.argmax())}] lies {off_plane.max():g} m off the plane")
        crossing = self._first_crossing()
        if crossing:
            raise InvalidArgument("vertices: the edges that begin at [{}] and [{}] cross".format(*crossing))

    def _doubled_area(self) -> Floats:
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
        return direction("normal", self._doubled_area(), any_length=True)

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(np.linalg.norm(self._doubled_area())) / 2


@dataclass(frozen=True, eq=False)
class Rectangle:
    """The parallelogram ``center + a half_u + b half_v`` with a, b in [-1, 1] and orthogonal half axes [m].

    Its front is the side that ``half_u x half_v`` points to.
    """

    center: Floats
    half_u: Floats
    half_v: Floats

    def __post_init__(self) -> None:
        center, u, v = vector("center", self.center), vector("half_u", self.half_u), vector("half_v", self.half_v)
        replace(self, center=center, half_u=u, half_v=v)
        lengths = np.linalg.norm(u), np.linalg.norm(v)
        for name, half in zip(("half_u", "half_v"), lengths, strict=True):
            if half == 0:
                raise InvalidArgument(f"{name} has no length, so that the rectangle has no area")
            demand_size(f"the length of {name}", float(half))
        if abs(u @ v) > 1e-9 * lengths[0] * lengths[1]:
            raise InvalidArgument("half_u and half_v are not orthogonal; use a Polygon for a parallelogram")

    @property
    def polygon(self) -> Polygon:
        """The same shape by its corners."""
        c, u, v = self.center, self.half_u, self.half_v
        return Polygon(np.array([c - u - v, c + u - v, c + u + v, c - u + v]))

    @property
    def normal(self) -> Floats:
        """Unit normal of the front."""
        return direction("normal", np.cross(self.half_u, self.half_v), any_length=True)

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(4 * np.linalg.norm(self.half_u) * np.linalg.norm(self.half_v))


@dataclass(frozen=True, eq=False)
class Disk:
    """A flat disk with `center` [m] and `radius` [m]; its front is the side that the unit vector `normal` points to."""

    center: Floats
    normal: Floats
    radius: float

    def __post_init__(self) -> None:
        replace(
            self,
            center=vector("center", self.center),
            normal=direction("normal", vector("normal", self.normal)),
            radius=length("radius", self.radius),
        )

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(np.pi * self.radius**2)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere with `center` [m] and `radius` [m]; its front is its outside."""

    center: Floats
    radius: float

    def __post_init__(self) -> None:
        replace(self, center=vector("center", self.center), radius=length("radius", self.radius))

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(4 * np.pi * self.radius**2)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles, each with its front on the side from which its corners go round counter-clockwise.

    Vertices [m], shape (V, 3), and indices into them, shape (M, 3). `normals`, shape (V, 3), bend the directions in
    which renderers shade it, and `uv`, shape (V, 2), places textures on it; closed forms need neither.
    """

    vertices: Floats
    triangles: Integers
    normals: Floats | None = None
    uv: Floats | None = None

    def __post_init__(self) -> None:
        vertices = position("vertices", self.vertices)
        if vertices.ndim != 2 or len(vertices) < 3:
            raise InvalidArgument(f"vertices has shape {vertices.shape}, a mesh needs (V, 3) with V >= 3")
        triangles = indices("triangles", self.triangles, len(vertices))
        replace(self, vertices=vertices, triangles=triangles)
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        b, c = b - a, c - a
        size = np.maximum(np.abs(b), np.abs(c)).max(axis=1)
        for index in (int(size.argmin()), int(size.argmax())):
            demand_size(f"the extent of triangles[{index}]", float(size[index]))
        flat = np.flatnonzero(np.linalg.norm(np.cross(b, c), axis=1) <= 1e-14 * size**2)
        if flat.size:
            raise InvalidArgument(f"triangles[{flat[0]}] {triangles[flat[0]].tolist()}: vertices enclose no area")
        if self.normals is not None:
            replace(self, normals=self._for_each_vertex("normals", direction("normals", self.normals), 3))
        if self.uv is not None:
            replace(self, uv=self._for_each_vertex("uv", finite("uv", self.uv), 2))

    def _for_each_vertex(self, name: str, value: Floats, width: int) -> Floats:
        wanted = (len(self.vertices), width)
        if value.shape != wanted:
            raise InvalidArgument(f"{name} has shape {value.shape}, it must be {wanted}, one row for each vertex")
        return value

    @property
    def polygons(self) -> tuple[Polygon, ...]:
        """The triangles, one by one."""
        return tuple(Polygon(self.vertices[triangle]) for triangle in self.triangles)

    @property
    def area(self) -> float:
        """Area of one side [m^2]."""
        return sum(polygon.area for polygon in self.polygons)


Shape: TypeAlias = Polygon | Rectangle | Disk | Sphere | Mesh
