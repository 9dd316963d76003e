"""Projected solid angle of polygons, clipped at the receiver's horizon.

Stokes' theorem turns the integral of the receiver's cosine over the polygon's solid angle into one along its edges,
``1/2 sum_i Theta_i (n . Gamma_i)``, with the angle Theta_i that edge i subtends and the unit normal Gamma_i of the
plane through edge and receiver [Lambert 1760; Nishita and Nakamae 1985; Arvo 1994]. Two things keep its digits:

- The angle comes from atan2 of sine and cosine; the arc cosine loses half of its digits for small angles.
- The contributions of a far polygon's edges cancel but for the square of its angular size. The constant part of
  ``Theta_i / |v_i x v_j|`` is therefore split off and summed as an area; what is left of it, g_i, is small and computed
  without cancellation.

Arrays of vectors have the shape (3, ...) here: numpy works fastest on long last axes.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.shapes import Polygon

# float64, and longer where that is not enough.
Reals: TypeAlias = NDArray[np.floating[Any]]

_EPSILON = float(np.finfo(np.float64).eps)
# Below this angular size (radius over distance, squared) the difference form is the more precise one.
_FAR = 0.15**2
# Where the bound exceeds this part of the value, longer numbers are tried.
_POOR = 2e-11
# Rounding errors in units of eps times the magnitude of what is added up; the largest found in verification was 3.
_ROUNDINGS = 8.0


def polygon(shape: Polygon, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Projected solid angle of a polygon [sr].

    Parameters
    ----------
    shape : Polygon
        Its front counts, and its back if `two_sided`. The polygon's own plane sees neither: there the result is 0,
        though on the polygon itself the limits from both sides are not.
    points, normals : ndarray
        Receivers, shape (N, 3) each.

    Returns
    -------
    Bounded
        Shape (N,). The error is a few ulp of the value where cosines of light and receiver are not small. Divide by the
        smaller one elsewhere: for a light seen nearly edge-on, or a sliver above the horizon.
    """
    vertices, p = shape.vertices.T[:, :, None], points.T
    result = _precise_contour(vertices, p[:, None, :], vertices, vertices[:, :1], normals.T)

    # From behind, the vertices go round the other way.
    value = np.abs(result.value) if two_sided else np.maximum(result.value, 0)
    w = shape.normal[:, None]
    away = p - vertices[:, 0]
    height = (w * away).sum(axis=0)
    value[height == 0 if two_sided else height <= 0] = 0
    # So near to the plane that the side is uncertain, all may be wrong.
    uncertain = np.abs(height) < _ROUNDINGS * _EPSILON * ((np.abs(w) + (w != 0)) * np.abs(away)).sum(axis=0)
    return Bounded(value, np.where(uncertain, result.error + np.abs(result.value), result.error))


def contour(offsets: Floats, normals: Floats, relative: Floats) -> Bounded:
    """Signed projected solid angle of polygons that differ from receiver to receiver.

    Parameters
    ----------
    offsets : ndarray
        Vertices as seen from the receivers [m], shape (N, V, 3); repeated ones do no harm. Positive are polygons that
        go round counter-clockwise as seen from the side on which the receiver is.
    normals : ndarray
        Unit normals of the receivers, shape (N, 3).
    relative : ndarray
        The same vertices relative to any point nearby, shape (N, V, 3): for far polygons these carry the digits.

    Returns
    -------
    Bounded
        Shape (N,) [sr], clipped at the receivers' horizons.
    """
    origin = np.zeros((3, 1, 1))
    return _precise_contour(offsets.transpose(2, 1, 0), origin, relative.transpose(2, 1, 0), origin, normals.T)


def _precise_contour(vertices: Floats, points: Floats, relative: Floats, origin: Floats, n: Floats) -> Bounded:
    """As `contour`, for vertices (3, V, N or 1) seen from points (3, 1, N or 1), and relative ones from the origin."""
    result = _contour(vertices - points, relative - origin, np.ascontiguousarray(n))
    poor = result.error > _POOR * np.abs(result.value)
    poor &= result.value != 0
    if not poor.any() or np.finfo(np.longdouble).eps >= _EPSILON:
        return result

    # Once more, with the longer numbers that many processors have; from the subtractions on, which round as well.
    def longer(array: Floats) -> NDArray[np.longdouble]:
        return (array if array.shape[-1] == 1 else array[..., poor]).astype(np.longdouble)

    m = n[:, poor].astype(np.longdouble)
    m /= np.sqrt((m**2).sum(axis=0))
    again = _contour(longer(vertices) - longer(points), longer(relative) - longer(origin), m)
    result.value[poor], result.error[poor] = again.value, again.error + _EPSILON / 2 * np.abs(again.value)
    return result


