"""The outlines of the shadows that disks and spheres cast in the light of a point or in parallel light: conics."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from oracle.arrays import Booleans, Floats, InvalidArgument, dot, length
from oracle.emitters import Directional, Point, Spot
from oracle.shapes import Disk, Polygon, Rectangle, Sphere
from oracle.visibility.shadow_edges import convex_polygon

# Every arc begins as so many segments.
_FIRST = 16


@dataclass(frozen=True, eq=False)
class ConicShadow:
    """The outline of a round occluder's shadow on a flat receiver.

    With ``q = (a, b, 1)``, the point ``origin + a u + b v`` [m] lies on the outline where ``q . matrix q = 0``, and
    inside where that is negative. A hyperbola, when a part of the occluder is higher above the receiver than the light,
    has a second branch that is no shadow; `arcs` leaves it out.
    """

    matrix: Floats
    origin: Floats
    u: Floats
    v: Floats
    _rim: _Rim
    _receiver: Polygon

    def arcs(self, tolerance: float) -> tuple[Floats, ...]:
        """The outline's parts on the receiver as polylines of points (K, 3) [m].

        The points are exact to rounding; the conic leaves the segments between them by at most `tolerance` [m].
        """
        tolerance = length("tolerance", tolerance)
        corners, up = self._receiver.vertices, self._receiver.normal
        # The outline meets the receiver's at these angles only. A branch that comes from infinity begins outside.
        borders = [(corner, np.cross(up, edge)) for corner, edge in self._borders()]
        cuts = [self._rim.cut(corner, edge) for corner, edge in self._borders()]
        angles = np.sort(np.concatenate(cuts) % (2 * np.pi))
        ends = np.append(angles, angles[0] + 2 * np.pi) if len(angles) else np.array([0.0, 2 * np.pi])
        arcs = []
        for first, last in pairwise(ends):
            middle = np.array([(first + last) / 2])
            if last == first or not self._rim.falls(middle, corners[0], up)[0]:
                continue
            point = self._rim.shadow(middle, corners[0], up)[0]
            if all((point - corner) @ inwards >= 0 for corner, inwards in borders):
                arcs.append(self._polyline(first, last, tolerance))
        return tuple(arcs)

    def _borders(self) -> list[tuple[Floats, Floats]]:
        corners = self._receiver.vertices
        return list(zip(corners, np.roll(corners, -1, axis=0) - corners, strict=True))

    def _polyline(self, first: float, last: float, tolerance: float) -> Floats:
        """Segments are halved, in the circle's angle, until all are near enough to the conic."""
        corner, up = self._receiver.vertices[0], self._receiver.normal
        angles = np.linspace(first, last, _FIRST + 1)
        while True:
            points = self._rim.shadow(angles, corner, up)
            middles = (angles[1:] + angles[:-1]) / 2
            there = self._rim.shadow(middles, corner, up)
            chord = points[1:] - points[:-1]
            t = dot(there - points[:-1], chord) / np.maximum(dot(chord, chord), 1e-300)
            sagitta = np.linalg.norm(there - points[:-1] - t[:, None] * chord, axis=-1)
            # The furthest point is near the middle angle, but not there.
            far = sagitta > tolerance / 2
            if not far.any():
                return points
            angles = np.sort(np.append(angles, middles[far]))


