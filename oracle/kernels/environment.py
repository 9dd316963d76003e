"""Irradiance of what is infinitely far away, with shape (N, C)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle import compensated
from oracle.arrays import Booleans, Floats, Integers
from oracle.arrays import dot as inner
from oracle.bounded import Bounded
from oracle.emitters import Constant, CosineSky, Equirectangular

_EPSILON = float(np.finfo(np.float64).eps)

# Rounding errors of one texel's integral, relative to its solid angle; the largest found was a tenth of this.
_ROUNDINGS = 16 * _EPSILON

# Texels are halved until they are at most so wide and high [rad]; then nodes of Gauss's quadrature reach float64's
# precision along every edge of a texel that the horizon cuts, where no direction is further above it than this.
_WIDEST = 0.2
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)

# Texels times receivers at a time; about 30 numbers are kept for each.
_AT_ONCE = 2**18


def constant(emitter: Constant, normals: Floats) -> Bounded:
    """Irradiance of an unobstructed constant environment: ``E = pi L``."""
    value = np.broadcast_to(np.pi * emitter.radiance, (len(normals), len(emitter.radiance)))
    return Bounded(value, _EPSILON * value)


def cosine_sky(emitter: CosineSky, normals: Floats) -> Bounded:
    """Irradiance of a sky that is linear in the sine of the elevation, over black ground.

    Notes
    -----
    With b the angle between normal and `up`, the visible half of the sky is a lune, over which the cosine integrates to
    ``a = pi (1 + cos b) / 2`` and the product of both cosines to ``s = 2/3 ((pi - b) cos b + sin b)``, so that
    ``E = horizon (a - s) + zenith s``. For the CIE overcast sky [ISO 15469:2004], whose zenith is three times its
    horizon, this is ``zenith (pi (1 + cos b) / 6 + 4/9 ((pi - b) cos b + sin b))``, for b = 0 7/9 of ``pi zenith``. The
    error is a few ulp of the value, also for receivers that face the ground and see but a sliver of the sky.
    """
    cross = compensated.cross(normals, np.broadcast_to(emitter.up, normals.shape))
    sine = np.hypot(np.hypot(cross[0], cross[1]), cross[2])
    # The angle of the lune that is visible, pi - b.
    lune = np.arctan2(sine, -(normals @ emitter.up))
    plain = np.pi * np.sin(lune / 2) ** 2
    squared = 2 / 3 * _sine_minus_product(lune)
    value = _outer(plain - squared, emitter.horizon) + _outer(squared, emitter.zenith)
    # The sine is right to an ulp and 1e-31; the integrals grow with the square and cube of a narrow lune.
    turned = _EPSILON**2 * 8 * (lune + _EPSILON**2)
    return Bounded(value, 16 * _EPSILON * value + _outer(turned, emitter.horizon + emitter.zenith))


def equirectangular(emitter: Equirectangular, normals: Floats) -> Bounded:
    """Irradiance of a map: the sum over its texels, each a patch of uniform radiance, clipped at the horizon.

    Notes
    -----
    The integral of the direction over a texel is elementary. What the horizon leaves of a texel is half the integral
    along its edges above the horizon of ``tan^2(m) n . (w x dw)``, m being the elevation of the direction w above the
    horizon [Stokes' theorem, minus the closed integral of the azimuth around n]: the horizon itself adds nothing, and
    the integrand is small and smooth. Memory is bounded, whatever the numbers of texels and receivers.
    """
    texels = Texels.of(emitter)
    rows, columns, channels = texels.radiance.shape
    frame = np.stack([emitter.front, np.cross(emitter.up, emitter.front), emitter.up])
    local = normals @ frame.T
    value, error = np.empty((len(normals), channels)), np.empty((len(normals), channels))
    rows_at_once = max(1, _AT_ONCE // columns)
    receivers_at_once = max(1, _AT_ONCE // (columns * min(rows, rows_at_once)))
    for first in range(0, len(normals), receivers_at_once):
        some = slice(first, first + receivers_at_once)
        sums = np.empty((rows, 2, len(local[some]), channels))
        for top in range(0, rows, rows_at_once):
            band = slice(top, min(top + rows_at_once, rows))
            weights = _weights(texels, band, local[some])
            sums[band] = weights @ texels.radiance[band][:, None]
        # Pairwise along the last axis, so that only the products above add many numbers one after the other.
        value[some], spread = np.ascontiguousarray(sums.transpose(1, 2, 3, 0)).sum(axis=-1)
        error[some] = (columns + 40) * _EPSILON / 2 * value[some] + _ROUNDINGS * spread
    return Bounded(value, error)


def _outer(factor: Floats, spectrum: Floats) -> Floats:
    return factor[:, None] * spectrum


def _sine_minus_product(angle: Floats) -> Floats:
    """``sin(x) - x cos(x)`` without cancellation for small x: the sum of ``(-1)^k 2k+2 / (2k+3)! x^(2k+3)``."""
    small = np.minimum(angle, 1.0)
    term, series = small**3 / 3, np.zeros_like(small)
    for k in range(10):
        series = series + term
        term = -term * small * small / ((2 * k + 2) * (2 * k + 5))
    result: Floats = np.where(angle < 1, series, np.sin(angle) - angle * np.cos(angle))
    return result


def _angle_minus_sine(angle: float) -> float:
    """``x - sin(x)`` for 0 <= x <= 0.2."""
    squared = angle * angle
    return angle * squared / 6 * (1 - squared / 20 * (1 - squared / 42 * (1 - squared / 72 * (1 - squared / 110))))


def sky_vector(emitter: CosineSky) -> Bounded:
    """Vector irradiance of a sky, shape (3, C): ``pi (horizon + 2 zenith) / 3`` along `up`."""
    value = emitter.up[:, None] * (np.pi / 3 * (emitter.horizon + 2 * emitter.zenith))
    return Bounded(value, 8 * _EPSILON * np.abs(value))


def map_vector(emitter: Equirectangular) -> Bounded:
    """Vector irradiance of a map, shape (3, C): the sum of radiance times the integral of the direction over texels."""
    texels = Texels.of(emitter)
    columns = texels.radiance.shape[1]
    around = np.stack([*texels.directions, np.full(columns, texels.azimuth[1])])
    by_row = (around @ texels.radiance) * np.stack([texels.across, texels.across, texels.upwards], axis=1)[..., None]
    fluence = np.ascontiguousarray((texels.solid_angles[:, None] * texels.radiance.sum(axis=1)).T).sum(axis=-1)
    frame = np.stack([emitter.front, np.cross(emitter.up, emitter.front), emitter.up])
    value = frame.T @ np.ascontiguousarray(by_row.transpose(1, 2, 0)).sum(axis=-1)
    return Bounded(value, np.broadcast_to((columns + 60) * _EPSILON * fluence, value.shape))


@dataclass(frozen=True, eq=False)
class Texels:
    """A map whose texels are small, with their edges: angles [rad] from the pole `up` and around it from `front`."""

    radiance: Floats
    """Shape (H, W, C)."""
    polar: Floats
    """Shape (H + 1,)."""
    azimuth: Floats
    """Shape (W + 1,)."""
    across: Floats
    """Integral of sin^2 over the polar angles of each row, shape (H,)."""
    upwards: Floats
    """Integral of sin cos over the polar angles of each row, shape (H,)."""

    @classmethod
    def of(cls, emitter: Equirectangular) -> Texels:
        """The texels of a map, those of a coarse one in equal parts."""
        rows, columns, _ = emitter.radiance.shape
        split_rows, split_columns = np.ceil(np.pi / rows / _WIDEST), np.ceil(2 * np.pi / columns / _WIDEST)
        radiance = emitter.radiance
        if split_rows > 1:
            radiance = np.repeat(radiance, int(split_rows), axis=0)
        if split_columns > 1:
            radiance = np.repeat(radiance, int(split_columns), axis=1)
        rows, columns, _ = radiance.shape
        height, middle = np.pi / rows, np.pi * (np.arange(rows) + 0.5) / rows
        # sin^2 is 1/2 - cos/2 of twice the angle: a sum of positive parts, small near the poles as it should be.
        across = (_angle_minus_sine(height) + 2 * np.sin(height) * np.sin(middle) ** 2) / 2
        upwards = np.sin(height) * np.sin(2 * middle) / 2
        return cls(
            radiance,
            np.pi * np.arange(rows + 1) / rows,
            2 * np.pi * np.arange(columns + 1) / columns,
            across,
            upwards,
        )

    @property
    def solid_angles(self) -> Floats:
        """Of the texels of each row, shape (H,)."""
        height = self.polar[1]
        result: Floats = self.azimuth[1] * 2 * np.sin(height / 2) * np.sin(self.polar[:-1] + height / 2)
        return result

    @property
    def directions(self) -> tuple[Floats, Floats]:
        """Integrals of cosine and sine over the azimuths of each column, shape (W,)."""
        middle = self.azimuth[:-1] + self.azimuth[1] / 2
        chord = 2 * np.sin(self.azimuth[1] / 2)
        return chord * np.cos(middle), chord * np.sin(middle)


def _weights(texels: Texels, band: slice, normals: Floats) -> Floats:
    """Integrals of the clipped cosine over texels, and solid angles of those that count: (rows, 2, N, columns)."""
    cosines, sines = texels.directions
    flat = normals[:, 0, None] * cosines + normals[:, 1, None] * sines
    upright = normals[:, 2, None] * texels.azimuth[1]
    whole = texels.across[band, None, None] * flat + texels.upwards[band, None, None] * upright

    above, below = _sides(texels, band, normals)
    weights = np.empty((whole.shape[0], 2, *whole.shape[1:]))
    weights[:, 0] = np.where(above, whole, 0.0)
    weights[:, 1] = np.where(below, 0.0, texels.solid_angles[band, None, None])
    row, receiver, column = np.nonzero(~(above | below))
    start, step = band.start, 2**16
    for first in range(0, len(row), step):
        i, n, j = (index[first : first + step] for index in (row, receiver, column))
        weights[i, 0, n, j] = _cut(texels, i + start, j, normals[n])
    return weights


def _sides(texels: Texels, band: slice, normals: Floats) -> tuple[Booleans, Booleans]:
    """Which texels are wholly above the horizon and which wholly below, shape (rows, N, columns) each."""
    # On each parallel, the azimuths less than `half` from the normal's are above.
    polar = texels.polar[band.start : band.stop + 1, None]
    half = _half_above(polar, np.arctan2(np.hypot(normals[:, 0], normals[:, 1]), normals[:, 2]))
    least, most = np.minimum(half[:-1], half[1:]), np.maximum(half[:-1], half[1:])
    turn = np.arctan2(normals[:, 1], normals[:, 0])[:, None]
    # Azimuths of the texels' edges from the normal's, in [0, pi]; within a texel they may go to 0 or pi.
    edges = np.mod(texels.azimuth - turn, 2 * np.pi)
    distance = np.minimum(edges, 2 * np.pi - edges)
    nearest, furthest = np.minimum(distance[:, :-1], distance[:, 1:]), np.maximum(distance[:, :-1], distance[:, 1:])
    passes_normal = edges[:, 1:] < edges[:, :-1]
    passes_opposite = (edges[:, :-1] <= np.pi) & (edges[:, 1:] >= np.pi)
    nearest, furthest = np.where(passes_normal, 0.0, nearest), np.where(passes_opposite, np.pi, furthest)
    return furthest <= least[..., None], nearest >= most[..., None]


def _half_above(polar: Floats, tilt: Floats) -> Floats:
    """Half of the azimuths on a parallel that are above the horizon, in [0, pi]; `tilt` is the normal's polar angle."""
    # The cosine of the azimuth is -cot(tilt) cot(polar); written by the sines of half the excess over -1 and 1.
    to_full, to_none = -np.cos(polar + tilt), np.cos(polar - tilt)
    half = 2 * np.arctan2(np.sqrt(np.maximum(to_none, 0)), np.sqrt(np.maximum(to_full, 0)))
    result: Floats = np.where(to_none <= 0, 0.0, np.where(to_full <= 0, np.pi, half))
    return result


def _cut(texels: Texels, rows: Integers, columns: Integers, normals: Floats) -> Floats:
    """Integral of the cosine over the parts above the horizon of texels (M,), each for its normal (M, 3)."""
    flat = np.hypot(normals[:, 0], normals[:, 1])
    upright = normals[:, 2]
    # Azimuths from the normal's, from [-pi, pi) on.
    turn = np.arctan2(normals[:, 1], normals[:, 0])
    left = np.mod(texels.azimuth[columns] - turn + np.pi, 2 * np.pi) - np.pi
    right = left + texels.azimuth[1]
    top, bottom = texels.polar[rows], texels.polar[rows + 1]
    total = _along_meridian(right, top, bottom, flat, upright) - _along_meridian(left, top, bottom, flat, upright)
    total += _along_parallel(top, left, right, flat, upright) - _along_parallel(bottom, left, right, flat, upright)
    result: Floats = np.maximum(total, 0.0) / 2
    return result


def _along_meridian(azimuth: Floats, top: Floats, bottom: Floats, flat: Floats, upright: Floats) -> Floats:
    """Integral of ``tan^2(m) n . (w x dw)`` down a meridian, above the horizon."""
    x = flat * np.cos(azimuth)
    # n . w is x sin + upright cos of the polar angle; its only zero is at `level`.
    level = np.where(upright == 0, np.where(x > 0, 0.0, np.pi), np.arctan2(np.abs(upright), -np.sign(upright) * x))
    level = np.clip(level, top, bottom)
    polar, weights = _gauss(np.where(upright > 0, top, level), np.where(upright > 0, level, bottom))
    sine = x[:, None] * np.sin(polar) + upright[:, None] * np.cos(polar)
    squared = sine * sine
    result: Floats = -flat * np.sin(azimuth) * inner(weights, squared / (1 - squared))
    return result


def _along_parallel(polar: Floats, left: Floats, right: Floats, flat: Floats, upright: Floats) -> Floats:
    """The same eastwards along a parallel, where the part above the horizon may be in two pieces."""
    half = _half_above(polar, np.arctan2(flat, upright))
    result = _along_arc(polar, np.clip(left, -half, half), np.clip(right, -half, half), flat, upright)
    again = right > 2 * np.pi - half
    if again.any():
        arc = -half[again], np.minimum(right[again] - 2 * np.pi, half[again])
        result[again] += _along_arc(polar[again], *arc, flat[again], upright[again])
    return result


def _along_arc(polar: Floats, left: Floats, right: Floats, flat: Floats, upright: Floats) -> Floats:
    azimuth, weights = _gauss(left, right)
    x, y = flat * np.sin(polar), upright * np.cos(polar)
    squared = (x[:, None] * np.cos(azimuth) + y[:, None]) ** 2
    steepness = (upright * np.sin(polar))[:, None] - (flat * np.cos(polar))[:, None] * np.cos(azimuth)
    return np.sin(polar) * inner(weights, squared / (1 - squared) * steepness)


def _gauss(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Nodes and weights (M, K) of Gauss's quadrature from start to end (M,)."""
    half = ((end - start) / 2)[:, None]
    return ((start + end) / 2)[:, None] + half * _NODES, half * _WEIGHTS
