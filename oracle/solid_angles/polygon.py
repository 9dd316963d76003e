"""Solid angle of polygons, by a signed fan of triangles [van Oosterom and Strackee 1983]."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np

from oracle.arrays import Floats, direction
from oracle.arrays import dot as plain_dot
from oracle.bounded import Bounded
from oracle.compensated import dot, two_product, two_sum
from oracle.shapes import Polygon, Rectangle

_EPSILON = float(np.finfo(np.float64).eps)


def polygon(shape: Polygon, points: Floats) -> Bounded:
    """Solid angle (N,) [sr] of a polygon at points (N, 3)."""
    return _of_corners([[Fraction(float(x)) for x in vertex] for vertex in shape.vertices], points)


def rectangle(shape: Rectangle, points: Floats) -> Bounded:
    """Solid angle (N,) [sr] of a rectangle, whose corners are not rounded."""
    c, u, v = ([Fraction(float(x)) for x in part] for part in (shape.center, shape.half_u, shape.half_v))
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return _of_corners([[x + s * y + t * z for x, y, z in zip(c, u, v, strict=True)] for s, t in signs], points)


def _in_parts(numbers: list[Fraction]) -> tuple[Floats, Floats]:
    """Exact numbers as float64 and what that rounds away."""
    high = [float(x) for x in numbers]
    return np.array(high), np.array([float(x - Fraction(h)) for x, h in zip(numbers, high, strict=True)])


def _of_corners(corners: list[list[Fraction]], points: Floats) -> Bounded:
    """Polygons whose corners are known exactly."""
    edges = [[x - y for x, y in zip(corner, corners[0], strict=True)] for corner in corners]
    size = float(max(abs(x) for edge in edges for x in edge))
    parts = [_in_parts(corner) for corner in corners]
    first, low = two_sum(parts[0][0], -points)
    # Scaled by powers of two, which rounds nothing, so that no product leaves the range of float64.
    scale = np.ldexp(1.0, np.clip(-np.frexp(np.maximum(np.abs(first).max(axis=1), size))[1], -1000, 1000))
    own = 2.0 ** -int(np.clip(np.frexp(size)[1], -1000, 1000))
    offsets = []
    for high, rest in parts:
        offset, lost = two_sum(high, -points)
        offsets.append((offset + (lost + rest)) * scale[:, None])
    first, low = first * scale[:, None], (low + parts[0][1]) * scale[:, None]

    # Doubled areas of the triangles that fan out from the first corner, and their sum, as vectors.
    areas = []
    for left, right in pairwise(edges[1:]):
        u, v = ([x * Fraction(own) for x in edge] for edge in (left, right))
        areas.append([u[j] * v[k] - u[k] * v[j] for j, k in ((1, 2), (2, 0), (0, 1))])
    determinants = []
    for area in areas:
        high, rest = _in_parts(area)
        determinants.append(dot(high, rest, first, low) * (scale / own) ** 2)
    whole = np.array([float(sum(area[axis] for area in areas)) for axis in range(3)])
    normal = direction("normal", whole, any_length=True)

    in_plane = np.all([determinant == 0 for determinant in determinants], axis=0)
    result = _fan(offsets, determinants)
    poor = ~in_plane & (result.error > 1e-13 * np.abs(result.value))
    if poor.any():
        height = np.abs(np.sum(determinants, axis=0)[poor] / (scale[poor] / own) ** 2 / np.linalg.norm(whole))
        again = _fan_around_foot([offset[poor] for offset in offsets], height, normal)
        better = again.error < result.error[poor]
        result.value[poor] = np.where(better, again.value, result.value[poor])
        result.error[poor] = np.where(better, again.error, result.error[poor])
    if in_plane.any():
        flat = _in_plane([offset[in_plane] for offset in offsets], normal)
        result.value[in_plane], result.error[in_plane] = flat.value, flat.error
    value = np.minimum(np.abs(result.value), 2 * np.pi)
    return Bounded(value, np.minimum(result.error, 2 * np.pi))


def _fan(offsets: list[Floats], determinants: list[Floats]) -> Bounded:
    """Sum of the signed triangles with a common first corner."""
    lengths = [np.sqrt(plain_dot(offset, offset)) for offset in offsets]
    total, error = np.zeros_like(lengths[0]), np.zeros_like(lengths[0])
    for i, determinant in enumerate(determinants, start=1):
        a, b, c = offsets[0], offsets[i], offsets[i + 1]
        ra, rb, rc = lengths[0], lengths[i], lengths[i + 1]
        product = ra * rb * rc
        rest = product + plain_dot(a, b) * rc + plain_dot(a, c) * rb + plain_dot(b, c) * ra
        angle = 2 * np.arctan2(determinant, rest)
        total += angle
        error += _error_of_angle(angle, rest, determinant, 6 * product, np.abs(determinant))
    return Bounded(total, error)


def _fan_around_foot(offsets: list[Floats], height: Floats, normal: Floats) -> Bounded:
    """As `_fan`, with triangles around the point's projection on the plane.

    They are poor for points far to the side, but have no diagonals next to which digits get lost.
    """
    lengths = [np.sqrt(plain_dot(offset, offset)) for offset in offsets]
    # Corners are not quite in one plane, by as much as rounding moved them.
    normals = np.broadcast_to(normal, offsets[0].shape)
    heights = [plain_dot(offset, normals) for offset in offsets]
    side = np.sign(np.sum(heights, axis=0))
    astray = [np.abs(h - side * height) + 2 * _EPSILON * r for h, r in zip(heights, lengths, strict=True)]
    total, error = np.zeros_like(height), np.zeros_like(height)
    for i, b in enumerate(offsets):
        c, rb, rc = offsets[i - 1], lengths[i], lengths[i - 1]
        edge = c - b
        cross = np.cross(b, edge)
        area = plain_dot(cross, normals)
        rest = rb * rc + plain_dot(b, c) + height * (rb + rc)
        angle = 2 * np.arctan2(area, rest)
        total += angle
        reach = np.sqrt(plain_dot(edge, edge)) * np.minimum(rb, rc) + np.abs(area)
        error += _error_of_angle(
            angle, rest, area, 4 * (rb * rc + height * (rb + rc)), 4 * rb * reach / np.minimum(rb, rc)
        )
        # An edge so much higher or lower sweeps at most half a turn, as far as it is away.
        distance = np.sqrt(plain_dot(cross, cross)) / np.sqrt(plain_dot(edge, edge))
        moved = np.maximum(astray[i], astray[i - 1])
        error += np.pi * moved / np.maximum(distance, moved)
    return Bounded(total, error)


def _error_of_angle(angle: Floats, x: Floats, y: Floats, error_x: Floats, error_y: Floats) -> Floats:
    """Bound for ``2 atan2(y, x)`` with errors of x and y in units of eps."""
    squared = x**2 + y**2
    known = squared > (8 * _EPSILON * (error_x + error_y)) ** 2
    turned = (np.abs(y) * error_x + np.abs(x) * error_y) / np.where(known, squared, 1.0)
    return np.where(known, _EPSILON * (4 * turned + 4 * np.abs(angle)), 2 * np.pi)


def _in_plane(offsets: list[Floats], normal: Floats) -> Bounded:
    """Points in the plane: half of all directions on the polygon, none beside it, and anything between on its edge."""
    axis = int(np.abs(normal).argmax())
    x, y = (axis + 1) % 3, (axis + 2) % 3
    inside, on_edge = np.zeros(len(offsets[0]), dtype=np.bool_), np.zeros(len(offsets[0]), dtype=np.bool_)
    for i, b in enumerate(offsets):
        a = offsets[i - 1]
        left, left_low = two_product(a[:, x], b[:, y])
        right, right_low = two_product(a[:, y], b[:, x])
        side = (left - right) + (left_low - right_low)
        # A ray to the right passes through an edge that goes upwards if the point is to the left of it.
        rises, falls = (a[:, y] <= 0) & (b[:, y] > 0), (a[:, y] > 0) & (b[:, y] <= 0)
        inside ^= (rises & (side > 0)) | (falls & (side < 0))
        on_edge |= (side == 0) & (a[:, x] * b[:, x] <= 0) & (a[:, y] * b[:, y] <= 0)
    value = np.where(on_edge, np.pi, np.where(inside, 2 * np.pi, 0.0))
    return Bounded(value, np.where(on_edge, np.pi, 4 * _EPSILON * value))
