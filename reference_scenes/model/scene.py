"""Scenes: objects, emitters, what fills the space between them, and what is seen of it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from reference_scenes.model.base import ABSENT, Model, Spectrum
from reference_scenes.model.emitters import (
    ConstantEmitter,
    DirectionalEmitter,
    Emitter,
    Environment,
    require_texture_coordinates,
)
from reference_scenes.model.materials import Material, texture_in
from reference_scenes.model.sensors import Film, Sensor
from reference_scenes.model.shapes import Disk, Instances, Mesh, Rectangle, Sphere


class Object(Model):
    """A shape that does not shine, or copies of one, and what it is made of."""

    shape: Annotated[Rectangle | Disk | Sphere | Mesh | Instances, Field(discriminator="type")]
    material: Material

    @model_validator(mode="after")
    def _texture_has_a_place(self) -> Self:
        texture = texture_in(self.material)
        if texture:
            shape = self.shape.mesh if isinstance(self.shape, Instances) else self.shape
            require_texture_coordinates(shape, f"material/{texture}")
        return self


class Medium(Model):
    """What fills all space: a homogeneous medium with absorption and scattering coefficients [1/m].

    ``asymmetry`` is the mean cosine of the angle by which light is turned, with the Henyey-Greenstein phase function:
    positive is forward, 0 is isotropic.
    """

    type: Literal["homogeneous"] = "homogeneous"
    absorption: Spectrum
    scattering: Spectrum
    asymmetry: Annotated[float, Field(strict=True, gt=-1, lt=1)] = 0.0


class Scene(Model):
    """All that a renderer needs to know, and nothing about how to render it."""

    format: Literal["render-oracle-scene"] = "render-oracle-scene"
    version: Literal[1] = 1
    objects: tuple[Object, ...] = ()
    emitters: tuple[Emitter, ...] = ()
    medium: Medium | None = ABSENT
    camera: Sensor
    film: Film

    @field_validator("emitters")
    @classmethod
    def _one_environment(cls, emitters: tuple[Emitter, ...]) -> tuple[Emitter, ...]:
        around = [index for index, emitter in enumerate(emitters) if isinstance(emitter, Environment)]
        # Constant ones add up to another constant one.
        if len(around) > 1 and not all(isinstance(emitters[index], ConstantEmitter) for index in around):
            raise ValueError(
                f"has environments at {around[0]} and {around[1]}; there can be one, or several constant ones"
            )
        return emitters

    @field_validator("medium")
    @classmethod
    def _light_comes_through(cls, medium: Medium | None, info: ValidationInfo) -> Medium | None:
        for index, emitter in enumerate(info.data.get("emitters", ()) if medium else ()):
            if isinstance(emitter, Environment | DirectionalEmitter):
                raise ValueError(
                    f"fills all space, so that no light of /emitters/{index} arrives; leave one of them out"
                )
        return medium
