"""Exchange areas of rectangles whose edges are parallel to one another, in parallel or perpendicular planes.

All functions take arrays over N pairs and return the exchange area ``A1 F12 = A2 F21`` [m^2], shape (N,). Along an axis
both rectangles are intervals of which only differences count: half lengths and the offset of their centres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, Integers
from oracle.bounded import Bounded
from oracle.view_factors.quadrature import gauss, graded

_EPSILON = float(np.finfo(np.float64).eps)

# Where rounding may cost the closed form more than this, relative, the positive integrand is integrated instead.
_GOOD = 1e-11

# Least distance from the integrand's singularity, in half lengths of a piece, and the Gauss points that then leave less
# than 1e-17 of the integral: the integrand grows at most 18-fold on the ellipses with rho = 45, 9 and 4.
_RULES = ((30.0, 6), (6.0, 10), (3.0, 16))

# Intermediate results of so many numbers stay within the processor's cache.
_AT_ONCE = 65536
_PAIRS_AT_ONCE = 2048


@dataclass(frozen=True, eq=False)
class Axis:
    """Two intervals for each pair: half the shorter and half the longer length, and their centres' offset, (N,)."""

    shorter: Floats
    longer: Floats
    offset: Floats

    @classmethod
    def of(cls, half_a: Floats, half_b: Floats, offset: Floats) -> Axis:
        """From half lengths in any order."""
        return cls(np.minimum(half_a, half_b), np.maximum(half_a, half_b), offset)

    def __getitem__(self, where: Integers | int) -> Axis:
        return Axis(self.shorter[where], self.longer[where], self.offset[where])

    @property
    def differences(self) -> tuple[Floats, Floats]:
        """The differences (4, N) of the intervals' ends, and with which sign (4,) each enters a closed form."""
        outer, inner, o = self.longer + self.shorter, self.longer - self.shorter, self.offset
        return np.stack([o + outer, o - outer, o + inner, o - inner]), np.array([1.0, 1.0, -1.0, -1.0])

    @property
    def reach(self) -> Floats:
        """Largest magnitude of a difference, (N,)."""
        result: Floats = np.abs(self.offset) + self.shorter + self.longer
        return result

    @property
    def nearest(self) -> Floats:
        """Smallest magnitude of a difference, (N,)."""
        result: Floats = np.maximum(np.abs(self.offset) - self.shorter - self.longer, 0.0)
        return result

    @property
    def widest(self) -> Floats:
        """Half the longest of the three pieces on which the density of the differences is linear, (N,)."""
        result: Floats = np.maximum(self.shorter, self.longer - self.shorter)
        return result

    def nodes(self, count: int) -> tuple[Floats, Floats]:
        """Differences (3 count, N) and weights that integrate a function of the difference over both intervals."""
        t, w = gauss(count)
        inner = self.longer - self.shorter
        rising = self.shorter * (1 + t[:, None])
        edge = w[:, None] * self.shorter * rising
        outermost = self.longer + self.shorter
        along = np.concatenate([rising - outermost, inner * t[:, None], outermost - rising])
        return self.offset + along, np.concatenate([edge, w[:, None] * inner * 2 * self.shorter, edge])

    def graded_nodes(self, distance: float) -> tuple[Floats, Floats]:
        """The same for a single pair and a function with singularities at ``+- i distance``."""
        narrow, flat = float(2 * self.shorter), float(2 * (self.longer - self.shorter))
        e = self.differences[0].tolist()
        # From, to, length, and the density of differences at both ends.
        pieces = [
            (e[1], e[3], narrow, 0.0, narrow),
            (e[3], e[2], flat, narrow, narrow),
            (e[2], e[0], narrow, narrow, 0.0),
        ]
        parts: list[tuple[float, float, float, float, float]] = []
        for low, high, length, at_low, at_high in pieces:
            if low < 0 < high:
                between = at_low + (at_high - at_low) * (-low / length)
                parts += [(0.0, -low, between, at_low, -1.0), (0.0, high, between, at_high, 1.0)]
            elif low >= 0:
                parts.append((low, length, at_low, at_high, 1.0))
            else:
                parts.append((-high, length, at_high, at_low, -1.0))
        # Measured from the end that is nearer to 0, neither a small difference nor its density loses digits.
        nodes = []
        for near, length, here, there, side in parts:
            if not length > 0:
                continue
            d, weights = graded(np.array([0.0, length]), np.array([-near]), np.array([distance]))
            nodes.append((side * (near + d), weights * (here + (there - here) * (d / length))))
        at, weights = (np.concatenate(column) for column in zip(*nodes, strict=True))
        return at, weights


