"""`oracle grade`."""

from __future__ import annotations

from pathlib import Path

from graders.cli.console import output, print_table, progress
from graders.errors import UsageError
from graders.grading import Job, grade
from graders.output import REPORT, require_writable, write_grading
from graders.result import CaseResult, Result
from graders.rubric import Rubric, load_rubric, ready_rubric
from graders.submission import load_submission
from reference_scenes.loading import InvalidFile


def run_grade(path: Path, rubric: Path | None, out: Path, seed: int, jobs: int, as_json: bool) -> dict[str, int]:
    """Grade a submission, write its results, print them; return how many cases have each verdict."""
    try:
        submission, source = load_submission(path)
        asked = load_rubric(rubric) if rubric else ready_rubric("first-light")
    except InvalidFile as error:
        raise UsageError(str(error)) from None
    require_writable(out)
    result = grade_and_write([Job(submission, source)], asked, seed, jobs, [out], f"grading {submission.name}")[0]
    if as_json:
        print(result.model_dump_json(indent=1))
    else:
        print_result(result)
        print((out / REPORT).resolve())
    return {str(verdict): count for verdict, count in result.verdicts.items()}


def grade_and_write(
    jobs: list[Job], rubric: Rubric, seed: int, workers: int, folders: list[Path], description: str
) -> list[Result]:
    """Grade submissions with a progress bar and write each into its folder."""
    with progress(description, len(jobs) * len(rubric.cases)) as bar:

        def advance(job: Job, result: CaseResult) -> None:
            bar.advance(bar.task_ids[0])

        graded = grade(jobs, rubric, seed, workers, advance)
    return [write_grading(folder, *one) for folder, one in zip(folders, graded, strict=True)]


def print_result(result: Result) -> None:
    """The table of a grading."""
    console = output()
    rows = []
    for case in result.cases:
        ratio = case.evidence.ratios.get("all") if case.evidence else None
        light = f"{100 * ratio.estimate:.2f} %" if ratio else "-"
        rows.append((case.family, str(case.verdict), light, f"{case.points:g}/{case.possible:g}", case.reason))
    print_table(console, ("case", "verdict", "light", "points", "because"), rows)
    console.print(f"{result.submission.name}: {result.points:g} of {result.possible:g} points", markup=False)
