"""Irradiance of straight lines, for unit intensity per length.

A metre of the line at the offset p from the receiver, of which h is the distance from the line, adds
``h n . p / |p|^4``: its intensity falls with the sine h/|p| of the angle to the line, and a cosine and the inverse
square follow. With the unit vectors o towards the line's nearest point and t along the line, ends at the distances r1
and r2, the angle D between them, their bisector w, and ``g = D/sin(D) - 1``, the integral over a length l is

    l / (r1 r2) * (g/2 n . o + (w . o) (n . w))

by elementary integration over the angle. Every part is small where the sum is small, so that far lines and receivers
that nearly lie on the line's extension keep their digits. The horizon moves an end that is below it to where n . p = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.compensated import dot, two_product, two_sum
from oracle.emitters import Line
from oracle.kernels.point_like import refuse_on_emitter

_EPSILON = float(np.finfo(np.float64).eps)

# Rounding errors; the largest found in verification was a quarter of this.
_ROUNDINGS = 32 * _EPSILON

# Receivers nearer to the line, in units of the distance to its further end, count as lying on it.
_NEAREST = 1e-25

# D/sin(D) - 1 in powers of D^2: the coefficients 2 (1 - 2^(1-2k)) zeta(2k) / pi^(2k).
_SERIES = (1 / 6, 7 / 360, 31 / 15120, 127 / 604800, 73 / 3421440, 1414477 / 653837184000)


@dataclass(frozen=True, eq=False)
class _Seen:
    """A line as seen from receivers (N,), with their distances scaled by a power of two to about 1."""

    offsets: tuple[tuple[Floats, Floats], tuple[Floats, Floats]]
    """Start and end (N, 3), with what rounding took from them."""
    distance: Floats
    """From the receiver to the line, extended to infinity."""
    towards: Floats
    """Unit vectors (N, 3) to the line's nearest point; 0 on the line's extension."""
    along: Floats
    """Unit vector (3,) from start to end."""
    length: Floats
    ends: tuple[Floats, Floats]
    """Places of start and end along the line, from the nearest point on."""
    radii: tuple[Floats, Floats]
    """Distances of start and end."""
    unit: Floats
    """What the scaled integrals have to be multiplied with [1/m]."""

    @property
    def uncertainty(self) -> Floats:
        """Relative error of `distance` beyond a few ulp."""
        furthest = np.maximum(*self.radii)
        return _EPSILON * _ROUNDINGS * furthest / np.where(self.distance == 0, furthest, self.distance)


@dataclass(frozen=True, eq=False)
class _Terms:
    """What the sum in the module's docstring is made of, shape (N,) each."""

    factor: Floats
    """l / (r1 r2)"""
    excess: Floats
    """g"""
    half_cosine: Floats
    """cos(D/2)"""
    bisector_across: Floats
    """w . o"""
    bisector_along: Floats
    """w . t"""

    @property
    def magnitude(self) -> Floats:
        """Bound on the integral with all cosines at the receiver set to 1."""
        return self.factor * (self.excess + self.bisector_across / self.half_cosine)


