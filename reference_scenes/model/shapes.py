"""Shapes: what light leaves from, meets and passes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from reference_scenes.model.base import ABSENT, Direction, Finite, Index, Model, Positive, Vector


class Rectangle(Model):
    """A rectangle ``center + s half_u + t half_v`` with s, t in [-1, 1]; its normal is ``half_u x half_v``."""

    type: Literal["rectangle"] = "rectangle"
    center: Vector
    half_u: Direction
    half_v: Direction

    @model_validator(mode="after")
    def _edges_are_orthogonal(self) -> Self:
        u, v = np.array(self.half_u), np.array(self.half_v)
        if abs(float(u @ v)) > 1e-9 * float(np.linalg.norm(u) * np.linalg.norm(v)):
            raise ValueError("half_u and half_v are not orthogonal; for other than right angles use a mesh")
        return self


class Disk(Model):
    """A flat disk that faces along ``normal`` (any length)."""

    type: Literal["disk"] = "disk"
    center: Vector
    normal: Direction
    radius: Positive


class Sphere(Model):
    """A sphere; its normals point outwards."""

    type: Literal["sphere"] = "sphere"
    center: Vector
    radius: Positive


class Mesh(Model):
    """Triangles over shared vertices, counter-clockwise seen from the front.

    With ``normals`` (any length) it is shaded as if bent between its vertices; ``uv`` places textures on it.
    """

    type: Literal["mesh"] = "mesh"
    vertices: Annotated[tuple[Vector, ...], Field(min_length=3)]
    triangles: Annotated[tuple[tuple[Index, Index, Index], ...], Field(min_length=1)]
    normals: tuple[Direction, ...] | None = ABSENT
    uv: tuple[tuple[Finite, Finite], ...] | None = ABSENT

    @model_validator(mode="after")
    def _triangles_exist(self) -> Self:
        vertices = np.array(self.vertices)
        indices = np.array(self.triangles)
        outside = np.flatnonzero((indices < 0).any(axis=1) | (indices >= len(vertices)).any(axis=1))
        if outside.size:
            raise ValueError(
                f"triangles[{outside[0]}] = {self.triangles[outside[0]]} names a vertex outside 0..{len(vertices) - 1}"
            )
        corners = vertices[indices]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat = np.flatnonzero(np.linalg.norm(normals, axis=1) == 0)
        if flat.size:
            raise ValueError(f"triangles[{flat[0]}] = {self.triangles[flat[0]]} has no area")
        return self

    @model_validator(mode="after")
    def _every_vertex_has_its_own(self) -> Self:
        for name, values in (("normals", self.normals), ("uv", self.uv)):
            if values is not None and len(values) != len(self.vertices):
                raise ValueError(
                    f"{name} has {len(values)} entries for {len(self.vertices)} vertices; give one for each"
                )
        return self


Shape = Annotated[Rectangle | Disk | Sphere | Mesh, Field(discriminator="type")]

_Row = tuple[Finite, Finite, Finite, Finite]


def _require_inverse(value: tuple[_Row, _Row, _Row]) -> tuple[_Row, _Row, _Row]:
    if np.linalg.det(np.array(value)[:, :3]) == 0:
        raise ValueError("has no inverse; it flattens what it maps")
    return value


# Three rows of four: a linear map and, as the last column, a translation [m].
Affine = Annotated[tuple[_Row, _Row, _Row], AfterValidator(_require_inverse)]


class Instances(Model):
    """Copies of a mesh, one for each affine map ``x -> m[:, :3] x + m[:, 3]``; mirroring is allowed.

    The front of a copy is the image of the mesh's front, whichever way round its vertices go then.
    """

    type: Literal["instances"] = "instances"
    mesh: Mesh
    transforms: Annotated[tuple[Affine, ...], Field(min_length=1)]
