"""Emitters."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model
from reference_scenes.export.errors import CannotExport
from reference_scenes.export.mitsuba3.elements import add_float, add_look_at, add_matrix, add_point, add_rgb
from reference_scenes.export.mitsuba3.files import Files
from reference_scenes.export.mitsuba3.maps import image_map, sky_map
from reference_scenes.export.mitsuba3.materials import add_emission
from reference_scenes.export.mitsuba3.shapes import add_shape

# How far apart the two sides of a two-sided emitter are, relative to its size and to its coordinates: enough for
# single precision to tell which one a ray meets first.
_THICKNESS = 1e-4
_RESOLVED = 1e-6


def add_emitter(root: Element, emitter: model.Emitter, where: str, files: Files, constant_before: bool) -> None:
    """An emitter; `where` is its place in the scene."""
    match emitter:
        case model.AreaEmitter():
            sides = [emitter.shape]
            if emitter.two_sided:
                sides.append(_back(emitter.shape, where))
            for index, side in enumerate(sides):
                shape = add_shape(root, side, files)
                if index:
                    SubElement(shape, "boolean", name="flip_normals", value="true")
                add_rgb(SubElement(shape, "bsdf", type="diffuse"), "reflectance", (0.0, 0.0, 0.0))
                add_emission(SubElement(shape, "emitter", type="area"), "radiance", emitter.radiance, files)
        case model.PointEmitter():
            element = SubElement(root, "emitter", type="point")
            add_point(element, "point", "position", emitter.position)
            add_rgb(element, "intensity", emitter.intensity)
        case model.SpotEmitter():
            element = SubElement(root, "emitter", type="spot")
            x, y, z = (float(number) for number in np.add(emitter.position, emitter.direction))
            up = np.eye(3)[np.abs(emitter.direction).argmin()]
            add_look_at(element, emitter.position, (x, y, z), tuple(up))
            add_rgb(element, "intensity", emitter.intensity)
            add_float(element, "cutoff_angle", emitter.cutoff_angle)
            add_float(element, "beam_width", emitter.beam_width)
        case model.DirectionalEmitter():
            element = SubElement(root, "emitter", type="directional")
            add_point(element, "vector", "direction", emitter.direction)
            add_rgb(element, "irradiance", emitter.irradiance)
        case model.ConstantEmitter():
            if constant_before:
                raise CannotExport(
                    where, "mitsuba3 has room for one environment; add its radiance to that of the other"
                )
            add_rgb(SubElement(root, "emitter", type="constant"), "radiance", emitter.radiance)
        case model.SkyEmitter():
            up = np.array(emitter.up) / np.linalg.norm(emitter.up)
            helper = np.eye(3)[np.abs(up).argmin()]
            front = np.cross(up, helper) / np.linalg.norm(np.cross(up, helper))
            _environment(root, sky_map(emitter), up, front, files)
        case model.ImageEmitter():
            up, front = np.array(emitter.up), np.array(emitter.front)
            texels = image_map(emitter.radiance.array)
            _environment(root, texels, up / np.linalg.norm(up), front / np.linalg.norm(front), files)


def _environment(root: Element, texels: Floats, up: Floats, front: Floats, files: Files) -> None:
    element = SubElement(root, "emitter", type="envmap")
    SubElement(element, "string", name="filename", value=files.image(texels))
    # Mitsuba's map begins at -z and goes round y clockwise seen from above, that is by +x.
    add_matrix(element, np.cross(front, up), up, -front, np.zeros(3))


def _back(shape: model.Shape, where: str) -> model.Shape:
    """The same shape, moved back by a little; with its normals flipped it is the other side."""
    match shape:
        case model.Rectangle():
            u, v = np.array(shape.half_u), np.array(shape.half_v)
            gap = _gap(float(min(np.linalg.norm(u), np.linalg.norm(v))), shape.center)
            return shape.model_copy(update={"center": _moved(shape.center, -gap, np.cross(u, v))})
        case model.Disk():
            gap = _gap(shape.radius, shape.center)
            return shape.model_copy(update={"center": _moved(shape.center, -gap, np.array(shape.normal))})
        case model.Sphere():
            return shape.model_copy(update={"radius": shape.radius - _gap(shape.radius, shape.center)})
        case model.Mesh():
            raise CannotExport(
                f"{where}/two_sided", "mitsuba3 has no two-sided emitters; turn copies of the triangles around"
            )


def _gap(size: float, center: model.Vector) -> float:
    return _THICKNESS * size + _RESOLVED * max(map(abs, center))


def _moved(point: model.Vector, distance: float, along: Floats) -> model.Vector:
    x, y, z = (float(number) for number in point + distance * along / np.linalg.norm(along))
    return (x, y, z)