def _contour(offsets: Reals, relative: Reals, n: Reals) -> Bounded:
    """As `contour`, with vectors first: offsets (3, V, N), relative (3, V, N or 1), n (3, N)."""
    heights = n[0] * offsets[0] + n[1] * offsets[1] + n[2] * offsets[2]
    below = (heights <= 0).all(axis=0)
    whole = (heights >= 0).all(axis=0) & ~below
    centered = relative - relative.mean(axis=1, keepdims=True)
    size_squared = (centered**2).sum(axis=0).max(axis=0)
    center = offsets[:, 0] - centered[:, 0]
    far = size_squared < _FAR * (center[0] ** 2 + center[1] ** 2 + center[2] ** 2)

    value, error = np.zeros(n.shape[1], n.dtype), np.zeros(n.shape[1], n.dtype)
    for is_far in (True, False):
        for is_whole in (True, False):
            which = ~below & (far == is_far) & (whole == is_whole)
            if not which.any():
                continue
            everyone = which.all()
            o, z, m = (offsets, heights, n) if everyone else (offsets[:, :, which], heights[:, which], n[:, which])
            c = centered if everyone or centered.shape[2] == 1 else centered[:, :, which]
            if is_far:
                part = _far_contour(o[:, 0] - c[:, 0], c if is_whole else _clip(c, z), m)
            else:
                part = _near_contour(o, c, None if is_whole else z, m)
            value[which], error[which] = part.value, part.error
    return Bounded(value, error)  # type: ignore[arg-type]  # longer numbers stay within this module


def _clip(relative: Reals, heights: Reals) -> Reals:
    """The part of each polygon above the horizon, with twice as many vertices, many of them repeated.

    Follows Sutherland and Hodgman (1974). Pieces of a polygon that is not convex stay connected along the horizon, by
    edges that are passed in both directions and cancel.
    """
    count = heights.shape[0]
    is_above = heights >= 0
    vertices: list[Reals] = []
    for i in range(count):
        j = (i + 1) % count
        crosses = is_above[i] != is_above[j]
        t = heights[i] / np.where(crosses, heights[i] - heights[j], 1.0)
        crossing = relative[:, i] + t * (relative[:, j] - relative[:, i])
        vertices += [np.broadcast_to(relative[:, i], crossing.shape), crossing]
    used = np.empty((2 * count, heights.shape[1]), dtype=np.bool_)
    used[::2] = is_above
    used[1::2] = is_above != np.roll(is_above, -1, axis=0)
    # Vertices that are not used repeat the one before; the last used one comes before the first.
    latest = np.maximum.accumulate(np.where(used, np.arange(2 * count)[:, None], -1), axis=0)
    latest = np.where(latest < 0, latest[-1], latest)
    clipped: Reals = np.stack(vertices, axis=1)[:, latest, np.arange(heights.shape[1])]
    return clipped


def _near_contour(offsets: Reals, relative: Reals, heights: Reals | None, n: Reals) -> Bounded:
    """Sum over the edges of angle times axis; if heights are given, clipped where they change their sign."""
    edges = np.roll(relative, -1, axis=1) - relative
    lengths = np.sqrt(edges[0] ** 2 + edges[1] ** 2 + edges[2] ** 2)
    squared = offsets[0] ** 2 + offsets[1] ** 2 + offsets[2] ** 2
    count = offsets.shape[1]
    total, magnitude = np.zeros(n.shape[1], n.dtype), np.zeros(n.shape[1], n.dtype)
    crossings: list[tuple[Reals, Reals]] = []
    for i in range(count):
        j = (i + 1) % count
        ex, ey, ez = edges[:, i]
        # Both ends give the same axis; the nearer one loses fewer digits.
        nearer = squared[i] <= squared[j]
        x, y, z = (np.where(nearer, component[i], component[j]) for component in offsets)
        ax, ay, az = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
        sine = np.sqrt(ax * ax + ay * ay + az * az)
        start, end = offsets[:, i], offsets[:, j]
        part: Reals | float = 1.0
        if heights is not None:
            start, end, part, crossing, passes_upwards = _edge_above(start, end, edges[:, i], heights[i], heights[j])
            crossings.append((crossing, passes_upwards))
        cosine = start[0] * end[0] + start[1] * end[1] + start[2] * end[2]
        # An edge that points at the receiver, or has no length, subtends no angle.
        angle = np.arctan2(part * sine, cosine) / np.where(sine == 0, 1.0, sine)
        if heights is not None:
            angle = np.where(part == 0, 0.0, angle)
        total -= angle * (n[0] * ax + n[1] * ay + n[2] * az)
        magnitude += angle * np.sqrt(np.minimum(squared[i], squared[j])) * lengths[i]
    if crossings:
        along, along_magnitude = _along_horizon(crossings, np.sqrt(squared.max(axis=0)), n)
        total, magnitude = total - along, magnitude + along_magnitude
    return Bounded(total / 2, _ROUNDINGS * np.finfo(n.dtype).eps / 2 * magnitude)


