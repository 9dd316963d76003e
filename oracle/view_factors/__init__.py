"""View factors: which fraction of the power that leaves one diffuse surface reaches another one unhindered."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oracle.arrays import InvalidArgument, dot
from oracle.bounded import Bounded
from oracle.emitters import Receivers
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere
from oracle.view_factors.aligned import Rectangles, exchange_areas
from oracle.view_factors.disks import coaxial_disks
from oracle.view_factors.over_surface import exchange_over_surface
from oracle.view_factors.polygons import exchange_area
from oracle.view_factors.spheres import exchange_of_spheres, exchange_with_sphere
from oracle.view_factors.strings import crossed_strings

__all__ = ["crossed_strings", "view_factor", "view_factors"]

_EPSILON = float(np.finfo(np.float64).eps)

# Intermediate results of so many pairs stay within the processor's cache.
_PAIRS_AT_ONCE = 4096


def view_factor(source: Shape | Receivers, target: Shape) -> Bounded:
    """View factor ``F12``: the fraction of the power leaving the source diffusely that reaches the target unhindered.

    Parameters
    ----------
    source : Shape or Receivers
        What shines from its front: a shape, or surface elements [m] of any shape (...).
    target : Shape
        What receives on its front. What lies behind the other's front does not count.

    Returns
    -------
    Bounded
        Dimensionless, with a bound on its error; shape () for a shape, (...) for surface elements.

    Raises
    ------
    InvalidArgument
        If a sphere passes through the other shape, or through a triangle of a mesh.

    Notes
    -----
    Closed forms: surface elements; rectangles whose edges are parallel to one another; coaxial disks; a sphere and a
    flat shape whose plane it does not reach through. All other flat polygons by quadrature to rounding. All other pairs
    by adaptive quadrature of the closed form for surface elements, with a bound, near 1e-11 of the value, that is an
    estimate from two orders and no proof; it takes seconds if round outlines touch or nearly coincide.
    Shapes may touch. A mesh is the sum of its triangles, which do not hide one another. Reciprocity,
    ``A1 F12 = A2 F21``, exchanges source and target.
    """
    if isinstance(source, Receivers):
        return projected_solid_angle(target, source) * (1 / np.pi)
    return _scalar(view_factors([source], [target]))


def view_factors(sources: Sequence[Shape], targets: Sequence[Shape]) -> Bounded:
    """View factors from each of S sources to each of T targets, shape (S, T); see `view_factor`.

    Many rectangles with parallel edges take some microseconds for each pair, other polygons milliseconds, disks and
    spheres without closed form tens of them. Nothing hides anything: for the inside of a convex enclosure this is the
    matrix of its radiosity equation.
    """
    if not len(sources) or not len(targets):
        raise InvalidArgument(f"{'targets' if len(sources) else 'sources'} is an empty sequence")
    value, error = np.zeros((len(sources), len(targets))), np.zeros((len(sources), len(targets)))
    left = np.ones(value.shape, dtype=bool)
    rows = np.flatnonzero([isinstance(one, Rectangle) for one in sources])
    columns = np.flatnonzero([isinstance(one, Rectangle) for one in targets])
    if len(rows) and len(columns):
        first = Rectangles.of([one for one in sources if isinstance(one, Rectangle)])
        second = Rectangles.of([one for one in targets if isinstance(one, Rectangle)])
        areas = 4 * first.halves.prod(axis=1)
        for s in range(0, len(rows), max(1, _PAIRS_AT_ONCE // len(columns))):
            some = slice(s, s + max(1, _PAIRS_AT_ONCE // len(columns)))
            for t in range(0, len(columns), _PAIRS_AT_ONCE):
                part = slice(t, t + _PAIRS_AT_ONCE)
                exchange, known = exchange_areas(first[some], second[part])
                here = np.ix_(rows[some], columns[part])
                value[here] = exchange.value / areas[some, None]
                error[here] = exchange.error / areas[some, None] + 4 * _EPSILON * value[here]
                left[here] = ~known
    for i, j in np.argwhere(left):
        exchanged, lost = _exchange(sources[i], targets[j])
        area = sources[i].area
        value[i, j], error[i, j] = exchanged / area, lost / area + 8 * _EPSILON * exchanged / area
    return Bounded(value, error)


def _exchange(a: Shape, b: Shape) -> tuple[float, float]:
    """Exchange area ``A1 F12 = A2 F21`` [m^2] and a bound on its error."""
    match a, b:
        case Mesh(), _:
            return _total([_exchange(one, b) for one in a.polygons])
        case _, Mesh():
            return _total([_exchange(a, one) for one in b.polygons])
        case Rectangle(), _:
            return _exchange(a.polygon, b)
        case _, Rectangle():
            return _exchange(a, b.polygon)
        case Polygon(), Polygon():
            return exchange_area(a, b)
        case Disk(), Disk():
            return _disks(a, b)
        case Disk(), Polygon():
            return exchange_over_surface(a, b)
        case Polygon(), Disk():
            return exchange_over_surface(b, a)
        case Sphere(), Sphere():
            return exchange_of_spheres(a, b)
        case Sphere(), Polygon() | Disk():
            return exchange_with_sphere(b, a)
        case Polygon() | Disk(), Sphere():
            return exchange_with_sphere(a, b)
    raise InvalidArgument(f"target: no view factor is known between {type(a).__name__} and {type(b).__name__}")


def _total(parts: list[tuple[float, float]]) -> tuple[float, float]:
    value = sum(part[0] for part in parts)
    return value, sum(part[1] for part in parts) + len(parts) * _EPSILON * value


def _disks(a: Disk, b: Disk) -> tuple[float, float]:
    offset = b.center - a.center
    height, aside = float(dot(offset, a.normal)), float(np.linalg.norm(np.cross(offset, a.normal)))
    scale = a.radius + b.radius + abs(height)
    if np.abs(np.cross(a.normal, b.normal)).max() > 64 * _EPSILON or aside > 64 * _EPSILON * scale:
        return exchange_over_surface(a, b)
    if a.normal @ b.normal > 0 or height <= 0:
        return 0.0, 0.0
    result = coaxial_disks(np.asarray(a.radius), np.asarray(b.radius), np.asarray(height))
    value = float(result.value) * a.area
    # Aside and tilted by rounding, they exchange less by the second order at most.
    rounding = 4 * _EPSILON * float(np.abs(offset) @ np.abs(a.normal))
    return value, float(result.error) * a.area + (2 * rounding / height + 4 * _EPSILON) * value


def _scalar(matrix: Bounded) -> Bounded:
    return Bounded(np.asarray(matrix.value[0, 0]), np.asarray(matrix.error[0, 0]))
