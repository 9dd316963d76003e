"""A scene in the words of the reference tracer: the same things with angles in radians.

Importing this module needs the tracer's extension, which nothing else here does.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from oracle import emitters, media, shapes
from oracle.arrays import Floats, direction
from oracle.tracer import scene as tracer
from reference_scenes import model

_Free: TypeAlias = emitters.Point | emitters.Spot | emitters.Directional | tracer.Environment


def to_tracer(scene: model.Scene) -> tuple[tracer.Scene, tracer.Sensor, tracer.Film]:
    """Translate a scene.

    Parameters
    ----------
    scene : Scene
        Any; angles in degrees.

    Returns
    -------
    tuple
        Scene, sensor and film as `oracle.tracer.scene` defines them; angles in radians. Area emitters follow the
        objects; several constant environments become one.

    Raises
    ------
    InvalidArgument
        If a mesh holds a triangle that float64 hardly tells from a line; the message names the triangle.
    """
    objects = [_object(one) for one in scene.objects]
    objects += [_shining(one) for one in scene.emitters if isinstance(one, model.AreaEmitter)]
    free = [_emitter(one) for one in scene.emitters if not isinstance(one, model.AreaEmitter | model.ConstantEmitter)]
    constant = [one.radiance for one in scene.emitters if isinstance(one, model.ConstantEmitter)]
    if constant:
        free.append(emitters.Constant(np.sum(constant, axis=0)))
    return tracer.Scene(objects, free, _medium(scene.medium)), _sensor(scene.camera), _film(scene.film)


# -------------------------------------------------------------------------------------------------- objects


def _object(scene_object: model.Object) -> tracer.Object | tracer.Instances:
    shape, material = scene_object.shape, _material(scene_object.material)
    if isinstance(shape, model.Instances):
        return tracer.Instances(_mesh(shape.mesh), material, np.array(shape.transforms))
    return tracer.Object(_shape(shape), material)


def _shining(emitter: model.AreaEmitter) -> tracer.Object:
    return tracer.Object(_shape(emitter.shape), None, _colours(emitter.radiance), emitter.two_sided)


def _shape(shape: model.Shape) -> shapes.Rectangle | shapes.Disk | shapes.Sphere | shapes.Mesh:
    match shape:
        case model.Rectangle():
            return _rectangle(shape)
        case model.Disk():
            return shapes.Disk(np.array(shape.center), _unit(shape.normal), shape.radius)
        case model.Sphere():
            return shapes.Sphere(np.array(shape.center), shape.radius)
        case model.Mesh():
            return _mesh(shape)


def _rectangle(shape: model.Rectangle) -> shapes.Rectangle:
    return shapes.Rectangle(np.array(shape.center), np.array(shape.half_u), np.array(shape.half_v))


def _mesh(mesh: model.Mesh) -> shapes.Mesh:
    normals = None if mesh.normals is None else _unit(mesh.normals)
    uv = None if mesh.uv is None else np.array(mesh.uv)
    return shapes.Mesh(np.array(mesh.vertices), np.array(mesh.triangles), normals, uv)


# ------------------------------------------------------------------------------------------------ materials


def _material(material: model.Material) -> tracer.Material:
    match material:
        case model.TwoSided():
            return tracer.TwoSided(_side(material.front), None if material.back is None else _side(material.back))
        case model.Mix():
            return _mix(material)
        case _:
            return _unmixed(material)


def _side(material: model.Opaque) -> tracer.Opaque:
    return _mix(material) if isinstance(material, model.Mix) else _reflecting(material)


def _mix(mix: model.Mix) -> tracer.Mix:
    return tracer.Mix(_unmixed(mix.first), _unmixed(mix.second), mix.weight)


def _unmixed(material: model.Unmixed) -> tracer.Unmixed:
    match material:
        case model.Dielectric():
            return tracer.Dielectric(material.eta)
        case model.RoughDielectric():
            return tracer.RoughDielectric(material.eta, material.alpha, material.separable)
        case _:
            return _reflecting(material)


def _reflecting(
    material: model.Diffuse | model.Mirror | model.Conductor | model.RoughConductor | model.Phong | model.Plastic,
) -> tracer.Diffuse | tracer.Mirror | tracer.Conductor | tracer.RoughConductor | tracer.Phong | tracer.Plastic:
    match material:
        case model.Diffuse():
            return tracer.Diffuse(_colours(material.reflectance))
        case model.Mirror():
            return tracer.Mirror(_colours(material.reflectance))
        case model.Conductor():
            return tracer.Conductor(np.array(material.eta), np.array(material.k))
        case model.RoughConductor():
            return tracer.RoughConductor(
                np.array(material.eta), np.array(material.k), material.alpha, material.separable
            )
        case model.Phong():
            return tracer.Phong(_colours(material.reflectance), material.exponent)
        case model.Plastic():
            return tracer.Plastic(_colours(material.reflectance), material.eta)


def _colours(colours: model.Vector | model.Texture) -> Floats | tracer.Texture:
    match colours:
        case model.Bitmap():
            return tracer.Bitmap(colours.texels.array, colours.smooth)
        case model.Checker():
            return tracer.Checker(np.array(colours.even), np.array(colours.odd), colours.columns, colours.rows)
        case _:
            return np.array(colours)


# -------------------------------------------------------------------------------------- emitters and sensors


def _emitter(
    emitter: model.PointEmitter | model.SpotEmitter | model.DirectionalEmitter | model.SkyEmitter | model.ImageEmitter,
) -> _Free:
    match emitter:
        case model.PointEmitter():
            return emitters.Point(np.array(emitter.position), np.array(emitter.intensity))
        case model.SpotEmitter():
            return emitters.Spot(
                np.array(emitter.position),
                _unit(emitter.direction),
                np.array(emitter.intensity),
                np.radians(emitter.beam_width),
                np.radians(emitter.cutoff_angle),
            )
        case model.DirectionalEmitter():
            return emitters.Directional(_unit(emitter.direction), np.array(emitter.irradiance))
        case model.SkyEmitter(horizon=None):
            return emitters.CosineSky.cie_overcast(_unit(emitter.up), np.array(emitter.zenith))
        case model.SkyEmitter():
            return emitters.CosineSky(_unit(emitter.up), np.array(emitter.horizon), np.array(emitter.zenith))
        case model.ImageEmitter():
            return emitters.Equirectangular(emitter.radiance.array, _unit(emitter.up), _unit(emitter.front))


def _medium(medium: model.Medium | None) -> media.Medium | None:
    if medium is None:
        return None
    return media.Medium(np.array(medium.absorption), np.array(medium.scattering), medium.asymmetry)


def _sensor(sensor: model.Sensor) -> tracer.Sensor:
    match sensor:
        case model.Camera():
            origin, target, up = np.array(sensor.origin), np.array(sensor.target), np.array(sensor.up)
            return tracer.Perspective(origin, target, up, float(np.radians(sensor.fov_x)))
        case model.OrthographicCamera():
            origin, target, up = np.array(sensor.origin), np.array(sensor.target), np.array(sensor.up)
            return tracer.Orthographic(origin, target, up, sensor.width)
        case model.IrradianceMeter():
            return tracer.IrradianceMeter(_rectangle(sensor.surface))
        case model.RadianceMeter():
            return tracer.RadianceMeter(np.array(sensor.origin), _unit(sensor.direction))


def _film(film: model.Film) -> tracer.Film:
    stddev = film.filter.stddev if isinstance(film.filter, model.GaussianFilter) else 0.0
    return tracer.Film(film.width, film.height, stddev)


def _unit(vectors: model.Vector | tuple[model.Vector, ...]) -> Floats:
    return direction("direction", vectors, any_length=True)
