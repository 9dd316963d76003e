"""Shapes, emitters and receivers as they stand in cases; each builds the one of `oracle` that it describes."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field

from oracle import emitters, shapes
from oracle.arrays import Floats, InvalidArgument
from oracle.truth.fields import (
    Angle,
    Index,
    Intensity,
    Length,
    Light,
    Model,
    Radiance,
    TwoSided,
    UnitVector,
    Vector,
    Vertices,
)


class Receiver(Model):
    """An oriented point: `point` [m] and unit normal."""

    point: Vector
    normal: UnitVector


# ---------------------------------------------------------------------------------------------- shapes


class Polygon(Model):
    """A flat polygon; its front is the side from which its vertices [m] go round counter-clockwise."""

    type: Literal["polygon"] = "polygon"
    vertices: Vertices


class Rectangle(Model):
    """A rectangle ``center + s half_u + t half_v``, s and t in [-1, 1]; its front faces along ``half_u x half_v``."""

    type: Literal["rectangle"] = "rectangle"
    center: Vector
    half_u: Vector
    half_v: Vector


class Disk(Model):
    """A flat disk with `center` and `radius` [m]; its front is where the unit vector `normal` points."""

    type: Literal["disk"] = "disk"
    center: Vector
    normal: UnitVector
    radius: Length


class Sphere(Model):
    """A sphere with `center` and `radius` [m]; its front is its outside."""

    type: Literal["sphere"] = "sphere"
    center: Vector
    radius: Length


class Mesh(Model):
    """Triangles as indices into `vertices` [m], each counter-clockwise seen from its front."""

    type: Literal["mesh"] = "mesh"
    vertices: Vertices
    triangles: Annotated[tuple[tuple[Index, Index, Index], ...], Field(min_length=1)]


Shape: TypeAlias = Annotated[Polygon | Rectangle | Disk | Sphere | Mesh, Field(discriminator="type")]


def shape_of(model: Polygon | Rectangle | Disk | Sphere | Mesh) -> shapes.Shape:
    """The shape of `oracle` that a model describes; raises InvalidArgument."""
    match model:
        case Polygon():
            return shapes.Polygon(np.array(model.vertices))
        case Rectangle():
            return shapes.Rectangle(np.array(model.center), np.array(model.half_u), np.array(model.half_v))
        case Disk():
            return shapes.Disk(np.array(model.center), np.array(model.normal), model.radius)
        case Sphere():
            return shapes.Sphere(np.array(model.center), model.radius)
        case Mesh():
            return shapes.Mesh(np.array(model.vertices), np.array(model.triangles))


# -------------------------------------------------------------------------------------------- emitters


class AreaEmitter(Model):
    """What all shapes that shine have: diffuse radiance [W/(m^2 sr)] on the front, or on both sides."""

    radiance: Radiance
    two_sided: TwoSided = False


class PolygonEmitter(AreaEmitter, Polygon):
    """A polygon that shines."""


class RectangleEmitter(AreaEmitter, Rectangle):
    """A rectangle that shines."""


class DiskEmitter(AreaEmitter, Disk):
    """A disk that shines."""


class SphereEmitter(AreaEmitter, Sphere):
    """A sphere that shines."""


class MeshEmitter(AreaEmitter, Mesh):
    """A mesh that shines; its triangles do not hide each other."""


class PointEmitter(Model):
    """A point with the same intensity [W/sr] in every direction."""

    type: Literal["point"] = "point"
    position: Vector
    intensity: Intensity


class SpotEmitter(Model):
    """A point that shines into a cone: full within `beam_width`, linear in the angle to 0 at `cutoff_angle`.

    Both are half angles [rad]; the intensity is W/sr.
    """

    type: Literal["spot"] = "spot"
    position: Vector
    direction: UnitVector
    intensity: Intensity
    beam_width: Angle
    cutoff_angle: Angle


class DirectionalEmitter(Model):
    """Parallel light along `direction`; `irradiance` [W/m^2] is that of a surface facing it."""

    type: Literal["directional"] = "directional"
    direction: UnitVector
    irradiance: Radiance


class LineEmitter(Model):
    """A line that shines like a thin diffuse tube, with intensity [W/(sr m)] across it for each metre."""

    type: Literal["line"] = "line"
    start: Vector
    end: Vector
    intensity_per_length: Annotated[Light, Field(description="W/(sr m)")]


class ConstantEmitter(Model):
    """An infinitely distant environment with the same radiance [W/(m^2 sr)] everywhere."""

    type: Literal["constant"] = "constant"
    radiance: Radiance


class CosineSkyEmitter(Model):
    """A sky around `up`, linear in the sine of the elevation from `horizon` to `zenith` [W/(m^2 sr)]; black ground."""

    type: Literal["cosine_sky"] = "cosine_sky"
    up: UnitVector
    horizon: Radiance
    zenith: Radiance


class OvercastSkyEmitter(Model):
    """The CIE standard overcast sky around `up`, with `zenith` radiance [W/(m^2 sr)]; the ground is black."""

    type: Literal["overcast_sky"] = "overcast_sky"
    up: UnitVector
    zenith: Radiance


class MapEmitter(Model):
    """An equirectangular environment map: rows of texels [W/(m^2 sr)] from the pole `up` to the other one.

    Columns begin at the meridian through `front` and go round `up` counter-clockwise seen from above.
    """

    type: Literal["map"] = "map"
    radiance: Annotated[tuple[Annotated[tuple[Light, ...], Field(min_length=1)], ...], Field(min_length=1)]
    up: UnitVector
    front: UnitVector


Emitter: TypeAlias = Annotated[
    PolygonEmitter
    | RectangleEmitter
    | DiskEmitter
    | SphereEmitter
    | MeshEmitter
    | PointEmitter
    | SpotEmitter
    | DirectionalEmitter
    | LineEmitter
    | ConstantEmitter
    | CosineSkyEmitter
    | OvercastSkyEmitter
    | MapEmitter,
    Field(discriminator="type"),
]


def emitter_of(model: Emitter) -> emitters.Emitter:
    """The emitter of `oracle` that a model describes; raises InvalidArgument."""
    match model:
        case PolygonEmitter() | RectangleEmitter() | DiskEmitter() | SphereEmitter() | MeshEmitter():
            return emitters.Area(shape_of(model), channels(model.radiance), model.two_sided)
        case PointEmitter():
            return emitters.Point(np.array(model.position), channels(model.intensity))
        case SpotEmitter():
            return emitters.Spot(
                np.array(model.position),
                np.array(model.direction),
                channels(model.intensity),
                model.beam_width,
                model.cutoff_angle,
            )
        case DirectionalEmitter():
            return emitters.Directional(np.array(model.direction), channels(model.irradiance))
        case LineEmitter():
            return emitters.Line(np.array(model.start), np.array(model.end), channels(model.intensity_per_length))
        case ConstantEmitter():
            return emitters.Constant(channels(model.radiance))
        case CosineSkyEmitter():
            return emitters.CosineSky(np.array(model.up), channels(model.horizon), channels(model.zenith))
        case OvercastSkyEmitter():
            return emitters.CosineSky.cie_overcast(np.array(model.up), channels(model.zenith))
        case MapEmitter():
            return emitters.Equirectangular(_texels(model), np.array(model.up), np.array(model.front))


def amount_of(model: Emitter) -> float | tuple[float, ...]:
    """The amount of light of an emitter in the form in which it was given: a number, or one for each channel."""
    match model:
        case PointEmitter() | SpotEmitter():
            return model.intensity
        case DirectionalEmitter():
            return model.irradiance
        case LineEmitter():
            return model.intensity_per_length
        case CosineSkyEmitter() | OvercastSkyEmitter():
            return model.zenith
        case MapEmitter():
            return model.radiance[0][0]
        case _:
            return model.radiance


def channels(amount: float | tuple[float, ...]) -> Floats:
    """An amount of light as an array (C,); a single number is one channel."""
    return np.atleast_1d(np.array(amount, dtype=np.float64))


def _texels(model: MapEmitter) -> Floats:
    """Radiance (H, W, C) of a map."""
    widths = {len(row) for row in model.radiance}
    kinds = {len(channels(texel)) for row in model.radiance for texel in row}
    if len(widths) > 1 or len(kinds) > 1:
        raise InvalidArgument("radiance has rows of different lengths, or texels with different numbers of channels")
    return np.array([[channels(texel) for texel in row] for row in model.radiance])
