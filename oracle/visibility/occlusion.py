"""Whether a point sees an emitter without size: shadow rays, exact but for the rounding of their arguments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from oracle import intersection
from oracle.arrays import Booleans, Floats, InvalidArgument, dot, position
from oracle.chunks import chunks
from oracle.emitters import Directional, Point, Spot
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere
from oracle.visibility.convex import convex_parts, polygons_of

# Distances below so many roundings of the coordinates' differences count as touching.
_TOUCH = 32 * float(np.finfo(np.float64).eps)


def visible(emitter: Point | Spot | Directional, points: ArrayLike, occluders: Sequence[Shape]) -> Booleans:
    """Whether points see an emitter without size past occluders.

    Parameters
    ----------
    emitter : Point, Spot or Directional
        A spot is seen outside of its cone, too: only what is in the way counts.
    points : array_like
        Positions [m], shape (..., 3).
    occluders : sequence of Shape
        Opaque surfaces, from both sides; a sphere is a hollow one.

    Returns
    -------
    ndarray
        Booleans, shape (...).

    Raises
    ------
    InvalidArgument
        If the emitter has a size, or a point is not finite.

    Notes
    -----
    The ray is open: an occluder that touches the receiver or the emitter without lying between them hides nothing, nor
    does a flat one in whose plane one of them is, or a sphere that the ray is tangent to. Nearer than 32 roundings of
    the coordinates' differences counts as touching. The rims of flat occluders hide, so that no ray slips through
    between the triangles of a mesh [Woop, Benthin and Wald 2013].
    """
    if not isinstance(emitter, Point | Spot | Directional):
        raise InvalidArgument(f"emitter is a {type(emitter).__name__}; a Point, Spot or Directional is supported")
    for index, occluder in enumerate(occluders):
        if not isinstance(occluder, Shape):
            raise InvalidArgument(f"occluders[{index}] is a {type(occluder).__name__}, not one of oracle.shapes")
    where = position("points", points)
    hidden = np.zeros(where.shape[:-1], dtype=np.bool_)
    for part in chunks(hidden.shape):
        p = where[part].reshape(-1, 3)
        here = np.zeros(len(p), dtype=np.bool_)
        for occluder in occluders:
            match occluder:
                case Sphere():
                    here |= _behind_sphere(emitter, p, occluder)
                case Disk():
                    here |= _behind_disk(emitter, p, occluder)
                case Polygon() | Rectangle() | Mesh():
                    for polygon in polygons_of("occluders", occluder):
                        here |= _behind_polygon(emitter, p, polygon)
        hidden[part] = here.reshape(hidden[part].shape)
    return ~hidden


def _to_emitter(emitter: Point | Spot | Directional, points: Floats) -> Floats:
    """Vectors (N, 3) to the emitter, or towards where its light comes from."""
    if isinstance(emitter, Directional):
        return np.broadcast_to(-emitter.direction, points.shape)
    result: Floats = emitter.position - points
    return result


def _heights(normal: Floats, offsets: Floats) -> Floats:
    """Distances from a plane of points (N, 3) relative to one of its own; rounding errors are 0."""
    heights = offsets @ normal
    noise = _TOUCH * (np.abs(offsets) @ np.abs(normal) + np.abs(offsets).max(axis=-1))
    return np.where(np.abs(heights) <= noise, 0.0, heights)


def _crosses_plane(
    emitter: Point | Spot | Directional, points: Floats, on_plane: Floats, normal: Floats
) -> tuple[Booleans, Floats]:
    """Whether the open ray passes through a plane, and the heights of the points."""
    height = _heights(normal, points - on_plane)
    if isinstance(emitter, Directional):
        # A direction's rounding errors are those of a unit vector.
        rise = float(-emitter.direction @ normal)
        beyond = 0.0 if abs(rise) <= _TOUCH else rise
    else:
        beyond = float(_heights(normal, (emitter.position - on_plane)[None])[0])
    return np.sign(height) * np.sign(beyond) < 0, height


def _behind_polygon(emitter: Point | Spot | Directional, points: Floats, polygon: Polygon) -> Booleans:
    across, _ = _crosses_plane(emitter, points, polygon.vertices[0], polygon.normal)
    inside = np.zeros(len(points), dtype=np.bool_)
    if across.any():
        ray = _to_emitter(emitter, points)[across]
        for part in convex_parts(polygon):
            fan = np.array([[0, k, k + 1] for k in range(1, len(part) - 1)])
            met, _ = intersection.mesh(points[across], ray, part, fan, t_min=-np.inf)
            inside[across] |= np.isfinite(met)
    return inside


def _behind_disk(emitter: Point | Spot | Directional, points: Floats, disk: Disk) -> Booleans:
    across, height = _crosses_plane(emitter, points, disk.center, disk.normal)
    ray = _to_emitter(emitter, points)
    fall = ray @ disk.normal
    # Ends on opposite sides, hence |fall| >= |height| > 0.
    t = -np.where(across, height, 0.0) / np.where(across, fall, 1.0)
    local = points - disk.center + t[:, None] * ray
    result: Booleans = across & (dot(local, local) <= disk.radius**2)
    return result


def _behind_sphere(emitter: Point | Spot | Directional, points: Floats, sphere: Sphere) -> Booleans:
    offset = points - sphere.center
    ray = _to_emitter(emitter, points)
    here = _above_sphere(offset, sphere.radius)
    squared = dot(ray, ray)
    t = -dot(offset, ray) / np.where(squared == 0, 1.0, squared)
    nearest = _above_sphere(offset + t[:, None] * ray, sphere.radius)
    if isinstance(emitter, Directional):
        there, ahead = np.ones(len(points)), t > 0
    else:
        end = _above_sphere((emitter.position - sphere.center)[None], sphere.radius)[0]
        there, ahead = np.full(len(points), end), (t > 0) & (t < 1)
    # Either both ends are outside and the ray passes through the ball, or one is inside and one is outside.
    through = (here >= 0) & (there >= 0) & ahead & (nearest < 0)
    result: Booleans = through | (np.sign(here) * np.sign(there) < 0)
    return result


def _above_sphere(offsets: Floats, radius: float) -> Floats:
    """Heights above a sphere of points (N, 3) relative to its centre; rounding errors are 0."""
    distance = np.linalg.norm(offsets, axis=-1)
    height = distance - radius
    return np.where(np.abs(height) <= _TOUCH * (distance + radius), 0.0, height)
