"""`oracle demo`: two right renderers, and one of them with every bug it knows."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from graders.cli.console import output, print_table
from graders.cli.grade import grade_and_write, print_result
from graders.grading import Job
from graders.output import REPORT, replace, require_writable
from graders.report.overview import overview_html
from graders.result import Result
from graders.rubric import ready_rubric
from graders.submission import CommandSubmission, load_submission
from oracle.statistics import Verdict

BUGS = (
    "no-inverse-pi",
    "extra-pi",
    "no-receiver-cosine",
    "no-light-cosine",
    "inverse-distance",
    "inverse-cube",
    "no-light-area",
    "hemisphere-pdf",
    "no-visibility",
    "two-sided-light",
    "srgb-output",
    "red-blue-swapped",
    "flipped-vertically",
    "half-pixel-shift",
    "no-division",
    "shadow-acne",
)


def run_demo(quick: bool, out: Path, seed: int, jobs: int) -> bool:
    """Grade, write a report for each and an overview of all; return whether everything came out as it should."""
    require_writable(out)
    rubric = ready_rubric("quick" if quick else "first-light")
    examples = Path(str(resources.files("graders"))) / "examples"
    mitsuba, student = (Job(*load_submission(examples / name)) for name in ("mitsuba", "student"))
    wanted = {"mitsuba3": mitsuba, "student": student} | {f"bugs/{bug}": _with_bug(student, bug) for bug in BUGS}
    results = grade_and_write(
        list(wanted.values()), rubric, seed, jobs, [out / name for name in wanted], "grading the demo"
    )
    named = dict(zip(wanted, results, strict=True))
    for name in ("mitsuba3", "student"):
        print_result(named[name])
    _print_matrix(named)
    replace(out / REPORT, overview_html(named).encode())

    wrong = [name for name in ("mitsuba3", "student") if named[name].points != named[name].possible]
    escaped = [bug for bug in BUGS if not named[f"bugs/{bug}"].verdicts.get(Verdict.WRONG)]
    console = output()
    if wrong:
        console.print(f"not right in every case: {', '.join(wrong)}")
    if escaped:
        console.print(f"caught in no case: {', '.join(escaped)}")
    console.print(f"{len(BUGS) - len(escaped)} of {len(BUGS)} bugs caught")
    print((out / REPORT).resolve())
    return not wrong and not escaped


def _with_bug(job: Job, bug: str) -> Job:
    """The example student with one of its bugs switched on."""
    assert isinstance(job.submission, CommandSubmission)
    render = job.submission.render.model_copy(update={"command": (*job.submission.render.command, "--bug", bug)})
    return Job(job.submission.model_copy(update={"name": f"student with {bug}", "render": render}), job.source)


def _print_matrix(results: dict[str, Result]) -> None:
    """Which bug is wrong in which cases."""
    rows = []
    for bug in BUGS:
        cases = results[f"bugs/{bug}"].cases
        caught = [case.family for case in cases if case.verdict == Verdict.WRONG]
        shown = "all cases" if len(caught) == len(cases) else ", ".join(caught) or "none"
        rows.append((bug, f"{len(caught)}/{len(cases)}", shown))
    print_table(output(), ("bug", "caught", "wrong in"), rows)
