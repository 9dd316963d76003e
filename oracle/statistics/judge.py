"""The judge: bets against a renderer that a right one almost never lets win, and against its being wrong.

By Ville's inequality (1939) the e-value of a right renderer, see `oracle.statistics.process`, ever exceeds 1/alpha
with a probability of at most alpha, whatever the distribution of the noise and however often one looks.

References: Waudby-Smith and Ramdas 2024 (betting), Ramdas, Gruenwald, Vovk and Shafer 2023 (e-processes).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from oracle.arrays import Booleans, Floats
from oracle.expectation import Expectation
from oracle.statistics.alternatives import alternatives
from oracle.statistics.coarse import Grid, coarse_deviations, coarse_expectation, coarse_image, grids
from oracle.statistics.directions import Deviation, Direction, direction, suspicions
from oracle.statistics.evidence import Evidence, Interval, Place, Verdict
from oracle.statistics.independence import independent
from oracle.statistics.interval import anytime_intervals, intervals_between_images
from oracle.statistics.null import SIDE, Null, from_blocks, null_of, planes, to_blocks
from oracle.statistics.process import ENOUGH, Process

# Fewer images cannot show that their pixels are independent.
MIN_IMAGES = 4
# The part of the wealth that bets on pixels and is lost when these turn out to be correlated; the rest is for blocks.
_ON_PIXELS = 0.8
# Where the evidence is: a place is as good as another if the logarithm of its wealth is this part of the other's.
_NEARLY = 0.75
# Two images that differ by less than this fraction of their mean radiance are one.
_SAME_IMAGE = 1e-5


@dataclass(frozen=True, eq=False)
class Bank:
    """What is bet on in a case; set up once, for any number of judges."""

    expectation: Expectation
    tolerance: float
    bias: float
    null: Null
    suspicions: tuple[Direction, ...]
    alternatives: tuple[Direction, ...]

    @classmethod
    def of(cls, expectation: Expectation, tolerance: float, detectable_bias: float) -> Bank:
        """Set up the bets on an expectation, see `judge` for the arguments."""
        null = null_of(expectation, tolerance)
        suspected, alternative = _deviations(expectation, null, detectable_bias)
        lit = _lit(null, expectation)
        return cls(
            expectation=expectation,
            tolerance=tolerance,
            bias=detectable_bias,
            null=null,
            suspicions=tuple(direction(*one, lit[one[1]]) for one in suspected),
            alternatives=tuple(direction(*one, lit[one[1]]) for one in alternative),
        )


@lru_cache(maxsize=256)
def _on_grid(bank: Bank, grid: Grid) -> tuple[Null, tuple[Direction, ...], tuple[Direction, ...]]:
    """What a process that bets on the blocks of a grid is made of."""
    coarse = coarse_expectation(bank.expectation, grid)
    null = null_of(coarse, bank.tolerance)
    mean, lit, coarse_lit = planes(bank.expectation.radiance), _lit(bank.null, bank.expectation), _lit(null, coarse)
    suspected, alternative = (
        tuple(
            direction(name, p, coarse_deviations(mean[p], lit[p], off, grid), coarse_lit[p]) for name, p, off in found
        )
        for found in _deviations(bank.expectation, bank.null, bank.bias)
    )
    return null, suspected, alternative


def _deviations(expectation: Expectation, null: Null, bias: float) -> tuple[Iterator[Deviation], Iterator[Deviation]]:
    """What is suspected, and what is to be ruled out."""
    mean, lit = planes(expectation.radiance), _lit(null, expectation)
    height, width = expectation.valid.shape
    error = from_blocks(np.repeat(null.error[:, None], SIDE * SIDE, axis=1), null.grid)[..., :height, :width]
    return suspicions(mean[0], lit[0]), alternatives(null.channels, mean, error, lit, bias)


def _lit(null: Null, expectation: Expectation) -> Booleans:
    height, width = expectation.valid.shape
    result: Booleans = from_blocks(null.lit, null.grid)[..., :height, :width]
    return result


class Judge:
    """Looks at the images of one renderer for one case as they arrive.

    Parameters
    ----------
    bank : Bank
        The case.
    error_budget : float
        Largest probability with which a right renderer may be called wrong, however often and late one looks.
    """

    def __init__(self, bank: Bank, error_budget: float) -> None:
        self._bank = bank
        self._threshold = -float(np.log(error_budget))
        self._pixels: Process | None = Process(bank.null, bank.suspicions, bank.alternatives)
        self._grids: tuple[tuple[Grid, Process], ...] = ()
        self._seen: list[Floats] = []
        self._spp: list[int] = []
        self._images = 0

    def look(self, image: Floats, spp: int = 1) -> Evidence:
        """Take one more image into account.

        Parameters
        ----------
        image : ndarray
            Independent of those before, shape (height, width, channels); finite and at least 0.
        spp : int
            Samples per pixel.

        Returns
        -------
        Evidence
            From all images so far.

        Raises
        ------
        ValueError
            If the image does not fit the expectation, or holds negative or non-finite pixels.
        """
        expected = self._bank.expectation.radiance.shape
        if image.shape != expected:
            raise ValueError(f"an image has shape {image.shape}, it must be {expected}")
        if not np.isfinite(image).all() or (image < 0).any():
            raise ValueError("images must be finite and at least 0 everywhere")
        self._images += 1
        if not any(_alike(image, other) for other in self._seen):
            self._seen.append(image)
            self._spp.append(spp)
            self._bet(image, spp)
        return self._evidence()

    def _bet(self, image: Floats, spp: int) -> None:
        if self._pixels is None:
            self._bet_on_grids(image, spp)
            return
        self._pixels.see(to_blocks(planes(image)), spp)
        if len(self._seen) >= MIN_IMAGES and not independent(self._comparable()):
            self._pixels = None
            self._grids = tuple((grid, Process(*_on_grid(self._bank, grid))) for grid in grids(self._comparable()))
            for past, samples in zip(self._seen, self._spp, strict=True):
                self._bet_on_grids(past, samples)

    def _bet_on_grids(self, image: Floats, spp: int) -> None:
        for grid, process in self._grids:
            process.see(to_blocks(coarse_image(planes(image), self._bank.expectation.valid, grid)), spp)

    def _comparable(self) -> Floats:
        """Pairs of consecutive images of equally many samples, all channels together."""
        kept: list[Floats] = []
        index = 0
        while index + 1 < len(self._seen):
            if self._spp[index] == self._spp[index + 1]:
                kept += [image.mean(axis=-1) for image in self._seen[index : index + 2]]
                index += 2
            else:
                index += 1
        lit = _lit(self._bank.null, self._bank.expectation)[0]
        return lit * np.stack(kept) if kept else np.zeros((2, *lit.shape))

    # ------------------------------------------------------------------------------------------- what is found

    def _evidence(self) -> Evidence:
        bank = self._bank
        processes: list[Process] = [self._pixels] if self._pixels else [process for _, process in self._grids]
        share = _ON_PIXELS if self._pixels else (1 - _ON_PIXELS) / len(processes)
        log_e = float(special.logsumexp([process.log_e for process in processes])) + float(np.log(share))
        excluded = special.logsumexp([p.log_excluded for p in processes], axis=0) - np.log(len(processes))
        left = excluded < ENOUGH
        not_excluded = tuple(one.name for one, open_ in zip(bank.alternatives, left, strict=True) if open_)
        if log_e >= self._threshold:
            verdict = Verdict.WRONG
        elif bank.alternatives and not not_excluded:
            verdict = Verdict.RIGHT
        else:
            verdict = Verdict.UNDECIDED
        return Evidence(
            verdict=verdict,
            log10_e_value=log_e / float(np.log(10)),
            log10_threshold=self._threshold / float(np.log(10)),
            images=self._images,
            distinct_images=len(self._seen),
            spp=sum(self._spp),
            ratios=self._ratios(),
            bias=bank.bias,
            alternatives=len(bank.alternatives),
            not_excluded=not_excluded,
            place=self._place() if verdict == Verdict.WRONG else None,
            images_needed=self._needed(log_e, excluded) if verdict == Verdict.UNDECIDED else None,
            assumptions=self._assumptions(),
        )

    def _ratios(self) -> dict[str, Interval]:
        if self._pixels:
            return anytime_intervals(self._bank.null, self._pixels.past)
        images = np.stack([to_blocks(planes(image)) for image in self._seen])
        return intervals_between_images(self._bank.null, images, np.array(self._spp, dtype=np.float64))

    def _needed(self, log_e: float, excluded: Floats) -> int | None:
        """Images after which one of both processes gets through, if they go on as they did."""
        count = len(self._seen)
        candidates = []
        if log_e > 1:
            candidates.append(count * self._threshold / log_e)
        slowest = float(excluded.min()) if len(excluded) else 0.0
        if slowest > 0.5:
            candidates.append(count * ENOUGH / slowest)
        return max(int(np.ceil(min(candidates))), count + 1) if candidates else None

    def _place(self) -> Place:
        """The smallest box in which some suspicion has grown nearly as rich as any has."""
        height, width = self._bank.expectation.valid.shape
        if self._pixels is None:
            of_grids = [wealth for _, process in self._grids for wealth in process.boxes()]
            richest = max(of_grids, key=lambda one: one.logs.max())
            return self._seen_in(richest.suspicion, 0, 0, 0, width, height)
        wealth = self._pixels.boxes()
        most = max(float(one.logs.max()) for one in wealth)
        by_size = sorted(wealth, key=lambda w: int(((w.scale.x1 - w.scale.x0) * (w.scale.y1 - w.scale.y0)).max()))
        best = next((w for w in by_size if w.logs.max() >= _NEARLY * most), by_size[-1])
        # All channels together are preferred to one in the same way.
        logs = best.logs[:, :1] if best.logs[:, 0].max() >= _NEARLY * best.logs.max() else best.logs
        _, plane, box = np.unravel_index(int(logs.argmax()), logs.shape)
        scale = best.scale
        x0, y0 = int(scale.x0[box]) * SIDE, int(scale.y0[box]) * SIDE
        x1, y1 = min(int(scale.x1[box]) * SIDE, width), min(int(scale.y1[box]) * SIDE, height)
        return self._seen_in(best.suspicion, int(plane), x0, y0, x1, y1)

    def _seen_in(self, suspicion: str, plane: int, x0: int, y0: int, x1: int, y1: int) -> Place:
        """A box with what is seen in it."""
        null = self._bank.null
        box = (plane, slice(y0, y1), slice(x0, x1))
        mask = from_blocks(null.black if suspicion == "not black" else null.lit, null.grid)[box]
        expected = float(planes(self._bank.expectation.radiance)[box][mask].sum())
        mean = np.average([planes(image)[box] for image in self._seen], axis=0, weights=self._spp)
        ratio = None if suspicion == "not black" or expected == 0 else float(mean[mask].sum()) / expected
        return Place(x0, y0, x1 - x0, y1 - y0, null.channels[plane], suspicion, ratio)

    def _assumptions(self) -> tuple[str, ...]:
        distinct = len(self._seen)
        statements = []
        if distinct < self._images:
            statements.append(f"{self._images - distinct} of {self._images} images repeat another and are not counted")
        if self._pixels is None:
            gap = self._grids[0][0].stride
            apart = "one bet per image is made" if len(self._grids) == 1 else f"bets are made {gap} pixels apart"
            statements.append(f"the noise of different pixels is correlated: {apart}")
        elif distinct < MIN_IMAGES:
            statements.append(
                f"the noise of different pixels is independent (not checked: fewer than {MIN_IMAGES} images)"
            )
        else:
            statements.append("the noise of different pixels is independent (checked)")
        statements.append("different images are independent")
        if np.isfinite(self._bank.null.largest).all():
            statements.append(
                "no sample is brighter than those of all customary estimators (only for bets on too dark)"
            )
        else:
            statements.append(
                "no pixel of an image is brighter than twice the brightest before it (only for bets on too dark)"
            )
        return tuple(statements)


def _alike(image: Floats, other: Floats) -> bool:
    """Whether an image is a copy of another, up to rounding: no second observation."""
    close = _SAME_IMAGE * image.mean()
    # The means are compared first, for most images differ in them.
    return bool(abs(image.mean() - other.mean()) <= close and np.abs(image - other).mean() <= close)


def judge(
    expectation: Expectation,
    images: Sequence[Floats] | Floats,
    tolerance: float,
    error_budget: float,
    detectable_bias: float,
    spp: int = 1,
) -> Evidence:
    """Judge the images of one case.

    Parameters
    ----------
    expectation : Expectation
        What a right renderer shows, shape (height, width, channels).
    images : sequence of ndarray
        Independent images of the case, in the order in which they were rendered, shape (height, width, channels) each;
        finite and at least 0.
    tolerance : float
        Relative bias that still counts as right, in every pixel.
    error_budget : float
        Largest probability with which a right renderer may be called wrong, however often and late one looks.
    detectable_bias : float
        "Right" is said only if biases of this size are ruled out.
    spp : int
        Samples per pixel of each image.

    Returns
    -------
    Evidence
        With the verdict right, wrong or undecided. What could not be checked is among its assumptions.

    Raises
    ------
    ValueError
        If the images do not fit the expectation, or hold negative or non-finite pixels, or there are none.
    """
    if len(images) == 0:
        raise ValueError("there are no images to judge")
    court = Judge(Bank.of(expectation, tolerance, detectable_bias), error_budget)
    return [court.look(image, spp) for image in images][-1]
