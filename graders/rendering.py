"""From a submission to images: building it, and rendering with a command, a Python function or existing files."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from graders import processes
from graders.processes import CannotStart, Tail
from graders.submission import CommandSubmission, ImagesSubmission, PythonSubmission, Submission


class RenderFailed(Exception):
    """The submission did not render; the message is one line, `log` what it printed."""

    def __init__(self, message: str, log: str) -> None:
        super().__init__(message)
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
    deadline = time.monotonic() + submission.build.timeout
    for command in submission.build.commands:
        arguments = [_filled(argument, source=source, build=made) for argument in command]
        completed = processes.run(arguments, source, folder, max(deadline - time.monotonic(), 0.1))
        log += completed.output
        if completed.failure is not None:
            return Built(submission, source, made, log, f"build failed: {arguments[0]} {completed.failure}")
    return Built(submission, source, made, log)


def _filled(template: str, **values: object) -> str:
    """Replace placeholders; other braces stay as they are."""
    for name, value in values.items():
        template = template.replace("{" + name + "}", str(value))
    return template


class Renderer:
    """Renders requests of one case, one after the other, and gathers what the submission prints."""

    def __init__(self, built: Built, timeout: float, scratch: Path) -> None:
        self._built = built
        self._timeout = timeout
        self._scratch = scratch

    def render(self, request: Request) -> str:
        """Render one image and return what the submission printed; raises RenderFailed."""
        raise NotImplementedError

    def close(self) -> None:
        """End what still runs."""


class CommandRenderer(Renderer):
    """Starts the submission's program anew for every image."""

    def render(self, request: Request) -> str:
        """See `Renderer`."""
        assert isinstance(self._built.submission, CommandSubmission)
        arguments = [
            _filled(argument, source=self._built.source, build=self._built.build, **vars(request))
            for argument in self._built.submission.render.command
        ]
        completed = processes.run(arguments, request.output.parent, self._scratch, self._timeout)
        if completed.failure is not None:
            raise RenderFailed(f"the renderer {completed.failure}{_last_line(completed.output)}", completed.output)
        return completed.output


class PythonRenderer(Renderer):
    """Keeps one process that imports the submission's function once and calls it for every image."""

    _process: subprocess.Popen[bytes] | None = None
    _errors: Tail

    def render(self, request: Request) -> str:
        """See `Renderer`."""
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        message = {name: str(value) if isinstance(value, Path) else value for name, value in vars(request).items()}
        answer = b""
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(json.dumps(message).encode() + b"\n")
            process.stdin.flush()
            answer = _read_line(process.stdout.fileno(), self._timeout)
        if answer is None:
            self.close()
            raise RenderFailed(f"the renderer did not finish within {self._timeout:.0f} s and was stopped", self._log())
        if not answer:
            exit_code = process.wait()
            self.close()
            failure = processes.Completed(exit_code, "", 0.0).failure or "ended without an answer"
            raise RenderFailed(f"the renderer's process {failure}", self._log())
        try:
            error = json.loads(answer)["error"]
        except (ValueError, KeyError, TypeError):
            error = "gave no valid answer"
        if error is not None:
            log = self._log_after_close()
            raise RenderFailed(f"the renderer failed: {processes.printable(str(error).encode())[:300]}", log)
        return ""

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            assert isinstance(self._built.submission, PythonSubmission)
            variables = processes.environment(self._scratch) | {"PYTHONPATH": str(self._built.source)}
            self._process = processes.start(
                [sys.executable, "-m", "graders.python_worker", self._built.submission.render.callable],
                self._scratch,
                variables,
                stdin=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
            assert self._process.stderr is not None
            self._errors = Tail(self._process.stderr)
        return self._process

    def _log(self) -> str:
        return self._errors.text()

    def _log_after_close(self) -> str:
        self.close()
        return self._log()

    def close(self) -> None:
        """See `Renderer`."""
        if self._process is not None:
            processes.kill_group(self._process)
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    with contextlib.suppress(BrokenPipeError):
                        pipe.close()
            self._process = None


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
            if not chunk or len(line) > 1 << 20:
                return b""
            line += chunk
    return line


def renderer(built: Built, timeout: float, scratch: Path) -> Renderer:
    """The renderer for a command or Python submission."""
    if isinstance(built.submission, PythonSubmission):
        return PythonRenderer(built, timeout, scratch)
    return CommandRenderer(built, timeout, scratch)


def existing_images(submission: ImagesSubmission, source: Path, case: str) -> Iterator[Path]:
    """The images that a submission brings for a case, in the order of their names."""
    yield from sorted(source.glob(submission.render.images.replace("{case}", case)))


def _last_line(output: str) -> str:
    """The last thing a program said, which is most often the reason."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return f": {lines[-1][:200]}" if lines else ""


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
