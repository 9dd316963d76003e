"""What a course asks: cases, points, tolerance and error budget."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from oracle.statistics import MIN_IMAGES
from reference_scenes.families import FAMILIES
from reference_scenes.loading import InvalidFile, load_toml, suggest
from reference_scenes.model import Model


def _require_family(name: str) -> str:
    if name not in FAMILIES:
        raise ValueError(f"is no family of scenes; {suggest(name, list(FAMILIES))}")
    return name


class CaseOfRubric(Model):
    """One family to be graded; `spp` defaults to what suits the family."""

    family: Annotated[str, AfterValidator(_require_family)]
    points: Annotated[float, Field(ge=0, le=1e6)] = 10.0
    spp: Annotated[int, Field(ge=1, le=1 << 20)] | None = None
    tolerance: Annotated[float, Field(gt=0, le=0.5)] | None = None


def _require_different(cases: tuple[CaseOfRubric, ...]) -> tuple[CaseOfRubric, ...]:
    names = [case.family for case in cases]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"names {', '.join(sorted(twice))} more than once")
    if not cases:
        raise ValueError("is empty; at least one case is needed")
    return cases


class Rubric(Model):
    """All that a grading needs besides the submission and the seed.

    Attributes
    ----------
    error_budget : float
        Largest probability with which a right submission may lose a point, shared by all cases.
    tolerance : float
        Relative bias that still counts as right.
    detectable_bias : float
        "Right" is said only if being off by this much is ruled out, globally and in patterns, at 99 % each.
    max_images : int
        A case that is still undecided after this many images stays undecided.
    timeout : float
        Seconds that one image may take.
    """

    name: Annotated[str, Field(min_length=1, max_length=200)]
    error_budget: Annotated[float, Field(gt=0, le=0.1)] = 1e-4
    tolerance: Annotated[float, Field(gt=0, le=0.5)] = 0.005
    detectable_bias: Annotated[float, Field(gt=0, le=1)] = 0.02
    max_images: Annotated[int, Field(ge=MIN_IMAGES, le=1024)] = 16
    timeout: Annotated[float, Field(gt=0, le=3600)] = 60.0
    cases: Annotated[tuple[CaseOfRubric, ...], AfterValidator(_require_different)]

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        largest = max(case.tolerance or self.tolerance for case in self.cases)
        if self.detectable_bias <= largest:
            raise ValueError(f"detectable_bias {self.detectable_bias} must exceed every tolerance, here {largest}")
        return self


def load_rubric(path: Path) -> Rubric:
    """Read a rubric from a TOML file; raises InvalidFile."""
    try:
        return load_toml(path, Rubric)
    except InvalidFile:
        raise
    except ValueError as error:
        # A number with thousands of digits is TOML, but too much for Python.
        raise InvalidFile(f"{path}: not TOML: {error}") from None


def ready_rubric(name: str) -> Rubric:
    """One of the rubrics that come with the package, by file name without suffix."""
    with resources.as_file(resources.files("graders") / "rubrics" / f"{name}.toml") as path:
        return load_rubric(path)
