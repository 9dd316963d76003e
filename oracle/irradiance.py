"""Irradiance at oriented points, in closed form, clipped at the receiver's horizon.

Every function takes one emitter and receivers of shape (..., 3) and returns irradiance [W/m^2] of shape (..., C)
in float64. Nothing here knows about occluders: see `oracle.intersection`.
"""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from oracle.arrays import Floats, dot
from oracle.emitters import Constant, Directional, Disk, Point, Polygon, Receivers, Sphere, Spot


@singledispatch
def irradiance(emitter: object, receivers: Receivers) -> Floats:
    """Irradiance of any emitter of this package; see the function of its kind for formula and source."""
    raise TypeError(f"no closed form for the irradiance of {type(emitter).__name__}")


@irradiance.register
def point(emitter: Point, receivers: Receivers) -> Floats:
    """Irradiance of an isotropic point: ``E = I cos(theta) / r^2``.

    Parameters
    ----------
    emitter : Point
        Position [m] and intensity [W/sr], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3), away from the emitter.

    Returns
    -------
    ndarray
        Irradiance [W/m^2], shape (..., C); 0 where the emitter is below the horizon.

    Notes
    -----
    Inverse-square and cosine law [Lambert 1760, Photometria; Pharr, Jakob and Humphreys 2023, eq. 4.11].
    """
    towards = emitter.position - receivers.points
    squared = dot(towards, towards)
    # n . towards is r cos(theta), hence the third power of the distance.
    factor = np.maximum(dot(receivers.normals, towards), 0) / (squared * np.sqrt(squared))
    result: Floats = factor[..., None] * emitter.intensity
    return result


@irradiance.register
def spot(emitter: Spot, receivers: Receivers) -> Floats:
    """Irradiance of a spot: a point whose intensity falls linearly with the angle from its axis.

    Parameters, shapes and domain as for `point`.

    Notes
    -----
    ``I(a) = I clip((cutoff - a) / (cutoff - beam), 0, 1)``; the falloff is a convention, here that of Mitsuba 3's
    ``spot`` plug-in. The angle comes from atan2 of sine and cosine, exact near the axis.
    """
    away = receivers.points - emitter.position
    sine = np.linalg.norm(np.cross(away, emitter.direction), axis=-1)
    angle = np.arctan2(sine, dot(away, emitter.direction))
    falloff = np.clip((emitter.cutoff_angle - angle) / (emitter.cutoff_angle - emitter.beam_width), 0, 1)
    result: Floats = falloff[..., None] * point(Point(emitter.position, emitter.intensity), receivers)
    return result


@irradiance.register
def directional(emitter: Directional, receivers: Receivers) -> Floats:
    """Irradiance of parallel light: ``E = E_perpendicular cos(theta)`` [Lambert 1760].

    Parameters, shapes and domain as for `point`; the receivers' positions do not matter.
    """
    cosine = np.maximum(-dot(receivers.normals, emitter.direction), 0)
    result: Floats = cosine[..., None] * emitter.irradiance
    return result


@irradiance.register
def constant(emitter: Constant, receivers: Receivers) -> Floats:
    """Irradiance of an unobstructed constant environment: ``E = pi L``.

    The integral of ``L cos(theta)`` over the hemisphere; positions and normals do not matter.
    """
    result: Floats = np.broadcast_to(np.pi * emitter.radiance, (*receivers.points.shape[:-1], len(emitter.radiance)))
    return result


@irradiance.register
def polygon(emitter: Polygon, receivers: Receivers) -> Floats:
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
    n = receivers.normals
    offsets = [vertex - receivers.points for vertex in emitter.vertices]
    heights = [dot(n, offset) for offset in offsets]
    shape = np.broadcast_shapes(receivers.points.shape, n.shape)[:-1]

    contour = np.zeros(shape)
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

    in_front = dot(receivers.points - emitter.vertices[0], emitter.normal) > 0
    result: Floats = np.where(in_front, np.abs(contour) / 2, 0.0)[..., None] * emitter.radiance
    return result


def _angle_times_axis(start: Floats, end: Floats, n: Floats) -> Floats:
    """Theta (n . Gamma) of the edge from `start` to `end`, both relative to the receiver."""
    # Not start x end, which loses the digits that both have in common.
    axis = np.cross(start, end - start)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, dot(start, end))
    result: Floats = angle * dot(n, axis) / np.where(sine == 0, 1.0, sine)
    return result


