"""Fresnel's equations between any two indices, with bounds that cover an uncertain angle of incidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.reflection import double_double as dd

Complexes: TypeAlias = NDArray[np.complex128]

_EPSILON = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Polarised:
    """A fraction of power for light polarised perpendicular (s) and parallel (p) to the plane of incidence."""

    s: Bounded
    p: Bounded

    @property
    def unpolarised(self) -> Bounded:
        """The fraction for unpolarised light, the mean of both."""
        return (self.s + self.p) * 0.5


@dataclass(frozen=True, eq=False)
class Interface:
    """What light meets at an interface; `q` is n_t cos_t, complex, with a bound on its error."""

    reflectance: Polarised
    transmittance: Polarised
    q: Complexes
    q_error: Floats


def interface(c: Floats, c_error: Floats, near: Floats, far: Floats, k: Floats) -> Interface:
    """Fresnel's equations between the indices `near` and `far + i k`, for checked arrays of one shape.

    The bounds cover an error `c_error` of the cosine c >= 0. The transmittance is meant for k = 0 only.
    """
    # In pairs: difference = n_t^2 - n_i^2 (real part), m = n_i c, radicand = q^2, brewster = 0 where r_p = 0.
    n_i, n_t = dd.exact(near), dd.exact(far)
    minus_n_i = (-near, np.zeros_like(near))
    k_squared = dd.multiply(dd.exact(k), dd.exact(k))
    difference = dd.multiply(dd.add(n_t, minus_n_i), dd.add(n_t, n_i))
    difference = dd.add(difference, (-k_squared[0], -k_squared[1]))
    m = dd.multiply(n_i, dd.exact(c))
    m_squared = dd.multiply(m, m)
    radicand = dd.add(difference, m_squared)[0]
    c_squared = dd.multiply(dd.exact(c), dd.exact(c))
    brewster = dd.add(dd.multiply(difference, c_squared), dd.add(m_squared, m_squared))
    brewster_real = dd.add(brewster, dd.multiply(n_i, minus_n_i))[0]
    brewster_imaginary = 2 * far * k * c**2

    q = _square_root(radicand, 2 * far * k)
    # |N^2 - n_i^2|, and magnitudes that the pairs' errors are relative to.
    contrast = np.hypot(far - near, k) * np.hypot(far + near, k)
    magnitude = np.abs(far - near) * (far + near) + k**2
    radicand_error = 16 * dd.EPSILON * (magnitude + m_squared[0]) + 2 * near**2 * c * c_error
    q_length = np.abs(q)
    # |sqrt(x + d) - sqrt(x)| <= |d| / max(sqrt|x|, sqrt|d|), up to the factor of 2.
    q_floor = np.maximum(q_length, np.sqrt(radicand_error))
    q_error = 2 * np.where(q_floor > 0, radicand_error / np.where(q_floor > 0, q_floor, 1.0), 0.0)
    q_error = q_error + 4 * _EPSILON * q_length

    # Denominators; without an interface nothing is reflected, and they may vanish.
    same = contrast == 0
    s_sum = np.where(same, 1.0, np.abs(m[0] + q))
    p_sum = np.hypot((far - k) * (far + k) * c + near * q.real, 2 * far * k * c + near * q.imag)
    p_sum = np.where(same, 1.0, p_sum)
    squared_index = far**2 + k**2
    s_shift = (q_error + near * c_error) / s_sum
    p_shift = (near * q_error + squared_index * c_error) / p_sum

    r_s = np.minimum((contrast / s_sum**2) ** 2, 1.0)
    brewster_length = np.hypot(brewster_real, brewster_imaginary)
    scale = contrast / p_sum**2
    r_p = np.minimum((brewster_length * scale) ** 2, 1.0)
    # Where the denominator is uncertain by a large part of itself, so is the result.
    s_error = 40 * _EPSILON * r_s + np.minimum(1.0, 6 * r_s * s_shift / np.maximum(1 - s_shift, 0.05) ** 4)
    brewster_error = 32 * dd.EPSILON * (near**2 + magnitude * c**2) + 2 * (contrast + 2 * near**2) * c * c_error
    p_error = 40 * _EPSILON * r_p + np.minimum(
        1.0,
        6 * r_p * p_shift / np.maximum(1 - p_shift, 0.05) ** 4
        + 2 * scale**2 * (brewster_length + brewster_error) * brewster_error,
    )

    t_s = np.minimum(4 * m[0] * q.real / s_sum**2, 1.0)
    t_p = np.minimum(4 * far**2 * c * near * q.real / p_sum**2, 1.0)
    t_s_slope, t_p_slope = 4 * m[0] / s_sum**2, 4 * far**2 * c * near / p_sum**2
    t_s_error = 40 * _EPSILON * t_s + np.minimum(1.0, 2 * t_s_slope * q_error + 6 * t_s * s_shift)
    t_p_error = 40 * _EPSILON * t_p + np.minimum(1.0, 2 * t_p_slope * q_error + 6 * t_p * p_shift)
    with_c = 2 * c_error
    t_s_error = t_s_error + np.minimum(1.0, 4 * near * q.real / s_sum**2 * with_c)
    t_p_error = t_p_error + np.minimum(1.0, 4 * far**2 * near * q.real / p_sum**2 * with_c)
    return Interface(
        Polarised(Bounded(r_s, s_error), Bounded(r_p, p_error)),
        Polarised(Bounded(t_s, t_s_error), Bounded(t_p, t_p_error)),
        q,
        q_error,
    )


def mean_reflectance(c: Floats, near: Floats, far: Floats, k: Floats) -> Floats:
    """Reflectance for unpolarised light, without bounds, for the many nodes of a quadrature."""
    if not k.any():
        difference = (far - near) * (far + near)
        radicand = difference + (near * c) ** 2
        q = np.sqrt(np.maximum(radicand, 0.0))
        perpendicular = difference / (near * c + q) ** 2
        parallel = (far**2 * c - near * q) / (far**2 * c + near * q)
        mean: Floats = np.where(radicand > 0, (perpendicular**2 + parallel**2) / 2, 1.0)
        return mean
    index = far + 1j * k
    root = np.sqrt((index - near) * (index + near) + (near * c) ** 2)
    s = (near * c - root) / (near * c + root)
    p = (index**2 * c - near * root) / (index**2 * c + near * root)
    return (s.real**2 + s.imag**2 + p.real**2 + p.imag**2) / 2


def _square_root(real: Floats, imaginary: Floats) -> Complexes:
    """Principal root of a complex number with `imaginary` >= 0, each part right to a few ulp."""
    larger = np.sqrt((np.hypot(real, imaginary) + np.abs(real)) / 2)
    smaller = np.where(larger > 0, imaginary / np.where(larger > 0, 2 * larger, 1.0), 0.0)
    root: Complexes = np.where(real >= 0, larger, smaller) + 1j * np.where(real >= 0, smaller, larger)
    return root
