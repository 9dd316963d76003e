"""Grading a submission: render each case, look, judge, render more while undecided, give points."""

from __future__ import annotations

import contextlib
import dataclasses
import datetime
import hashlib
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from graders import processes, wording
from graders.decoding import BadImage, read_image, rgbe_quantisation, srgb_quantisation
from graders.errors import InfrastructureError
from graders.processes import ScratchFolder, one_line
from graders.rendering import Built, Renderer, RenderFailed, Request, build, existing_images, renderer
from graders.result import CaseResult, CaseTimes, EvidenceResult, GradingTimes, ImagesOfCase, Result, SubmissionResult
from graders.rubric import CaseOfRubric, Rubric
from graders.submission import ImagesSubmission, Submission
from oracle.arrays import Floats
from oracle.expectation import Expectation
from oracle.statistics import MIN_IMAGES, Bank, Evidence, Judge, Verdict
from reference_scenes.closed_form import closed_form
from reference_scenes.export import export
from reference_scenes.families import FAMILIES
from reference_scenes.model import Scene

# sRGB files end at 1; what is expected above this could be cut off by noise.
_BRIGHTEST_JUDGED_IN_SRGB = 0.75


@dataclass(frozen=True)
class Case:
    """One member of a family, with all that judging it needs."""

    family: str
    seed: int
    scene: Scene
    spp: int
    tolerance: float
    error_budget: float
    detectable_bias: float
    points: float


@dataclass(frozen=True, eq=False)
class Judged:
    """The outcome of a case: its result, and the expected and mean observed image where there are any."""

    result: CaseResult
    expected: Floats | None = None
    observed: Floats | None = None


@dataclass(frozen=True)
class Job:
    """A submission to grade, with its folder."""

    submission: Submission
    source: Path


def cases_of(rubric: Rubric, seed: int) -> tuple[Case, ...]:
    """The cases of a rubric; the error budget is shared evenly."""
    return tuple(case_of(wanted, rubric, seed) for wanted in rubric.cases)


def case_of(wanted: CaseOfRubric, rubric: Rubric, seed: int) -> Case:
    """One case of a rubric."""
    family = FAMILIES[wanted.family]
    return Case(
        family=wanted.family,
        seed=seed,
        scene=family.member(seed),
        spp=wanted.spp or family.spp,
        tolerance=wanted.tolerance or rubric.tolerance,
        error_budget=rubric.error_budget / len(rubric.cases),
        detectable_bias=rubric.detectable_bias,
        points=wanted.points,
    )


@lru_cache(maxsize=128)
def expectation_of(family: str, seed: int) -> Expectation:
    """The expectation of a family's member."""
    chosen = FAMILIES[family]
    return closed_form(chosen.member(seed), (f"{chosen.formula} [{chosen.source}]",))


def render_seed(family: str, seed: int, index: int) -> int:
    """Seed of the index-th image of a case: different for each, and below 2^31 for renderers that use int."""
    digest = hashlib.sha256(f"{family}/{seed}/image {index}".encode()).digest()
    return int.from_bytes(digest[:4], "little") & 0x7FFFFFFF


# ------------------------------------------------------------------------------------------------ one case


def judge_images(case: Case, images: Sequence[Floats], output: str) -> Evidence:
    """Judge images of a case, at least one, that are already linear and came in the format `output`."""
    court = judge_of(case, output)
    return [court.look(image, case.spp) for image in images][-1]


def judge_of(case: Case, output: str) -> Judge:
    """A judge who has seen no image of a case yet, which will come in the format `output`."""
    bank = _bank_of(case.family, case.seed, output, case.tolerance, case.detectable_bias)
    return Judge(bank, case.error_budget)


@lru_cache(maxsize=32)
def _bank_of(family: str, seed: int, output: str, tolerance: float, detectable_bias: float) -> Bank:
    return Bank.of(_as_seen_through(output, expectation_of(family, seed)), tolerance, detectable_bias)


def _as_seen_through(output: str, expectation: Expectation) -> Expectation:
    """Widen the expectation by what the format rounds, and leave out what a display's white may have cut off."""
    radiance, error, valid = expectation.radiance, expectation.error_bound, expectation.valid
    if output == "hdr":
        error = error + rgbe_quantisation(radiance)
    elif output == "png":
        error = error + srgb_quantisation(np.minimum(radiance, 1.0))
        valid = valid & (radiance <= _BRIGHTEST_JUDGED_IN_SRGB).all(axis=2)
    return dataclasses.replace(expectation, error_bound=error, valid=valid)


