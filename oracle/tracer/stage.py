"""From the description of a scene to what the extension renders; errors name the object at fault."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeAlias

import numpy as np

from oracle.arrays import Floats, InvalidArgument
from oracle.emitters import Constant, CosineSky, Directional, Equirectangular, Point, Spot
from oracle.shapes import Disk, Mesh, Rectangle, Sphere
from oracle.tracer import _core
from oracle.tracer import scene as description
from oracle.tracer.scene import Material, Texture

_Triple: TypeAlias = tuple[float, float, float]


def build(scene: description.Scene) -> _core.Stage:
    """Hand a scene over to the extension, which builds its hierarchies.

    Raises
    ------
    InvalidArgument
        If something does not fit single precision; the message names the object or emitter.
    """
    stage = _core.Stage()
    parts = _Parts(stage)
    for index, one in enumerate(scene.objects):
        with _named(f"objects[{index}]"):
            parts.add(one)
    for index, emitter in enumerate(scene.emitters):
        with _named(f"emitters[{index}]"):
            _add_emitter(stage, emitter)
    if scene.medium is not None:
        with _named("medium"):
            absorption, scattering = scene.medium.absorption, scene.medium.scattering
            stage.set_medium(_triple(absorption), _triple(scattering), scene.medium.asymmetry)
    stage.commit()
    return stage


@contextmanager
def _named(name: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise InvalidArgument(f"{name}: {error}") from None


class _Parts:
    """Objects with their materials and textures; each of these is handed over once, however many share it."""

    def __init__(self, stage: _core.Stage) -> None:
        self._stage = stage
        self._numbers: dict[int, int] = {}
        self._seen: list[Material | Texture] = []  # kept, so that no other object gets the same id

    def add(self, one: description.Object | description.Instances) -> None:
        material = -1 if one.material is None else self._material(one.material)
        if isinstance(one, description.Instances):
            number = self._stage.add_object(material, None, False)
            mesh = one.mesh
            self._stage.add_instances(number, mesh.vertices, mesh.triangles, mesh.normals, mesh.uv, one.transforms)
            return
        radiance = None if one.radiance is None else self._colours(one.radiance)
        number = self._stage.add_object(material, radiance, one.two_sided)
        match one.shape:
            case Mesh(vertices, triangles, normals, uv):
                self._stage.add_mesh(number, vertices, triangles, normals, uv)
            case Rectangle(center, half_u, half_v):
                self._stage.add_rectangle(number, _triple(center), _triple(half_u), _triple(half_v))
            case Disk(center, normal, radius):
                self._stage.add_disk(number, _triple(center), _triple(normal), radius)
            case Sphere(center, radius):
                self._stage.add_sphere(number, _triple(center), radius)

    def _once(self, thing: Material | Texture, number: int) -> int:
        self._numbers[id(thing)] = number
        self._seen.append(thing)
        return number

    def _colours(self, value: Floats | Texture) -> _Triple | int:
        if not isinstance(value, description.Texture):
            return _triple(value)
        if id(value) in self._numbers:
            return self._numbers[id(value)]
        if isinstance(value, description.Bitmap):
            return self._once(value, self._stage.add_bitmap(value.texels, value.smooth))
        even, odd = _triple(value.even), _triple(value.odd)
        return self._once(value, self._stage.add_checker(even, odd, value.columns, value.rows))

    def _material(self, material: Material) -> int:
        if id(material) in self._numbers:
            return self._numbers[id(material)]
        add = self._stage.add_material
        match material:
            case description.Diffuse(reflectance):
                number = add("diffuse", reflectance=self._colours(reflectance))
            case description.Mirror(reflectance):
                number = add("mirror", reflectance=self._colours(reflectance))
            case description.Dielectric(eta):
                number = add("dielectric", ior=eta)
            case description.Conductor(eta, k):
                number = add("conductor", eta=_triple(eta), k=_triple(k))
            case description.RoughConductor(eta, k, alpha, separable):
                number = add("rough_conductor", eta=_triple(eta), k=_triple(k), alpha=alpha, separable=separable)
            case description.RoughDielectric(eta, alpha, separable):
                number = add("rough_dielectric", ior=eta, alpha=alpha, separable=separable)
            case description.Phong(reflectance, exponent):
                number = add("phong", reflectance=self._colours(reflectance), exponent=exponent)
            case description.Plastic(reflectance, eta):
                number = add("plastic", reflectance=self._colours(reflectance), ior=eta)
            case description.TwoSided(front, back):
                first = self._material(front)
                number = add("two_sided", first=first, second=first if back is None else self._material(back))
            case description.Mix(one, other, weight):
                number = add("mix", first=self._material(one), second=self._material(other), weight=weight)
        return self._once(material, number)


def _add_emitter(stage: _core.Stage, emitter: Point | Spot | Directional | description.Environment) -> None:
    match emitter:
        case Point(position, intensity):
            stage.add_point(_triple(position), _triple(intensity))
        case Spot(position, direction, intensity, beam_width, cutoff_angle):
            stage.add_spot(_triple(position), _triple(direction), _triple(intensity), beam_width, cutoff_angle)
        case Directional(direction, irradiance):
            stage.add_directional(_triple(direction), _triple(irradiance))
        case Constant(radiance):
            stage.set_constant(_triple(radiance))
        case CosineSky(up, horizon, zenith):
            stage.set_sky(_triple(up), _triple(horizon), _triple(zenith))
        case Equirectangular(radiance, up, front):
            stage.set_map(radiance, _triple(up), _triple(front))


def _triple(value: Floats) -> _Triple:
    if np.shape(value) != (3,):
        raise InvalidArgument(f"has {np.shape(value)} numbers where the tracer needs 3, one for each channel or axis")
    x, y, z = (float(number) for number in value)
    return x, y, z


def brightest(scene: description.Scene) -> float:
    """The largest radiance, intensity or irradiance of any emitter; 1 in the dark."""
    found = [0.0]
    for one in scene.objects:
        if isinstance(one, description.Object) and one.radiance is not None:
            match one.radiance:
                case description.Bitmap(texels):
                    found.append(float(texels.max()))
                case description.Checker(even, odd):
                    found.append(float(max(even.max(), odd.max())))
                case radiance:
                    found.append(float(radiance.max()))
    for emitter in scene.emitters:
        match emitter:
            case Point() | Spot():
                found.append(float(emitter.intensity.max()))
            case Directional():
                found.append(float(emitter.irradiance.max()))
            case CosineSky():
                found.append(float(max(emitter.zenith.max(), emitter.horizon.max())))
            case Constant() | Equirectangular():
                found.append(float(emitter.radiance.max()))
    return max(found) or 1.0


def sensor(what: description.Sensor, film: description.Film) -> _core.Sensor:
    """A sensor as the origin and the two edges of what it sees."""
    aspect = film.height / film.width
    match what:
        case description.Perspective() | description.Orthographic():
            forward = what.target - what.origin
            forward = forward / np.linalg.norm(forward)
            right = np.cross(forward, what.up)
            right = right / np.linalg.norm(right)
            down = np.cross(forward, right)
            width = what.width if isinstance(what, description.Orthographic) else 2 * np.tan(what.fov_x / 2)
            kind = "orthographic" if isinstance(what, description.Orthographic) else "perspective"
            edges = width * right, width * aspect * down
            return _core.Sensor(kind, _triple(what.origin), _triple(forward), _triple(edges[0]), _triple(edges[1]))
        case description.IrradianceMeter(surface):
            corner = surface.center - surface.half_u + surface.half_v
            edges = 2 * surface.half_u, -2 * surface.half_v
            normal = _triple(surface.normal)
            return _core.Sensor("irradiance_meter", _triple(corner), normal, _triple(edges[0]), _triple(edges[1]))
        case description.RadianceMeter(origin, direction):
            nothing = (0.0, 0.0, 0.0)
            return _core.Sensor("radiance_meter", _triple(origin), _triple(direction), nothing, nothing)