def line(emitter: Line, points: Floats, normals: Floats) -> Bounded:
    """Irradiance of a line of unit intensity per length, clipped at each receiver's horizon [1/m], shape (N,).

    Raises
    ------
    OnEmitter
        If a receiver lies on the line.

    Notes
    -----
    The error is a few ulp of the value, unless the line is within 1e-6 of the horizon, all along or where it is cut and
    also near to the receiver.
    """
    seen = _seen(emitter, points)
    h, (s1, s2), (r1, r2) = seen.distance, seen.ends, seen.radii
    z1, z2 = (dot(normals, 0.0, end, low) for end, low in seen.offsets)
    upright, upright_error = _sine_of_nearest(seen, normals, z1, z2)

    # Where the line passes through the horizon, counted from the nearest point or from the start: what rounds less.
    cut = (z1 < 0) != (z2 < 0)
    rise = np.where(cut, z2 - z1, 1.0)
    scale = np.where(cut, seen.length / rise, 0.0)
    shift = z1 * scale
    by_nearest, by_start = np.abs(scale) * h, np.abs(s1) + np.abs(shift)
    crossing = np.clip(np.where(by_nearest < by_start, -upright * h * scale, s1 - shift), s1, s2)
    radius = np.where(cut, np.hypot(h, crossing), 1.0)
    misplaced = np.where(cut, np.minimum(_ROUNDINGS * np.minimum(by_nearest, by_start) / radius, 1.0), 0.0)

    # The part of the line above the horizon.
    start_below, end_below = cut & (z1 < 0), cut & (z2 < 0)
    length = np.where(cut, np.maximum(z1, z2) * np.abs(scale), seen.length)
    ends = np.where(start_below, crossing, s1), np.where(end_below, crossing, s2)
    radii = np.where(start_below, radius, r1), np.where(end_below, radius, r2)
    part = _terms(h, length, ends, radii)
    bisector_up = (np.maximum(z1, 0) / radii[0] + np.maximum(z2, 0) / radii[1]) / (2 * part.half_cosine)
    value = np.maximum(part.factor * (part.excess / 2 * upright + part.bisector_across * bisector_up), 0.0)

    visible = (z1 > 0) | (z2 > 0)
    magnitude = part.factor * (part.excess * np.abs(upright) + part.bisector_across * bisector_up)
    error = (_ROUNDINGS + misplaced) * magnitude + upright_error * part.factor * part.excess
    # The heights are uncertain by so small a turn of the normal.
    certain = (z1 < -_EPSILON * _ROUNDINGS * r1) & (z2 < -_EPSILON * _ROUNDINGS * r2)
    whole = _terms(h, seen.length, seen.ends, seen.radii).magnitude
    turn = (_EPSILON * _ROUNDINGS + seen.uncertainty) * whole
    error = np.where(visible, error, 0.0) + np.where(certain, 0.0, turn)
    return Bounded(np.where(visible, value, 0.0) * seen.unit, error * seen.unit)


def vector(emitter: Line, points: Floats) -> Bounded:
    """Vector irradiance of the same line [1/m], shape (N, 3), with no horizon to clip it.

    Raises
    ------
    OnEmitter
        If a receiver lies on the line.
    """
    seen = _seen(emitter, points)
    whole = _terms(seen.distance, seen.length, seen.ends, seen.radii)
    across = whole.factor * (whole.excess / 2 + whole.bisector_across**2)
    lengthwise = whole.factor * whole.bisector_across * whole.bisector_along
    value = across[:, None] * seen.towards + lengthwise[:, None] * seen.along
    error = (_ROUNDINGS + seen.uncertainty) * whole.magnitude
    return Bounded(value * seen.unit[:, None], np.broadcast_to((error * seen.unit)[:, None], value.shape))


def _seen(emitter: Line, points: Floats) -> _Seen:
    offsets = [two_sum(emitter.start, -points), two_sum(emitter.end, -points)]
    edge = two_sum(emitter.end, -emitter.start)
    # Powers of two rescale without rounding, after which no product leaves the range of float64.
    furthest = np.maximum(np.abs(offsets[0][0]), np.abs(offsets[1][0])).max(axis=-1, keepdims=True)
    exponent = -np.frexp(furthest)[1]
    (start, start_low), (end, end_low) = ((np.ldexp(x, exponent), np.ldexp(y, exponent)) for x, y in offsets)
    edge_scaled, edge_low = (np.ldexp(np.broadcast_to(x, points.shape), exponent) for x in edge)

    # The moment's direction and length decide everything near the line's extension, where plain products cancel.
    moment = _cross(start, start_low, edge_scaled, edge_low)
    length, size = np.linalg.norm(edge_scaled, axis=-1), np.linalg.norm(moment, axis=-1)
    along = edge[0] / np.abs(edge[0]).max()
    along = along / np.linalg.norm(along)
    ends = start @ along, end @ along
    distance = size / length
    refuse_on_emitter(points, (distance < _NEAREST) & (ends[0] * ends[1] <= 0), "on the line")
    towards = np.cross(along, moment) / np.where(size == 0, 1.0, size)[:, None]
    radii = np.linalg.norm(start, axis=-1), np.linalg.norm(end, axis=-1)
    unit = np.ldexp(1.0, exponent[:, 0])
    return _Seen(((start, start_low), (end, end_low)), distance, towards, along, length, ends, radii, unit)


