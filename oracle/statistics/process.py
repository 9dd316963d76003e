"""The betting process on images whose pixels are independent: wealth after every image.

A component is a suspicion such as "this tile is 4 % too bright". It starts with a share of the wealth 1 and stakes a
fraction of what it has on every pixel of every image. Its wealth is a non-negative supermartingale for a right
renderer, and so is the sum over all components: the e-value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from oracle.arrays import Floats, Integers
from oracle.statistics.bets import LOST, Outcomes, Pixels, log_product, most_below, stakes
from oracle.statistics.directions import Direction
from oracle.statistics.forecast import Past
from oracle.statistics.null import SIDE, Null
from oracle.statistics.regions import Scale, scales, summed_area_table

AMPLITUDES = np.array([0.0025, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.5, 2.0])
DARK_AMPLITUDES = -np.array([0.0025, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.75])
_BLACK_STAKES = np.array([0.05, 0.5])
# Tiles bet on these amplitudes only: smaller ones are too small to be seen in them.
_LEAST_IN_TILES = 0.015
# What a pixel may be off by if it is one of few.
_SPARSE_AMPLITUDES = np.array([0.1, 0.3, 1.0, 5.0, -0.1, -0.3, -0.8])
# The part of all pixels, or of all tiles, that may be off, each by an amount of its own.
_PARTS_OF_PIXELS = (1e-4, 1e-3, 1e-2, 5e-2)
_PARTS_OF_TILES = (0.003, 0.03, 0.3, 0.9)
_RICHEST = 1e250
# With less than this, as a logarithm, a component never comes back in any reasonable time.
_RUINED = -60.0
# An alternative is excluded if the bet against it ever has this much, as a logarithm: false with 1 %.
ENOUGH = float(np.log(100))
# Of the first image, two pixels of each block are only looked at.
_LOOKED_AT = (5, 15)
_BET_ON = tuple(pixel for pixel in range(SIDE * SIDE) if pixel not in _LOOKED_AT)

# How the wealth is shared.
_SHARES = {"image": 0.42, "tiles": 0.14, "black": 0.02, "directions": 0.17, "pixels": 0.1, "mosaics": 0.15}
# "All" channels together are bet on more than each alone.
_ALL = 0.7
# So much begins to bet with the first image, the rest with the second, when rare bright events are better known.
_AT_ONCE = 0.75


@dataclass(frozen=True, eq=False)
class Wealth:
    """Logarithms of share times wealth, (amplitudes, P, boxes), of one suspicion at one scale."""

    suspicion: str
    scale: Scale
    logs: Floats


class Process:
    """Bets on images of one case, one after another."""

    def __init__(self, null: Null, directions: tuple[Direction, ...], alternatives: tuple[Direction, ...]) -> None:
        self.null = null
        self.past = Past.of(null)
        self._directions = directions
        self._alternatives = alternatives
        self._images = 0
        self._surprises = 0
        self._scales = scales(*null.grid)
        blocks = null.low.shape
        # Sums of gains: of blocks, of whole images along directions, and against alternatives.
        self._brighter = np.zeros((len(AMPLITUDES), *blocks))
        self._darker = np.zeros((len(DARK_AMPLITUDES), *blocks))
        self._black = np.zeros((len(_BLACK_STAKES), *blocks))
        self._along = _Series(len(directions))
        self._against = _Series(len(alternatives))
        self._first_image = np.zeros((2, len(AMPLITUDES), blocks[0]))
        self._factors = np.ones((len(_SPARSE_AMPLITUDES), SIDE * SIDE, blocks[1]))

    # ------------------------------------------------------------------------------------------------- betting

    def see(self, observed: Floats, spp: int) -> None:
        """Bet on one image, (P, 16, blocks), of so many samples per pixel."""
        null = self.null
        values = np.where(null.lit, observed / null.mean - 1, 0.0)
        if self._images == 0:
            self._see_part(values[:, _LOOKED_AT], _LOOKED_AT, spp, bets=False)
            surprised = self._see_part(values[:, _BET_ON], _BET_ON, spp, bets=True)
            self._first_image = np.stack([self._brighter.sum(axis=-1), self._darker.sum(axis=-1)])
        else:
            surprised = self._see_part(values, tuple(range(SIDE * SIDE)), spp, bets=True)
        if null.black.any():
            above = np.where(null.black, observed / null.black_level - 1, 0.0)
            for index, stake in enumerate(_BLACK_STAKES):
                self._black[index] += np.log1p(stake * above).sum(axis=1)
        self._along.end_of_image(self._images == 0)
        self._against.end_of_image(self._images == 0)
        self._images += 1
        # A pixel above the headroom shows that downward bets were unfair: they start again, with half of the wealth.
        if surprised:
            self._surprises += 1
            self._darker[:] = 0
            self._first_image[1] = 0
            self._along.forget()
            self._against.lose()
            self._factors[_SPARSE_AMPLITUDES < 0] = 1

    def _see_part(self, values: Floats, which: tuple[int, ...], spp: int, bets: bool) -> bool:
        """Bet on some pixels of every block, then remember them; returns whether one was too bright to be true."""
        null = self.null
        rows = list(which)
        pixels = Pixels.of(values, null.lit[:, rows])
        surprised = False
        if bets:
            variance, headroom = self.past.variance(null) / spp, self.past.headroom(null)
            self._bet(pixels, rows, variance, headroom)
            surprised = bool((1 + pixels.highest > headroom)[pixels.sums[0] > 0].any())
        self.past = self.past.having_seen(pixels, spp, null.smooth[:, rows])
        return surprised

    def _bet(self, pixels: Pixels, rows: list[int], variance: Floats, headroom: Floats) -> None:
        null = self.null
        above, below = pixels.about(null.high), pixels.about(null.low)
        most = most_below(headroom, null.low)
        for index, amplitude in enumerate(AMPLITUDES):
            self._brighter[index] += above.gains(stakes(amplitude, variance, most))
        for index, amplitude in enumerate(DARK_AMPLITUDES):
            self._darker[index] += below.gains(stakes(amplitude, variance, most))
        of_planes = [(above.of_plane(p), below.of_plane(p)) for p in range(len(variance))]
        for index in self._along.alive:
            one = self._directions[index]
            self._along.add(index, _gain(one, of_planes[one.plane], rows, variance[one.plane], most[one.plane]))
        for index in self._against.undecided:
            one = self._alternatives[index]
            p = slice(one.plane, one.plane + 1)
            self._against.add(index, _gain_against(one, pixels, rows, variance[p], headroom[p]))
        up = (pixels.values[0] - (null.high[0] - 1)) / null.high[0]
        down = (pixels.values[0] - (null.low[0] - 1)) / null.low[0]
        for index, amplitude in enumerate(_SPARSE_AMPLITUDES):
            stake = stakes(amplitude, variance[0], most[0])
            factors = np.maximum(1 + stake * (up if amplitude > 0 else down), LOST)
            factors[~pixels.included[0]] = 1
            factors *= self._factors[index, rows]
            self._factors[index, rows] = np.minimum(factors, _RICHEST, out=factors)

    # ------------------------------------------------------------------------------------------------- wealth

    @property
    def log_e(self) -> float:
        """Logarithm of the e-value."""
        boxes = [special.logsumexp(wealth.logs) for wealth in self.boxes()]
        along = self._along.logs + self._start + np.log(_SHARES["directions"] / max(len(self._directions), 1))
        return float(special.logsumexp([*boxes, *self._late(), *along, *self._log_pixels(), *self._log_mosaics()]))

    @property
    def log_excluded(self) -> Floats:
        """Logarithms of the wealth of the bets against each alternative, which end once they have enough."""
        return self._against.logs

    @property
    def _start(self) -> float:
        """Logarithm of what bets on too dark have begun with."""
        return -self._surprises * float(np.log(2))

    def boxes(self) -> list[Wealth]:
        """The wealth of all components that bet on a box being uniformly off, from the first image on."""
        found = []
        for suspicion, logs, amplitudes in (
            ("brighter", self._brighter, AMPLITUDES),
            ("darker", self._darker + self._start, DARK_AMPLITUDES),
            ("not black", self._black, np.ones(len(_BLACK_STAKES))),
        ):
            tile_scales = len(self._scales) - 1
            in_tiles = np.abs(amplitudes) >= _LEAST_IN_TILES
            table = summed_area_table(logs[in_tiles].reshape(in_tiles.sum(), -1, *self.null.grid))
            for scale in self._scales:
                sums = logs.sum(axis=-1, keepdims=True) if scale.is_whole else scale.sums(table)
                if suspicion == "not black":
                    part = _SHARES["black"] / len(self._scales)
                elif scale.is_whole:
                    part = _AT_ONCE * _SHARES["image"] / 2
                else:
                    part = _SHARES["tiles"] / tile_scales / 2
                found.append(Wealth(suspicion, scale, sums + self._log_parts(part / len(sums) / scale.count)[:, None]))
        return found

    def _late(self) -> list[float]:
        """What bets on the whole image have made that began with the second one."""
        parts = self._log_parts((1 - _AT_ONCE) * _SHARES["image"] / 2 / len(AMPLITUDES))
        later = np.stack([self._brighter.sum(axis=-1), self._darker.sum(axis=-1) + self._start]) - self._first_image
        return [float(special.logsumexp(later + parts))]

    def _log_parts(self, share: float) -> Floats:
        """Logarithms of a share, divided among planes."""
        planes = len(self.null.channels)
        of_planes = np.full(planes, (1 - _ALL) / max(planes - 1, 1))
        of_planes[0] = _ALL if planes > 1 else 1.0
        result: Floats = np.log(share * of_planes)
        return result

    def _log_pixels(self) -> list[float]:
        """Any few pixels may be off: the product over all pixels of mixtures, in which most of the wealth is kept."""
        share = np.log(_SHARES["pixels"] / len(_PARTS_OF_PIXELS))
        gained = self._factors.mean(axis=0) - 1
        return [float(log_product(1 + part * gained).sum()) + share + self._start for part in _PARTS_OF_PIXELS]

    def _log_mosaics(self) -> list[float]:
        """The same for tiles that do not overlap."""
        logs = np.concatenate([self._brighter[:, 0], self._darker[:, 0]])
        logs = logs.reshape(len(logs), *self.null.grid)
        sides = [side for side in (1, 2, 4, 8, 16) if side < max(self.null.grid)]
        found = []
        for side in sides:
            whole = np.pad(logs, [(0, 0), (0, -logs.shape[1] % side), (0, -logs.shape[2] % side)])
            count, height, width = whole.shape
            tiles = whole.reshape(count, height // side, side, width // side, side).sum(axis=(2, 4))
            top = tiles.max(axis=0)
            mixed = np.log(np.exp(tiles - top).mean(axis=0)) + top
            share = np.log(_SHARES["mosaics"] / len(sides) / len(_PARTS_OF_TILES)) + self._start
            for part in _PARTS_OF_TILES:
                found.append(float(np.logaddexp(np.log(1 - part), np.log(part) + mixed).sum()) + share)
        return found


class _Series:
    """Gains of components of the whole image, some of whose wealth waits for the second image."""

    def __init__(self, count: int) -> None:
        self._gains = np.zeros(count)
        self._first = np.zeros(count)

    @property
    def alive(self) -> Integers:
        """Components that are not ruined; they may be left to what they have."""
        return np.flatnonzero(self.logs > _RUINED)

    @property
    def undecided(self) -> Integers:
        """Those of them that have not enough to exclude what they bet against; the others stop there."""
        return np.flatnonzero((self.logs > _RUINED) & (self.logs < ENOUGH))

    def add(self, index: int, gain: float) -> None:
        """Bet once."""
        self._gains[index] += gain

    def end_of_image(self, is_first: bool) -> None:
        """Let the rest of the wealth begin after the first image."""
        if is_first:
            self._first = self._gains.copy()

    def forget(self) -> None:
        """Begin anew."""
        self._gains[:] = 0
        self._first[:] = 0

    def lose(self) -> None:
        """Give up what was gained."""
        self._gains = np.minimum(self._gains, 0)
        self._first = np.minimum(self._first, self._gains)

    @property
    def logs(self) -> Floats:
        """Logarithms of wealth that began with 1."""
        result: Floats = np.logaddexp(np.log(_AT_ONCE) + self._gains, np.log(1 - _AT_ONCE) + self._gains - self._first)
        return result


def _gain(
    along: Direction, outcomes: tuple[Outcomes, Outcomes], rows: list[int], variance: Floats, most: Floats
) -> float:
    """Gain of a bet that pixels are off along a direction: above their highest or below their lowest right value."""
    above, below = outcomes
    total = 0.0
    wanted = stakes(along.even, variance, most)[None]
    if (wanted > 0).any():
        total += float(above.gains(np.maximum(wanted, 0)).sum())
    if (wanted < 0).any():
        total += float(below.gains(np.minimum(wanted, 0)).sum())
    if len(along.uneven):
        where = along.uneven
        pixels = along.pixels[rows]
        stake = stakes(pixels, variance[where], most[where])
        limit = np.where(stake > 0, above.limit[0, where], below.limit[0, where])
        values = above.pixels.values[0][:, where]
        off = (values - (limit - 1)) / limit * above.pixels.included[0][:, where]
        total += float(log_product(1 + stake * off).sum())
    return total


def _gain_against(against: Direction, pixels: Pixels, rows: list[int], variance: Floats, headroom: Floats) -> float:
    """Gain of a bet that pixels are right, fair if they are off along a direction at least as much as it says."""
    total = 0.0
    plane = slice(against.plane, against.plane + 1)
    one = Pixels(
        pixels.values[plane], pixels.included[plane], pixels.sums[:, plane], pixels.lowest[plane], pixels.highest[plane]
    )
    limit = 1 + against.even[None]
    # Downwards if the alternative is brighter, and the other way round.
    wanted = stakes(-against.even[None], variance, most_below(headroom, limit))
    total += float(one.about(limit).gains(wanted).sum())
    if len(against.uneven):
        where = against.uneven
        deviations = against.pixels[rows]
        limit = 1 + deviations
        stake = stakes(-deviations, variance[0, where], most_below(headroom[0, where], limit))
        off = (one.values[0][:, where] - deviations) / limit * one.included[0][:, where]
        total += float(log_product(1 + stake * off).sum())
    return total
