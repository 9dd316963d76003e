"""View factors of disks and spheres in closed form."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded

_EPSILON = float(np.finfo(np.float64).eps)


def coaxial_disks(radius: Floats, target_radius: Floats, distance: Floats) -> Bounded:
    """View factor between parallel disks on a common axis that face each other at a positive distance [m].

    Notes
    -----
    ``F12 = 2 R2^2 / (R1^2 + R2^2 + h^2 + sqrt((h^2 + (R1 - R2)^2) (h^2 + (R1 + R2)^2)))``: the classical
    ``(X - sqrt(X^2 - 4 (R2/R1)^2)) / 2`` [Howell, A Catalog of Radiation Heat Transfer Configuration Factors, parallel
    coaxial disks], rationalised so that nothing cancels.
    """
    near = np.hypot(distance, radius - target_radius)
    far = np.hypot(distance, radius + target_radius)
    # R1^2 + R2^2 + h^2 = (near^2 + far^2) / 2, so that the denominator is half of a square.
    value = np.asarray((2 * target_radius / (near + far)) ** 2)
    return Bounded(value, 16 * _EPSILON * value)


def sphere_to_coaxial_disk(distance: Floats, target_radius: Floats) -> Bounded:
    """View factor from a sphere to a disk that faces it, the sphere's centre `distance` [m] above the disk's.

    The sphere must not reach below the disk's plane; then its radius does not count.

    Notes
    -----
    ``F12 = (1 - h / sqrt(h^2 + R^2)) / 2``, the disk's solid angle over ``4 pi`` [Feingold and Gupta 1970], without
    the difference.
    """
    slant = np.hypot(distance, target_radius)
    value = np.asarray((target_radius / slant) * (target_radius / (slant + distance)) / 2)
    return Bounded(value, 16 * _EPSILON * value)


def sphere_to_polygon(offsets: Floats) -> Bounded:
    """View factor from a sphere to a polygon that faces it; `offsets` (N, 3) [m] lead from its centre to the vertices.

    The sphere must not reach below the polygon's plane; then its radius does not count.

    Notes
    -----
    A receiver on the polygon sees the whole sphere, as if its light came from its centre: ``cos / (4 pi r^2) dA``
    integrates to the polygon's solid angle over ``4 pi``. Each triangle of the fan has
    ``tan(omega / 2) = a . (b x c) / (abc + (a . b) c + (b . c) a + (c . a) b)`` [Van Oosterom and Strackee 1983].
    """
    a, b, c = offsets[:1], offsets[1:-1], offsets[2:]
    u, v = b - a, c - a
    volume = np.cross(u, v) @ a[0]
    ra, rb, rc = _norm(a), _norm(b), _norm(c)
    whole = ra * rb * rc + (a * b).sum(axis=1) * rc + (b * c).sum(axis=1) * ra + (c * a).sum(axis=1) * rb
    # d omega = 2 (whole d volume - volume d whole) / (whole^2 + volume^2), and whole is a sum of four terms.
    square = whole**2 + volume**2
    lost = np.abs(whole) * ra * _norm(u) * _norm(v) + np.abs(volume) * 4 * ra * rb * rc
    error = 16 * _EPSILON * (lost / square).sum() / (2 * np.pi)
    # Seen from its front, a polygon goes round counter-clockwise, and the volume is negative.
    value = np.asarray(-2 * np.arctan2(volume, whole).sum() / (4 * np.pi))
    return Bounded(value, np.asarray(error + 4 * _EPSILON * np.abs(value)))


def _norm(vectors: Floats) -> Floats:
    result: Floats = np.linalg.norm(vectors, axis=1)
    return result
