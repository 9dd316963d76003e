"""The scene model: what is rendered, in SI units, as frozen and validated data.

Conventions, once and for all
-----------------------------
* World space is right-handed; lengths are metres.
* Radiance L is W/(m^2 sr), irradiance E is W/m^2, intensity I is W/sr, per RGB channel.
* A surface's front is where its geometric normal points: ``half_u x half_v`` for a rectangle, ``normal``
  for a disk, outwards for a sphere, counter-clockwise vertices for a triangle.
* Area emitters shine from their front only and reflect nothing. Diffuse surfaces reflect from their front only.
* The camera looks from ``origin`` to ``target``; image x grows to the camera's right, image y downwards.
  Pixel (0, 0) is the top left one and its centre lies at film position (0.5, 0.5).
  ``fov_x`` is the full horizontal angle between the left and the right edge of the film; pixels are square.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, WithJsonSchema, model_validator

# Whatever is larger overflows in renderers of single precision, if not itself then its square.
LARGEST = 1e18

# Strict: neither text nor true and false are taken for numbers.
Finite = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST, allow_inf_nan=False)]
Index = Annotated[int, Field(strict=True)]
Vector = tuple[Finite, Finite, Finite]


def _require_non_negative(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if min(value) < 0:
        raise ValueError("has a negative component; light is at least 0 in every channel")
    return value


def _require_albedo(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if min(value) < 0 or max(value) > 1:
        raise ValueError("has a component outside [0, 1]; a diffuse surface reflects between none and all of the light")
    return value


def _require_direction(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if float(np.linalg.norm(value)) < 1e-12:
        raise ValueError("has no length; a direction needs at least one component that is not 0")
    return value


def _three_numbers(minimum: float, maximum: float) -> WithJsonSchema:
    """What the JSON Schema says of a vector whose validator it cannot know."""
    number = {"type": "number", "minimum": minimum, "maximum": maximum}
    return WithJsonSchema({"type": "array", "prefixItems": [number] * 3, "minItems": 3, "maxItems": 3})


Direction = Annotated[Vector, AfterValidator(_require_direction)]
Spectrum = Annotated[Vector, AfterValidator(_require_non_negative), _three_numbers(0, LARGEST)]
Albedo = Annotated[Vector, AfterValidator(_require_albedo), _three_numbers(0, 1)]


class Model(BaseModel):
    """Frozen data that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


# --------------------------------------------------------------------------------------------- shapes


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
    """Triangles over shared vertices, counter-clockwise seen from the front."""

    type: Literal["mesh"] = "mesh"
    vertices: Annotated[tuple[Vector, ...], Field(min_length=3)]
    triangles: Annotated[tuple[tuple[Index, Index, Index], ...], Field(min_length=1)]

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


Shape = Annotated[Rectangle | Disk | Sphere | Mesh, Field(discriminator="type")]


# ------------------------------------------------------------------------------------------- materials


class Diffuse(Model):
    """A Lambertian surface, f = reflectance / pi."""

    type: Literal["diffuse"] = "diffuse"
    reflectance: Albedo


class Object(Model):
    """A shape that does not shine, and what it is made of."""

    shape: Shape
    material: Diffuse


# -------------------------------------------------------------------------------------------- emitters


class AreaEmitter(Model):
    """A shape whose front sends out the same radiance [W/(m^2 sr)] in every direction, and reflects nothing."""

    type: Literal["area"] = "area"
    shape: Shape
    radiance: Spectrum


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


Emitter = Annotated[
    AreaEmitter | PointEmitter | SpotEmitter | DirectionalEmitter | ConstantEmitter, Field(discriminator="type")
]


# ------------------------------------------------------------------------------------- camera and film


class Camera(Model):
    """A pinhole camera; ``fov_x`` is its full horizontal field of view in degrees."""

    type: Literal["perspective"] = "perspective"
    origin: Vector
    target: Vector
    up: Direction = (0.0, 0.0, 1.0)
    fov_x: Annotated[float, Field(strict=True, gt=0, lt=180)]

    @model_validator(mode="after")
    def _axes_exist(self) -> Self:
        forward = np.array(self.target) - np.array(self.origin)
        if float(np.linalg.norm(forward)) == 0:
            raise ValueError("origin and target are the same point; the camera looks nowhere")
        if float(np.linalg.norm(np.cross(forward, self.up))) < 1e-9 * float(
            np.linalg.norm(forward) * np.linalg.norm(self.up)
        ):
            raise ValueError("up is parallel to the viewing direction; choose another up")
        return self


class BoxFilter(Model):
    """A pixel is the plain average over its own square."""

    type: Literal["box"] = "box"


class GaussianFilter(Model):
    """A pixel is a Gaussian average with this standard deviation [pixels], cut off at 4 of them."""

    type: Literal["gaussian"] = "gaussian"
    stddev: Annotated[float, Field(strict=True, gt=0, le=2)] = 0.5


Filter = Annotated[BoxFilter | GaussianFilter, Field(discriminator="type")]


class Film(Model):
    """The pixel grid and its reconstruction filter."""

    width: Annotated[int, Field(strict=True, ge=1, le=16384)]
    height: Annotated[int, Field(strict=True, ge=1, le=16384)]
    filter: Filter = BoxFilter()


# ----------------------------------------------------------------------------------------------- scene


class Scene(Model):
    """All that a renderer needs to know, and nothing about how to render it."""

    format: Literal["render-oracle-scene"] = "render-oracle-scene"
    version: Literal[1] = 1
    objects: tuple[Object, ...] = ()
    emitters: tuple[Emitter, ...] = ()
    camera: Camera
    film: Film
