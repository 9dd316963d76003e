"""Vector irradiance: how much light arrives, and from where on average, with no horizon to clip it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oracle.arrays import Floats, InvalidArgument, position
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import (
    Area,
    Constant,
    CosineSky,
    Directional,
    Emitter,
    Equirectangular,
    Line,
    Point,
    Spot,
)
from oracle.kernels import environment, line, point_like
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere

__all__ = ["vector_irradiance"]

_EPSILON = float(np.finfo(np.float64).eps)

# Flat shapes are computed in the longest numbers of the processor: near a shape's plane or edge its parts cancel.
Reals: TypeAlias = NDArray[np.floating[Any]]
_LONG_EPSILON = float(np.finfo(np.longdouble).eps)
# Rounding errors; the largest found in verification was a tenth of this.
_ROUNDINGS = 16 * _LONG_EPSILON

# Below this angular size (radius over distance, squared) of a polygon the difference form is the more precise one.
_FAR = 0.15**2


def vector_irradiance(emitter: Emitter | Sequence[Emitter], points: ArrayLike) -> Bounded:
    """Integral of radiance times direction over all directions, of one emitter or of several together.

    Parameters
    ----------
    emitter : Emitter or sequence of Emitter
        All with the same number of channels C.
    points : array_like
        Where light arrives [m], shape (..., 3).

    Returns
    -------
    Bounded
        Vectors towards the light [W/m^2] and a bound on the error of each component, shape (..., 3, C). Where all of
        the light is above a receiver's horizon, the inner product with its unit normal is its irradiance; elsewhere
        that is the difference of the irradiances of its two sides.

    Raises
    ------
    InvalidArgument
        If there is no emitter, their numbers of channels differ, a point is not finite, or is where a point or line
        emitter's irradiance is infinite.

    Notes
    -----
    Called light vector by Gershun (1939). Bounds are a few ulp of the vector's length, whatever the component; near
    the plane of a shape, where the vector itself vanishes, they are larger in relation to it. In a shape's own plane it
    is 0, though the limits on its two sides are not.
    """
    together = list(emitter) if isinstance(emitter, Sequence) else [emitter]
    if not together:
        raise InvalidArgument("emitter is an empty sequence")
    channels = [_light(one).shape[-1] for one in together]
    for index, count in enumerate(channels):
        if count != channels[0]:
            raise InvalidArgument(f"emitter[{index}] has {count} channels, emitter[0] has {channels[0]}")
    places = position("points", points)
    leading = places.shape[:-1]
    result = Bounded(np.empty((*leading, 3, channels[0])), np.empty((*leading, 3, channels[0])))
    for part in chunks(leading):
        some = places[part].reshape(-1, 3)
        try:
            here = reduce(add, (_of_one(one, some) for one in together))
        except point_like.OnEmitter as error:
            raise error.within(leading, part) from None
        result.value[part] = here.value.reshape(result.value[part].shape)
        result.error[part] = here.error.reshape(result.error[part].shape)
    return result


def _light(emitter: Emitter) -> Floats:
    """What the emitter's geometry is multiplied with; channels are on the last axis."""
    match emitter:
        case Point() | Spot():
            return emitter.intensity
        case Directional():
            return emitter.irradiance
        case Line():
            return emitter.intensity_per_length
        case CosineSky():
            return emitter.zenith
        case Area() | Constant() | Equirectangular():
            return emitter.radiance


def _of_one(emitter: Emitter, points: Floats) -> Bounded:
    """Vector irradiance (N, 3, C) of one emitter."""
    match emitter:
        case Constant():
            return _everywhere(points, Bounded(np.zeros((3, 1)), np.zeros((3, 1))) * emitter.radiance)
        case CosineSky():
            return _everywhere(points, environment.sky_vector(emitter))
        case Equirectangular():
            return _everywhere(points, environment.map_vector(emitter))
        case _:
            geometry = _of_unit(emitter, points)
            return Bounded(geometry.value[..., None], geometry.error[..., None]) * _light(emitter)


def _everywhere(points: Floats, vectors: Bounded) -> Bounded:
    shape = (len(points), *vectors.value.shape)
    return Bounded(np.broadcast_to(vectors.value, shape), np.broadcast_to(vectors.error, shape))


def _of_unit(emitter: Point | Spot | Directional | Line | Area, points: Floats) -> Bounded:
    """Vector irradiance (N, 3) for intensity, radiance ... of 1."""
    match emitter:
        case Point():
            return _point(emitter.position, points)
        case Spot():
            bare, part = _point(emitter.position, points), point_like.falloff(emitter, points)
            value = bare.value * part.value[:, None]
            error = bare.error * part.value[:, None] + np.abs(bare.value) * part.error[:, None] * (1 + 8 * _EPSILON)
            return Bounded(value, error + _EPSILON * np.abs(value))
        case Directional():
            value = np.broadcast_to(-emitter.direction, points.shape)
            return Bounded(value, np.zeros_like(value))
        case Line():
            return line.vector(emitter, points)
        case Area():
            return _of_shape(emitter.shape, points, emitter.two_sided)


