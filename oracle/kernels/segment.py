"""Projected solid angle of the part of a disk that the receiver's horizon leaves.

The horizon cuts the disk along a chord. In the frame of unit vectors s along the chord, e in the disk's plane towards
the visible part, and w from the receiver to that plane, the receiver's normal is ``g e + c w`` and the disk's points
are ``(s, tau, H)``. Their height over the horizon is g t, where t is the distance from the chord. Two forms share the
work:

- The contour: Stokes' theorem leaves an elementary integral along the arc, and the plain angle that the chord subtends
  [Lambert 1760; Sparrow 1963]. Its terms are of the size of 1 radian and cancel for small results.
- The strips: all that counts is positive in ``g H int t int ds / (s^2 + tau^2 + H^2)^2 dt``. The strip parallel to the
  chord is elementary. Quadrature across the strips, double-exponential [Takahasi and Mori 1974] in asinh(tau / H),
  keeps nearly all digits, however thin, far or near the segment is, for twenty times the price. Gauss's suffices, for
  ten times, where the disk is three radii away or further.

The bound of the contour counts roundings. That of the strips is an estimate: what leaving out every second, or two of
three, of their nodes changes, raised to a power that supposes that digits grow with the number of nodes. Tests compare
both with ball arithmetic, next to rims, edge-on and in slivers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from oracle.arrays import Booleans, Floats
from oracle.bounded import Bounded
from oracle.chunks import chunks

_EPSILON = float(np.finfo(np.float64).eps)
# Where the contour's bound exceeds this part of its value, the strips are worth their price.
_GOOD = 2e-13


@dataclass(frozen=True, eq=False)
class Segment:
    """Disks cut by horizons, shape (N,) each; lengths in any unit in which they are neither huge nor tiny."""

    distance: Floats
    """Distance H > 0 of the receiver from the disk's plane."""
    cosine: Floats
    """Cosine c between the receiver's normal and the direction to the disk's plane."""
    sine: Floats
    """Sine g > 0 of the same angle."""
    above: Floats
    """How far the disk reaches from the chord on the visible side, in (0, 2 R)."""
    below: Floats
    """How far it reaches on the other side; `above` and `below` add up to the diameter."""
    aside: Floats
    """Coordinate of the disk's centre along the chord, where the receiver's is 0."""
    power: Floats
    """Squared distance of the disk's centre from the receiver, minus the squared radius."""

    def __getitem__(self, index: Booleans | tuple[int | slice, ...]) -> Segment:
        return Segment(*(getattr(self, field.name)[index] for field in fields(self)))


def segment(cut: Segment) -> Bounded:
    """Projected solid angle [sr] of the visible parts, shape (N,)."""
    result = _contour(cut)
    _improve(result, cut, cut.power > 8 * ((cut.above + cut.below) / 2) ** 2, _small)
    for rule in _STRIPS:
        _improve(result, cut, np.ones_like(cut.sine, dtype=np.bool_), rule)
    # What the cut's own coordinates lost in rounding, near the rim.
    radius = (cut.above + cut.below) / 2
    size = radius + np.abs(cut.aside) + cut.distance * np.abs(cut.cosine) / cut.sine
    # Below the smallest distance from the rim; `rims` is its product with the largest.
    rims = np.sqrt(cut.power**2 + (2 * radius * cut.distance) ** 2)
    rim = np.minimum(np.sqrt(rims), rims / (2 * radius))
    lost = 12 * _EPSILON * size / rim
    # On the rim, as far as float64 can tell, every value is possible.
    error = np.where(lost < 1e-3, result.error + lost * np.abs(result.value), np.pi)
    return Bounded(np.clip(result.value, 0, np.pi), error)


def _improve(result: Bounded, cut: Segment, where: Booleans, rule: Callable[[Segment], Bounded]) -> None:
    """Replace poor results by those of another rule that are better."""
    poor = where & (result.error > _GOOD * np.abs(result.value))
    if not poor.any():
        return
    hard, value, error = cut[poor], result.value[poor], result.error[poor]
    for part in chunks(value.shape, at_once=512):
        again = rule(hard[part])
        better = again.error < error[part]
        value[part] = np.where(better, again.value, value[part])
        error[part] = np.where(better, again.error, error[part])
    result.value[poor], result.error[poor] = value, error