def _edge_above(
    start: Reals, end: Reals, edge: Reals, z0: Reals, z1: Reals
) -> tuple[Reals, Reals, Reals, Reals, Reals]:
    """The part of edges above the horizon: start, end, fraction, crossing, and +1 or -1 if it leads up or down."""
    upwards, downwards = (z0 < 0) & (z1 >= 0), (z0 >= 0) & (z1 < 0)
    crosses = upwards | downwards
    t = z0 / np.where(crosses, z0 - z1, 1.0)
    crossing = start + t * edge
    fraction = np.where(upwards, 1 - t, np.where(downwards, t, np.where(z0 < 0, 0.0, 1.0)))
    start, end = np.where(upwards, crossing, start), np.where(downwards, crossing, end)
    return start, end, fraction, crossing, upwards * 1.0 - downwards


def _along_horizon(crossings: list[tuple[Reals, Reals]], extent: Reals, n: Reals) -> tuple[Reals, Reals]:
    """Angles that close the contours along the horizon, and how much rounding may turn them, in units of eps.

    All crossings lie on one line, so that their angles from any one of them stay below pi.
    """
    reference = np.zeros_like(crossings[0][0])
    for crossing, sign in crossings:
        unset = (reference == 0).all(axis=0) & (sign != 0)
        reference = np.where(unset, crossing, reference)
    total, magnitude = np.zeros(n.shape[1], n.dtype), np.zeros(n.shape[1], n.dtype)
    x, y, z = reference
    for (cx, cy, cz), sign in crossings:
        sine = n[0] * (y * cz - z * cy) + n[1] * (z * cx - x * cz) + n[2] * (x * cy - y * cx)
        total += np.where(sign != 0, sign * np.arctan2(sine, x * cx + y * cy + z * cz), 0.0)
        distance = np.sqrt(cx * cx + cy * cy + cz * cz)
        magnitude += np.where(sign != 0, 1 + extent / np.where(distance == 0, 1.0, distance), 0.0)
    return total, magnitude


def _far_contour(center: Reals, centered: Reals, n: Reals) -> Bounded:
    """Difference form: 1/r_c^2 times the projected area, and a sum over the edges of g_i times their axes."""
    edges = np.roll(centered, -1, axis=1) - centered
    lengths_squared = edges[0] ** 2 + edges[1] ** 2 + edges[2] ** 2
    spread = (np.sqrt(lengths_squared) * np.sqrt((centered**2).sum(axis=0))).sum(axis=0)
    count = centered.shape[1]
    rc2 = center[0] ** 2 + center[1] ** 2 + center[2] ** 2
    rc = np.sqrt(rc2)

    # Distances of the vertices, as differences d from that of the centre.
    vertices = [center + centered[:, i] for i in range(count)]
    r, d = [], []
    for i, (x, y, z) in enumerate(vertices):
        radius = np.sqrt(x * x + y * y + z * z)
        u = centered[:, i]
        r.append(radius)
        d.append((u[0] * (x + center[0]) + u[1] * (y + center[1]) + u[2] * (z + center[2])) / (radius + rc))

    area_x, area_y, area_z = np.cross(centered, edges, axis=0).sum(axis=1)
    total = (n[0] * area_x + n[1] * area_y + n[2] * area_z) / rc2
    for i in range(count):
        j = (i + 1) % count
        x, y, z = vertices[i]
        ex, ey, ez = edges[:, i]
        ax, ay, az = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
        product = r[i] * r[j]
        # By the chord, the sine of half the angle is precise; |e|^2 = (r_i - r_j)^2 + 4 r_i r_j sin^2(theta/2).
        half_sine_squared = (lengths_squared[i] - (d[i] - d[j]) ** 2) / (4 * product)
        g = (_angle_over_sine(half_sine_squared) - (rc * (d[i] + d[j]) + d[i] * d[j]) / rc2) / product
        total += g * (n[0] * ax + n[1] * ay + n[2] * az)
    return Bounded(-total / 2, _ROUNDINGS * np.finfo(n.dtype).eps / 2 * spread / rc2)


# theta/sin(theta) - 1 in powers of q = sin^2(theta/2): with asin(s)/(s sqrt(1-s^2)) = sum (4 q)^k / ((2k+1) C(2k,k)).
_SERIES = [1.0]
for _k in range(1, 13):
    _SERIES.append(_SERIES[-1] * 2 * _k / (2 * _k + 1))


def _angle_over_sine(q: Reals) -> Reals:
    """``theta/sin(theta) - 1`` of angles with ``q = sin^2(theta/2)``, up to 0.35 rad."""
    result = np.full_like(q, _SERIES[-1])
    for coefficient in reversed(_SERIES[1:-1]):
        result = coefficient + q * result
    return q * result