def _of_shape(shape: Shape, points: Floats, two_sided: bool) -> Bounded:
    match shape:
        case Polygon():
            long = shape.vertices.astype(np.longdouble)
            return _polygon(long[0], long - long[0], points, two_sided)
        case Rectangle():
            # Not by its corners, which are rounded.
            u, v = shape.half_u.astype(np.longdouble), shape.half_v.astype(np.longdouble)
            return _polygon(shape.center, np.stack([-u - v, u - v, u + v, v - u]), points, two_sided)
        case Disk():
            return _disk(shape, points, two_sided)
        case Sphere():
            return _sphere(shape, points)
        case Mesh():
            return reduce(add, (_of_shape(one, points, two_sided) for one in shape.polygons))


def _point(position: Floats, points: Floats) -> Bounded:
    """Inverse-square law [1/m^2], shape (N, 3)."""
    offsets, _, squared = point_like.towards(position, points)
    value = offsets / (squared * np.sqrt(squared))[:, None]
    return Bounded(value, 8 * _EPSILON * np.abs(value))


def _sphere(shape: Sphere, points: Floats) -> Bounded:
    """``pi (R/d)^2`` towards the centre, as the cone's symmetry demands; 0 inside, also from a two-sided sphere."""
    offsets = shape.center - points
    distance = np.linalg.norm(offsets, axis=-1)
    inside = distance < shape.radius
    distance = np.where(inside, shape.radius, distance)
    value = offsets * (np.pi * (shape.radius / distance) ** 2 / distance)[:, None]
    error = np.where(inside, 0.0, 12 * _EPSILON)[:, None] * np.abs(value)
    uncertain = np.abs(np.linalg.norm(offsets, axis=-1) - shape.radius) < 4 * _EPSILON * shape.radius
    error = np.where(uncertain[:, None], 1.01 * np.abs(value), error)
    return Bounded(np.where(inside[:, None], 0.0, value), error)


def _disk(shape: Disk, points: Floats, two_sided: bool) -> Bounded:
    """Vector irradiance of a disk [sr], shape (N, 3).

    Notes
    -----
    With the height h of the disk above the receiver along its normal w, and u the direction from the receiver's foot
    to the centre at the distance rho, Stokes' theorem gives the integral of ``p x dp / |p|^2`` around the rim,
    ``V = pi r / S ((r - k rho) w + k h u)`` up to the sign of h, with ``D = rho^2 + h^2 + r^2``,
    ``S = sqrt(D^2 - 4 r^2 rho^2)`` and ``k = 2 r rho / (S + D)``.
    """
    w = shape.normal.astype(np.longdouble)
    w = w / np.sqrt((w * w).sum())
    offsets = shape.center - points.astype(np.longdouble)
    h = offsets @ w
    in_plane = offsets - h[:, None] * w
    rho, r = _norm(in_plane), np.longdouble(shape.radius)
    u = in_plane / np.where(rho == 0, 1, rho)[:, None]
    s = np.hypot(h, r - rho) * np.hypot(h, r + rho)
    s = np.where(s == 0, 1, s)
    d = rho * rho + h * h + r * r
    k = 2 * r * rho / (s + d)
    # r - k rho, of which outside of the disk near its plane nothing would be left.
    q = (rho - r) * (rho + r) - h * h
    lift = r * np.where(q > 0, 4 * (h * rho) ** 2 / (s + np.maximum(q, 0)), s - q) / (s + d)
    value = (_PI * r / s)[:, None] * ((lift * np.where(h > 0, 1, -1))[:, None] * w + (k * np.abs(h))[:, None] * u)
    # By so much may the receiver be misplaced; the vector changes by less than the contour integral of 2/|p|^2, and
    # also than the area integral of 4/|p|^3.
    nearest = np.maximum(np.abs(h), rho - r)
    area = np.where(nearest > 0, r * r / np.where(nearest > 0, nearest, 1) ** 3, np.inf)
    slope = 4 * np.pi * np.minimum(r / s, area)
    misplaced = _ROUNDINGS * _norm(offsets)
    error = np.minimum(slope * misplaced + _ROUNDINGS * _norm(value), 2 * np.pi)
    return _one_side(value, error, -h, misplaced, two_sided)


