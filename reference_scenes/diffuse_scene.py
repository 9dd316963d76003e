"""Scenes of diffuse surfaces under uniform light, seen by a camera: what closed forms speak of."""

from __future__ import annotations

from dataclasses import dataclass

from reference_scenes import model


class NoClosedForm(ValueError):
    """The scene holds something that no closed form here covers; the message names it."""


@dataclass(frozen=True)
class Surface:
    """A shape with a reflectance."""

    shape: model.Shape
    reflectance: model.Vector


@dataclass(frozen=True)
class Light:
    """A shape whose front has a radiance [W/(m^2 sr)]."""

    shape: model.Shape
    radiance: model.Vector


Emitter = Light | model.PointEmitter | model.SpotEmitter | model.DirectionalEmitter | model.ConstantEmitter


@dataclass(frozen=True)
class DiffuseScene:
    """The parts of a scene, in their order."""

    surfaces: tuple[Surface, ...]
    emitters: tuple[Emitter, ...]
    camera: model.Camera
    film: model.Film


def diffuse_scene(scene: model.Scene) -> DiffuseScene:
    """Take a scene for one of diffuse surfaces under uniform light.

    Raises
    ------
    NoClosedForm
        If it holds anything else, or if the pixel filter is not a box. The message names the first such part.
    """
    if not isinstance(scene.film.filter, model.BoxFilter):
        raise NoClosedForm(f"/film/filter is {scene.film.filter.type}; closed forms need the box filter")
    if scene.medium is not None:
        raise NoClosedForm("/medium scatters or absorbs; closed forms of images need empty space")
    return DiffuseScene(
        tuple(_surface(f"/objects/{index}", scene_object) for index, scene_object in enumerate(scene.objects)),
        tuple(_emitter(f"/emitters/{index}", emitter) for index, emitter in enumerate(scene.emitters)),
        pinhole(scene),
        scene.film,
    )


def pinhole(scene: model.Scene) -> model.Camera:
    """The scene's camera; NoClosedForm if it has another sensor."""
    if not isinstance(scene.camera, model.Camera):
        raise NoClosedForm(f"/camera is {scene.camera.type}; closed forms of images need a perspective camera")
    return scene.camera


def _surface(where: str, scene_object: model.Object) -> Surface:
    shape, material = scene_object.shape, scene_object.material
    if isinstance(shape, model.Instances):
        raise NoClosedForm(f"{where}/shape holds instances, which may hide each other or light each other")
    if isinstance(shape, model.Mesh) and shape.normals is not None:
        raise NoClosedForm(f"{where}/shape/normals bend it; closed forms need the surface as it is")
    if not isinstance(material, model.Diffuse):
        raise NoClosedForm(f"{where}/material is {material.type}; closed forms of images need diffuse")
    return Surface(shape, _uniform(f"{where}/material/reflectance", material.reflectance))


def _emitter(where: str, emitter: model.Emitter) -> Emitter:
    match emitter:
        case model.AreaEmitter():
            if emitter.two_sided:
                raise NoClosedForm(f"{where}/two_sided is true; closed forms of images need light from the front alone")
            return Light(emitter.shape, _uniform(f"{where}/radiance", emitter.radiance))
        case model.SkyEmitter() | model.ImageEmitter():
            raise NoClosedForm(f"{where} is {emitter.type}; closed forms of images need a constant environment")
        case _:
            return emitter


def _uniform(where: str, colour: model.Vector | model.Texture) -> model.Vector:
    if isinstance(colour, model.Bitmap | model.Checker):
        raise NoClosedForm(f"{where} is a texture; closed forms of images need one colour")
    return colour
