"""Emitters: where light comes from."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from reference_scenes.model.base import ABSENT, Direction, Flag, Model, Spectrum, Vector
from reference_scenes.model.shapes import Disk, Mesh, Shape, Sphere
from reference_scenes.model.textures import Bitmap, Checker, Radiance, Texels


class AreaEmitter(Model):
    """A shape whose front sends out the same radiance [W/(m^2 sr)] in every direction, and reflects nothing.

    ``two_sided``: its back does the same.
    """

    type: Literal["area"] = "area"
    shape: Shape
    radiance: Radiance
    two_sided: Flag = False

    @model_validator(mode="after")
    def _texture_has_a_place(self) -> Self:
        if isinstance(self.radiance, Bitmap | Checker):
            require_texture_coordinates(self.shape, "radiance")
        return self


def require_texture_coordinates(shape: Shape, field: str) -> None:
    """Refuse textures on shapes that have no texture coordinates."""
    if isinstance(shape, Disk | Sphere):
        raise ValueError(
            f"{field} is a texture, and a {shape.type} has no place for it; use a rectangle or a mesh with uv"
        )
    if isinstance(shape, Mesh) and shape.uv is None:
        raise ValueError(f"{field} is a texture, and the mesh has no uv to place it; give uv, one pair for each vertex")


class PointEmitter(Model):
    """A point with the same intensity [W/sr] in every direction."""

    type: Literal["point"] = "point"
    position: Vector
    intensity: Spectrum


class SpotEmitter(Model):
    """A point that shines into a cone around ``direction``.

    The intensity [W/sr] is full inside ``beam_width`` and falls linearly with the angle to 0 at ``cutoff_angle``
    (both half angles, in degrees).
    """

    type: Literal["spot"] = "spot"
    position: Vector
    direction: Direction
    intensity: Spectrum
    cutoff_angle: Annotated[float, Field(strict=True, gt=0, lt=90)]
    beam_width: Annotated[float, Field(strict=True, gt=0, lt=90)]

    @model_validator(mode="after")
    def _beam_inside_cone(self) -> Self:
        if self.beam_width >= self.cutoff_angle:
            raise ValueError(f"beam_width {self.beam_width} is not below cutoff_angle {self.cutoff_angle}")
        return self


class DirectionalEmitter(Model):
    """Parallel light that travels along ``direction``; ``irradiance`` [W/m^2] is that of a surface facing it."""

    type: Literal["directional"] = "directional"
    direction: Direction
    irradiance: Spectrum


class ConstantEmitter(Model):
    """The same radiance [W/(m^2 sr)] from every direction of an infinitely distant environment."""

    type: Literal["constant"] = "constant"
    radiance: Spectrum


class SkyEmitter(Model):
    """An infinitely distant sky around ``up`` over black ground; its radiance is linear in the sine of the elevation.

    It goes from ``horizon`` to ``zenith`` [W/(m^2 sr)]. A horizon that is not given is a third of the zenith: the CIE
    standard overcast sky.
    """

    type: Literal["sky"] = "sky"
    up: Direction = (0.0, 0.0, 1.0)
    zenith: Spectrum
    horizon: Spectrum | None = ABSENT


class ImageEmitter(Model):
    """An infinitely distant environment given as texels, each of uniform radiance [W/(m^2 sr)].

    Row 0 begins at the pole ``up``, the last row ends at the other; column 0 begins at the meridian through ``front``,
    and columns go round ``up`` counter-clockwise seen from above. Rows are equally high in angle, columns equally wide.
    """

    type: Literal["image"] = "image"
    radiance: Texels
    up: Direction = (0.0, 0.0, 1.0)
    front: Direction = (1.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _axes_are_orthogonal(self) -> Self:
        up, front = np.array(self.up), np.array(self.front)
        if abs(float(up @ front)) > 1e-9 * float(np.linalg.norm(up) * np.linalg.norm(front)):
            raise ValueError("up and front are not orthogonal; front is where the horizon meets column 0")
        return self


Environment = ConstantEmitter | SkyEmitter | ImageEmitter
Emitter = Annotated[
    AreaEmitter | PointEmitter | SpotEmitter | DirectionalEmitter | ConstantEmitter | SkyEmitter | ImageEmitter,
    Field(discriminator="type"),
]
