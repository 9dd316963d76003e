"""The expectation of a scene in closed form: direct light on convex diffuse surfaces, integrated over pixels.

The closed forms of `oracle.irradiances` hold while nothing but the receiver's own horizon hides an area emitter and
no surface lights another. `require_closed_form` proves both for a scene or names what stands in the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle import emitters, intersection, pixels
from oracle import shapes as oracle_shapes
from oracle.arrays import Booleans, Floats, Integers, direction
from oracle.emitters import Receivers
from oracle.expectation import Expectation, Provenance
from oracle.irradiances import irradiance
from reference_scenes import model
from reference_scenes.diffuse_scene import DiffuseScene, Emitter, Light, NoClosedForm, diffuse_scene, pinhole

__all__ = ["NoClosedForm", "camera_rays", "closed_form", "film_radiance", "hit_shape", "require_closed_form"]

# A ray that starts on a surface must not meet it again; relative to the size of the coordinates involved.
_RAY_EPSILON = 1e-9
# A pixel whose integral is known less well than this, relative to its radiance or the image's, is not judged: the
# error has to stay well below any sensible tolerance.
_WORST_ERROR = 5e-4
# Labels are hashed modulo 2^64, so that the states of any number of emitters fit into one.
_MIX = 6364136223846793005


# ------------------------------------------------------------------------------------------------ camera


def camera_rays(scene: model.Scene, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Rays through film positions (pixel (0, 0) spans [0, 1] x [0, 1], top left); directions are not normalised."""
    camera, film = pinhole(scene), scene.film
    origin = np.array(camera.origin)
    forward = np.array(camera.target) - origin
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    scale = 2 * np.tan(np.radians(camera.fov_x) / 2) / film.width
    horizontal = (x - film.width / 2) * scale
    vertical = (y - film.height / 2) * scale
    directions = forward + horizontal[:, None] * right + vertical[:, None] * down
    return np.broadcast_to(origin, directions.shape), directions


# ------------------------------------------------------------------------------------------------ shapes


def hit_shape(
    shape: model.Shape, origins: Floats, directions: Floats, t_min: float = 0.0
) -> tuple[Floats, Floats, Integers]:
    """First hit of rays with a shape: ray parameter (infinity for none), unit geometric normal, index of the face."""
    face = np.zeros(len(origins), dtype=np.int64)
    match shape:
        case model.Rectangle():
            u, v = np.array(shape.half_u), np.array(shape.half_v)
            t = intersection.rectangle(origins, directions, np.array(shape.center), u, v, t_min)
            normal = np.cross(u, v) / (np.linalg.norm(u) * np.linalg.norm(v))
            return t, np.broadcast_to(normal, origins.shape), face
        case model.Disk():
            normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
            t = intersection.disk(origins, directions, np.array(shape.center), normal, shape.radius, t_min)
            return t, np.broadcast_to(normal, origins.shape), face
        case model.Sphere():
            center = np.array(shape.center)
            t = intersection.sphere(origins, directions, center, shape.radius, t_min)
            hits = origins + np.where(np.isfinite(t), t, 0.0)[:, None] * directions
            return t, (hits - center) / shape.radius, face
        case model.Mesh():
            vertices, triangles = np.array(shape.vertices), np.array(shape.triangles)
            t, face = intersection.mesh(origins, directions, vertices, triangles, t_min)
            corners = vertices[triangles]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            return t, normals[face], face


def _oracle_emitter(emitter: Emitter) -> emitters.Emitter:
    """The emitter of `oracle.emitters` that shines like one of the scene."""
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
        case model.ConstantEmitter():
            return emitters.Constant(np.array(emitter.radiance))
        case Light():
            radiance = np.array(emitter.radiance)
            match emitter.shape:
                case model.Rectangle() as shape:
                    return emitters.Area(oracle_shapes.Polygon(_rectangle_corners(shape)), radiance)
                case model.Disk() as shape:
                    normal = _unit(shape.normal)
                    return emitters.Area(oracle_shapes.Disk(np.array(shape.center), normal, shape.radius), radiance)
                case model.Sphere() as shape:
                    return emitters.Area(oracle_shapes.Sphere(np.array(shape.center), shape.radius), radiance)
                case model.Mesh() as shape:
                    return emitters.Area(
                        oracle_shapes.Mesh(np.array(shape.vertices), np.array(shape.triangles)), radiance
                    )


