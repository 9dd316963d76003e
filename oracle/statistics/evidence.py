"""What follows from an expectation and the images of a renderer."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What is said of a case; nothing else is."""

    RIGHT = "right"
    WRONG = "wrong"
    UNDECIDED = "undecided"
    UNGRADABLE = "ungradable"
    INFRASTRUCTURE_ERROR = "infrastructure-error"


@dataclass(frozen=True)
class Interval:
    """An estimate with its 99 % confidence interval."""

    estimate: float
    low: float
    high: float


@dataclass(frozen=True)
class Place:
    """Where the evidence is strongest: a box of pixels, its channel, and what is wrong with it.

    ``suspicion`` is "brighter", "darker" or "not black"; ``ratio`` is observed over expected light in the box, None
    where none was expected.
    """

    x: int
    y: int
    width: int
    height: int
    channel: str
    suspicion: str
    ratio: float | None


@dataclass(frozen=True)
class Evidence:
    """What the images show.

    Attributes
    ----------
    verdict : Verdict
        Right, wrong or undecided.
    log10_e_value : float
        Evidence against the renderer, as the decimal logarithm of an e-value. A right renderer reaches
        ``log10_threshold`` with a probability of at most the error budget, whenever one looks.
    log10_threshold : float
        From here on the verdict is wrong: minus the logarithm of the error budget.
    images, distinct_images : int
        How many images there were, and how many of them differed.
    spp : int
        Samples per pixel of the distinct images together.
    ratios : dict
        Observed over expected light of the whole image, for "all" channels together and for each by name. The
        intervals hold at all times together, unless pixels are correlated.
    bias : float
        The bias by which the alternatives differ from the expectation.
    alternatives : int
        In how many ways a renderer could be off by that: global, in a channel, patterns, quarters, shifts.
    not_excluded : tuple of str
        Those that the images do not yet rule out. Each that is true would be ruled out with a probability of at most
        1 %, whenever one looks. Right means that none is left.
    place : Place or None
        Where the evidence is strongest; None unless wrong.
    images_needed : int or None
        How many images like these would decide an undecided case; None if no number would.
    assumptions : tuple of str
        What the statement rests on, checked or not.
    """

    verdict: Verdict
    log10_e_value: float
    log10_threshold: float
    images: int
    distinct_images: int
    spp: int
    ratios: dict[str, Interval]
    bias: float
    alternatives: int
    not_excluded: tuple[str, ...]
    place: Place | None
    images_needed: int | None
    assumptions: tuple[str, ...]
