"""One reference: rendered into its folder, pass by pass, with what is done kept whatever happens."""

from __future__ import annotations

import math
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import oracle
from graders.cli.reference_progress import Status, percent, shown
from graders.errors import InfrastructureError, UsageError
from graders.output import require_writable
from oracle.arrays import InvalidArgument
from oracle.tracer import Goal, Job, Method, Progress, Rendering, embree_version, first_hits
from oracle.tracer import scene as tracer
from oracle.tracer.rendering import VERSION, relative_error
from reference_scenes import model
from reference_scenes.loading import InvalidFile
from reference_scenes.references import (
    About,
    Run,
    Samples,
    is_reference,
    joined,
    read_state,
    scene_digest,
    sole_writer,
    write_aovs,
    write_reference,
)
from reference_scenes.tracing import to_tracer

# What a crash of the machine may cost [s].
SAVE_SECONDS = 300.0


class Kept(Exception):
    """The rendering was interrupted, and what was done is kept in a folder."""

    def __init__(self, folder: Path, about: About) -> None:
        super().__init__(f"{about.spp} samples per pixel are kept in {folder}")


@dataclass(frozen=True)
class Subject:
    """What is rendered: a scene with its name, and the seed that drew it from its family."""

    name: str
    scene: model.Scene
    member: int | None = None


@dataclass(frozen=True)
class Plan:
    """How it is rendered, and until when."""

    goal: Goal
    method: Method
    seed: int
    threads: int


class Reference:
    """A scene in the tracer, and what a folder says of it."""

    def __init__(self, subject: Subject, method: Method) -> None:
        self.subject = subject
        self.method = method
        try:
            self.parts: tuple[tracer.Scene, tracer.Sensor, tracer.Film] = to_tracer(subject.scene)
            self.job = Job(*self.parts, method)
        except InvalidArgument as error:
            raise UsageError(f"{subject.name}: {error}") from None

    def about(self, rendering: Rendering, share: float, runs: tuple[Run, ...]) -> About:
        """What a rendering of it is."""
        return About(
            scene=self.subject.name,
            member=self.subject.member,
            scene_sha256=self._digest,
            identity=self.job.identity,
            tracer=VERSION,
            width=self.job.film.width,
            height=self.job.film.height,
            strategy=self.method.strategy,
            sampler=self.method.sampler,
            bounces=self.method.bounces,
            samples=samples_of(rendering),
            runs=joined(runs),
            **measured(rendering, share),
        )

    @cached_property
    def _digest(self) -> str:
        return scene_digest(self.subject.scene)

    def difference(self, found: About) -> str | None:
        """Why a reference that was found does not show this scene in this way; None if it does."""
        return difference(found, self.job.identity, VERSION, self.method)


def difference(found: About, identity: str, version: int, method: Method) -> str | None:
    """Why a reference that was found does not show what is wanted; None if it does."""
    if found.identity == identity:
        return None
    if found.tracer != version:
        return f"comes from version {found.tracer} of the tracer, not from {version}"
    for name in ("strategy", "sampler", "bounces"):
        theirs, wanted = getattr(found, name), getattr(method, name)
        if theirs != wanted:
            return f"was rendered {_with(name, theirs)}, not {_with(name, wanted)}"
    return f"shows another scene, {found.scene} as it was then"


def _with(name: str, value: object) -> str:
    return f"without --{name}" if value is None else f"with --{name} {value}"


def samples_of(rendering: Rendering) -> tuple[Samples, ...]:
    """The samples of a rendering."""
    return tuple(Samples(seed=one.seed, first=one.first, count=one.count) for one in rendering.ranges)


def measured(rendering: Rendering, share: float) -> dict[str, Any]:
    """How good a rendering is, in the words of `About`."""
    # A black image tells nothing of the error.
    error = relative_error(rendering, share) if (rendering.mean > 0).any() else None
    return {"spp": rendering.spp, "share": share, "relative_error": error}


def is_reached(goal: Goal, about: About) -> bool:
    """Whether a reference is as good as is asked for, as far as its description tells."""
    exact = about.relative_error is not None and about.share == goal.share
    return (
        (goal.spp is not None and about.spp >= goal.spp)
        or (goal.error is not None and exact and (about.relative_error or 0) <= goal.error)
        or (goal.seconds is not None and about.seconds >= goal.seconds)
    )


def quality(about: About) -> str:
    """How good a reference is, in words."""
    error = "unknown" if about.relative_error is None else f"at most {percent(about.relative_error)}"
    return f"{about.spp} samples per pixel; standard error {error} in {percent(about.share)} of the pixels"