def _unit(vector: model.Vector) -> Floats:
    return direction("direction", vector, any_length=True)


def _rectangle_corners(shape: model.Rectangle) -> Floats:
    center, u, v = np.array(shape.center), np.array(shape.half_u), np.array(shape.half_v)
    return np.array([center - u - v, center + u - v, center + u + v, center - u + v])


# --------------------------------------------------------------------------------- when the forms hold


@dataclass(frozen=True)
class _Plane:
    """The plane of a flat shape, its front on the positive side."""

    point: Floats
    normal: Floats

    def has_behind(self, shape: model.Shape) -> bool:
        """Whether a shape lies wholly in the closed half space behind the plane."""
        slack = 1e-9 * (1 + float(np.abs(self.point).max()))
        return bool(_extent(shape, self.normal) <= self.normal @ self.point + slack)


def _extent(shape: model.Shape, directions: Floats) -> Floats:
    """Largest coordinate of a shape along unit directions (..., 3)."""
    match shape:
        case model.Rectangle():
            corners = _rectangle_corners(shape)
        case model.Mesh():
            corners = np.array(shape.vertices)
        case model.Disk():
            normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
            across = np.linalg.norm(np.cross(normal, directions), axis=-1)
            flat: Floats = directions @ np.array(shape.center) + shape.radius * across
            return flat
        case model.Sphere():
            round_: Floats = directions @ np.array(shape.center) + shape.radius
            return round_
    furthest: Floats = (directions @ corners.T).max(axis=-1)
    return furthest


def _plane_of(shape: model.Shape) -> _Plane | None:
    """The plane of a rectangle, disk or single triangle; None for other shapes."""
    match shape:
        case model.Rectangle():
            normal = np.cross(shape.half_u, shape.half_v)
            return _Plane(np.array(shape.center), normal / np.linalg.norm(normal))
        case model.Disk():
            return _Plane(np.array(shape.center), np.array(shape.normal) / np.linalg.norm(shape.normal))
        case model.Mesh() if len(shape.triangles) == 1:
            a, b, c = np.array(shape.vertices)[list(shape.triangles[0])]
            normal = np.cross(b - a, c - a)
            return _Plane(a, normal / np.linalg.norm(normal))
        case _:
            return None


def require_closed_form(scene: model.Scene) -> None:
    """Make sure that the closed forms hold for a scene, for any number of bounces.

    Raises
    ------
    NoClosedForm
        If there is more than diffuse surfaces and uniform emitters, a diffuse surface could light another or itself,
        anything could hide part of an area emitter or of the environment, the view is not a perspective one, or the
        pixel filter is not a box. The message names the parts of the scene.
    """
    _require_unhidden(diffuse_scene(scene))


