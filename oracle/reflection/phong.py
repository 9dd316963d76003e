"""Phong-type lobes: cosine powers around an axis, integrated over polygons and over the hemisphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, direction, dot
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import Area, Receivers
from oracle.reflection.domain import within
from oracle.reflection.lobe_over_polygon import GONE, moment, potential
from oracle.shapes import Polygon, Rectangle

__all__ = ["axial_moment", "directional_albedo", "double_axis_moment", "reflected_radiance"]

_EPSILON = float(np.finfo(np.float64).eps)
_LARGEST_EXPONENT = 10_000
# Points of a Gauss rule over the part of the rim where the power matters.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)


def axial_moment(shape: Polygon | Rectangle, receivers: Receivers, axes: ArrayLike, exponent: int) -> Bounded:
    """Integral of a cosine power around an axis over the directions in which the front of a polygon is seen.

    Parameters
    ----------
    shape : Polygon or Rectangle
        Seen from its front only; from its own plane it is not seen. Non-convex is allowed.
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3). What is below their horizon is clipped away.
    axes : array_like
        Unit vectors, broadcast with the receivers to shape (..., 3). What is more than a right angle from them is
        clipped away too.
    exponent : int
        From 0, which gives the solid angle, to 10,000.

    Returns
    -------
    Bounded
        ``int max(w . axis, 0)^exponent dw`` [sr], shape (...).

    Raises
    ------
    InvalidArgument
        If an axis is no unit vector or the exponent is not such a number.

    Notes
    -----
    Axial moment of Arvo [1995]. In polar coordinates around the axis, z = cos(theta), the integral over the distance
    from the axis leaves the contour integral of ``(1 - z^(n+1)) / (n+1) dphi``. Each edge is an arc of a great circle,
    ``z = c cos(s)``, on which ``dphi = b ds / (1 - z^2)``. Arvo's recurrence is the expansion of that quotient; here it
    is integrated by a Gauss rule over the part of the arc where the power matters, and in closed form beyond, which
    costs the same for all exponents. Small polygons are integrated over their area.
    Where edges nearly cancel, as those of needles and of slivers above a horizon, or pass the receiver at a millionth
    of their length, float64 loses digits: there it is computed once more in `numpy.longdouble`, if that is longer. What
    is lost then (1e-10 or more of some slivers seen from 1e-6 beside the polygon's plane), the bound says.
    """
    return _moment(shape, receivers, axes, exponent, double=False)


def double_axis_moment(shape: Polygon | Rectangle, receivers: Receivers, axes: ArrayLike, exponent: int) -> Bounded:
    """Like `axial_moment`, weighted with the cosine at the receiver.

    Returns
    -------
    Bounded
        ``int max(w . axis, 0)^exponent (w . normal) dw`` [sr], shape (...).

    Notes
    -----
    Double-axis moment of Arvo [1995]. The normal's part along the axis raises the exponent by one; the part across
    leaves the contour integral of ``z^n w . (axis x normal) dz``.
    """
    return _moment(shape, receivers, axes, exponent, double=True)


def reflected_radiance(
    emitter: Area, receivers: Receivers, towards_viewer: ArrayLike, exponent: int, reflectance: ArrayLike
) -> Bounded:
    """Radiance that the modified Phong lobe reflects from a polygonal light to the viewer.

    Parameters
    ----------
    emitter : Area
        Polygon or Rectangle with radiance [W/(m^2 sr)], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3).
    towards_viewer : array_like
        Unit vectors, broadcast with the receivers to shape (..., 3). A viewer below the horizon sees nothing.
    exponent : int
        From 0 to 10,000.
    reflectance : array_like
        The lobe's k_s in [0, 1], shape (C,): what it reflects of perpendicular light (see `directional_albedo`).

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C).

    Notes
    -----
    BRDF ``k_s (n + 2) / (2 pi) max(w . r, 0)^n`` with r the viewer's direction mirrored at the normal
    [Lafortune and Willems 1994], integrated with the cosine at the receiver.
    """
    if not isinstance(emitter.shape, Polygon | Rectangle):
        raise InvalidArgument(f"emitter is a {type(emitter.shape).__name__}, it must be a Polygon or a Rectangle")
    if emitter.two_sided:
        raise InvalidArgument("emitter is two-sided; add the polygon with its vertices reversed")
    factor = within("reflectance", reflectance, 0, 1, "it must be in [0, 1]") * emitter.radiance
    if factor.shape != emitter.radiance.shape:
        raise InvalidArgument(f"reflectance and radiance {emitter.radiance.shape} do not fit together")
    view, oriented = _fit("towards_viewer", towards_viewer, receivers)
    cosine = dot(oriented.normals, view)
    # The mirrored direction has the length of the viewer's; scaling away its rounding error costs no more.
    mirrored = 2 * cosine[..., None] * oriented.normals - view
    axes = mirrored / np.sqrt(dot(mirrored, mirrored))[..., None]
    moment = double_axis_moment(emitter.shape, oriented, axes, exponent)
    error = moment.error
    if exponent > 0:
        # The mirrored direction is off by some ulp, by which the lobe turns.
        below = double_axis_moment(emitter.shape, oriented, axes, exponent - 1)
        error = error + 4 * _EPSILON * exponent * (below.value + below.error)
    # Along the surface rounding decides from which side one looks.
    grazing = np.abs(cosine) <= 8 * _EPSILON
    error = error + np.where(grazing, 1.0, 4 * _EPSILON) * moment.value
    scale = (exponent + 2) / (2 * np.pi)
    value = np.where(cosine > 0, scale * moment.value, 0.0)
    error = np.where((cosine > 0) | grazing, scale * error, 0.0)
    return Bounded(value[..., None] * factor, error[..., None] * factor)


def directional_albedo(cosine: ArrayLike, exponent: int) -> Bounded:
    """Part of the light from one direction that a modified Phong lobe with k_s = 1 reflects.

    Parameters
    ----------
    cosine : array_like
        Of the angle of incidence (or, by reciprocity, of view), in [0, 1].
    exponent : int
        From 0 to 10,000.

    Returns
    -------
    Bounded
        In (0, 1], shape of `cosine`: 1 at normal incidence and below elsewhere, for the horizon cuts the lobe. It is
        what a white furnace shows.

    Notes
    -----
    ``(n + 2) / (2 pi)`` times the double-axis moment of the lune between the horizons of normal and lobe:
    ``g/(n+2) [pi + g int (1 - z^(n+2)) / (1 - z^2) ds] + sin^(n+2) int cos(s)^n sin(s)^2 ds`` with
    ``z = sin cos(s)`` and s from -pi/2 to pi/2, where g and sin belong to the angle of incidence.
    """
    g = within("cosine", cosine, 0, 1, "it must be in [0, 1]")
    n = _exponent(exponent)
    p = n + 2
    sine = np.sqrt((1 - g) * (1 + g))
    core = np.arccos(np.exp(-GONE / max(n, 1)))
    s = core * _NODES
    ratio, _ = potential(g[..., None], sine[..., None], s, p, whole=True)
    inner = core * (ratio * _WEIGHTS).sum(axis=-1)
    # Beyond the core the power is gone, and the rest is the angle around the axis.
    outer = 2 * np.arctan2(g * np.cos(core), np.sin(core))
    # sin^p from what is small where it is not.
    lost = np.minimum(g**2, 0.5)
    power = np.where(g**2 < 0.5, np.exp(p / 2 * np.log1p(-lost)), sine**p)
    _, logarithm = potential(np.zeros(()), np.ones(()), s, p, whole=True)
    rim = power * core * float((np.exp(n * logarithm) * np.sin(s) ** 2) @ _WEIGHTS)
    value = (g * (np.pi + g * inner + outer) + p * rim) / (2 * np.pi)
    return Bounded(value, _EPSILON * (32 * value + 8 * p * p * rim * np.minimum(g**2, sine**2)))


def _exponent(exponent: int) -> int:
    if isinstance(exponent, bool) or not isinstance(exponent, int | np.integer):
        raise InvalidArgument(f"exponent is {exponent!r}, it must be a whole number")
    if not 0 <= exponent <= _LARGEST_EXPONENT:
        raise InvalidArgument(f"exponent is {exponent}, it must be from 0 to {_LARGEST_EXPONENT}")
    return int(exponent)


def _fit(name: str, vectors: ArrayLike, receivers: Receivers) -> tuple[Floats, Receivers]:
    """Unit vectors and receivers, broadcast to one shape."""
    unit = direction(name, vectors)
    try:
        shape = np.broadcast_shapes(unit.shape, receivers.points.shape)
    except ValueError:
        raise InvalidArgument(f"{name} {unit.shape} and receivers {receivers.shape} do not fit together") from None
    fitting = Receivers(np.broadcast_to(receivers.points, shape), np.broadcast_to(receivers.normals, shape))
    return np.broadcast_to(unit, shape), fitting


def _moment(shape: Polygon | Rectangle, receivers: Receivers, axes: ArrayLike, exponent: int, double: bool) -> Bounded:
    n = _exponent(exponent)
    unit, oriented = _fit("axes", axes, receivers)
    polygon = shape.polygon if isinstance(shape, Rectangle) else shape
    result = Bounded(np.zeros(oriented.shape), np.zeros(oriented.shape))
    for part in chunks(oriented.shape, at_once=1024):
        points, normals, along = (
            np.reshape(array[part], (-1, 3)) for array in (oriented.points, oriented.normals, unit)
        )
        here = moment(polygon, points, normals, along, n, double)
        result.value[part] = here.value.reshape(result.value[part].shape)
        result.error[part] = here.error.reshape(result.error[part].shape)
    return result
