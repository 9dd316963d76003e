"""The report for people: one HTML page that needs nothing else, not even a network."""

from __future__ import annotations

import base64
import hashlib
import shlex
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup

from graders.report import pictures, text
from graders.result import CaseResult, EvidenceResult, IntervalResult, PlaceResult, Result
from oracle.arrays import Floats
from oracle.statistics import Verdict

# What deserves attention comes first.
_ORDER = (Verdict.WRONG, Verdict.UNGRADABLE, Verdict.UNDECIDED, Verdict.INFRASTRUCTURE_ERROR, Verdict.RIGHT)
_MEANINGS = {
    Verdict.WRONG: "The light differs from what the law demands by more than the tolerance; noise does not explain it.",
    Verdict.UNGRADABLE: "There was no image that could be judged: the submission failed, or its image is broken.",
    Verdict.UNDECIDED: "The noise hides whether the light is right.",
    Verdict.INFRASTRUCTURE_ERROR: "The grading machine failed, not the submission. The case does not count.",
    Verdict.RIGHT: "No deviation was found, and one that matters would have been.",
}
_CHANNELS = ("red", "green", "blue")
# Of the ways in which an image may still be wrong, so many are named.
_NAMED = 3


@dataclass(frozen=True)
class _Figure:
    """A picture with its words; only that of the difference has a limit and perhaps a marked place."""

    title: str
    note: str
    description: str
    source: str
    width: int
    height: int
    limit: str | None = None
    place: PlaceResult | None = None


@dataclass(frozen=True)
class _CaseView:
    """A case as the template shows it."""

    anchor: str
    case: CaseResult
    overall: IntervalResult | None
    excluded: float | None
    figures: tuple[_Figure, ...]
    sentences: tuple[str, ...]
    command: str


def write_html(result: Result, folder: Path) -> str:
    """Format a result as one self-contained page.

    Parameters
    ----------
    result : Result
        What was found.
    folder : Path
        Where the images named in the result are.

    Returns
    -------
    str
        The page. It loads nothing, runs no script, and shows whatever a submission calls itself or prints as text.

    Raises
    ------
    InfrastructureError
        If an image that the result names cannot be read.
    """
    here = resources.files("graders.report")
    style = (here / "report.css").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "number": text.number,
        "percent": text.percent,
        "sentence": text.sentence,
        "ratio": _ratio,
        "interval": _interval,
        "word": lambda verdict: verdict.replace("-", " "),
    }
    template = environment.from_string((here / "report.html.jinja").read_text("utf-8"))
    ranked = sorted(enumerate(result.cases, start=1), key=lambda entry: _ORDER.index(entry[1].verdict))
    return text.printable(
        template.render(
            result=result,
            cases=[_case_view(f"case-{index}", case, result.submission.scene_format, folder) for index, case in ranked],
            tally=[(verdict, result.verdicts[verdict]) for verdict in _ORDER if result.verdicts.get(verdict)],
            symbols=text.SYMBOLS,
            meanings={verdict: _MEANINGS[verdict] for verdict in _ORDER},
            nothing_ran=all(case.verdict == Verdict.UNGRADABLE for case in result.cases),
            legend=_data_uri(pictures.legend()),
            # The policy admits this style alone, so that no markup of a stranger could bring its own.
            style=Markup(style),  # noqa: S704 - a file of this package
            style_hash=base64.b64encode(hashlib.sha256(style.encode()).digest()).decode(),
        )
    )


def _case_view(anchor: str, case: CaseResult, scene_format: str, folder: Path) -> _CaseView:
    evidence = case.evidence
    excluded = evidence.bias if evidence and evidence.alternatives and not evidence.not_excluded else None
    return _CaseView(
        anchor=anchor,
        case=case,
        overall=evidence.ratios.get("all") if evidence else None,
        excluded=excluded,
        figures=_figures(case, folder),
        sentences=_sentences(evidence, case.verdict, case.tolerance) if evidence else (),
        command=f"oracle scenes export {shlex.quote(case.family)} --seed {case.seed}"
        f" --format {shlex.quote(scene_format)} -o {shlex.quote(f'{case.family}-{case.seed}')}",
    )


# ----------------------------------------------------------------------------------------------- words


def _ratio(interval: IntervalResult) -> str:
    """An estimate in percent, as precise as it is."""
    return text.percent(interval.estimate, (interval.high - interval.low) / 2)


