"""Projected solid angle of polygons."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats, dot
from oracle.bounded import Bounded
from oracle.shapes import Polygon


def polygon(shape: Polygon, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Irradiance of a one-sided uniform diffuse polygon, clipped at each receiver's horizon.

    Parameters
    ----------
    emitter : Polygon
        N >= 3 coplanar vertices [m], shape (N, 3), and radiance [W/(m^2 sr)], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3). In the polygon's own plane the result is 0.

    Returns
    -------
    ndarray
        Irradiance [W/m^2], shape (..., C). Its error is below 1e-14 of the radiance; while the whole polygon is well
        above the horizon also below 1e-15 of the value, divided by the polygon's angular size where that is small.

    Notes
    -----
    Lambert's contour formula ``E = L/2 sum_i Theta_i (n . Gamma_i)`` over the clipped contour [Lambert 1760;
    Nishita and Nakamae 1985; Arvo 1994, eq. 12], with atan2 in place of the arc cosine. The contour is closed
    along the horizon, where Gamma = n and the edge contributes its plain angle.
    """
    n = normals
    offsets = [vertex - points for vertex in shape.vertices]
    heights = [dot(n, offset) for offset in offsets]
    
    contour = np.zeros(len(points))
    # Where the contour passes through the horizon, with +1 for entering the upper side and -1 for leaving it.
    crossings: list[tuple[Floats, Floats]] = []
    for i, (a, za) in enumerate(zip(offsets, heights, strict=True)):
        b, zb = offsets[(i + 1) % len(offsets)], heights[(i + 1) % len(offsets)]
        direction_of_crossing = np.where((za < 0) & (zb >= 0), 1.0, 0.0) - np.where((za >= 0) & (zb < 0), 1.0, 0.0)
        crosses = direction_of_crossing != 0
        t = za / np.where(crosses, za - zb, 1.0)
        crossing = a + t[..., None] * (b - a)
        crossings.append((crossing, direction_of_crossing))

        # The part of this edge above the horizon.
        start = np.where((za < 0)[..., None], crossing, a)
        end = np.where((zb < 0)[..., None], crossing, b)
        contribution = _angle_times_axis(start, end, n)
        contour += np.where((za < 0) & (zb < 0), 0.0, contribution)

    # Along the horizon all crossings lie on one line, so that their angles from any one of them stay below pi.
    reference = np.zeros_like(crossings[0][0])
    for crossing, sign in crossings:
        reference = np.where(
            (np.abs(reference).sum(axis=-1) == 0)[..., None] & (sign != 0)[..., None], crossing, reference
        )
    for crossing, sign in crossings:
        swept = np.arctan2(dot(n, np.cross(reference, crossing)), dot(reference, crossing))
        contour += sign * np.where(sign != 0, swept, 0.0)

    in_front = dot(points - shape.vertices[0], shape.normal) > 0
    result: Floats = np.where(in_front | two_sided, np.abs(contour) / 2, 0.0)
    return Bounded(result, np.full_like(result, 1e-14))


def _angle_times_axis(start: Floats, end: Floats, n: Floats) -> Floats:
    """Theta (n . Gamma) of the edge from `start` to `end`, both relative to the receiver."""
    # Not start x end, which loses the digits that both have in common.
    axis = np.cross(start, end - start)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, dot(start, end))
    result: Floats = angle * dot(n, axis) / np.where(sine == 0, 1.0, sine)
    return result