@irradiance.register
def disk(emitter: Disk, receivers: Receivers) -> Floats:
    """Irradiance of a one-sided uniform diffuse disk, clipped at each receiver's horizon.

    Parameters
    ----------
    emitter : Disk
        Center [m], unit normal, radius [m] and radiance [W/(m^2 sr)], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3). In the disk's own plane the result is 0.

    Returns
    -------
    ndarray
        Irradiance [W/m^2], shape (..., C); errors as for `polygon`.

    Notes
    -----
    Stokes' theorem turns the form-factor integral into ``E = L/2 |closed integral of n . (p x dp) / |p|^2|``
    [Lambert 1760; Sparrow 1963, eq. 4; Howell's catalogue B-13 for the unclipped parallel case]. On the arc above the
    horizon the integrand is ``(A + B cos f + C sin f) / (D + F cos f)`` and integrates to elementary functions,
    written here with ``k = F / (S + D)`` so that nothing cancels when the receiver is on the axis (F = 0). The chord
    along the horizon contributes its plain angle.
    """
    n = receivers.normals
    offset = emitter.center - receivers.points
    w = emitter.normal
    h = dot(offset, np.broadcast_to(w, offset.shape))
    in_plane = offset - h[..., None] * w
    # The frame of the disk: u points away from the receiver's foot; any direction will do on the axis. Near the axis
    # rounding turns u out of the disk's plane, from where it is brought back.
    fallback = np.cross(w, np.eye(3)[np.abs(w).argmin()])
    u = _unit_or(in_plane, fallback)
    u = _unit_or(u - dot(u, np.broadcast_to(w, u.shape))[..., None] * w, fallback)
    rho = dot(offset, u)
    v = np.cross(np.broadcast_to(w, u.shape), u)
    r = emitter.radius
    nu, nv, nw, nc = dot(n, u), dot(n, v), dot(n, np.broadcast_to(w, u.shape)), dot(n, offset)

    a, b, c = r**2 * nw, r * (rho * nw - h * nu), -r * h * nv
    d, f = rho**2 + h**2 + r**2, 2 * r * rho
    s = np.sqrt((h**2 + (r - rho) ** 2) * (h**2 + (r + rho) ** 2))
    s = np.where(s == 0, 1.0, s)
    k = f / (s + d)

    # The part of the rim above the horizon: nc + r (nu cos f + nv sin f) >= 0, an arc around `middle`.
    reach = r * np.hypot(nu, nv)
    cut = np.abs(nc) < reach
    half = np.where(cut, np.arccos(np.where(cut, -nc, 0.0) / np.where(cut, reach, 1.0)), np.where(nc > 0, np.pi, 0.0))
    middle = np.arctan2(nv, nu)
    first, last = middle - half, middle + half

    def antiderivatives(phi: Floats) -> tuple[Floats, Floats]:
        """Integrals of 1/(D + F cos) and of cos/(D + F cos), up to a constant."""
        x = np.sin(phi) / (1 + k * np.cos(phi))
        kx = k * x
        ratio = np.where(kx == 0, 1.0, np.arctan(kx) / np.where(kx == 0, 1.0, kx))
        return (phi - 2 * np.arctan(kx)) / s, (-k * phi + 2 * d / (s + d) * ratio * x) / s

    plain_first, cosine_first = antiderivatives(first)
    plain_last, cosine_last = antiderivatives(last)
    growth = (np.cos(last) - np.cos(first)) / (d + f * np.cos(first))
    fg = f * growth
    sine = -growth * np.where(fg == 0, 1.0, np.log1p(fg) / np.where(fg == 0, 1.0, fg))
    arc = a * (plain_last - plain_first) + b * (cosine_last - cosine_first) + c * sine

    # Close the contour along the horizon, from the end of the arc back to its start.
    start = offset + r * (np.cos(first)[..., None] * u + np.sin(first)[..., None] * v)
    end = offset + r * (np.cos(last)[..., None] * u + np.sin(last)[..., None] * v)
    chord = np.arctan2(dot(n, np.cross(end, start)), dot(end, start))
    contour = arc + np.where(cut, chord, 0.0)

    in_front = h < 0
    result: Floats = np.where(in_front, np.abs(contour) / 2, 0.0)[..., None] * emitter.radiance
    return result


def _unit_or(vectors: Floats, fallback: Floats) -> Floats:
    """Vectors (..., 3) scaled to length 1, and `fallback` (3,) in place of those without length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Floats = np.where(
        length > 0, vectors / np.where(length > 0, length, 1.0), fallback / np.linalg.norm(fallback)
    )
    return result


@irradiance.register
def sphere(emitter: Sphere, receivers: Receivers) -> Floats:
    """Irradiance of a uniform diffuse sphere, clipped at each receiver's horizon.

    Parameters
    ----------
    emitter : Sphere
        Center [m], radius [m] and radiance [W/(m^2 sr)], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3). Inside the sphere, which shines outwards, the result is 0.

    Returns
    -------
    ndarray
        Irradiance [W/m^2], shape (..., C). Its error is below 1e-14 of the radiance; while the whole sphere is above
        the horizon also below 1e-15 of the value.

    Notes
    -----
    ``E = pi L (R/d)^2 cos(theta)`` when wholly above the horizon; else the cap that the horizon cuts
    [Snyder 1996; Lagarde and de Rousiers 2014, listing 7].
    """
    towards = emitter.center - receivers.points
    distance = np.linalg.norm(towards, axis=-1)
    inside = distance < emitter.radius
    distance = np.where(inside, emitter.radius, distance)
    cosine = np.clip(dot(receivers.normals, towards) / distance, -1, 1)
    sine = np.linalg.norm(np.cross(receivers.normals, towards), axis=-1) / distance
    sine2_sigma = (emitter.radius / distance) ** 2
    cos_sigma = np.sqrt(np.clip(1 - sine2_sigma, 0, 1))
    sin_sigma = np.sqrt(sine2_sigma)

    above = cosine >= sin_sigma
    below = cosine <= -sin_sigma
    # The cut cap; cot(sigma) is 0 only in contact with the sphere.
    cot_sigma = cos_sigma / sin_sigma
    y = np.clip(-cot_sigma * cosine / np.where(sine == 0, 1.0, sine), -1, 1)
    root = sine * np.sqrt(1 - y**2)
    cut = (cosine * np.arccos(y) - cot_sigma * root) * sine2_sigma + np.arctan2(root, cot_sigma)
    factor = np.where(above, np.pi * cosine * sine2_sigma, np.maximum(cut, 0.0))
    factor = np.where(below | inside, 0.0, factor)
    result: Floats = factor[..., None] * emitter.radiance
    return result