def conic_shadow(
    emitter: Point | Spot | Directional, occluder: Disk | Sphere, receiver: Polygon | Rectangle
) -> ConicShadow:
    """The outline of the shadow of a disk or a sphere.

    Parameters
    ----------
    emitter : Point, Spot or Directional
        In front of the receiver. A spot shines everywhere: its cone has its own edge.
    occluder : Disk or Sphere
        Wholly in front of the receiver's plane.
    receiver : Polygon or Rectangle
        Convex.

    Raises
    ------
    InvalidArgument
        If one of them is of another kind, the emitter shines on the receiver's back or is inside the sphere or in the
        disk's plane, or the occluder reaches to the receiver's plane.

    Notes
    -----
    A disk with centre c, normal n and radius r hides the light l from x where the ray from l along y = x - l meets its
    plane within r of c: ``|(l - c)(n . y) + (n . (c - l)) y|^2 < r^2 (n . y)^2``, quadratic in the plane's coordinates.
    Parallel light along d replaces the ray: ``|y (n . d) - d (n . y)|^2 < r^2 (n . d)^2`` with y = x - c. A sphere
    casts the shadow of the circle in which the light's tangent cone touches it.
    """
    if not isinstance(emitter, Point | Spot | Directional):
        raise InvalidArgument(f"emitter is a {type(emitter).__name__}; a Point, Spot or Directional is supported")
    if not isinstance(occluder, Disk | Sphere):
        raise InvalidArgument(f"occluder is a {type(occluder).__name__}; a Disk or a Sphere is supported")
    ground = convex_polygon("receiver", receiver)
    up, origin = ground.normal, ground.vertices[0]
    parallel = isinstance(emitter, Directional)
    light = -emitter.direction if isinstance(emitter, Directional) else emitter.position
    if light @ up - (0.0 if parallel else origin @ up) <= 0:
        raise InvalidArgument("emitter is behind the receiver")
    center, axis, radius = _circle(light, parallel, occluder)
    reach = occluder.radius * (np.linalg.norm(np.cross(axis, up)) if isinstance(occluder, Disk) else 1.0)
    if (occluder.center - origin) @ up <= reach:
        raise InvalidArgument("occluder reaches to the receiver's plane")

    along = axis @ (light if parallel else center - light)
    if along == 0:
        raise InvalidArgument("emitter is in the disk's plane, where the disk has no shadow")
    first = ground.vertices[1] - origin
    u = first / np.linalg.norm(first)
    v = np.cross(up, u)
    if parallel:
        affine = np.column_stack([u, v, origin - center])
        # The matrix of y -> y (n . d) - d (n . y).
        sheared = (along * np.eye(3) - np.outer(light, axis)) @ affine
        matrix = sheared.T @ sheared
        matrix[2, 2] -= (radius * along) ** 2
    else:
        affine = np.column_stack([u, v, origin - light])
        sheared = (np.outer(light - center, axis) + along * np.eye(3)) @ affine
        matrix = sheared.T @ sheared - radius**2 * np.outer(axis @ affine, axis @ affine)
    across = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    across *= radius / np.linalg.norm(across)
    rim = _Rim(center, across, np.cross(axis, across), light, parallel)
    return ConicShadow(matrix, origin, u, v, rim, ground)


def _circle(light: Floats, parallel: bool, occluder: Disk | Sphere) -> tuple[Floats, Floats, float]:
    """Centre, axis and radius of the circle that casts the outline."""
    if isinstance(occluder, Disk):
        return occluder.center, occluder.normal, occluder.radius
    if parallel:
        return occluder.center, light, occluder.radius
    towards = light - occluder.center
    distance = float(np.linalg.norm(towards))
    ratio = occluder.radius / distance if distance > occluder.radius else 1.0
    if ratio >= 1:
        raise InvalidArgument("emitter is inside the sphere")
    axis = towards / distance
    # (1 - q)(1 + q) keeps the digits of a light near to the sphere.
    return occluder.center + occluder.radius * ratio * axis, axis, occluder.radius * np.sqrt((1 - ratio) * (1 + ratio))


@dataclass(frozen=True)
class _Rim:
    """The circle ``center + cos(f) u + sin(f) v``, and the position of the light or the direction towards it."""

    center: Floats
    u: Floats
    v: Floats
    light: Floats
    parallel: bool

    def at(self, angles: Floats) -> Floats:
        """Points (K, 3) of the circle."""
        result: Floats = self.center + np.cos(angles)[:, None] * self.u + np.sin(angles)[:, None] * self.v
        return result

    def falls(self, angles: Floats, corner: Floats, up: Floats) -> Booleans:
        """Whether the rays past the circle fall on the plane through `corner`, rather than rise from it."""
        if self.parallel:
            return np.ones(angles.shape, dtype=np.bool_)
        result: Booleans = (self.at(angles) - self.light) @ up < 0
        return result

    def shadow(self, angles: Floats, corner: Floats, up: Floats) -> Floats:
        """Where the rays meet the plane, shape (K, 3)."""
        rim = self.at(angles)
        ray = np.broadcast_to(-self.light, rim.shape) if self.parallel else rim - self.light
        result: Floats = rim + (((corner - rim) @ up) / (ray @ up))[:, None] * ray
        return result

    def cut(self, corner: Floats, edge: Floats) -> Floats:
        """Angles, at most two, at which the rays pass through the line through `corner` along `edge`."""
        to_light = self.light if self.parallel else self.light - corner
        normal = np.cross(edge, to_light)
        # What is left is a zero of constant + cosine cos(f) + sine sin(f).
        constant = normal @ (self.center - corner)
        cosine, sine = normal @ self.u, normal @ self.v
        amplitude = np.hypot(cosine, sine)
        if abs(constant) >= amplitude:
            return np.empty(0)
        half = np.arccos(-constant / amplitude)
        result: Floats = np.arctan2(sine, cosine) + np.array([-half, half])
        return result