@dataclass(frozen=True, eq=False)
class Strip:
    """Distances of a strip's two edges from a line along them, at least 0, and their difference, (N,)."""

    near: Floats
    far: Floats
    width: Floats

    @classmethod
    def of(cls, middle: Floats, half: Floats) -> Strip:
        """The part of ``middle - half`` to ``middle + half`` that is not negative."""
        near, far = np.maximum(middle - half, 0.0), np.maximum(middle + half, 0.0)
        return cls(near, far, np.where(near > 0, 2 * half, far))

    def __getitem__(self, where: Integers | int) -> Strip:
        return Strip(self.near[where], self.far[where], self.width[where])


def parallel(x: Axis, y: Axis, gap: Floats) -> Bounded:
    """Exchange area of parallel rectangles that face each other at the distance `gap` > 0 [m], shape (N,).

    Notes
    -----
    Sixteen terms, one for each pair of corners [Howell, A Catalog of Radiation Heat Transfer Configuration Factors,
    C-13]. Where they cancel, Gauss quadrature of ``gap^2 / (pi r^4)``.
    """
    result = _parallel_closed(x, y, gap)
    return _mended(
        result,
        np.hypot(np.hypot(x.nearest, y.nearest), gap) / np.maximum(x.widest, y.widest),
        lambda here, count: _parallel_far(x[here], y[here], gap[here], count),
        lambda one: _parallel_graded(x[one], y[one], float(gap[one])),
    )


def _mended(
    result: Bounded, apart: Floats, far: Callable[[Integers, int], Floats], near: Callable[[int], float]
) -> Bounded:
    """The same, with quadrature of the positive integrand where the terms of the closed form cancel.

    `apart`, shape (N,), is the distance of the integrand's singularities in half lengths of the longest piece.
    """
    poor = np.flatnonzero(result.error > _GOOD * result.value)
    rest = poor
    for least, count in _RULES:
        here, rest = rest[apart[rest] >= least], rest[apart[rest] < least]
        for start in range(0, len(here), _PAIRS_AT_ONCE):
            part = here[start : start + _PAIRS_AT_ONCE]
            result.value[part] = far(part, count)
    for one in rest:
        result.value[one] = near(int(one))
    # Neither the positive nodes and weights nor their sum lose more than this.
    result.error[poor] = 64 * _EPSILON * result.value[poor]
    return result


def _parallel_closed(x: Axis, y: Axis, gap: Floats) -> Bounded:
    dx, sign_x = x.differences
    dy, sign_y = y.differences
    rx, ry = np.sqrt(dx**2 + gap**2), np.sqrt(dy**2 + gap**2)
    # A common factor of all distances does not count; it keeps the logarithms small.
    unit = np.maximum(x.reach, y.reach) ** 2 + gap**2
    factor = 0.5 * gap**2
    value, size = np.zeros_like(gap), np.zeros_like(gap)
    for i in range(4):
        for j in range(4):
            first = dy[j] * rx[i] * np.arctan(dy[j] / rx[i])
            second = dx[i] * ry[j] * np.arctan(dx[i] / ry[j])
            third = factor * np.log((dx[i] ** 2 + ry[j] ** 2) / unit)
            value += sign_x[i] * sign_y[j] * (first + second - third)
            # The logarithm is never positive.
            size += first + second - third + factor
    return Bounded(value / (2 * np.pi), size * (16 * _EPSILON / (2 * np.pi)))


