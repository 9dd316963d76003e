"""Diffuse reflection: surfaces that are equally bright from everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, light
from oracle.bounded import Bounded
from oracle.emitters import Emitter, Receivers
from oracle.irradiances import irradiance
from oracle.reflection.domain import together, within
from oracle.shapes import Sphere

_EPSILON = float(np.finfo(np.float64).eps)
# pi = np.pi + _PI_REST to twice the digits.
_PI_REST = 1.2246467991473532e-16


def exitance(received: Bounded, reflectance: ArrayLike) -> Bounded:
    """Reflected exitance ``M = rho E`` of a diffuse surface, in all directions together.

    Parameters
    ----------
    received : Bounded
        Irradiance [W/m^2], shape (..., C), as `oracle.irradiances.irradiance` returns it.
    reflectance : array_like
        Part that is reflected, in [0, 1], shape (C,) or (..., C).

    Returns
    -------
    Bounded
        Exitance [W/m^2], shape (..., C).

    Raises
    ------
    InvalidArgument
        If a reflectance is below 0 or above 1, which would be a surface that shines by itself.
    """
    return received * _reflectance(reflectance)


def radiance(received: Bounded, reflectance: ArrayLike) -> Bounded:
    """Reflected radiance ``L = (rho / pi) E`` of a diffuse surface, the same in every direction.

    Parameters
    ----------
    received : Bounded
        Irradiance [W/m^2], shape (..., C), as `oracle.irradiances.irradiance` returns it.
    reflectance : array_like
        Part that is reflected, in [0, 1], shape (C,) or (..., C).

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C).

    Raises
    ------
    InvalidArgument
        If a reflectance is below 0 or above 1.

    Notes
    -----
    A constant BRDF f reflects ``f`` times the integral of the cosine over the hemisphere, pi f, of the light; so f is
    ``rho / pi`` [Lambert 1760; Nicodemus et al. 1977]. A white surface in a uniform surrounding is invisible.
    """
    result = received * (_reflectance(reflectance) / np.pi)
    return Bounded(result.value, result.error + 2 * _EPSILON * result.value)


def sphere(
    shape: Sphere, emitter: Emitter | Sequence[Emitter], directions: ArrayLike, reflectance: ArrayLike
) -> Bounded:
    """Radiance at points of a diffuse sphere, lit from outside it.

    Parameters
    ----------
    shape : Sphere
        The sphere; it reflects on its outside and does not shine.
    emitter : Emitter or sequence of Emitter
        What lights it, with C channels.
    directions : array_like
        From the centre to the points of the surface, unit vectors, shape (..., 3).
    reflectance : array_like
        In [0, 1], shape (C,).

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C), in whatever direction one looks.

    Notes
    -----
    ``L = (rho / pi) E(n)``. A convex body hides from each of its points just what lies below the point's horizon.
    The bound takes the points for exact after rounding to the nearest float64.
    """
    normals = Receivers(np.zeros(3), np.asarray(directions)).normals
    return radiance(irradiance(emitter, Receivers(shape.center + shape.radius * normals, normals)), reflectance)


def phase_function(phase_angle: ArrayLike) -> Bounded:
    """How much of its full brightness a diffuse sphere under parallel light shows, Lambert's phase curve.

    Parameters
    ----------
    phase_angle : array_like
        Angle at the sphere between the directions to the light and to the viewer [rad], in [0, pi]: 0 when full.

    Returns
    -------
    Bounded
        In [0, 1], of the same shape.

    Notes
    -----
    ``(sin a + (pi - a) cos a) / pi`` [Lambert 1760; Sobolev 1975]: the integral of the two cosines over the lune that
    is both lit and seen. For thin crescents, x = pi - a small, the difference ``sin x - x cos x`` is summed as a series
    ``sum 2k (-1)^(k+1) x^(2k+1) / (2k+1)!``.
    """
    angle = within("phase_angle", phase_angle, 0, np.pi, "it must be in [0, pi]")
    dark = (np.pi - angle) + _PI_REST
    # A factor of x^3 / 3 is taken out of the series.
    square = np.minimum(dark, 1.0) ** 2
    series = np.zeros_like(square)
    for k in range(10, 0, -1):
        series = 1 - square * series * (k + 1) / (k * (2 * k + 2) * (2 * k + 3))
    crescent = dark**3 / 3 * series
    value = np.where(dark < 1, crescent, np.sin(angle) + dark * np.cos(angle)) / np.pi
    return Bounded(value, 16 * _EPSILON * value)


def disk_mean(irradiance: ArrayLike, phase_angle: ArrayLike, reflectance: ArrayLike) -> Bounded:
    """Mean radiance over the disk that a distant viewer sees of a diffuse sphere under parallel light.

    Parameters
    ----------
    irradiance : array_like
        Of a surface that faces the light [W/m^2], at least 0, shape (..., C).
    phase_angle : array_like
        Angle between the directions to the light and to the viewer [rad], in [0, pi], shape (..., 1) or ().
    reflectance : array_like
        In [0, 1], shape (..., C).

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C); the dark part of the disk counts. Times the disk's solid angle it is the
        irradiance at the viewer.

    Notes
    -----
    ``(2/3) (rho / pi) E Phi(a)`` with Lambert's phase curve Phi: the geometric albedo of a white diffuse sphere is 2/3.
    """
    curve = phase_function(phase_angle)
    received, rho, value, error = together(
        irradiance=light("irradiance", irradiance),
        reflectance=_reflectance(reflectance),
        phase_angle=curve.value,
        phase_angle_error=curve.error,
    )
    factor = 2 / (3 * np.pi) * rho * received
    return Bounded(factor * value, factor * error + 8 * _EPSILON * factor * value)


def _reflectance(value: ArrayLike) -> Floats:
    return within("reflectance", value, 0, 1, "it must be in [0, 1]")
