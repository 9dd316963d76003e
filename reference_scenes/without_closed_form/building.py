"""What these scenes are built of. z is up; lengths are metres."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model

FILM = model.Film(width=64, height=64)
WHITE = model.Diffuse(reflectance=(0.73, 0.73, 0.73))
GREY = model.Diffuse(reflectance=(0.5, 0.5, 0.5))
RED = model.Diffuse(reflectance=(0.6, 0.06, 0.05))
GREEN = model.Diffuse(reflectance=(0.12, 0.45, 0.1))
BLUE = model.Diffuse(reflectance=(0.1, 0.15, 0.6))
# Gold and copper at 630, 532 and 465 nm, rounded [Johnson and Christy 1972].
GOLD = {"eta": (0.18, 0.42, 1.37), "k": (3.42, 2.35, 1.77)}
COPPER = {"eta": (0.27, 1.03, 1.25), "k": (3.41, 2.58, 2.34)}


def camera(origin: model.Vector, target: model.Vector, fov_x: float) -> model.Camera:
    """A camera with z upwards."""
    return model.Camera(origin=origin, target=target, fov_x=fov_x)


def rectangle(center: model.Vector, half_u: model.Vector, half_v: model.Vector) -> model.Rectangle:
    """A rectangle that faces along ``half_u x half_v``."""
    return model.Rectangle(center=center, half_u=half_u, half_v=half_v)


def floor(half: float, material: model.Material, z: float = 0.0) -> model.Object:
    """A square that faces upwards."""
    return model.Object(shape=rectangle((0.0, 0.0, z), (half, 0.0, 0.0), (0.0, half, 0.0)), material=material)


def ball(center: model.Vector, radius: float, material: model.Material) -> model.Object:
    """A sphere made of something."""
    return model.Object(shape=model.Sphere(center=center, radius=radius), material=material)


def ceiling_lamp(center: model.Vector, half_x: float, half_y: float, radiance: model.Vector) -> model.AreaEmitter:
    """A rectangle that shines downwards."""
    return model.AreaEmitter(shape=rectangle(center, (half_x, 0.0, 0.0), (0.0, -half_y, 0.0)), radiance=radiance)


# --------------------------------------------------------------------------------------------------- meshes

# Faces of a cube, each counter-clockwise seen from outside; corner i is at bit 0, 1, 2 of i along x, y, z.
_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def block(center: model.Vector, half: model.Vector, turned: float = 0.0) -> model.Mesh:
    """A box of 12 triangles, turned around the vertical by some degrees."""
    corners = (np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) * 2 - 1) * np.array(half)
    cosine, sine = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return quadrilaterals(corners @ rotation.T + np.array(center), _FACES)


def quadrilaterals(corners: Floats, faces: tuple[tuple[int, int, int, int], ...]) -> model.Mesh:
    """A mesh of two triangles for each face."""
    triangles = [triangle for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))]
    return mesh(corners, triangles)


def mesh(vertices: Floats, triangles: list[tuple[int, int, int]], normals: Floats | None = None) -> model.Mesh:
    """A mesh from arrays."""
    return model.Mesh(
        vertices=rows(vertices), triangles=tuple(triangles), normals=None if normals is None else rows(normals)
    )


def joined(*meshes: model.Mesh) -> model.Mesh:
    """Several meshes as one."""
    vertices: list[model.Vector] = []
    triangles: list[tuple[int, int, int]] = []
    for one in meshes:
        first = len(vertices)
        vertices += one.vertices
        triangles += [(a + first, b + first, c + first) for a, b, c in one.triangles]
    return model.Mesh(vertices=tuple(vertices), triangles=tuple(triangles))


def walls(half: float, height: float, *which: str) -> model.Mesh:
    """Walls of a room that one sees from inside, two triangles each; its floor is at 0, its front is open."""
    x, z = half, height
    corners = np.array([[i, j, k] for k in (0.0, z) for j in (-x, x) for i in (-x, x)])
    # Numbered as in a cube, counter-clockwise seen from inside.
    inside = {
        "floor": (0, 1, 3, 2),
        "ceiling": (4, 6, 7, 5),
        "back": (2, 3, 7, 6),
        "front": (0, 4, 5, 1),
        "left": (0, 2, 6, 4),
        "right": (1, 5, 7, 3),
    }
    return joined(*(quadrilaterals(corners[list(inside[name])], ((0, 1, 2, 3),)) for name in which))


def rows(array: Floats) -> tuple[model.Vector, ...]:
    """Vectors as the model's plain tuples."""
    return tuple((float(x), float(y), float(z)) for x, y, z in array)