def _cross(a: Floats, a_low: Floats, b: Floats, b_low: Floats) -> Floats:
    """``(a + a_low) x (b + b_low)``, as if computed in twice the precision."""
    components = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        first, first_low = two_product(a[..., i], b[..., j])
        second, second_low = two_product(a[..., j], b[..., i])
        total, lost = two_sum(first, -second)
        mixed = a[..., i] * b_low[..., j] + a_low[..., i] * b[..., j]
        mixed = mixed - (a[..., j] * b_low[..., i] + a_low[..., j] * b[..., i])
        components.append(total + (lost + (first_low - second_low) + mixed))
    return np.stack(components, axis=-1)


def _sine_of_nearest(seen: _Seen, normals: Floats, z1: Floats, z2: Floats) -> tuple[Floats, Floats]:
    """``n . o`` and its error: from the vector, or from the heights of both ends where these are more precise."""
    (s1, s2), area = seen.ends, seen.length * seen.distance
    apart = np.where(area == 0, 1.0, area)
    spread = np.where(area == 0, 1.0, (np.abs(z1 * s2) + np.abs(z2 * s1)) / apart)
    from_heights = spread < 0.5
    direct = np.einsum("ij,ij->i", normals, seen.towards)
    return np.where(from_heights, (z1 * s2 - z2 * s1) / apart, direct), _ROUNDINGS * np.minimum(spread, 1.0)


def _terms(h: Floats, length: Floats, ends: tuple[Floats, Floats], radii: tuple[Floats, Floats]) -> _Terms:
    (s1, s2), (r1, r2) = ends, radii
    sine = h * length / (r1 * r2)
    cosine = np.clip((h * h + s1 * s2) / (r1 * r2), -1, 1)
    wide = cosine < 0
    half_sine = np.sqrt((1 - np.minimum(cosine, 0)) / 2)
    half_cosine = np.where(wide, sine / (2 * half_sine), np.sqrt((1 + np.maximum(cosine, 0)) / 2))
    # What is cut off completely may have no angle at all.
    half_cosine = np.where(half_cosine == 0, 1.0, half_cosine)

    # The bisector is the mean of both directions, divided by cos(D/2). Between nearly opposite ends its component
    # along the line cancels, but the squares of the ends' components differ by h^2/r1^2 - h^2/r2^2.
    sine1, sine2 = s1 / r1, s2 / r2
    difference = (h / r1) * (h / r2) * (r2 - r1) * (1 / r1 + 1 / r2) / np.where(wide, sine2 - sine1, 1.0)
    total = np.where(wide, difference, sine1 + sine2)
    return _Terms(
        length / (r1 * r2),
        _angle_over_sine(np.arctan2(sine, cosine), sine),
        half_cosine,
        (h / r1 + h / r2) / (2 * half_cosine),
        total / (2 * half_cosine),
    )


def _angle_over_sine(angle: Floats, sine: Floats) -> Floats:
    """``D/sin(D) - 1``."""
    small = (angle < 0.25) | (sine == 0)
    squared = np.minimum(angle, 0.25) ** 2
    series = np.zeros_like(angle)
    for coefficient in reversed(_SERIES):
        series = squared * (coefficient + series)
    result: Floats = np.where(small, series, angle / np.where(small, 1.0, sine) - 1)
    return result