def _parallel_far(x: Axis, y: Axis, gap: Floats, count: int) -> Floats:
    dx, wx = x.nodes(count)
    dy, wy = y.nodes(count)
    square = dy**2 + gap**2
    total = np.zeros_like(gap)
    for at, weight in zip(dx, wx, strict=True):
        total += weight * (wy * (gap / (at**2 + square)) ** 2).sum(axis=0)
    return total / np.pi


def _parallel_graded(x: Axis, y: Axis, gap: float) -> float:
    u, wu = x.graded_nodes(float(np.hypot(gap, y.nearest)))
    v, wv = y.graded_nodes(float(np.hypot(gap, x.nearest)))
    square = v**2 + gap**2
    step = max(1, _AT_ONCE // len(v))
    parts = (slice(start, start + step) for start in range(0, len(u), step))
    return sum(float(wu[part] @ ((gap / (u[part, None] ** 2 + square)) ** 2 @ wv)) for part in parts) / np.pi


def perpendicular(x: Axis, y: Strip, z: Strip) -> Bounded:
    """Exchange area of rectangles in perpendicular planes whose fronts see each other, shape (N,).

    `x` runs along the line in which the planes meet, `y` and `z` away from it.

    Notes
    -----
    Sixteen terms [Howell, perpendicular rectangles with parallel edges]. Where they cancel, quadrature along `x` of
    ``log(r12^2 r21^2 / (r11^2 r22^2)) / (4 pi)``, whose argument differs from 1 by a product.
    """
    nearest = np.hypot(y.near, z.near)
    return _mended(
        _perpendicular_closed(x, y, z),
        np.hypot(nearest, x.nearest) / x.widest,
        lambda here, count: _perpendicular_far(x[here], y[here], z[here], count),
        lambda one: _perpendicular_graded(x[one], y[one], z[one], float(nearest[one])),
    )


def _perpendicular_closed(x: Axis, y: Strip, z: Strip) -> Bounded:
    dx, sign_x = x.differences
    unit = x.reach**2 + y.far**2 + z.far**2
    value, size = np.zeros_like(unit), np.zeros_like(unit)
    for j, edge_y in enumerate((y.near, y.far)):
        for k, edge_z in enumerate((z.near, z.far)):
            square = edge_y**2 + edge_z**2
            c = np.sqrt(square)
            sign_of_edges = 1.0 if j != k else -1.0
            for i in range(4):
                whole = dx[i] ** 2 + square
                # Where both are 0, so is their term.
                first = dx[i] * c * np.arctan(dx[i] / np.where(c > 0, c, 1.0))
                second = 0.25 * (dx[i] - c) * (dx[i] + c) * np.log(np.where(whole > 0, whole, unit) / unit)
                value += sign_x[i] * sign_of_edges * (first + second)
                size += first + np.abs(second) + 0.25 * whole
    return Bounded(value / (2 * np.pi), size * (16 * _EPSILON / (2 * np.pi)))


def _perpendicular_far(x: Axis, y: Strip, z: Strip, count: int) -> Floats:
    dx, weights = x.nodes(count)
    result: Floats = (weights * _between_lines(dx, y, z)).sum(axis=0)
    return result


def _perpendicular_graded(x: Axis, y: Strip, z: Strip, nearest: float) -> float:
    u, weights = x.graded_nodes(nearest)
    return float(weights @ _between_lines(u, y, z))


def _between_lines(u: Floats, y: Strip, z: Strip) -> Floats:
    """Exchange area of two strips across the rectangles, for each metre of both widths; `u` is the strips' distance."""
    near, far = u**2 + (y.near**2 + z.near**2), u**2 + (y.far**2 + z.far**2)
    product = y.width * (y.near + y.far) * z.width * (z.near + z.far)
    # The logarithm's peak where the rectangles touch is so narrow that its tip does not count.
    result: Floats = np.log1p(product / (np.maximum(near, 1e-60 * far) * far)) / (4 * np.pi)
    return result
