"""Mitsuba 3 XML with PLY meshes.

Emitters that are surfaces get a black BSDF, so that they reflect nothing in any version of the renderer.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model
from reference_scenes.export.ply import write_ply


def write(scene: model.Scene, path: Path) -> None:
    """Write the scene as XML; meshes go beside it as mesh_0.ply, mesh_1.ply, ..."""
    root = Element("scene", version="3.0.0")
    SubElement(root, "default", name="spp", value="64")
    SubElement(root, "integrator", type="path")
    _sensor(root, scene)
    meshes: list[model.Mesh] = []
    for scene_object in scene.objects:
        shape = _shape(root, scene_object.shape, meshes)
        _diffuse(shape, scene_object.material.reflectance)
    for emitter in scene.emitters:
        _emitter(root, emitter, meshes)
    for index, mesh in enumerate(meshes):
        write_ply(mesh, path.with_name(f"mesh_{index}.ply"))
    ElementTree.indent(root)
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _sensor(root: Element, scene: model.Scene) -> None:
    sensor = SubElement(root, "sensor", type="perspective")
    _float(sensor, "fov", scene.camera.fov_x)
    SubElement(sensor, "string", name="fov_axis", value="x")
    extent = float(np.linalg.norm(np.subtract(scene.camera.target, scene.camera.origin)))
    _float(sensor, "near_clip", 1e-4 * extent)
    _float(sensor, "far_clip", 1e4 * extent)
    _look_at(sensor, scene.camera.origin, scene.camera.target, scene.camera.up)
    sampler = SubElement(sensor, "sampler", type="independent")
    SubElement(sampler, "integer", name="sample_count", value="$spp")
    film = SubElement(sensor, "film", type="hdrfilm")
    SubElement(film, "integer", name="width", value=str(scene.film.width))
    SubElement(film, "integer", name="height", value=str(scene.film.height))
    SubElement(film, "string", name="pixel_format", value="rgb")
    SubElement(film, "string", name="component_format", value="float32")
    match scene.film.filter:
        case model.BoxFilter():
            SubElement(film, "rfilter", type="box")
        case model.GaussianFilter(stddev=stddev):
            _float(SubElement(film, "rfilter", type="gaussian"), "stddev", stddev)


def _shape(parent: Element, shape: model.Shape, meshes: list[model.Mesh]) -> Element:
    match shape:
        case model.Rectangle():
            element = SubElement(parent, "shape", type="rectangle")
            u, v = np.array(shape.half_u), np.array(shape.half_v)
            normal = np.cross(u, v) / (np.linalg.norm(u) * np.linalg.norm(v))
            _matrix(element, u, v, normal, np.array(shape.center))
        case model.Disk():
            element = SubElement(parent, "shape", type="disk")
            normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
            u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
            u *= shape.radius / np.linalg.norm(u)
            _matrix(element, u, np.cross(normal, u), normal, np.array(shape.center))
        case model.Sphere():
            element = SubElement(parent, "shape", type="sphere")
            x, y, z = shape.center
            SubElement(element, "point", name="center", x=repr(x), y=repr(y), z=repr(z))
            _float(element, "radius", shape.radius)
        case model.Mesh():
            element = SubElement(parent, "shape", type="ply")
            SubElement(element, "string", name="filename", value=f"mesh_{len(meshes)}.ply")
            SubElement(element, "boolean", name="face_normals", value="true")
            meshes.append(shape)
    return element


def _emitter(root: Element, emitter: model.Emitter, meshes: list[model.Mesh]) -> None:
    match emitter:
        case model.AreaEmitter():
            shape = _shape(root, emitter.shape, meshes)
            _diffuse(shape, (0.0, 0.0, 0.0))
            _rgb(SubElement(shape, "emitter", type="area"), "radiance", emitter.radiance)
        case model.PointEmitter():
            element = SubElement(root, "emitter", type="point")
            x, y, z = emitter.position
            SubElement(element, "point", name="position", x=repr(x), y=repr(y), z=repr(z))
            _rgb(element, "intensity", emitter.intensity)
        case model.SpotEmitter():
            element = SubElement(root, "emitter", type="spot")
            target = np.add(emitter.position, emitter.direction)
            up = np.eye(3)[np.abs(emitter.direction).argmin()]
            _look_at(element, emitter.position, tuple(target), tuple(up))
            _rgb(element, "intensity", emitter.intensity)
            _float(element, "cutoff_angle", emitter.cutoff_angle)
            _float(element, "beam_width", emitter.beam_width)
        case model.DirectionalEmitter():
            element = SubElement(root, "emitter", type="directional")
            x, y, z = emitter.direction
            SubElement(element, "vector", name="direction", x=repr(x), y=repr(y), z=repr(z))
            _rgb(element, "irradiance", emitter.irradiance)
        case model.ConstantEmitter():
            _rgb(SubElement(root, "emitter", type="constant"), "radiance", emitter.radiance)


def _diffuse(shape: Element, reflectance: model.Vector) -> None:
    _rgb(SubElement(shape, "bsdf", type="diffuse"), "reflectance", reflectance)


def _look_at(parent: Element, origin: model.Vector, target: model.Vector, up: model.Vector) -> None:
    transform = SubElement(parent, "transform", name="to_world")
    SubElement(transform, "lookat", origin=_list(origin), target=_list(target), up=_list(up))


def _matrix(parent: Element, u: Floats, v: Floats, w: Floats, translation: Floats) -> None:
    rows = np.vstack([np.column_stack([u, v, w, translation]), [0.0, 0.0, 0.0, 1.0]])
    transform = SubElement(parent, "transform", name="to_world")
    SubElement(transform, "matrix", value=" ".join(repr(float(number)) for number in rows.ravel()))


def _rgb(parent: Element, name: str, value: model.Vector) -> None:
    SubElement(parent, "rgb", name=name, value=_list(value))


def _float(parent: Element, name: str, value: float) -> None:
    SubElement(parent, "float", name=name, value=repr(float(value)))


def _list(vector: model.Vector) -> str:
    return ", ".join(repr(float(number)) for number in vector)
