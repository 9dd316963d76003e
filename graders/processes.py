"""Running other people's programs: with a time limit, a small memory of what they print, and no heirs."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from graders.errors import InfrastructureError

# Of what a program prints, this many last bytes are kept.
_KEPT_BYTES = 8192
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ufeff]")
_ESCAPE = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)?|.)", re.DOTALL)


# Programs that run now, so that an interrupted grading can end them: they are in sessions of their own.
_running: set[subprocess.Popen[bytes]] = set()


@dataclass(frozen=True)
class Completed:
    """How a program ended: exit code (negative for a signal), None when stopped at the time limit."""

    exit_code: int | None
    output: str
    seconds: float

    @property
    def failure(self) -> str | None:
        """What went wrong in words, None if nothing did."""
        if self.exit_code is None:
            return f"did not finish within {self.seconds:.0f} s and was stopped"
        if self.exit_code < 0:
            try:
                name = signal.Signals(-self.exit_code).name
            except ValueError:
                name = f"signal {-self.exit_code}"
            return f"was ended by {name}"
        if self.exit_code > 0:
            return f"ended with exit code {self.exit_code}"
        return None


def environment(scratch: Path) -> dict[str, str]:
    """The few variables a submission gets; CMake and ninja of this installation are on its path."""
    tools = str(Path(sys.executable).parent)
    variables = {
        "PATH": os.pathsep.join([tools, os.environ.get("PATH", os.defpath)]),
        "HOME": str(scratch),
        "TMPDIR": str(scratch),
        "LANG": "C.UTF-8",
    }
    if shutil.which("make") is None:
        variables["CMAKE_GENERATOR"] = "Ninja"
    return variables


def run(arguments: Sequence[str], folder: Path, scratch: Path, timeout: float) -> Completed:
    """Run a program to its end, or to its time limit, in a process group of its own.

    Raises
    ------
    InfrastructureError
        If this machine could not even try.
    """
    started = time.monotonic()
    try:
        process = start(arguments, folder, environment(scratch), stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT)
    except CannotStart as error:
        return Completed(127, str(error), 0.0)
    assert process.stdout is not None
    tail = Tail(process.stdout)
    try:
        exit_code: int | None = process.wait(timeout)
    except subprocess.TimeoutExpired:
        exit_code = None
    finally:
        kill_group(process)
    output = tail.text()
    return Completed(exit_code, output, time.monotonic() - started)


class CannotStart(Exception):
    """The program is not there or is no program."""


def start(
    arguments: Sequence[str], folder: Path, variables: dict[str, str], stdin: int, stderr: int
) -> subprocess.Popen[bytes]:
    """Start a program in a process group of its own, its standard output piped.

    Raises
    ------
    CannotStart
        If the program is at fault.
    InfrastructureError
        If this machine is.
    """
    try:
        process = subprocess.Popen(
            list(arguments),
            cwd=folder,
            env=variables,
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=stderr,
            start_new_session=True,
        )
    except (FileNotFoundError, PermissionError, NotADirectoryError) as error:
        raise CannotStart(f"cannot run {arguments[0]}: {error.strerror}") from None
    except OSError as error:
        if error.errno == errno.ENOEXEC:
            raise CannotStart(f"cannot run {arguments[0]}: {error.strerror}") from None
        raise InfrastructureError(f"cannot start a process: {error.strerror}") from error
    _running.add(process)
    return process


def stop_all() -> None:
    """End every program that still runs."""
    for process in list(_running):
        kill_group(process)


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """End a program and everything it started in its process group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    _running.discard(process)


class Tail:
    """Reads a pipe to its end on a thread and keeps the last bytes, so that no writer blocks or fills the memory."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._kept = b""
        self._pipe = pipe
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            while chunk := os.read(self._pipe.fileno(), 65536):
                self._kept = (self._kept + chunk)[-_KEPT_BYTES:]

    def text(self) -> str:
        """What was printed last, made harmless."""
        # A process that left the group may hold the pipe; what has arrived by now is enough.
        self._thread.join(1.0)
        if not self._thread.is_alive():
            self._pipe.close()
        return printable(self._kept)


def printable(raw: bytes) -> str:
    """Text of a stranger without terminal escapes, control and bidirectional characters."""
    text = raw.decode("utf-8", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", _ESCAPE.sub("", text))
