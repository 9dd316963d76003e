"""Sensors and film: what the picture is of."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from reference_scenes.model.base import Direction, Model, Positive, Vector, requires_type, type_or
from reference_scenes.model.shapes import Rectangle


def _require_axes(origin: Vector, target: Vector, up: Vector) -> None:
    forward = np.array(target) - np.array(origin)
    if float(np.linalg.norm(forward)) == 0:
        raise ValueError("origin and target are the same point; the camera looks nowhere")
    if float(np.linalg.norm(np.cross(forward, up))) < 1e-9 * float(np.linalg.norm(forward) * np.linalg.norm(up)):
        raise ValueError("up is parallel to the viewing direction; choose another up")


class Camera(Model):
    """A pinhole camera; ``fov_x`` is its full horizontal field of view in degrees."""

    type: Literal["perspective"] = "perspective"
    origin: Vector
    target: Vector
    up: Direction = (0.0, 0.0, 1.0)
    fov_x: Annotated[float, Field(strict=True, gt=0, lt=180)]

    @model_validator(mode="after")
    def _axes_exist(self) -> Self:
        _require_axes(self.origin, self.target, self.up)
        return self


class _Sensor(Model):
    model_config = ConfigDict(json_schema_extra=requires_type)


class OrthographicCamera(_Sensor):
    """Parallel rays along ``target - origin``; the image is ``width`` metres wide and centred on ``origin``."""

    type: Literal["orthographic"] = "orthographic"
    origin: Vector
    target: Vector
    up: Direction = (0.0, 0.0, 1.0)
    width: Positive

    @model_validator(mode="after")
    def _axes_exist(self) -> Self:
        _require_axes(self.origin, self.target, self.up)
        return self


class IrradianceMeter(_Sensor):
    """Irradiance [W/m^2] on the front of a rectangle, averaged over each of the pixels that divide it.

    Pixel columns go along ``half_u``, rows against ``half_v``. The rectangle itself is not part of the scene.
    """

    type: Literal["irradiance_meter"] = "irradiance_meter"
    surface: Rectangle


class RadianceMeter(_Sensor):
    """Radiance along a single ray, in every pixel: it arrives at ``origin`` from where ``direction`` points."""

    type: Literal["radiance_meter"] = "radiance_meter"
    origin: Vector
    direction: Direction


Sensor = Annotated[
    Annotated[Camera, Tag("perspective")]
    | Annotated[OrthographicCamera, Tag("orthographic")]
    | Annotated[IrradianceMeter, Tag("irradiance_meter")]
    | Annotated[RadianceMeter, Tag("radiance_meter")],
    Discriminator(type_or("perspective")),
]


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
