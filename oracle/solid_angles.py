"""Solid angles of shapes, and the change of variables between area and solid angle."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from oracle.arrays import Floats, InvalidArgument, direction, finite
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere

_Reals: TypeAlias = NDArray[np.floating[Any]]

_EPSILON = float(np.finfo(np.float64).eps)
# Rounding errors in units of eps times the magnitude of what is added up.
_ROUNDINGS = 8.0
# Where the bound exceeds this part of the value, longer numbers are tried.
_POOR = 2e-11
# From so many radii on, 12 x 32 nodes integrate over a disk to the last digit.
_FAR = 4.0
_RADIAL, _RADIAL_WEIGHTS = np.polynomial.legendre.leggauss(12)
_AROUND = 2 * np.pi * (np.arange(32) + 0.5) / 32


def solid_angle(shape: Shape, points: ArrayLike) -> Bounded:
    """Solid angle that a shape subtends, from whichever side it is seen.

    Parameters
    ----------
    shape : Polygon, Rectangle, Disk or Sphere
        A flat shape subtends 2 pi in its own plane from within its outline, 0 from outside. A sphere subtends 4 pi
        from inside.
    points : array_like
        Where it is seen from [m], shape (..., 3).

    Returns
    -------
    Bounded
        Solid angle [sr], shape (...). A few ulp of the value, but where a flat shape is seen nearly edge-on or from
        beside its outline.

    Raises
    ------
    InvalidArgument
        If the shape is a mesh, whose triangles may hide each other.

    Notes
    -----
    Polygons: the signed sum over a fan of triangles, ``tan(Omega/2) = a.(b x c) / (abc + (a.b) c + (b.c) a + (c.a) b)``
    [van Oosterom and Strackee 1983]. Disks: complete elliptic integrals of the first and third kind [Paxton 1959] in
    Carlson's form; Gauss quadrature from four radii on, where they cancel. Spheres: ``4 pi sin^2(alpha/2)``.
    """
    p = finite("points", points, (3,))
    result = Bounded(np.empty(p.shape[:-1]), np.empty(p.shape[:-1]))
    for part in chunks(p.shape[:-1], at_once=4096):
        here = _of_chunk(shape, p[part].reshape(-1, 3))
        result.value[part] = here.value.reshape(result.value[part].shape)
        result.error[part] = here.error.reshape(result.error[part].shape)
    return result


def cone(half_angle: ArrayLike) -> Floats:
    """Solid angle [sr] of a cone with `half_angle` in [0, pi] [rad], within a few ulp.

    ``4 pi sin^2(alpha/2)``: unlike ``2 pi (1 - cos alpha)`` it keeps its digits for narrow cones.
    """
    angle = finite("half_angle", half_angle)
    if ((angle < 0) | (angle > np.pi)).any():
        raise InvalidArgument("half_angle must lie between 0 and pi")
    result: Floats = 4 * np.pi * np.sin(angle / 2) ** 2
    return result


def plane_angle(start: ArrayLike, end: ArrayLike, points: ArrayLike) -> Floats:
    """Angle [rad] in [0, pi] that the segment from `start` to `end` subtends at points (..., 3), within a few ulp.

    The solid angle's counterpart in two dimensions; by atan2, as the arc cosine loses half of the digits of small angles.
    """
    p = finite("points", points, (3,))
    a, b = finite("start", start, (3,)) - p, finite("end", end, (3,)) - p
    # The nearer end loses fewer digits in the cross product.
    nearer = np.where((a**2).sum(axis=-1, keepdims=True) < (b**2).sum(axis=-1, keepdims=True), a, b)
    sine = np.linalg.norm(np.cross(nearer, finite("end", end, (3,)) - finite("start", start, (3,))), axis=-1)
    result: Floats = np.arctan2(sine, (a * b).sum(axis=-1))
    return result


def area_to_solid_angle(points: ArrayLike, surface_points: ArrayLike, surface_normals: ArrayLike) -> Floats:
    """Jacobian ``d omega / d A = |cos(theta)| / r^2`` [sr/m^2] of surface elements seen from points, within a few ulp.

    Multiply a density over solid angle with it to get one over area, and divide for the way back. Positions and unit
    normals broadcast from shape (..., 3).

    Raises
    ------
    InvalidArgument
        If a point lies on its surface element.
    """
    towards = finite("surface_points", surface_points, (3,)) - finite("points", points, (3,))
    normals = direction("surface_normals", surface_normals)
    distance = np.linalg.norm(towards, axis=-1)
    if (distance == 0).any():
        index = np.argwhere(distance == 0)[0].tolist()
        raise InvalidArgument(f"points{index or ''} lies on its surface element")
    result: Floats = np.abs((normals * towards).sum(axis=-1)) / distance**3
    return result


def _of_chunk(shape: Shape, points: Floats) -> Bounded:
    match shape:
        case Polygon():
            return _of_polygon(shape, points)
        case Rectangle():
            return _of_polygon(shape.polygon, points)
        case Disk():
            return _of_disk(shape, points)
        case Sphere():
            return _of_sphere(shape, points)
        case Mesh():
            raise InvalidArgument(
                "shape is a mesh, whose triangles may hide each other; ask for its polygons one by one"
            )


# ------------------------------------------------------------------------------------------------ polygon


def _of_polygon(shape: Polygon, points: Floats) -> Bounded:
    result = _fan(shape.vertices, points)
    poor = (result.error > _POOR * np.abs(result.value)) & (result.value != 0)
    if poor.any() and np.finfo(np.longdouble).eps < _EPSILON:
        again = _fan(shape.vertices.astype(np.longdouble), points[poor].astype(np.longdouble))
        result.value[poor], result.error[poor] = again.value, again.error + _EPSILON * np.abs(again.value)
    return Bounded(np.abs(result.value), np.minimum(result.error, 4 * np.pi))


def _fan(vertices: _Reals, points: _Reals) -> Bounded:
    """Signed sum over the triangles that join the first vertex to the edges."""
    offsets = [vertex - points for vertex in vertices]
    lengths = [np.sqrt((offset**2).sum(axis=-1)) for offset in offsets]
    edges = vertices - vertices[0]
    total, error = np.zeros(len(points), points.dtype), np.zeros(len(points), points.dtype)
    for i in range(1, len(vertices) - 1):
        a, b, c = offsets[0], offsets[i], offsets[i + 1]
        la, lb, lc = lengths[0], lengths[i], lengths[i + 1]
        # From the edges, not from b x c, which loses what all corners have in common; at the nearest corner.
        sides = np.cross(edges[i], edges[i + 1])
        near = np.where((la <= np.minimum(lb, lc))[:, None], a, np.where((lb <= lc)[:, None], b, c))
        numerator = near @ sides
        product = la * lb * lc
        denominator = product + (a * b).sum(axis=-1) * lc + (b * c).sum(axis=-1) * la + (c * a).sum(axis=-1) * lb
        total += 2 * np.arctan2(numerator, denominator)
        spread = np.sqrt((edges[i] ** 2).sum() * (edges[i + 1] ** 2).sum())
        of_numerator = np.minimum(np.minimum(la, lb), lc) * spread
        squared = numerator**2 + denominator**2
        # How far errors of numerator and denominator turn their angle; at the origin anything is possible.
        turned = (of_numerator * np.abs(denominator) + np.abs(numerator) * product) / np.where(squared > 0, squared, 1)
        error += np.where(squared > 0, turned, np.inf)
    error = _ROUNDINGS * np.finfo(points.dtype).eps * 2 * error
    return Bounded(total, error)  # type: ignore[arg-type]  # longer numbers stay within this module


# --------------------------------------------------------------------------------------------------- disk


def _of_disk(shape: Disk, points: Floats) -> Bounded:
    offset = shape.center - points
    height = np.abs(offset @ shape.normal)
    aside = np.linalg.norm(np.cross(offset, shape.normal), axis=-1)
    # In radii.
    h, a = height / shape.radius, aside / shape.radius
    distance = np.hypot(h, a)
    far = distance > _FAR
    value, error = np.zeros(len(h)), np.zeros(len(h))
    value[far], error[far] = _far_disk(h[far], a[far])
    value[~far], error[~far] = _near_disk(h[~far], a[~far])
    # The height is known to a few ulp of the distance.
    sensitivity = value / np.where(height == 0, 1.0, height) * (np.abs(offset) @ np.abs(shape.normal)) * (height != 0)
    return Bounded(value, error + _ROUNDINGS * _EPSILON * np.minimum(sensitivity, 2 * np.pi))


def _far_disk(h: Floats, a: Floats) -> tuple[Floats, Floats]:
    """Quadrature of ``h / r^3`` over the disk, in polar coordinates."""
    radius = np.sqrt((_RADIAL + 1) / 2)
    # Divided by the distance first, so that no power of it leaves the range of float64.
    distance = np.hypot(h, a)
    u, v = h / distance, a / distance
    x = radius[:, None] * np.cos(_AROUND)
    y = radius[:, None] * np.sin(_AROUND)
    scale = (1 / distance)[:, None, None]
    squared = (v[:, None, None] - scale * x) ** 2 + (scale * y) ** 2 + (u**2)[:, None, None]
    mean = np.einsum("nij,i->n", squared**-1.5, _RADIAL_WEIGHTS / 2) / len(_AROUND)
    value = np.pi * u / distance**2 * mean
    return value, _ROUNDINGS * _EPSILON * value


def _near_disk(h: Floats, a: Floats) -> tuple[Floats, Floats]:
    """Complete elliptic integrals."""
    near, far = np.hypot(h, 1 - a), np.hypot(h, 1 + a)
    complement = (near / far) ** 2
    ratio = ((1 - a) / (1 + a)) ** 2
    on_rim = (h == 0) & (a == 1)
    complement = np.where(on_rim, 1.0, complement)
    # Beside the rim the second integral diverges as the factor before it vanishes: their product is finite.
    safe = np.where(ratio < 1e-30, 1.0, ratio)
    first = special.elliprf(0, np.where(complement == 0, 1.0, complement), 1)
    # 4 a / (1 + a)^2 = 1 - ratio.
    third = first + (1 - ratio) / 3 * special.elliprj(0, np.where(complement == 0, 1.0, complement), 1, safe)
    both = first + (1 - a) / (1 + a) * np.where(ratio < 1e-30, 0.0, third)
    inside = a < 1
    value = np.where(inside, 2 * np.pi, 0.0) - 2 * h / far * both
    value = np.where(ratio < 1e-30, np.pi - 2 * h / far * first, value)
    value = np.where(h == 0, np.where(inside, 2 * np.pi, 0.0), value)
    error = _ROUNDINGS * _EPSILON * (np.where(inside, 2 * np.pi, 0.0) + 2 * h / far * np.abs(both) * (1 + a / far))
    # Beside the rim the angle turns by pi within a distance that the coordinates may not resolve.
    error += np.where(h == 0, 0.0, _ROUNDINGS * _EPSILON * 2 * h / np.where(near == 0, 1.0, near) ** 2)
    return np.maximum(value, 0), np.where(on_rim, 2 * np.pi, error)


# ------------------------------------------------------------------------------------------------- sphere


def _of_sphere(shape: Sphere, points: Floats) -> Bounded:
    distance = np.linalg.norm(shape.center - points, axis=-1)
    inside = distance <= shape.radius
    d = np.where(inside, 1.0, distance)
    sine = np.where(inside, 0.0, shape.radius / d)
    cosine = np.sqrt(np.maximum((1 - sine) * (1 + sine), 0))
    value = np.where(inside, 4 * np.pi, 2 * np.pi * sine**2 / (1 + cosine))
    # Near the surface the cosine has lost digits, though never more than half of them.
    lost = np.minimum(_EPSILON * sine**2 / np.where(cosine == 0, 1.0, cosine), np.sqrt(_EPSILON))
    lost = np.where((cosine == 0) & ~inside, np.sqrt(_EPSILON), lost)
    return Bounded(value, _ROUNDINGS * (_EPSILON * value + 2 * np.pi * lost * (value < 4 * np.pi)))
