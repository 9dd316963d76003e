"""Solid angles of shapes, and the Jacobian between solid angle and area."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Booleans, Floats, InvalidArgument, demand_size, direction, finite, position, vector
from oracle.arrays import dot as plain_dot
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.compensated import dot, scaled_offsets, two_product, two_sum
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere
from oracle.solid_angles.disk import disk
from oracle.solid_angles.polygon import polygon, rectangle

__all__ = ["area_to_solid_angle", "cone", "plane_angle", "solid_angle", "solid_angle_to_area"]

_EPSILON = float(np.finfo(np.float64).eps)


def solid_angle(shape: Shape, points: ArrayLike) -> Bounded:
    """Solid angle that a shape subtends, the same from both of its sides.

    Parameters
    ----------
    shape : Polygon, Rectangle, Disk or Sphere
        Non-convex polygons are allowed.
    points : array_like
        Where the solid angle is seen from [m], shape (..., 3).

    Returns
    -------
    Bounded
        Solid angle [sr] and a bound on its error, shape (...). In the plane of a flat shape it is 2 pi on the shape,
        which fills half of the directions, and 0 beside it; on the edge it has no limit, and the bound covers 0 to
        2 pi. Inside a sphere it is 4 pi, on its surface 2 pi. The relative error is a few ulp, however far, near or
        edge-on the shape is; only next to the edges of a polygon it grows like eps times size over distance.

    Raises
    ------
    InvalidArgument
        If a point is not finite, or the shape is a mesh: its triangles may hide each other.

    Notes
    -----
    - Polygon: sum over a fan of triangles ``2 atan2(det(a, b, c), |a||b||c| + ...)`` with their signs [van Oosterom and
      Strackee 1983]. The determinant is a constant vector of the triangle times one offset, in twice the precision.
      Next to the polygon, the fan around the projection of the point has no inner edges to lose digits at.
    - Disk: complete elliptic integrals [Paxton 1959] in Carlson's symmetric form; series in Legendre polynomials where
      the disk is further away than three radii.
    - Sphere: ``4 pi sin^2(a/2)`` with ``sin a = R / d``.
    """
    positions = position("points", points)
    shape_of_result = positions.shape[:-1]
    result = Bounded(np.empty(shape_of_result), np.empty(shape_of_result))
    for part in chunks(shape_of_result):
        some = positions[part].reshape(-1, 3)
        match shape:
            case Polygon():
                found = polygon(shape, some)
            case Rectangle():
                found = rectangle(shape, some)
            case Disk():
                found = disk(shape, some)
            case Sphere():
                found = _sphere(shape, some)
            case Mesh():
                raise InvalidArgument(
                    "shape is a Mesh, whose triangles may hide each other; add up the solid angles of `mesh.polygons` "
                    "that face the point if they do not"
                )
        result.value[part] = found.value.reshape(result.value[part].shape)
        result.error[part] = found.error.reshape(result.error[part].shape)
    return result


def cone(half_angle: ArrayLike) -> Floats:
    """Solid angle of circular cones: ``4 pi sin^2(a/2)``, which unlike ``2 pi (1 - cos a)`` keeps narrow cones.

    Parameters
    ----------
    half_angle : array_like
        Angle between axis and side [rad], in [0, pi], any shape.

    Returns
    -------
    ndarray
        Solid angle [sr] of the same shape, right to a few ulp.

    Raises
    ------
    InvalidArgument
        If an angle is not in [0, pi].
    """
    angles = finite("half_angle", half_angle)
    _refuse_first("half_angle", angles, (angles < 0) | (angles > np.pi), "is {}, it must be in [0, pi]")
    return np.asarray(4 * np.pi * np.sin(angles / 2) ** 2)


def plane_angle(start: ArrayLike, end: ArrayLike, points: ArrayLike) -> Bounded:
    """Angle that a segment subtends, in the plane through it and the point: a solid angle's counterpart in 2-D.

    Parameters
    ----------
    start, end : array_like
        Ends of the segment [m], shape (3,).
    points : array_like
        Where it is seen from [m], shape (..., 3).

    Returns
    -------
    Bounded
        Angle [rad] in [0, pi] and a bound on its error, shape (...). It is pi on the segment; at its ends there is no
        limit, and the bound covers 0 to pi. Elsewhere the error is a few ulp, or about eps^2 if larger.

    Raises
    ------
    InvalidArgument
        If a number is not finite, or both ends are the same point.

    Notes
    -----
    ``atan2(|a x b|, a . b)`` with the ends a, b relative to the point, and ``a x b`` as ``a x (b - a)`` in twice the
    precision.
    """
    a, b = vector("start", start), vector("end", end)
    if (a == b).all():
        raise InvalidArgument("start and end are the same point")
    demand_size("the length from start to end", float(np.abs(b - a).max()))
    positions = position("points", points)
    result = Bounded(np.empty(positions.shape[:-1]), np.empty(positions.shape[:-1]))
    for part in chunks(positions.shape[:-1]):
        p = positions[part].reshape(-1, 3)
        angle, error = _plane_angle(a, b, p)
        result.value[part] = angle.reshape(result.value[part].shape)
        result.error[part] = error.reshape(result.error[part].shape)
    return result


def area_to_solid_angle(points: ArrayLike, surface_points: ArrayLike, surface_normals: ArrayLike) -> Floats:
    """Solid angle per area of small surfaces: ``|cos| / r^2``, the Jacobian d omega / d A.

    Parameters
    ----------
    points, surface_points : array_like
        Where the surface is seen from, and where it is [m], shape (..., 3).
    surface_normals : array_like
        Unit normals, shape (..., 3); which side they point to does not matter. All three broadcast.

    Returns
    -------
    ndarray
        Factor [sr/m^2], shape (...), right to a few ulp even for surfaces seen edge-on.

    Raises
    ------
    InvalidArgument
        If a number is not finite, a normal not of unit length, or a point lies on its surface point.
    """
    cosine, squared = _cosine_and_distance(points, surface_points, surface_normals)
    return np.asarray(cosine / squared)


def solid_angle_to_area(points: ArrayLike, surface_points: ArrayLike, surface_normals: ArrayLike) -> Floats:
    """Area of small surfaces per solid angle: ``r^2 / |cos|``, the Jacobian d A / d omega [m^2/sr].

    Arguments and errors are those of `area_to_solid_angle`; besides, no surface may be seen exactly edge-on.
    """
    cosine, squared = _cosine_and_distance(points, surface_points, surface_normals)
    _refuse_first("surface_normals", cosine, cosine == 0, "belongs to a surface seen edge-on, cosine {}")
    return np.asarray(squared / cosine)


def _cosine_and_distance(points: ArrayLike, surface_points: ArrayLike, normals: ArrayLike) -> tuple[Floats, Floats]:
    p, q = position("points", points), position("surface_points", surface_points)
    n = direction("surface_normals", normals)
    try:
        p, q, n = np.broadcast_arrays(p, q, n)
    except ValueError:
        raise InvalidArgument(
            f"points {p.shape}, surface_points {q.shape} and surface_normals {n.shape} do not fit together"
        ) from None
    away, low = two_sum(q, -p)
    squared = plain_dot(away, away)
    _refuse_first("points", squared, squared == 0, "lies on its surface point, at a distance of {}")
    return np.abs(dot(n, 0.0, away, low)) / np.sqrt(squared), squared


def _refuse_first(name: str, array: Floats, bad: Booleans, reason: str) -> None:
    where = np.argwhere(bad)
    if len(where):
        index = [int(i) for i in where[0]]
        raise InvalidArgument(f"{name}{index or ''} {reason.format(array[tuple(index)])}")


def _sphere(shape: Sphere, points: Floats) -> Bounded:
    offset, low, scale = scaled_offsets(shape.center, points, shape.radius)
    radius = shape.radius * scale
    power = dot(offset.T, low.T, offset.T, low.T, minus=radius)
    inside = power < 0
    squared = np.where(inside, 1.0, power + radius**2)
    value = 2 * np.pi * radius**2 / (squared + np.sqrt(np.where(inside, 0.0, power) * squared))
    value = np.where(inside, 4 * np.pi, value)
    return Bounded(value, 8 * _EPSILON * value)


def _plane_angle(start: Floats, end: Floats, points: Floats) -> tuple[Floats, Floats]:
    a, a_low, scale = scaled_offsets(start, points, float(np.abs(end - start).max()))
    b, b_low = (part.T * scale for part in two_sum(end, -points))
    edge, edge_low = (part[:, None] * scale for part in two_sum(end, -start))
    normal = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        first, first_low = two_product(a[i], edge[j])
        second, second_low = two_product(a[j], edge[i])
        total, lost = two_sum(first, -second)
        lows = a_low[i] * edge[j] - a_low[j] * edge[i] + a[i] * edge_low[j] - a[j] * edge_low[i]
        normal.append(total + (lost + (first_low - second_low + lows)))
    # Not by squares, which underflow next to the ends.
    sine = np.hypot(np.hypot(normal[0], normal[1]), normal[2])
    cosine = dot(a.T, a_low.T, b.T, b_low.T)
    value = np.arctan2(sine, cosine)
    # Rounding, and what is lost although computed in twice the precision.
    lost = np.abs(a).sum(axis=0) * np.abs(edge).sum(axis=0) * np.abs(cosine)
    squared = sine**2 + cosine**2
    error = 8 * _EPSILON * value + 16 * _EPSILON**2 * lost / np.where(squared == 0, 1.0, squared)
    at_end = (a == 0).all(axis=0) | (b == 0).all(axis=0)
    return np.where(at_end, np.pi / 2, value), np.where(at_end, np.pi / 2, error)
