"""What a grading found: `result.json`, the only truth; reports format it.

Everything but the fields named ``times`` is the same for the same submission, rubric, seed and tool version.
"""

from __future__ import annotations

from importlib import metadata
from typing import Literal

from oracle.statistics import Evidence, Verdict
from reference_scenes.model import Model


class IntervalResult(Model):
    """An estimate with its 99 % confidence interval."""

    estimate: float
    low: float
    high: float


class PlaceResult(Model):
    """The box of pixels with the strongest evidence, and observed over expected light in it (null where none was)."""

    x: int
    y: int
    width: int
    height: int
    channel: str
    suspicion: str
    ratio: float | None


class EvidenceResult(Model):
    """`oracle.statistics.Evidence` as data; see there for what the fields mean."""

    log10_e_value: float
    log10_threshold: float
    images: int
    distinct_images: int
    spp: int
    ratios: dict[str, IntervalResult]
    bias: float
    alternatives: int
    not_excluded: tuple[str, ...]
    place: PlaceResult | None
    images_needed: int | None
    assumptions: tuple[str, ...]

    @classmethod
    def of(cls, evidence: Evidence) -> EvidenceResult:
        """Evidence as data, its numbers rounded to what they mean."""
        place = evidence.place
        return cls(
            log10_e_value=_rounded(evidence.log10_e_value),
            log10_threshold=_rounded(evidence.log10_threshold),
            images=evidence.images,
            distinct_images=evidence.distinct_images,
            spp=evidence.spp,
            ratios={
                name: IntervalResult(
                    estimate=_rounded(ratio.estimate), low=_rounded(ratio.low), high=_rounded(ratio.high)
                )
                for name, ratio in evidence.ratios.items()
            },
            bias=evidence.bias,
            alternatives=evidence.alternatives,
            not_excluded=evidence.not_excluded,
            place=None
            if place is None
            else PlaceResult(
                x=place.x,
                y=place.y,
                width=place.width,
                height=place.height,
                channel=place.channel,
                suspicion=place.suspicion,
                ratio=_rounded_or_none(place.ratio),
            ),
            images_needed=evidence.images_needed,
            assumptions=evidence.assumptions,
        )


class CaseTimes(Model):
    """Seconds spent on a case."""

    render: float
    judge: float


class ImagesOfCase(Model):
    """Paths of a case's images relative to the result, linear EXR.

    ``difference`` is (observed - expected) / expected, 0 where neither has light.
    """

    expected: str
    observed: str | None
    difference: str | None


class CaseResult(Model):
    """What was found in one case.

    ``reason`` is one sentence for people; ``log`` is what the submission printed, without control characters.
    """

    family: str
    seed: int
    law: str
    concept: str
    formula: str
    source: str
    spp: int
    tolerance: float
    verdict: Verdict
    reason: str
    points: float
    possible: float
    evidence: EvidenceResult | None
    images: ImagesOfCase | None
    log: str
    times: CaseTimes


class SubmissionResult(Model):
    """Who was graded."""

    name: str
    kind: str
    scene_format: str
    build_log: str


class GradingTimes(Model):
    """When the grading started (UTC, ISO 8601) and how long it took."""

    started: str
    seconds: float


class Tool(Model):
    """What graded."""

    name: str = "render-oracle"
    version: str = metadata.version("render-oracle")


class Result(Model):
    """A whole grading. ``possible`` leaves out the cases in which the machine failed."""

    format: Literal["render-oracle-result"] = "render-oracle-result"
    version: Literal[1] = 1
    tool: Tool = Tool()
    rubric: str
    error_budget: float
    seed: int
    submission: SubmissionResult
    verdicts: dict[Verdict, int]
    points: float
    possible: float
    cases: tuple[CaseResult, ...]
    times: GradingTimes


def _rounded(value: float) -> float:
    """Six significant digits."""
    return float(f"{value:.6g}")


def _rounded_or_none(value: float | None) -> float | None:
    return None if value is None else _rounded(value)