def grade_case(case: Case, built: Built, max_images: int, timeout: float) -> Judged:
    """Render and judge one case; never raises but for bugs of this program."""
    started = time.monotonic()
    log = ""
    images: list[Floats] = []
    evidence: Evidence | None = None
    rendering = 0.0
    try:
        if built.failure is not None:
            raise RenderFailed(built.failure, "")
        with ScratchFolder("oracle-") as name:
            source = _Images(case, built, Path(name).resolve(), timeout)
            try:
                wanted = MIN_IMAGES
                court = judge_of(case, built.submission.render.output)
                while True:
                    before = time.monotonic()
                    new = source.more(wanted - len(images))
                    rendering += time.monotonic() - before
                    images += new
                    evidence = [court.look(image, case.spp) for image in new][-1]
                    if evidence.verdict != Verdict.UNDECIDED or source.exhausted(images, evidence, max_images):
                        break
                    wanted = _next_count(len(images), evidence.images_needed, max_images)
            finally:
                log = source.close()
        verdict, reason = evidence.verdict, wording.reason(evidence)
    except RenderFailed as failure:
        verdict, reason, log = Verdict.UNGRADABLE, str(failure), failure.log or log
    except BadImage as failure:
        verdict, reason = Verdict.UNGRADABLE, str(failure)
    except (InfrastructureError, OSError, MemoryError) as failure:
        verdict, reason = Verdict.INFRASTRUCTURE_ERROR, one_line(f"{type(failure).__name__}: {failure}")

    family = FAMILIES[case.family]
    observed = np.mean(images, axis=0) if images else None
    result = CaseResult(
        family=case.family,
        seed=case.seed,
        law=family.law,
        concept=family.concept,
        formula=family.formula,
        source=family.source,
        spp=case.spp,
        tolerance=case.tolerance,
        verdict=verdict,
        reason=reason,
        points=case.points if verdict == Verdict.RIGHT else 0.0,
        possible=0.0 if verdict == Verdict.INFRASTRUCTURE_ERROR else case.points,
        evidence=EvidenceResult.of(evidence) if evidence else None,
        images=None,
        log=log,
        times=CaseTimes(render=round(rendering, 3), judge=round(time.monotonic() - started - rendering, 3)),
    )
    return Judged(result, expectation_of(case.family, case.seed).radiance, observed)


