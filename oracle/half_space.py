"""A half-space that scatters isotropically, with all orders of scattering."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.reflection.domain import together, within

_EPSILON = float(np.finfo(np.float64).eps)
# Step and reach of the trapezoidal rule for H, which converges as exp(-pi^2 / step).
_STEP = 0.25
_REACH = 42.0


def h_function(cosine: ArrayLike, albedo: ArrayLike) -> Bounded:
    """Chandrasekhar's H function for isotropic scattering.

    Parameters
    ----------
    cosine : array_like
        Of the angle to the normal, in [0, 1].
    albedo : array_like
        Of single scattering, ``sigma_s / sigma_t``, in [0, 1].

    Returns
    -------
    Bounded
        Shape of the arguments broadcast together; between 1 and 2.91.

    Notes
    -----
    The solution of ``H(m) = 1 + (w/2) m H(m) int_0^1 H(x)/(m + x) dx`` is ``log H = -(m/pi) int_0^inf
    log(1 - w atan(t)/t) / (1 + m^2 t^2) dt`` [Chandrasekhar 1960; Stibbs and Weir 1959]. With ``t = e^v / m`` the
    integrand is analytic for ``|Im v| < pi/2`` and decays on both sides, where the trapezoidal rule is best.
    """
    mu, w = together(
        cosine=within("cosine", cosine, 0, 1, "it must be in [0, 1]"),
        albedo=within("albedo", albedo, 0, 1, "it must be in [0, 1]"),
    )
    logarithm = _log_h(mu, w)
    value = np.exp(logarithm)
    return Bounded(value, 32 * _EPSILON * value)


def half_space_brdf(cosine_in: ArrayLike, cosine_out: ArrayLike, albedo: ArrayLike) -> Bounded:
    """BRDF of a half-space that scatters isotropically, with all orders of scattering.

    Parameters
    ----------
    cosine_in, cosine_out : array_like
        Of the angles of incidence and of reflection to the normal, in (0, 1].
    albedo : array_like
        Of single scattering, in [0, 1].

    Returns
    -------
    Bounded
        [1/sr], shape of the arguments broadcast together; the same in all azimuths.

    Notes
    -----
    ``w / (4 pi) H(m) H(m0) / (m + m0)`` [Chandrasekhar 1960]; without the two H it is single scattering alone.
    """
    m0, m, w = together(
        cosine_in=within("cosine_in", cosine_in, np.finfo(np.float64).tiny, 1, "it must be in (0, 1]"),
        cosine_out=within("cosine_out", cosine_out, np.finfo(np.float64).tiny, 1, "it must be in (0, 1]"),
        albedo=within("albedo", albedo, 0, 1, "it must be in [0, 1]"),
    )
    first, second = h_function(m0, w), h_function(m, w)
    factor = w / (4 * np.pi * (m + m0))
    value = factor * first.value * second.value
    error = factor * (first.error * second.value + second.error * first.value)
    return Bounded(value, error + 8 * _EPSILON * value)


def half_space_albedo(cosine: ArrayLike, albedo: ArrayLike) -> Bounded:
    """Part of the light that a half-space reflects which scatters isotropically, for light from one direction.

    Parameters
    ----------
    cosine : array_like
        Of the angle of incidence to the normal, in [0, 1].
    albedo : array_like
        Of single scattering, in [0, 1].

    Returns
    -------
    Bounded
        In [0, 1], shape of the arguments broadcast together.

    Notes
    -----
    ``1 - H(m0) sqrt(1 - w)`` [Chandrasekhar 1960], with the logarithms of both factors for dark media.
    """
    mu, w = together(
        cosine=within("cosine", cosine, 0, 1, "it must be in [0, 1]"),
        albedo=within("albedo", albedo, 0, 1, "it must be in [0, 1]"),
    )
    logarithm = _log_h(mu, w)
    root = np.log1p(-np.minimum(w, 0.75)) / 2
    value = np.where(w < 0.75, 0 - np.expm1(logarithm + root), 1 - np.exp(logarithm) * np.sqrt(1 - w))
    return Bounded(value, _EPSILON * np.where(w < 0.75, 32 * (logarithm - root), 64))


def _log_h(mu: Floats, w: Floats) -> Floats:
    """Logarithm of the H function."""
    total = np.zeros_like(mu)
    # Below this cosine H is 1.
    safe = np.maximum(mu, 1e-280)
    for v in np.arange(-_REACH, _REACH + _STEP / 2, _STEP):
        t = np.exp(v) / safe
        scattered = w * np.arctan(t) / t
        near_one = np.log1p(-np.minimum(scattered, 0.5))
        logarithm = np.where(scattered < 0.5, near_one, np.log((1 - w) + w * _one_minus_atan_over(t)))
        total = total - logarithm / np.cosh(v)
    result: Floats = np.where(mu > 0, total * _STEP / (2 * np.pi), 0.0)
    return result


def _one_minus_atan_over(t: Floats) -> Floats:
    """``1 - atan(t) / t`` for t > 0, by its alternating series where that is a small number."""
    square = np.minimum(t, 0.3) ** 2
    series = np.zeros_like(square)
    for k in range(15, 0, -1):
        series = 1 / (2 * k + 1) - square * series
    large = np.maximum(t, 0.3)
    result: Floats = np.where(t < 0.3, square * series, 1 - np.arctan(large) / large)
    return result
