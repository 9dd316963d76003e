"""Sensors, film and the medium around them."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from reference_scenes import model
from reference_scenes.export.errors import CannotExport
from reference_scenes.export.mitsuba3.elements import (
    add_float,
    add_look_at,
    add_matrix,
    add_point,
    add_rgb,
    look_at,
)


def add_medium(root: Element, medium: model.Medium) -> None:
    """The medium, which the sensor refers to; as no surface bounds it, it fills all space."""
    extinction = np.add(medium.absorption, medium.scattering)
    # What is not 0 is at most 1, as Mitsuba wants of colours; the scale says the rest.
    scale = float(extinction.max()) or 1.0
    albedo = np.divide(medium.scattering, extinction, out=np.zeros(3), where=extinction > 0)
    element = SubElement(root, "medium", type="homogeneous", id="medium")
    add_rgb(element, "sigma_t", tuple(extinction / scale))
    add_float(element, "scale", scale)
    add_rgb(element, "albedo", tuple(albedo))
    add_float(SubElement(element, "phase", type="hg"), "g", medium.asymmetry)


def add_sensor(root: Element, scene: model.Scene) -> None:
    """The sensor with its film."""
    camera = scene.camera
    match camera:
        case model.Camera():
            sensor = SubElement(root, "sensor", type="perspective")
            add_float(sensor, "fov", camera.fov_x)
            SubElement(sensor, "string", name="fov_axis", value="x")
            _clip(sensor, camera)
            add_look_at(sensor, camera.origin, camera.target, camera.up)
        case model.OrthographicCamera():
            sensor = SubElement(root, "sensor", type="orthographic")
            _clip(sensor, camera)
            transform = SubElement(sensor, "transform", name="to_world")
            # Unscaled, the image is 2 wide.
            SubElement(transform, "scale", x=repr(camera.width / 2), y=repr(camera.width / 2))
            look_at(transform, camera.origin, camera.target, camera.up)
        case model.IrradianceMeter():
            _require_found_by_chance(scene)
            shape = SubElement(root, "shape", type="rectangle")
            u, v = np.array(camera.surface.half_u), np.array(camera.surface.half_v)
            normal = np.cross(u, v) / (np.linalg.norm(u) * np.linalg.norm(v))
            # Mitsuba's rows go along the second axis.
            add_matrix(shape, u, -v, normal, np.array(camera.surface.center))
            SubElement(shape, "bsdf", type="null")
            sensor = SubElement(shape, "sensor", type="irradiancemeter")
        case model.RadianceMeter():
            if (scene.film.width, scene.film.height) != (1, 1):
                raise CannotExport("/film", "mitsuba3 has radiance meters of one pixel; set width and height to 1")
            sensor = SubElement(root, "sensor", type="radiancemeter")
            add_point(sensor, "point", "origin", camera.origin)
            add_point(sensor, "vector", "direction", camera.direction)
    if scene.medium is not None:
        SubElement(sensor, "ref", id="medium")
    _film(sensor, scene.film)


def _require_found_by_chance(scene: model.Scene) -> None:
    for index, emitter in enumerate(scene.emitters):
        if isinstance(emitter, model.PointEmitter | model.SpotEmitter | model.DirectionalEmitter):
            raise CannotExport(
                f"/emitters/{index}/type",
                f"mitsuba3's irradiance meters do not see {emitter.type} emitters; take a small area emitter",
            )


def _clip(sensor: Element, camera: model.Camera | model.OrthographicCamera) -> None:
    extent = float(np.linalg.norm(np.subtract(camera.target, camera.origin)))
    add_float(sensor, "near_clip", 1e-4 * extent)
    add_float(sensor, "far_clip", 1e4 * extent)


def _film(sensor: Element, film: model.Film) -> None:
    sampler = SubElement(sensor, "sampler", type="independent")
    SubElement(sampler, "integer", name="sample_count", value="$spp")
    element = SubElement(sensor, "film", type="hdrfilm")
    SubElement(element, "integer", name="width", value=str(film.width))
    SubElement(element, "integer", name="height", value=str(film.height))
    SubElement(element, "string", name="pixel_format", value="rgb")
    SubElement(element, "string", name="component_format", value="float32")
    match film.filter:
        case model.BoxFilter():
            SubElement(element, "rfilter", type="box")
        case model.GaussianFilter(stddev=stddev):
            add_float(SubElement(element, "rfilter", type="gaussian"), "stddev", stddev)