def method_of(about: About) -> Method:
    """How a reference was rendered."""
    return Method(about.strategy, about.sampler, about.bounces)


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Be the only one that writes into a folder; all that may go wrong there becomes one line.

    Raises
    ------
    UsageError
        If it cannot be written, or another run does.
    InfrastructureError
        If the disk does not take it.
    """
    require_writable(folder)
    try:
        with sole_writer(folder):
            yield
    except InvalidFile as error:
        raise UsageError(str(error)) from None
    except OSError as error:
        raise InfrastructureError(
            f"{folder}: writing failed: {error.strerror or error}; what was there before is untouched"
        ) from None


def render_into(folder: Path, reference: Reference, plan: Plan, goes_on: bool) -> About:
    """Render a reference into a folder that this run alone writes to, going on from what is there if that is wished.

    Raises
    ------
    Kept
        If it was interrupted after some samples.
    UsageError
        If what is there shows something else, or an error is asked for where no light is found.
    InvalidFile
        If what is there is broken.
    """
    before: About | None = None
    start = reference.job.nothing()
    if goes_on and is_reference(folder):
        before, start = read_state(folder)
        difference = reference.difference(before)
        if difference:
            raise UsageError(f"{folder}: {difference}; choose another folder")
    saver = _Saver(folder, reference, plan, before, start)
    goal, is_over = _remaining(plan.goal, before.seconds if before else 0.0)
    status = Status(reference.subject.name, start.spp, start.spp, limit=goal.seconds or math.inf)
    try:
        with shown(status) as display:
            if not is_over:
                for rendering in reference.job.passes(goal, plan.seed, 0, plan.threads, start, _writes(status)):
                    saver.take(rendering)
                    status.samples, status.expected = rendering.spp, goal.samples(rendering)
                    status.error = measured(rendering, goal.share)["relative_error"]
                    display.line()
        about = saver.save()
    except BaseException as error:
        # Whatever it is, hours of work are not to be lost.
        if not saver.has_new:
            raise
        about = saver.save()
        if isinstance(error, KeyboardInterrupt):
            raise Kept(folder, about) from None
        raise
    if about.relative_error is None and not is_reached(plan.goal, about):
        nothing = f"no light reached a pixel in {about.spp} samples, so that --error says nothing"
        raise UsageError(f"{reference.subject.name}: {nothing}; look at the scene, or give --spp as well")
    return about


def _remaining(goal: Goal, spent: float) -> tuple[Goal, bool]:
    """What a goal asks for after some seconds, and whether they were too many already."""
    if goal.seconds is None:
        return goal, False
    return (goal, True) if spent >= goal.seconds else (replace(goal, seconds=goal.seconds - spent), False)


def _writes(status: Status) -> Callable[[Progress], None]:
    """What the tracer tells its progress; as short as can be, as an interruption ends it with an exception."""

    def watch(progress: Progress) -> None:
        status.samples, status.seconds = progress.samples, progress.seconds

    return watch


class _Saver:
    """Keeps the newest rendering, and writes it from time to time."""

    def __init__(self, folder: Path, reference: Reference, plan: Plan, before: About | None, start: Rendering) -> None:
        self._folder, self._reference, self._plan, self._before = folder, reference, plan, before
        self._start = self._newest = start
        self._began = self._saved = time.monotonic()
        self._seconds = 0.0
        self._revision = revision()

    @property
    def has_new(self) -> bool:
        """Whether anything was rendered."""
        return self._newest is not self._start

    def take(self, rendering: Rendering) -> None:
        """Keep a rendering."""
        self._newest = rendering
        self._seconds = time.monotonic() - self._began
        if time.monotonic() - self._saved >= SAVE_SECONDS:
            self.save()
            self._saved = time.monotonic()

    def save(self) -> About:
        """Write what there is."""
        runs = self._before.runs if self._before else ()
        if self.has_new:
            run = Run(
                revision=self._revision,
                embree=embree_version(),
                threads=self._plan.threads,
                spp=self._newest.spp - self._start.spp,
                seconds=self._seconds,
            )
            runs = (*runs, run)
        about = self._reference.about(self._newest, self._plan.goal.share, runs)
        return write_reference(self._folder, about, self._newest)


# ------------------------------------------------------------------------------------------- further images


def render_aovs(folder: Path, reference: Reference, about: About, threads: int) -> None:
    """Write what the pixels show without light, and the light that was reflected once at most and more often.

    Raises
    ------
    KeyboardInterrupt
        If it was interrupted; nothing of it is kept.
    """
    hits = first_hits(*reference.parts)
    channels: dict[str, NDArray[np.floating[Any]]] = {"distance": hits.distance}
    for name, axes in (("position", "XYZ"), ("normal", "XYZ"), ("albedo", "RGB")):
        channels |= {f"{name}.{axis}": getattr(hits, name)[..., index] for index, axis in enumerate(axes)}
    channels["object"] = hits.object.astype(np.float32)
    method = reference.method
    direct = replace(method, bounces=1 if method.bounces is None else min(1, method.bounces))
    for name, part in (("direct", direct), ("indirect", replace(method, first_bounce=2))):
        mean = _same_samples(Job(*reference.parts, part), about, threads, f"{reference.subject.name}, {name}").mean
        channels |= {f"{name}.{axis}": mean[..., index] for index, axis in enumerate("RGB")}
    write_aovs(folder, about, channels)


def _same_samples(job: Job, about: About, threads: int, name: str) -> Rendering:
    """What another job shows with the samples of a reference."""
    rendering = job.nothing()
    status = Status(name, expected=about.spp)
    with shown(status) as display:
        for one in about.samples:
            status.before = rendering.spp
            goal = Goal(spp=rendering.spp + one.count)
            for better in job.passes(goal, one.seed, one.first, threads, rendering, _writes(status)):
                rendering = better
                display.line()
    return rendering


# ------------------------------------------------------------------------------------------------ provenance


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def revision() -> str:
    """This version, and of a checkout the revision."""
    version = metadata.version("render-oracle")
    root = Path(oracle.__file__).parents[1]
    if not (root / ".git").exists():
        return version
    command = [
        "git",
        "--no-optional-locks",
        "-C",
        str(root),
        "describe",
        "--always",
        "--dirty",
        "--abbrev=40",
        "--exclude=*",
    ]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return version
    described = found.stdout.strip().replace("-", ".")
    return f"{version}+g{described}" if found.returncode == 0 and described else version