def _require_unhidden(scene: DiffuseScene) -> None:
    reflecting = [(i, surface) for i, surface in enumerate(scene.surfaces) if max(surface.reflectance) > 0]
    for i, receiver in reflecting:
        where = f"/objects/{i}/shape"
        plane = _plane_of(receiver.shape)
        if plane is None and not isinstance(receiver.shape, model.Sphere):
            raise NoClosedForm(f"{where} reflects and may not be convex; use a rectangle, disk, sphere or triangle")
        for k, other in reflecting:
            if k != i and not (plane is not None and plane.has_behind(other.shape)):
                raise NoClosedForm(f"{where} and /objects/{k}/shape both reflect and may light each other")

    solids = [(f"/objects/{i}/shape", surface.shape) for i, surface in enumerate(scene.surfaces)]
    solids += [(f"/emitters/{i}/shape", e.shape) for i, e in enumerate(scene.emitters) if isinstance(e, Light)]
    for i, emitter in enumerate(scene.emitters):
        if not isinstance(emitter, Light | model.ConstantEmitter):
            continue
        light_plane = _plane_of(emitter.shape) if isinstance(emitter, Light) else None
        for k, receiver in reflecting:
            receiver_plane = _plane_of(receiver.shape)
            for name, solid in solids:
                if name in (f"/emitters/{i}/shape", f"/objects/{k}/shape"):
                    continue
                # What lies behind the light or below the receiver's horizon cannot come between them.
                if light_plane is not None and light_plane.has_behind(solid):
                    continue
                if receiver_plane is not None and receiver_plane.has_behind(solid):
                    continue
                raise NoClosedForm(f"{name} may hide /emitters/{i} from /objects/{k}")
        if isinstance(emitter, Light) and isinstance(emitter.shape, model.Mesh) and light_plane is None:
            raise NoClosedForm(f"/emitters/{i}/shape is a mesh of several triangles, which may hide each other")


# ------------------------------------------------------------------------------------- radiance on the film


def film_radiance(scene: model.Scene) -> pixels.Image:
    """Radiance at film positions, with labels of the visible surface and of what shines on it.

    Returns
    -------
    callable
        Film positions x, y (N,) to radiance [W/(m^2 sr)] (N, 3) and labels (N,), as `oracle.pixels.average` takes it.

    Raises
    ------
    NoClosedForm
        As `require_closed_form`.
    """
    diffuse = diffuse_scene(scene)
    _require_unhidden(diffuse)
    shapes = [surface.shape for surface in diffuse.surfaces]
    lights = [e for e in diffuse.emitters if isinstance(e, Light)]
    shapes += [e.shape for e in lights]
    background = np.zeros(3)
    for emitter in diffuse.emitters:
        if isinstance(emitter, model.ConstantEmitter):
            background += emitter.radiance

    def image(x: Floats, y: Floats) -> tuple[Floats, Integers]:
        origins, directions = camera_rays(scene, x, y)
        nearest, normal, surface = np.full(len(x), np.inf), np.zeros((len(x), 3)), np.full(len(x), -1)
        face = np.zeros(len(x), dtype=np.int64)
        for index, shape in enumerate(shapes):
            t, shape_normal, shape_face = hit_shape(shape, origins, directions)
            closer = t < nearest
            nearest = np.where(closer, t, nearest)
            normal = np.where(closer[:, None], shape_normal, normal)
            surface = np.where(closer, index, surface)
            face = np.where(closer, shape_face, face)
        front = np.einsum("ni,ni->n", normal, directions) < 0

        radiance = np.zeros((len(x), 3))
        radiance[surface == -1] = background
        lighting = np.zeros(len(x), dtype=np.int64)
        for index, seen_surface in enumerate(diffuse.surfaces):
            seen = (surface == index) & front
            if seen.any() and max(seen_surface.reflectance) > 0:
                points = origins[seen] + nearest[seen, None] * directions[seen]
                receivers = Receivers(points, normal[seen])
                irradiances, lighting[seen] = _direct_light(diffuse, shapes, receivers)
                radiance[seen] = np.array(seen_surface.reflectance) / np.pi * irradiances
        for index, light in enumerate(lights, start=len(diffuse.surfaces)):
            radiance[(surface == index) & front] = light.radiance
        # One integer from all of them; the face separates the triangles of a mesh.
        what = (face * (len(shapes) + 1) + surface + 1) * 2 + front
        return radiance, lighting * _MIX + what

    return image


