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
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from graders.errors import InfrastructureError

# Of what a program prints, this many last bytes are kept.
_KEPT_BYTES = 8192
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")
_ESCAPE = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)?|.)", re.DOTALL)
# Why a program does not start although nothing is wrong with it.
_MACHINE_AT_FAULT = {errno.EAGAIN, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO}

# Programs that run now, so that an interrupted grading can end them: they are in sessions of their own.
_running: set[subprocess.Popen[bytes]] = set()
_may_start = True
_starting = threading.Lock()


@dataclass(frozen=True)
class Completed:
    """How a program ended: exit code (negative for a signal), None when stopped at its time limit [s]."""

    exit_code: int | None
    output: str
    limit: float

    @property
    def failure(self) -> str | None:
        """What went wrong in words, None if nothing did."""
        if self.exit_code is None:
            return f"did not finish within {self.limit:g} s and was stopped"
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
    CannotStart
        If there is no such program.
    InfrastructureError
        If this machine could not even try.
    """
    process = start(arguments, folder, environment(scratch), stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT)
    assert process.stdout is not None
    tail = Tail(process.stdout)
    try:
        exit_code: int | None = process.wait(timeout)
    except subprocess.TimeoutExpired:
        exit_code = None
    finally:
        kill_group(process)
    return Completed(exit_code, tail.text(), timeout)


class CannotStart(Exception):
    """The program is not there or is no program; the message is one line."""


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
    program = arguments[0]
    try:
        with _starting:
            if not _may_start:
                raise InfrastructureError("the grading was interrupted")
            process = subprocess.Popen(
                list(arguments),
                cwd=folder,
                env=variables,
                stdin=stdin,
                stdout=subprocess.PIPE,
                stderr=stderr,
                start_new_session=True,
            )
            _running.add(process)
    except ValueError as error:
        raise CannotStart(f"cannot run {one_line(program)}: {error}") from None
    except OSError as error:
        if error.errno in _MACHINE_AT_FAULT or str(error.filename) == str(folder):
            raise InfrastructureError(f"cannot start a process: {error.strerror}") from error
        reason = error.strerror
        if error.errno == errno.ENOENT and shutil.which(program, path=variables.get("PATH")):
            reason = "the interpreter in its first line does not exist"
        raise CannotStart(f"cannot run {one_line(program)}: {reason}") from None
    return process


def allow_all() -> None:
    """Let programs start, again after `stop_all`."""
    global _may_start
    with _starting:
        _may_start = True


def stop_all() -> None:
    """End every program that still runs, and start no other."""
    global _may_start
    with _starting:
        _may_start = False
        running = list(_running)
    for process in running:
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
        self._is_cut = False
        self._pipe = pipe
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        # A process that left the group may hold the pipe for long, so that only this thread knows when to close it.
        with self._pipe, contextlib.suppress(OSError, ValueError):
            while chunk := os.read(self._pipe.fileno(), 65536):
                self._is_cut |= len(self._kept) + len(chunk) > _KEPT_BYTES
                self._kept = (self._kept + chunk)[-_KEPT_BYTES:]

    def text(self) -> str:
        """What was printed last, made harmless."""
        # What has arrived by now is enough.
        self._thread.join(1.0)
        kept = self._kept
        # Half a line says nothing, and may begin within a character or an escape sequence.
        return printable(kept.partition(b"\n")[2] or kept if self._is_cut else kept)


def printable(raw: bytes) -> str:
    """Text of a stranger without terminal escapes, control and bidirectional characters."""
    text = raw.decode("utf-8", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", _ESCAPE.sub("", text))


def one_line(text: str) -> str:
    """Text of a stranger on one line, for messages."""
    return " ".join(printable(text.encode("utf-8", errors="replace")).split())


class ScratchFolder(tempfile.TemporaryDirectory[str]):
    """A folder for a stranger's program, removed afterwards whatever the program left in it."""

    def __init__(self, prefix: str) -> None:
        super().__init__(prefix=prefix, ignore_cleanup_errors=True)

    def cleanup(self) -> None:
        """Remove the folder."""
        try:
            super().cleanup()
        except RecursionError:
            subprocess.run(["rm", "-rf", "--", self.name], check=False)
