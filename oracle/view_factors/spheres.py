"""Exchange areas of spheres, whose front is their outside."""

from __future__ import annotations

import numpy as np

from oracle.adaptive import integrate
from oracle.arrays import Floats, Integers, InvalidArgument, dot
from oracle.emitters import Receivers
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Disk, Polygon, Sphere
from oracle.solid_angles import solid_angle
from oracle.view_factors.over_surface import exchange_over_surface, misplaced
from oracle.visibility.convex import convex_parts

_EPSILON = float(np.finfo(np.float64).eps)

# Parts of the meridian whose two quadratures differ by less than this part of the whole are not divided further.
_TOLERANCE = 1e-12
# Distances below so many roundings count as touching.
_TOUCH = 16 * _EPSILON


def exchange_with_sphere(flat: Polygon | Disk, sphere: Sphere) -> tuple[float, float]:
    """Exchange area ``A1 F12 = A2 F21`` [m^2] of a flat shape and a sphere, and a bound on its error.

    Raises
    ------
    InvalidArgument
        If the sphere passes through the flat shape.

    Notes
    -----
    A point on a flat shape that sees the whole sphere sees it as if its light came from its centre:
    ``cos / (4 pi r^2) dA`` integrates to the flat shape's solid angle over ``4 pi`` [Feingold and Gupta 1970]. A sphere
    that reaches through the shape's plane is seen in part only; then the irradiance is integrated.
    """
    anchor = flat.center if isinstance(flat, Disk) else flat.vertices[0]
    offset = sphere.center - anchor
    height = float(dot(offset, flat.normal))
    rounding = _TOUCH * (float(np.abs(offset) @ np.abs(flat.normal)) + sphere.radius)
    if height <= -sphere.radius:
        return 0.0, 0.0
    if height >= sphere.radius - rounding:
        seen = solid_angle(flat, sphere.center)
        # ``4 pi R^2`` over ``4 pi``.
        value = float(seen.value) * sphere.radius**2
        return value, float(seen.error) * sphere.radius**2 + (2 * rounding / height + 4 * _EPSILON) * value
    if _furthest(flat, sphere.center) <= sphere.radius:
        return 0.0, 0.0
    if _nearest(flat, sphere.center) < sphere.radius - rounding:
        raise InvalidArgument("target: the sphere and its partner pass through each other; they may only touch")
    return exchange_over_surface(flat, sphere)


def exchange_of_spheres(a: Sphere, b: Sphere) -> tuple[float, float]:
    """Exchange area ``A1 F12 = A2 F21`` [m^2] of two spheres, and a bound on its error, an estimate.

    Raises
    ------
    InvalidArgument
        If they pass through each other.

    Notes
    -----
    What the smaller one receives depends on the angle f to the line of centres only: it sees all of the other one up to
    ``cos f = (r + R) / D`` and nothing of it from ``cos f = (r - R) / D`` on.
    """
    small, large = sorted((a, b), key=lambda sphere: sphere.radius)
    offset = large.center - small.center
    distance = float(np.linalg.norm(offset))
    rounding = 4 * _EPSILON * distance
    if distance + small.radius <= large.radius + rounding:
        # From inside, one sees a sphere's back.
        return 0.0, 0.0
    if distance < small.radius + large.radius - rounding:
        raise InvalidArgument("target: the spheres pass through each other; they may only touch")
    r, seen = small.radius, Sphere(np.array([0, 0, distance]), large.radius)
    angles = np.arccos(np.clip([1, (r + large.radius) / distance, (r - large.radius) / distance], -1, 1))
    start, span = angles[:-1], np.diff(angles)

    def integrand(index: Integers, s: Floats) -> tuple[Floats, Floats]:
        angle = start[index, None] + span[index, None] * s
        normals = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=-1)
        here = projected_solid_angle(seen, Receivers(r * normals, normals))
        # Without the common factor, 2 pi r^2.
        weight = np.sin(angle) * span[index, None]
        return here.value * weight, (here.error + 16 * _EPSILON * here.value) * weight

    total = integrate(integrand, np.zeros(2, dtype=np.int64), 1, _TOLERANCE, dimensions=1)
    value, error = 2 * r**2 * float(total.value[0]), 2 * r**2 * float(total.error[0])
    return value, error + misplaced(value, rounding, distance - r - large.radius, r)


def _furthest(flat: Polygon | Disk, point: Floats) -> float:
    """Distance of a point from what of a flat shape is furthest away."""
    if isinstance(flat, Polygon):
        return float(np.linalg.norm(flat.vertices - point, axis=1).max())
    height, aside = _height_and_aside(flat, point)
    return float(np.hypot(height, aside + flat.radius))


def _nearest(flat: Polygon | Disk, point: Floats) -> float:
    """Distance of a point from what of a flat shape is nearest."""
    if isinstance(flat, Disk):
        height, aside = _height_and_aside(flat, point)
        return float(np.hypot(height, max(aside - flat.radius, 0.0)))
    return min(_from_convex(part, flat.normal, point) for part in convex_parts(flat))


def _height_and_aside(flat: Disk, point: Floats) -> tuple[float, float]:
    offset = point - flat.center
    return float(offset @ flat.normal), float(np.linalg.norm(np.cross(offset, flat.normal)))


def _from_convex(corners: Floats, normal: Floats, point: Floats) -> float:
    """Distance of a point from a convex polygon."""
    edges, offsets = np.roll(corners, -1, axis=0) - corners, point - corners
    if (np.cross(edges, offsets) @ normal >= 0).all():
        return abs(float(offsets[0] @ normal))
    along = np.clip(dot(offsets, edges) / dot(edges, edges), 0, 1)
    return float(np.linalg.norm(offsets - along[:, None] * edges, axis=1).min())
