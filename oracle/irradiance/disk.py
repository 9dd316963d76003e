"""Projected solid angle of disks."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats, dot
from oracle.bounded import Bounded
from oracle.shapes import Disk


def disk(shape: Disk, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
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
    n = normals
    offset = shape.center - points
    w = shape.normal
    h = dot(offset, np.broadcast_to(w, offset.shape))
    in_plane = offset - h[..., None] * w
    # The frame of the disk: u points away from the receiver's foot; any direction will do on the axis. Near the axis
    # rounding turns u out of the disk's plane, from where it is brought back.
    fallback = np.cross(w, np.eye(3)[np.abs(w).argmin()])
    u = _unit_or(in_plane, fallback)
    u = _unit_or(u - dot(u, np.broadcast_to(w, u.shape))[..., None] * w, fallback)
    rho = dot(offset, u)
    v = np.cross(np.broadcast_to(w, u.shape), u)
    r = shape.radius
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
    result: Floats = np.where(in_front | two_sided, np.abs(contour) / 2, 0.0)
    return Bounded(result, np.full_like(result, 1e-14))


def _unit_or(vectors: Floats, fallback: Floats) -> Floats:
    """Vectors (..., 3) scaled to length 1, and `fallback` (3,) in place of those without length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Floats = np.where(
        length > 0, vectors / np.where(length > 0, length, 1.0), fallback / np.linalg.norm(fallback)
    )
    return result


