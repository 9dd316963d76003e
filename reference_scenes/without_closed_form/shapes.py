"""Shapes: copies of a mesh, surfaces that are shaded as if bent, sheets with two sides."""

from __future__ import annotations

import numpy as np

from reference_scenes import model
from reference_scenes.without_closed_form.building import (
    BLUE,
    FILM,
    GREEN,
    GREY,
    RED,
    WHITE,
    block,
    camera,
    ceiling_lamp,
    floor,
    mesh,
    rectangle,
)

LAMP = ceiling_lamp((0.4, -0.4, 2.2), 0.5, 0.5, (7.0, 7.0, 7.0))
VIEW = camera((0.4, -3.2, 1.6), (0.0, 0.0, 0.4), 40.0)


def copies() -> model.Scene:
    """Copies of one block, moved, turned, stretched and mirrored."""
    transforms = []
    for index in range(12):
        angle = 0.7 * index
        linear = np.array([[np.cos(angle), -np.sin(angle), 0.2], [np.sin(angle), np.cos(angle), 0.1], [0.0, 0.0, 1.0]])
        linear *= np.array([0.5 + 0.04 * index, 0.7, (-1.0) ** index])
        shift = (0.5 * (index % 4) - 0.75, 0.6 * (index // 4) - 0.5, 0.22 + 0.02 * index)
        first, second, third = (
            (float(a), float(b), float(c), float(d)) for (a, b, c), d in zip(linear, shift, strict=True)
        )
        transforms.append((first, second, third))
    wedge = model.Mesh(
        vertices=((-0.2, -0.2, -0.2), (0.25, -0.2, -0.2), (-0.2, 0.3, -0.2), (-0.1, -0.1, 0.3)),
        triangles=((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    )
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            model.Object(shape=model.Instances(mesh=wedge, transforms=tuple(transforms)), material=RED),
        ),
        emitters=(LAMP, model.ConstantEmitter(radiance=(0.2, 0.25, 0.3))),
        camera=VIEW,
        film=FILM,
    )


def smooth_normals() -> model.Scene:
    """A coarse ball of 320 triangles that is shaded as if it were round."""
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            model.Object(shape=_round((0.0, 0.0, 0.7), 0.6), material=WHITE),
        ),
        emitters=(LAMP, model.ConstantEmitter(radiance=(0.2, 0.25, 0.3))),
        camera=VIEW,
        film=FILM,
    )


def _round(center: model.Vector, radius: float) -> model.Mesh:
    """A sphere of triangles: an icosahedron whose edges are halved twice."""
    golden = (1 + np.sqrt(5)) / 2
    corners = [np.roll([0.0, i, j * golden], k) for k in range(3) for i in (-1, 1) for j in (-1, 1)]
    # Faces join corners at the distance of an edge, 2.
    near = [[bool(abs(np.linalg.norm(a - b) - 2) < 1e-9) for b in corners] for a in corners]
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i][j] and near[j][k] and near[i][k]
    ]
    triangles = [np.array([corners[i] for i in face]) for face in faces]
    for _ in range(2):
        finer = []
        for a, b, c in triangles:
            ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
            finer += [np.array(part) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        triangles = finer
    points = np.concatenate(triangles)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    indices = []
    for first in range(0, len(points), 3):
        a, b, c = points[first : first + 3]
        outwards = np.linalg.det([a, b, c]) > 0
        indices.append((first, first + 1, first + 2) if outwards else (first, first + 2, first + 1))
    return mesh(np.array(center) + radius * points, indices, points)


def blades() -> model.Scene:
    """Sheets with a front of one colour and a back of another, between which light is caught."""
    sheets = tuple(
        model.Object(
            shape=rectangle((0.4 * index - 0.8, 0.0, 0.5), (0.1, 0.6, 0.0), (0.15, -0.025, 0.4)),
            material=model.TwoSided(front=front, back=back),
        )
        for index, (front, back) in enumerate(((RED, BLUE), (GREEN, RED), (WHITE, None), (BLUE, GREEN), (RED, WHITE)))
    )
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            *sheets,
            model.Object(shape=block((0.0, 1.0, 0.4), (1.0, 0.1, 0.4)), material=WHITE),
        ),
        emitters=(LAMP,),
        camera=camera((0.6, -3.0, 1.8), (0.0, 0.0, 0.4), 42.0),
        film=FILM,
    )