def _contour(cut: Segment) -> Bounded:
    height, c, g = cut.distance, cut.cosine, cut.sine
    radius, middle = (cut.above + cut.below) / 2, (cut.above - cut.below) / 2
    tau0 = -c * height / g
    tau = tau0 + middle
    far = np.hypot(tau, cut.aside)
    turn = np.arctan2(cut.aside, tau)
    # Half of the visible arc, by its sagitta, which may be small.
    half = 2 * np.arctan2(np.sqrt(cut.above), np.sqrt(cut.below))
    chord = np.sqrt(cut.above * cut.below)

    # The arc: integral of (a + b cos f + d sin f) / (p + q cos f), with k such that nothing divides by q.
    a, b, d = c * radius**2, radius * (c * far - g * height * np.cos(turn)), radius * g * height * np.sin(turn)
    s = np.sqrt(cut.power**2 + (2 * radius * height) ** 2)
    p, q = cut.power + 2 * radius**2, 2 * radius * far
    k = q / (s + p)
    first, last = -half - turn, half - turn

    def antiderivatives(f: Floats) -> tuple[Floats, Floats, Floats]:
        """Integrals of 1 and of cos over p + q cos, up to constants, and the size of what cancels in them."""
        x = np.sin(f) / (1 + k * np.cos(f))
        angle = np.arctan(k * x)
        ratio = np.where(k * x == 0, 1.0, angle / np.where(k * x == 0, 1.0, k * x))
        return (f - 2 * angle) / s, (2 * p / (s + p) * ratio * x - k * f) / s, np.abs(x)

    plain_first, cosine_first, x_first = antiderivatives(first)
    plain_last, cosine_last, x_last = antiderivatives(last)
    start, end = p + q * np.cos(first), p + q * np.cos(last)
    ends = np.minimum(start, end)
    # Where the rim passes the receiver closely, the logarithm is not to be trusted.
    trusted = (ends > 1e-2 * p) & (s > 1e-12 * p)
    start = np.where(trusted, start, 1.0)
    step = np.cos(last) - np.cos(first)
    growth = np.where(trusted, q * step / start, 0.0)
    sines = -step / start * np.where(growth == 0, 1.0, np.log1p(growth) / np.where(growth == 0, 1.0, growth))
    arc = a * (plain_last - plain_first) + b * (cosine_last - cosine_first) + d * sines

    # The chord, closing the contour.
    nearest = height / g
    angle = np.arctan2(2 * chord * nearest, nearest**2 + (cut.aside - chord) * (cut.aside + chord))
    value = (arc + angle) / 2
    size = (
        np.abs(a) * 4 * np.pi
        + np.abs(b) * (2 * np.pi * k + x_first + x_last)
        + (np.abs(d) + radius * np.sqrt(np.abs(ends))) * np.pi * s / np.where(trusted, ends, p)
    ) / s + np.pi
    return Bounded(value, np.where(trusted, 4 * _EPSILON * size, np.inf))


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Nodes in (0, 1) by their distances from 0 and from 1, and weights; shape (2 count + 1, 1)."""

    low: Floats
    high: Floats
    weights: Floats

    @classmethod
    def tanh_sinh(cls, count: int) -> _Nodes:
        step = 3.2 / count
        x = step * np.arange(-count, count + 1)[:, None]
        bend = np.pi * np.sinh(x)
        low, high = 1 / (1 + np.exp(-bend)), 1 / (1 + np.exp(bend))
        return cls(low, high, step * np.pi * np.cosh(x) * low * high)


def _strips(cut: Segment, nodes: _Nodes) -> Bounded:
    # With tau = H sinh(y), the distance of a strip's line from the receiver is H cosh(y).
    height = cut.distance
    bottom, top = -cut.cosine / cut.sine, cut.above / height
    top = top + bottom
    bottom_cosh, top_cosh = np.hypot(1, bottom), np.hypot(1, top)
    bottom_exp = np.where(bottom > 0, bottom + bottom_cosh, 1 / (bottom_cosh + np.abs(bottom)))
    top_exp = np.where(top > 0, top + top_cosh, 1 / (top_cosh + np.abs(top)))
    # y(top) - y(bottom), precise even if they are close.
    span = np.log1p(cut.above / height * (bottom_exp + top_exp) / ((bottom_cosh + top_cosh) * bottom_exp))

    # The quadrature is cut in two where the integrand is nearly singular: where the rim is nearest to the receiver, or
    # under the receiver if the strips on both of its sides reach far.
    radius, tau = (cut.above + cut.below) / 2, bottom * height + (cut.above - cut.below) / 2
    far = np.hypot(tau, cut.aside)
    nearest = tau * (1 - radius / np.where(far == 0, 1.0, far)) / height
    nearest = np.where((bottom < -10) & (top > 10), 0.0, nearest)
    share = (np.arcsinh(nearest) - np.arcsinh(bottom)) / span
    share = np.where((share > 1e-6) & (share < 1 - 1e-6) & (far > 0), share, 0.5)

    total, by_twos, by_threes = np.zeros_like(span), np.zeros_like(span), np.zeros_like(span)
    for is_upper in (False, True):
        width = span * (1 - share if is_upper else share)
        from_bottom = width * nodes.low + (span * share if is_upper else 0.0)
        from_top = width * nodes.high + (0.0 if is_upper else span * (1 - share))
        # Differences of sinh(y), as products.
        grown = np.exp(from_bottom / 2)
        t = height * np.sinh(from_bottom / 2) * (bottom_exp * grown + 1 / (bottom_exp * grown))
        shrunk = np.exp(-from_top / 2)
        rest = height * np.sinh(from_top / 2) * (top_exp * shrunk + 1 / (top_exp * shrunk))
        line = height / 2 * (bottom_exp * grown * grown + 1 / (bottom_exp * grown * grown))
        terms = nodes.weights * width * t / line**2 * _strip(np.sqrt(rest * (t + cut.below)), cut.aside, line)
        part = terms.sum(axis=0)
        total += part
        by_twos += np.abs(part - 2 * terms[::2].sum(axis=0))
        by_threes += np.abs(part - 3 * terms[::3].sum(axis=0))
    value = cut.sine * height / 2 * total
    # The number of right digits is proportional to that of the nodes; a half more is allowed for luck.
    scale = np.where(total == 0, 1.0, total)
    by_twos, by_threes = by_twos / scale, by_threes / scale
    doubt = np.maximum(by_twos**1.5, by_threes**2)
    return Bounded(value, value * (16 * _EPSILON + np.where(by_twos < 1e-3, doubt, 10 * (by_twos + by_threes))))


# Tried one after the other, until the bound is good.
_STRIPS = [partial(_strips, nodes=_Nodes.tanh_sinh(count)) for count in (24, 48, 96)]

# Gauss's nodes and weights in (0, 1) for segments that are small as seen from the receiver.
_X, _W = (part[:, None] / 2 for part in np.polynomial.legendre.leggauss(28))
_X = _X + 0.5


def _small(cut: Segment) -> Bounded:
    """As the strips, with the angle of the rim's points as variable; where the disk is three radii away or further."""
    radius, half = (cut.above + cut.below) / 2, 2 * np.arctan2(np.sqrt(cut.above), np.sqrt(cut.below))
    angle = half * _X
    t = 2 * radius * np.sin((half + angle) / 2) * np.sin((half - angle) / 2)
    chord = radius * np.sin(angle)
    line2 = (t - cut.cosine * cut.distance / cut.sine) ** 2 + cut.distance**2
    line = np.sqrt(line2)
    terms = _W * half * chord * t / (line2 * line) * _strip(chord, cut.aside, line)
    value: Floats = cut.sine * cut.distance / 2 * terms.sum(axis=0)
    return Bounded(value, 64 * _EPSILON * value)