def _direct_light(scene: DiffuseScene, shapes: list[model.Shape], receivers: Receivers) -> tuple[Floats, Integers]:
    """Irradiance (N, 3) of all emitters at receivers (N, 3), and a label of which of them are visible or cut."""
    total = np.zeros((len(receivers.points), 3))
    label = np.zeros(len(receivers.points), dtype=np.int64)
    for emitter in scene.emitters:
        match emitter:
            case model.PointEmitter() | model.SpotEmitter():
                towards = np.array(emitter.position) - receivers.points
                visible = ~_occluded(shapes, receivers.points, towards, 1.0)
                state = visible.astype(np.int64)
                if isinstance(emitter, model.SpotEmitter):
                    state += _cone_state(emitter, towards)
            case model.DirectionalEmitter():
                towards = np.broadcast_to(-np.array(emitter.direction), receivers.points.shape)
                visible = ~_occluded(shapes, receivers.points, towards, np.inf)
                state = visible.astype(np.int64)
            case Light():
                visible = np.ones(len(total), dtype=np.bool_)
                state = _cut_state(emitter.shape, receivers)
            case model.ConstantEmitter():
                visible = np.ones(len(total), dtype=np.bool_)
                state = np.zeros(len(total), dtype=np.int64)
        light = irradiance(_oracle_emitter(emitter), receivers).value
        total += np.where(visible[:, None], light, 0.0)
        label = label * _MIX + state
    return total, label


def _occluded(shapes: list[model.Shape], points: Floats, towards: Floats, t_max: float) -> Booleans:
    """Whether any shape lies on the way from points along directions, up to ray parameter `t_max`."""
    blocked = np.zeros(len(points), dtype=np.bool_)
    for shape in shapes:
        t, _, _ = hit_shape(shape, points, towards, _RAY_EPSILON)
        blocked |= t < t_max * (1 - _RAY_EPSILON)
    return blocked


def _cone_state(emitter: model.SpotEmitter, towards: Floats) -> Integers:
    """Whether a receiver lies within the beam and within the cone of a spot (2 and 4); the falloff has kinks there."""
    axis = np.array(emitter.direction) / np.linalg.norm(emitter.direction)
    cosine = -(towards @ axis) / np.linalg.norm(towards, axis=-1)
    in_beam = cosine > np.cos(np.radians(emitter.beam_width))
    in_cone = cosine > np.cos(np.radians(emitter.cutoff_angle))
    state: Integers = 2 * in_beam.astype(np.int64) + 4 * in_cone.astype(np.int64)
    return state


def _cut_state(shape: model.Shape, receivers: Receivers) -> Integers:
    """How an area emitter meets the receiver's horizon, and the receiver its plane (3 bits).

    The irradiance has kinks where these change.
    """
    height = np.einsum("ni,ni->n", receivers.points, receivers.normals)
    above = (_extent(shape, receivers.normals) > height).astype(np.int64)
    wholly_above = (-_extent(shape, -receivers.normals) >= height).astype(np.int64)
    state: Integers = 2 * above + wholly_above
    plane = _plane_of(shape)
    if plane is not None:
        state = state + 4 * ((receivers.points - plane.point) @ plane.normal > 0)
    return state


# ----------------------------------------------------------------------------------------- the expectation


def closed_form(scene: model.Scene, formulas: tuple[str, ...] = ()) -> Expectation:
    """The expected image of a scene, its radiance integrated over each pixel's square.

    Parameters
    ----------
    scene : Scene
        A scene for which `require_closed_form` holds.
    formulas : tuple of str
        Formulas with their sources, for the provenance.

    Raises
    ------
    NoClosedForm
        As `require_closed_form`.
    """
    radiance, error = pixels.average(film_radiance(scene), scene.film.width, scene.film.height)
    known = error <= _WORST_ERROR * np.maximum(radiance, radiance.mean(axis=(0, 1)))
    return Expectation(
        radiance=radiance,
        standard_error=np.zeros_like(radiance),
        error_bound=error,
        valid=known.all(axis=2),
        provenance=Provenance("closed form", formulas),
    )
