"""From a submission to images: building it, and rendering with a command, a Python function or existing files."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import re
import selectors
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from graders import processes, python_worker
from graders.errors import InfrastructureError
from graders.processes import CannotStart, Tail, one_line
from graders.submission import CommandSubmission, ImagesSubmission, PythonSubmission, Submission

# Images that exist already are all read at once.
_MOST_IMAGES = 1024
# How long a message may get that quotes a submission.
_QUOTED = 300
# A worker's answer is short, and a worker that gave none ends at once [s].
_LONGEST_ANSWER = 1 << 20
_GRACE = 1.0
# What CMake says of its own speed.
_CMAKE_SECONDS = re.compile(r"^(-- \w+ done) \(\d+\.\d+s\)$", re.MULTILINE)


class RenderFailed(Exception):
    """The submission did not render; the message is one line, `log` what it printed."""

    def __init__(self, message: str, log: str) -> None:
        super().__init__(one_line(message))
        self.log = log


@dataclass(frozen=True)
class Request:
    """One image to render: its scene file, where to write it, and with how many samples and which seed."""

    scene: Path
    output: Path
    spp: int
    seed: int
    width: int
    height: int


@dataclass(frozen=True)
class Built:
    """A submission that is ready to render, or why it is not."""

    submission: Submission
    source: Path
    build: Path
    log: str = ""
    failure: str | None = None


def build(submission: Submission, source: Path, folder: Path) -> Built:
    """Run the build commands of a submission, with everything they make in `folder`."""
    made = folder / "build"
    made.mkdir()
    if not isinstance(submission, CommandSubmission) or submission.build is None:
        return Built(submission, source, made)
    log = ""
    limit = submission.build.timeout
    deadline = time.monotonic() + limit
    places = {"source": source, "build": made, "scratch": folder}
    for command in submission.build.commands:
        arguments = [_filled(argument, places) for argument in command]
        try:
            completed = processes.run(arguments, source, folder, max(deadline - time.monotonic(), 0.1))
        except CannotStart as error:
            return Built(submission, source, made, log, f"build failed: {_neutral(str(error), places)}")
        output = _CMAKE_SECONDS.sub(r"\1", _neutral(completed.output, places))
        log += output
        failure = dataclasses.replace(completed, limit=limit).failure
        if failure is not None:
            return Built(submission, source, made, log, f"build failed: {command[0]} {failure}{_first_error(output)}")
    return Built(submission, source, made, log)


def _filled(template: str, values: Mapping[str, object]) -> str:
    """Replace placeholders; other braces stay as they are."""
    return re.sub(r"{(\w+)}", lambda found: str(values.get(found[1], found[0])), template)


def _neutral(text: str, places: Mapping[str, Path]) -> str:
    """What a submission printed, with placeholders for the folders of this grading, which are others each time."""
    for name, path in sorted(places.items(), key=lambda place: -len(str(place[1]))):
        if path.parent != path:
            text = re.sub(re.escape(str(path)) + r"(?![\w.-])", f"{{{name}}}", text)
    return text


class Renderer:
    """Renders requests of one case, one after the other, and gathers what the submission prints."""

    def __init__(self, built: Built, timeout: float, scratch: Path) -> None:
        self._built = built
        self._timeout = timeout
        self._scratch = scratch
        self._places = {"source": built.source, "build": built.build, "scratch": scratch}

    def render(self, request: Request) -> str:
        """Render one image and return what the submission printed; raises RenderFailed."""
        raise NotImplementedError

    def close(self) -> str:
        """End what still runs; return what the submission printed and `render` did not return."""
        return ""


class CommandRenderer(Renderer):
    """Starts the submission's program anew for every image."""

    def render(self, request: Request) -> str:
        """See `Renderer`."""
        assert isinstance(self._built.submission, CommandSubmission)
        values = {"source": self._built.source, "build": self._built.build, **vars(request)}
        arguments = [_filled(argument, values) for argument in self._built.submission.render.command]
        try:
            completed = processes.run(arguments, request.output.parent, self._scratch, self._timeout)
        except CannotStart as error:
            raise RenderFailed(_neutral(str(error), self._places), "") from None
        log = _neutral(completed.output, self._places)
        if completed.failure is not None:
            raise RenderFailed(f"the renderer {completed.failure}{_last_line(log)}", log)
        return log