def _next_count(count: int, needed: int | None, max_images: int) -> int:
    """How many images to have before looking again: a little more than predicted, at least half as many again."""
    predicted = 2 * count if needed is None else int(1.1 * needed) + 1
    return min(max(predicted, count + (count + 1) // 2), max_images)


class _Images:
    """Delivers the images of one case as they are wanted."""

    def __init__(self, case: Case, built: Built, scratch: Path, timeout: float) -> None:
        self._case = case
        self._built = built
        self._scratch = scratch
        self._count = 0
        self._log = ""
        self._renderer: Renderer | None = None
        self._existing: list[Path] | None = None
        if isinstance(built.submission, ImagesSubmission):
            self._existing = existing_images(built.submission, built.source, case.family)
        else:
            self._scene = export(case.scene, built.submission.scene_format, scratch / "scene")
            self._renderer = renderer(built, timeout, scratch)

    def more(self, count: int) -> list[Floats]:
        """The next images; all that exist at once if there is no renderer."""
        film, output = self._case.scene.film, self._built.submission.render.output
        if self._existing is not None:
            return [read_image(path, output, film.width, film.height) for path in self._existing]
        assert self._renderer is not None
        images = []
        for _ in range(count):
            folder = self._scratch / f"image-{self._count}"
            try:
                folder.mkdir()
            except (FileNotFoundError, FileExistsError, NotADirectoryError, PermissionError):
                if self._count == 0:
                    raise
                # That was the renderer, not the machine: no points are to be saved in this way.
                raise RenderFailed("the renderer spoilt the folder it was given to work in", self._log) from None
            path = folder / f"image.{output}"
            seed = render_seed(self._case.family, self._case.seed, self._count)
            request = Request(self._scene, path, self._case.spp, seed, film.width, film.height)
            self._log = self._renderer.render(request) or self._log
            if not os.path.lexists(path):
                raise RenderFailed(f"the renderer succeeded but wrote no image{_found_instead(folder)}", self._log)
            images.append(read_image(path, output, film.width, film.height))
            with contextlib.suppress(RecursionError):
                shutil.rmtree(folder, ignore_errors=True)
            self._count += 1
        return images

    def exhausted(self, images: list[Floats], evidence: Evidence, max_images: int) -> bool:
        """Whether more images cannot be had or, being all alike, would not help."""
        return self._existing is not None or len(images) >= max_images or evidence.distinct_images == 1

    def close(self) -> str:
        """End the renderer; return what the submission printed last."""
        if self._renderer is not None:
            self._log = self._renderer.close() or self._log
        return self._log


def _found_instead(folder: Path) -> str:
    try:
        found = sorted(path.name for path in folder.iterdir())
    except OSError:
        return ", and its folder is gone or closed"
    return f" at {{output}}; it left {', '.join(found[:3])} instead" if found else " at {output}"


# ------------------------------------------------------------------------------------------ whole gradings


def grade(
    jobs: Sequence[Job],
    rubric: Rubric,
    seed: int,
    workers: int,
    on_progress: Callable[[Job, CaseResult], None] = lambda job, result: None,
) -> list[tuple[Result, list[Judged]]]:
    """Grade submissions by a rubric, several cases at a time.

    Parameters
    ----------
    jobs : sequence of Job
        Whom to grade. Jobs with equal build commands and folders are built once.
    rubric : Rubric
        By what.
    seed : int
        Draws the members of the families and the seeds of the images.
    workers : int
        How many cases are rendered at the same time.
    on_progress : callable
        Told of every case that is done.

    Returns
    -------
    list
        For each job its result, without images, and the judged cases with theirs.
    """
    started = datetime.datetime.now(datetime.UTC)
    clock = time.monotonic()
    cases = cases_of(rubric, seed)
    processes.allow_all()
    with (
        ScratchFolder("oracle-build-") as name,
        ThreadPoolExecutor(workers) as pool,
    ):
        try:
            expectations = [pool.submit(expectation_of, case.family, case.seed) for case in cases]
            built = _build_all(jobs, Path(name).resolve())
            for expectation in expectations:
                expectation.result()
            futures: dict[Future[Judged], tuple[int, int]] = {
                pool.submit(grade_case, case, built[i], rubric.max_images, rubric.timeout): (i, k)
                for i in range(len(jobs))
                for k, case in enumerate(cases)
            }
            judged: dict[tuple[int, int], Judged] = {}
            for future in as_completed(futures):
                i, k = futures[future]
                judged[i, k] = future.result()
                on_progress(jobs[i], judged[i, k].result)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            processes.stop_all()
            raise
    results = []
    for i, job in enumerate(jobs):
        own = [judged[i, k] for k in range(len(cases))]
        found = tuple(one.result for one in own)
        counts = Counter(one.verdict for one in found)
        result = Result(
            rubric=rubric.name,
            error_budget=rubric.error_budget,
            seed=seed,
            submission=SubmissionResult(
                name=job.submission.name,
                kind=job.submission.kind,
                scene_format=job.submission.scene_format,
                build_log=built[i].log,
            ),
            verdicts={verdict: counts[verdict] for verdict in Verdict if counts[verdict]},
            points=sum(one.points for one in found),
            possible=sum(one.possible for one in found),
            cases=found,
            times=GradingTimes(
                started=started.isoformat(timespec="seconds"), seconds=round(time.monotonic() - clock, 3)
            ),
        )
        results.append((result, own))
    return results


def _build_all(jobs: Sequence[Job], folder: Path) -> list[Built]:
    """Build each different submission once."""
    done: dict[tuple[Path, object], Built] = {}
    built = []
    for job in jobs:
        key = (job.source, getattr(job.submission, "build", None))
        if key not in done:
            own = folder / str(len(done))
            own.mkdir()
            done[key] = build(job.submission, job.source, own)
        built.append(dataclasses.replace(done[key], submission=job.submission))
    return built


def with_images(judged: Judged) -> Judged:
    """Name the images of a case in its result."""
    if judged.expected is None:
        return judged
    name = judged.result.family
    seen = judged.observed is not None
    images = ImagesOfCase(
        expected=f"images/{name}-expected.exr",
        observed=f"images/{name}-observed.exr" if seen else None,
        difference=f"images/{name}-difference.exr" if seen else None,
    )
    return dataclasses.replace(judged, result=judged.result.model_copy(update={"images": images}))
