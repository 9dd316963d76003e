"""`oracle reference`."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from graders.cli import EXIT_INTERRUPTED, EXIT_RIGHT, EXIT_WRONG
from graders.cli.reference_cache import check, fill
from graders.cli.reference_rendering import (
    Kept,
    Plan,
    Reference,
    Subject,
    difference,
    measured,
    method_of,
    processors,
    quality,
    render_aovs,
    render_into,
    samples_of,
    writing,
)
from graders.errors import InfrastructureError, UsageError
from graders.rubric import load_rubric
from oracle.arrays import InvalidArgument
from oracle.tracer import Goal, IrradianceMeter, Method, merge
from oracle.tracer.rendering import GROUP, Sampler, Strategy
from reference_scenes.families import FAMILIES
from reference_scenes.loading import InvalidFile, load_scene, suggest
from reference_scenes.references import IMAGE, About, is_reference, joined, read_state, write_reference
from reference_scenes.without_closed_form import SCENES

# What each way of use takes; the rest would be ignored, and is refused.
_MERGE = {"scenes", "merge", "out"}
_CHECK = {"all", "check", "rubric", "member", "spp", "error", "time", "share", "strategy", "sampler", "bounces", "out"}
_ALL = _CHECK | {"threads", "seed"}
_SCENE = (_ALL - {"all", "check", "rubric"}) | {"scenes", "resume", "aovs"}
_UNITS = {"": 1, "s": 1, "m": 60, "min": 60, "h": 3600}


@dataclass(frozen=True)
class Request:
    """The command line."""

    scenes: tuple[str, ...]
    out: Path
    spp: int | None
    error: str | None
    time: str | None
    share: str
    threads: int | None
    seed: int
    member: int
    sampler: Sampler
    strategy: Strategy
    bounces: int | None
    resume: bool
    aovs: bool
    merge: bool
    all: bool
    rubric: Path | None
    check: bool


def run_reference(request: Request, given: set[str]) -> int:
    """Render, merge or check references; `given` names the options on the command line. Return the exit code.

    Raises
    ------
    UsageError
        If the command line, a scene or a reference is wrong.
    InfrastructureError
        If the disk or the memory is full, or there is no tracer.
    """
    try:
        if request.merge:
            _require_only(given, _MERGE, "--merge")
            _merge(request)
        elif request.check:
            _require_only(given, _CHECK, "--check")
            if not request.all:
                raise UsageError("--check looks at a cache; give --all as well")
            is_fresh = check(_subjects(request), request.out, _goal(request, True), _method(request))
            return EXIT_RIGHT if is_fresh else EXIT_WRONG
        elif request.all:
            _require_only(given, _ALL, "--all")
            fill(_subjects(request), request.out, _plan(request))
        else:
            _require_only(given, _SCENE, "a scene")
            _render(request)
    except Kept as kept:
        goes_on = "the same command" if request.resume or request.all else "the same command with --resume"
        print(f"oracle: interrupted; {kept}; {goes_on} goes on from there", file=sys.stderr)
        return EXIT_INTERRUPTED
    except (InvalidFile, InvalidArgument) as error:
        raise UsageError(str(error)) from None
    except MemoryError as error:
        raise InfrastructureError(f"the memory does not suffice: {error or 'no more is there'}") from None
    return EXIT_RIGHT


def _require_only(given: set[str], allowed: set[str], way: str) -> None:
    for name in sorted(given - allowed):
        words = "a scene" if name == "scenes" else f"--{name}"
        raise UsageError(f"{words} has no meaning together with {way}; leave one of them out")


# ---------------------------------------------------------------------------------------------- ways of use


def _render(request: Request) -> None:
    if len(request.scenes) != 1:
        number = f"{len(request.scenes)} scenes" if request.scenes else "no scene"
        raise UsageError(f"there is {number}; give one, or --all for all that have a name")
    plan = _plan(request)
    reference = Reference(_subject(request.scenes[0], request.member), plan.method)
    if request.aovs and isinstance(reference.parts[1], IrradianceMeter):
        raise UsageError(f"--aovs: the sensor of {request.scenes[0]} looks everywhere at once; leave --aovs out")
    with writing(request.out):
        if not request.resume:
            _require_none(request.out, "go on from it with --resume, or choose another folder")
        about = render_into(request.out, reference, plan, request.resume)
        if request.aovs:
            try:
                render_aovs(request.out, reference, about, plan.threads)
            except KeyboardInterrupt:
                raise Kept(request.out, about) from None
    _print(about, request.out)


def _require_none(folder: Path, advice: str) -> None:
    if is_reference(folder):
        raise UsageError(f"{folder}: holds a reference already; {advice}")


def _merge(request: Request) -> None:
    folders = [Path(name) for name in request.scenes]
    if len(folders) < 2:
        raise UsageError("--merge needs two folders with references or more")
    about, rendering = read_state(folders[0])
    runs = about.runs
    for index, folder in enumerate(folders[1:], 1):
        other, more = read_state(folder)
        reason = difference(other, about.identity, about.tracer, method_of(about))
        if reason:
            raise UsageError(f"{folder}: {reason}; only references of the same can be merged")
        try:
            rendering = merge(rendering, more)
        except InvalidArgument as error:
            before = " and ".join(map(str, folders[:index]))
            raise UsageError(f"--merge: with a = {before} and b = {folder}, {error}") from None
        runs += other.runs
    news = {"samples": samples_of(rendering), "runs": joined(runs), **measured(rendering, about.share)}
    about = about.model_copy(update=news)
    with writing(request.out):
        _require_none(request.out, "choose another folder")
        write_reference(request.out, about, rendering)
    _print(about, request.out)


def _print(about: About, folder: Path) -> None:
    print(quality(about))
    print((folder / IMAGE).resolve())


# ------------------------------------------------------------------------------------------- from words


def _subjects(request: Request) -> list[Subject]:
    """The scenes that a rubric names, or all that have a name."""
    if request.rubric:
        names: Sequence[str] = [case.family for case in load_rubric(request.rubric).cases]
    else:
        names = [*FAMILIES, *SCENES]
    return [_subject(name, request.member if name in FAMILIES else 0) for name in names]


def _subject(name: str, member: int) -> Subject:
    """The scene of that name or in that file."""
    if name in FAMILIES:
        return Subject(name, FAMILIES[name].member(member), member)
    if member:
        raise UsageError(f"--member {member}: {name} is no family; only members of families are drawn")
    if name in SCENES:
        return Subject(name, SCENES[name]())
    path = Path(name)
    if path.suffix.lower() != ".json" and not path.exists():
        raise UsageError(f"there is no scene {name!r} and no such file; {suggest(name, [*FAMILIES, *SCENES])}")
    return Subject(path.name, load_scene(path))


def _plan(request: Request) -> Plan:
    goal = _goal(request, False)
    assert goal is not None
    return Plan(goal, _method(request), request.seed, request.threads or processors())


def _method(request: Request) -> Method:
    return Method(request.strategy, request.sampler, request.bounces)


def _goal(request: Request, may_be_missing: bool) -> Goal | None:
    if request.spp is None and request.error is None and request.time is None:
        if may_be_missing:
            return None
        raise UsageError("give --spp, --error or --time; rendering ends at the first that is reached")
    spp = request.spp
    if spp is not None:
        spp = GROUP * math.ceil(spp / GROUP)
        if spp != request.spp:
            print(f"oracle: --spp {request.spp} becomes {spp}, as samples come in groups of {GROUP}", file=sys.stderr)
    error = None if request.error is None else _percent("--error", request.error)
    return Goal(
        spp, error, None if request.time is None else _seconds(request.time), _percent("--share", request.share)
    )


def _percent(option: str, text: str) -> float:
    found = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)(e-?\d{1,2})?\s*%\s*", text)
    value = float(found[1] + (found[2] or "")) / 100 if found else 0.0
    if not 0 < value <= 1:
        raise UsageError(f"{option}: {text[:80]!r} is no part in percent, above 0% and at most 100%, such as 0.5%")
    return value


def _seconds(text: str) -> float:
    found = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|m|min|h|)\s*", text)
    seconds = float(found[1]) * _UNITS[found[2]] if found else 0.0
    if not 0.1 <= seconds <= 1e8:
        raise UsageError(f"--time: {text[:80]!r} is no time between 0.1 s and 1e8 s, such as 30s, 5m or 1.5h")
    return seconds