class PythonRenderer(Renderer):
    """Keeps one process that imports the submission's function once and calls it for every image."""

    _process: subprocess.Popen[bytes] | None = None
    _errors: Tail

    def render(self, request: Request) -> str:
        """See `Renderer`."""
        failure = self._failure(request)
        if failure is not None:
            raise RenderFailed(_neutral(failure, self._places), self.close())
        return ""

    def _failure(self, request: Request) -> str | None:
        """Have one image rendered; return what went wrong in words, None if nothing did."""
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        message = {name: str(value) if isinstance(value, Path) else value for name, value in vars(request).items()}
        answer: bytes | None = b""
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(json.dumps(message).encode() + b"\n")
            process.stdin.flush()
            answer = _read_line(process.stdout.fileno(), self._timeout)
        if answer is None:
            return f"the renderer did not finish within {self._timeout:g} s and was stopped"
        if not answer:
            try:
                completed = processes.Completed(process.wait(_GRACE), "", _GRACE)
            except subprocess.TimeoutExpired:
                return "the renderer closed the pipe on which its process answers"
            return f"the renderer's process {completed.failure or 'ended without an answer'}"
        try:
            error = json.loads(answer)["error"]
        except (ValueError, KeyError, TypeError):
            error = "gave no valid answer"
        return None if error is None else f"the renderer failed: {one_line(str(error))[:_QUOTED]}"

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            assert isinstance(self._built.submission, PythonSubmission)
            # A submission's files are no part of this program, and reading them must not leave any behind.
            variables = processes.environment(self._scratch) | {"PYTHONDONTWRITEBYTECODE": "1"}
            function = self._built.submission.render.callable
            try:
                self._process = processes.start(
                    [sys.executable, "-P", python_worker.__file__, function, str(self._built.source)],
                    self._scratch,
                    variables,
                    stdin=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                )
            except CannotStart as error:
                raise InfrastructureError(str(error)) from None
            assert self._process.stderr is not None
            self._errors = Tail(self._process.stderr)
        return self._process

    def close(self) -> str:
        """See `Renderer`."""
        if self._process is None:
            return ""
        processes.kill_group(self._process)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        self._process = None
        return _neutral(self._errors.text(), self._places)


def _read_line(descriptor: int, timeout: float) -> bytes | None:
    """One line from a pipe; empty at its end, None when the time is over."""
    deadline = time.monotonic() + timeout
    line = b""
    with selectors.DefaultSelector() as selector:
        selector.register(descriptor, selectors.EVENT_READ)
        while not line.endswith(b"\n"):
            if not selector.select(max(deadline - time.monotonic(), 0)):
                return None
            chunk = os.read(descriptor, 65536)
            if not chunk:
                return b""
            line += chunk
            if len(line) > _LONGEST_ANSWER:
                break
    return line


def renderer(built: Built, timeout: float, scratch: Path) -> Renderer:
    """The renderer for a command or Python submission."""
    if isinstance(built.submission, PythonSubmission):
        return PythonRenderer(built, timeout, scratch)
    return CommandRenderer(built, timeout, scratch)


def existing_images(submission: ImagesSubmission, source: Path, case: str) -> list[Path]:
    """The images that a submission brings for a case, in the order of their names; raises RenderFailed."""
    pattern = submission.render.images.replace("{case}", case)
    try:
        found = sorted(source.glob(pattern))
    except (ValueError, NotImplementedError, RecursionError, OSError) as error:
        raise RenderFailed(f"images that match {pattern} cannot be looked for: {error}", "") from None
    if not found:
        raise RenderFailed(f"no image matches {pattern}", "")
    if len(found) > _MOST_IMAGES:
        raise RenderFailed(f"{len(found)} images match {pattern}; at most {_MOST_IMAGES} are judged", "")
    home = os.path.realpath(source)
    for path in found:
        if not Path(os.path.realpath(path.parent)).is_relative_to(home):
            raise RenderFailed(f"{path.relative_to(source)}: lies outside the submission's folder", "")
    return found


def _last_line(output: str) -> str:
    """The last thing a program said, which is most often the reason."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return f": {lines[-1][:_QUOTED]}" if lines else ""


def _first_error(output: str) -> str:
    """The first line in which a compiler speaks of an error, else the last line."""
    errors = [line.strip() for line in output.splitlines() if re.search(r"\berror\b", line, re.IGNORECASE)]
    return f": {errors[0][:_QUOTED]}" if errors else _last_line(output)


__all__ = [
    "Built",
    "CannotStart",
    "RenderFailed",
    "Renderer",
    "Request",
    "build",
    "existing_images",
    "renderer",
]