def _interval(interval: IntervalResult) -> str:
    """The bounds of an interval in percent."""
    half_width = (interval.high - interval.low) / 2
    low, high = (text.percent(bound, half_width) for bound in (interval.low, interval.high))
    return f"{low[:-2]} to {high}"


def _sentences(evidence: EvidenceResult, verdict: Verdict, tolerance: float) -> tuple[str, ...]:
    """The evidence in words."""
    sentences = []
    overall = evidence.ratios.get("all")
    if overall is not None:
        sentences.append(
            f"Observed light in the whole image is {_ratio(overall)} of the expected light,"
            f" 99\N{NO-BREAK SPACE}% interval {_interval(overall)}."
        )
    tolerated = f"a bias of up to {text.percent(tolerance)} is tolerated."
    sentences.append(tolerated.capitalize() if verdict == Verdict.WRONG else f"{_ruled_out(evidence)}; {tolerated}")
    sentences.append(
        f"The evidence against the renderer, an e-value, is {text.power_of_ten(evidence.log10_e_value)}."
        f" From {text.power_of_ten(evidence.log10_threshold)} on the verdict is wrong; a right renderer ever gets"
        f" there with a probability of at most {text.power_of_ten(-evidence.log10_threshold)}."
    )
    return tuple(sentences)


def _ruled_out(evidence: EvidenceResult) -> str:
    """What the image is not."""
    if not evidence.alternatives:
        return "No way of being off could be ruled out"
    out = evidence.alternatives - len(evidence.not_excluded)
    size = text.percent(evidence.bias)
    if not evidence.not_excluded:
        return (
            f"That the image is off by {size} is ruled out in all of {out} ways, such as globally, in a channel or in"
            " patterns, each with 99\N{NO-BREAK SPACE}% confidence"
        )
    named = ", ".join(evidence.not_excluded[:_NAMED]) + (" ..." if len(evidence.not_excluded) > _NAMED else "")
    return f"Of {evidence.alternatives} ways to be off by {size}, {out} are ruled out; not yet: {named}"


# ------------------------------------------------------------------------------------------------ pictures


def _figures(case: CaseResult, folder: Path) -> tuple[_Figure, ...]:
    """The pictures of a case."""
    if case.images is None:
        return ()
    expected = pictures.read(folder / case.images.expected)
    height, width = expected.shape[:2]
    white = pictures.white_level(expected)
    figures = [
        _Figure(
            title="expected",
            note=f"white is {white:g} W/(m² sr) or more",
            description=f"Expected image of {case.family}, {width} × {height} pixels",
            source=_data_uri(pictures.display(expected, white)),
            width=width,
            height=height,
        )
    ]
    if case.images.observed is not None:
        observed = pictures.read(folder / case.images.observed)
        count = case.evidence.images if case.evidence else 0
        figures += [
            _Figure(
                title="observed",
                note=f"mean of {count} images, same exposure" if count > 1 else "same exposure",
                description=f"Observed image of {case.family}, {width} × {height} pixels",
                source=_data_uri(pictures.display(observed, white)),
                width=width,
                height=height,
            ),
            _difference(expected, observed, case.evidence.place if case.evidence else None),
        ]
    return tuple(figures)


def _difference(expected: Floats, observed: Floats, place: PlaceResult | None) -> _Figure:
    """The relative difference of the channel with the strongest evidence, or of the mean of the channels."""
    if place is not None and place.channel in _CHANNELS:
        channel = _CHANNELS.index(place.channel)
        before, after, what = expected[..., channel], observed[..., channel], f"{place.channel} channel"
    else:
        before, after, what = expected.mean(axis=2), observed.mean(axis=2), "all channels"
    difference = pictures.relative_difference(before, after)
    limit = pictures.colour_limit(difference)
    height, width = difference.shape
    description = (
        f"Relative difference, {what}: {np.mean(difference > 0):.0%} of the pixels are brighter than expected and"
        f" {np.mean(difference < 0):.0%} darker, by {text.percent(float(np.abs(difference).mean()))} on average"
    )
    if place is not None:
        description += (
            f"; outlined are the {place.width} × {place.height} pixels at x = {place.x}, y = {place.y},"
            " where the evidence is strongest"
        )
    return _Figure(
        title="difference",
        note=f"(observed − expected) / expected, {what}: blue is darker, red is brighter",
        description=description,
        source=_data_uri(pictures.false_colour(difference, limit)),
        width=width,
        height=height,
        limit=text.percent(limit),
        place=place,
    )


def _data_uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