def _strip(half: Floats, aside: Floats, line: Floats) -> Floats:
    """``2 D^3`` times the integral of ``1 / (s^2 + D^2)^2`` from ``aside - half`` to ``aside + half``, D = `line`.

    In angles it is ``a + sin(a) cos(b)``, where a and b are difference and sum of those of the ends; in the form
    ``(a - sin a) + sin(a) (1 + cos b)`` nothing cancels.
    """
    start, end = aside - half, aside + half
    product, line2 = start * end, line * line
    radii = np.sqrt((start * start + line2) * (end * end + line2))
    angle = np.arctan2(2 * half * line, line2 + product)
    sine = 2 * half * line / radii
    excess = product - line2
    ahead = excess > 0
    one_plus_cosine = np.where(ahead, line2 * (4 * aside * aside) / (radii + np.abs(excess)), radii - excess) / radii
    return _angle_minus_sine(angle) + sine * one_plus_cosine


# a - sin(a) in powers of a^2, up to 0.7.
_SERIES = [1 / 6]
for _k in range(2, 9):
    _SERIES.append(-_SERIES[-1] / (2 * _k * (2 * _k + 1)))


def _angle_minus_sine(a: Floats) -> Floats:
    square = a * a
    series = np.full_like(a, _SERIES[-1])
    for coefficient in reversed(_SERIES[:-1]):
        series = coefficient + square * series
    return np.where(a < 0.7, a * square * series, a - np.sin(a))
