"""Bets on pixels: factors by which wealth grows.

A bet with the stake l on a pixel of value x multiplies wealth by ``1 + l (x / limit - 1)``: fair, or worse, for every
renderer whose pixel averages to the limit or less if l > 0, and to the limit or more if l < 0. Values are never
negative, so that stakes below 1 are safe upwards; downwards the largest value a pixel can take bounds them.

A block's pixels are bet on with one stake. Its gain, the logarithm of the product of its factors, then follows from
sums of powers of the pixels, which makes hundreds of bets as cheap as one; where the series does not converge well,
products are taken instead.

References: Waudby-Smith and Ramdas 2024 (betting); the stake ``d / (v + d^2)`` nearly maximises the expected logarithm
of wealth for a deviation d and a variance v [Kelly 1956].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from oracle.arrays import Booleans, Floats

MAX_STAKE = 0.95
# Higher values, relative to the mean, count as this much: that makes an upward bet worse, and hence still fair.
_BRIGHTEST = 1e15
# Up to here the series for the logarithm is used. Its last term is made so large that no gain is overstated:
# x^6/6 + x^7/7 + ... < 0.24 x^6 for 0 < x < 0.3.
_CONVERGES = 0.3
_SERIES = (1.0, -1 / 2, 1 / 3, -1 / 4, 1 / 5, -0.24)
# A bet on too dark is lost, rather than worth less than nothing, should a pixel exceed what it was said to reach.
LOST = 1e-6


@dataclass(frozen=True, eq=False)
class Pixels:
    """Pixels of one image that are bet on: observed over expected values less 1, (P, pixels, blocks), and their sums.

    Attributes
    ----------
    values, included : ndarray
        Where nothing is bet on, the value is 0 and not included.
    sums : ndarray
        Sums over each block of the powers 0 to 6, (7, P, blocks).
    lowest, highest : ndarray
        Extremes of each block, (P, blocks).
    """

    values: Floats
    included: Booleans
    sums: Floats
    lowest: Floats
    highest: Floats

    @classmethod
    def of(cls, values: Floats, included: Booleans) -> Pixels:
        """Of values where they are included."""
        kept = np.where(included, np.minimum(values, _BRIGHTEST), 0.0)
        sums = [included.sum(axis=1).astype(np.float64), kept.sum(axis=1)]
        power = kept * kept
        for degree in range(2, 7):
            sums.append(power.sum(axis=1))
            if degree < 6:
                power *= kept
        return cls(kept, included, np.stack(sums), kept.min(axis=1), kept.max(axis=1))

    def about(self, limit: Floats) -> Outcomes:
        """What bets against limits, relative to the mean, (P, blocks) or a number, come out as."""
        shift = limit - 1
        # Powers of (value - shift) by the binomial theorem.
        moved = [self.sums[0]]
        powers = [np.ones_like(shift)]
        for degree in range(1, 7):
            powers.append(powers[-1] * -shift)
            total = self.sums[degree].copy()
            for j in range(degree):
                total += comb(degree, j) * powers[degree - j] * self.sums[j]
            moved.append(total)
        reach = np.maximum(np.abs(self.lowest - shift), np.abs(self.highest - shift))
        return Outcomes(self, np.asarray(limit), np.stack(moved[1:]), reach)


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Sums of powers 1 to 6 of what pixels are off their limits, (6, P, blocks), and the largest of it, (P, blocks)."""

    pixels: Pixels
    limit: Floats
    sums: Floats
    reach: Floats

    def of_plane(self, plane: int) -> Outcomes:
        """Those of one plane alone."""
        one = slice(plane, plane + 1)
        p = self.pixels
        pixels = Pixels(p.values[one], p.included[one], p.sums[:, one], p.lowest[one], p.highest[one])
        limit = np.broadcast_to(self.limit, self.reach.shape)[one]
        return Outcomes(pixels, limit, self.sums[:, one], self.reach[one])

    def gains(self, stakes: Floats) -> Floats:
        """Gains of a bet on every block, as logarithms, (P, blocks)."""
        per = stakes / self.limit
        result: Floats = _SERIES[-1] * per * self.sums[-1]
        for coefficient, total in zip(_SERIES[-2::-1], self.sums[-2::-1], strict=True):
            result += coefficient * total
            result *= per
        far = np.abs(per) * self.reach > _CONVERGES
        if far.any():
            plane, block = np.nonzero(far)
            shift = np.broadcast_to(self.limit - 1, far.shape)[far]
            # Leading to (pixels, blocks).
            off = self.pixels.values[plane, :, block].T - shift
            factors = 1 + per[far] * off * self.pixels.included[plane, :, block].T
            result[far] = log_product(factors)
        return result


def log_product(factors: Floats) -> Floats:
    """Logarithm of the product along the first axis, of up to 16 factors."""
    kept = np.maximum(factors, LOST)
    if kept.max(initial=0) > _BRIGHTEST:
        # The product could leave the range of float64.
        apart: Floats = np.log(kept).sum(axis=0)
        return apart
    result: Floats = np.log(np.multiply.reduce(kept, axis=0))
    return result


def stakes(deviations: Floats | float, variance: Floats, most_below: Floats) -> Floats:
    """Stakes on pixels that are off by relative deviations, of either sign."""
    wanted = deviations / (variance + deviations * deviations + 1e-30)
    result: Floats = np.maximum(np.minimum(wanted, MAX_STAKE), -most_below)
    return result


def most_below(headroom: Floats, limit: Floats) -> Floats:
    """Largest stake on "darker than the limit" that a pixel of `headroom` cannot bankrupt."""
    result: Floats = np.minimum(MAX_STAKE * limit / np.maximum(headroom - limit, 1e-9), MAX_STAKE)
    return result