def _polygon(origin: Reals, corners: Reals, points: Floats, two_sided: bool) -> Bounded:
    """Vector irradiance of a polygon [sr], shape (N, 3), with corners (V, 3) relative to an origin.

    Notes
    -----
    ``1/2 sum_i Theta_i Gamma_i`` over its edges, with the angle Theta_i that edge i subtends and the unit normal
    Gamma_i of the plane through edge and receiver [Lambert 1760; Arvo 1994]. For small angular sizes the sum cancels;
    then the constant part of ``Theta_i / |v_i x v_j|`` is split off and summed as the polygon's area.
    """
    centered = corners - corners.mean(axis=0)
    center = (origin - points.astype(np.longdouble)) + corners.mean(axis=0)
    edges = np.roll(centered, -1, axis=0) - centered
    doubled_area = np.cross(centered, edges).sum(axis=0)
    w = doubled_area / _norm(doubled_area)

    far = (centered**2).sum(axis=-1).max() < _FAR * (center**2).sum(axis=-1)
    value, error = np.zeros_like(center), np.zeros_like(center[:, 0])
    for which, form in ((far, _far_contour), (~far, _near_contour)):
        if which.any():
            value[which], error[which] = form(center[which], centered, edges)
    # The other way round from behind; Stokes' theorem for the side that looks at w counts against w.
    height = -(center @ w)
    uneven = np.abs(centered @ w).max()
    value = np.where(height > 0, -1, 1)[:, None] * value
    return _one_side(value, error, height, _ROUNDINGS * _norm(center) + uneven, two_sided)


def _one_side(value: Reals, error: Reals, height: Reals, misplaced: Reals, two_sided: bool) -> Bounded:
    """The vectors of receivers on the front, at positive heights; or on both sides, but not in the plane."""
    seen = height != 0 if two_sided else height > 0
    # So near to the plane the side is uncertain, and with it everything.
    uncertain = np.abs(height) < misplaced
    error = np.where(uncertain, error + 2 * _norm(value), np.where(seen, error, 0))
    total = np.where(seen[:, None], value, 0).astype(np.float64)
    bound = error.astype(np.float64)[:, None] * (1 + _EPSILON) + _EPSILON * np.abs(total)
    return Bounded(total, bound)


def _near_contour(center: Reals, centered: Reals, edges: Reals) -> tuple[Reals, Reals]:
    total, error = np.zeros_like(center), np.zeros_like(center[:, 0])
    for i, edge in enumerate(edges):
        start, end = center + centered[i], center + centered[(i + 1) % len(edges)]
        axis = np.cross(start, np.broadcast_to(edge, start.shape))
        sine = _norm(axis)
        unit = np.where(sine == 0, 1, sine)
        # An edge that points at the receiver subtends no angle.
        angle = np.where(sine == 0, 0, np.arctan2(sine, (start * end).sum(axis=-1)))
        total += (angle / unit)[:, None] * axis / 2
        error += _ROUNDINGS * angle * (1 + (_norm(center) + _norm(centered[i])) * _norm(edge) / unit)
    return total, error


def _far_contour(center: Reals, centered: Reals, edges: Reals) -> tuple[Reals, Reals]:
    squared = (center**2).sum(axis=-1)
    distance = np.sqrt(squared)
    vertices = [center + corner for corner in centered]
    radii = [_norm(vertex) for vertex in vertices]
    # Distances of the vertices, as differences from that of the centre.
    more = [
        ((vertex + center) @ corner) / (radius + distance)
        for vertex, corner, radius in zip(vertices, centered, radii, strict=True)
    ]
    total = np.cross(centered, edges).sum(axis=0) / squared[:, None]
    spread = np.zeros_like(edges[0, 0])
    for i, edge in enumerate(edges):
        j = (i + 1) % len(edges)
        product = radii[i] * radii[j]
        # |edge|^2 = (r_i - r_j)^2 + 4 r_i r_j sin^2(Theta/2)
        half_sine_squared = ((edge @ edge) - (more[i] - more[j]) ** 2) / (4 * product)
        g = (
            _angle_over_sine(half_sine_squared) - (distance * (more[i] + more[j]) + more[i] * more[j]) / squared
        ) / product
        total += g[:, None] * np.cross(vertices[i], np.broadcast_to(edge, center.shape))
        spread += _norm(edge) * _norm(centered[i])
    return total / 2, _ROUNDINGS * spread / squared


def _norm(vectors: Reals) -> Reals:
    result: Reals = np.sqrt((vectors * vectors).sum(axis=-1))
    return result


_PI = 4 * np.arctan(np.longdouble(1))
# theta/sin(theta) - 1 in powers of q = sin^2(theta/2): with asin(s)/(s sqrt(1-s^2)) = sum (4 q)^k / ((2k+1) C(2k,k)).
_SERIES = [np.longdouble(1)]
for _k in range(1, 15):
    _SERIES.append(_SERIES[-1] * 2 * _k / (2 * _k + 1))


def _angle_over_sine(q: Reals) -> Reals:
    """``theta/sin(theta) - 1`` of angles with ``q = sin^2(theta/2)``, up to 0.35 rad."""
    result = np.full_like(q, _SERIES[-1])
    for coefficient in reversed(_SERIES[1:-1]):
        result = coefficient + q * result
    return q * result
