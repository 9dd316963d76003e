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
    ratios : dict
        Observed over expected light of the whole image, for "all" channels together and for each by name.
    detectable_brighter, detectable_darker : float or None
        The smallest global bias in either direction that these images would have revealed with 99 % probability;
        None if no bias would, and for a wrong verdict.
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
    ratios: dict[str, Interval]
    detectable_brighter: float | None
    detectable_darker: float | None
    place: Place | None
    images_needed: int | None
    assumptions: tuple[str, ...]
