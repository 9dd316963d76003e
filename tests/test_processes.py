"""Running programs that do what they like."""

import errno
import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from graders import processes
from graders.errors import InfrastructureError
from graders.processes import CannotStart, ScratchFolder, one_line, printable, run

MISBEHAVING = Path(__file__).parent / "programs" / "misbehaving.sh"


def run_misbehaving(folder, word, timeout=20.0):
    shutil.copy(MISBEHAVING, folder)
    return run([str(folder / "misbehaving.sh"), word, "scene", str(folder / "image.pfm")], folder, folder, timeout)


def assert_gone(file, count):
    """The processes whose ids the file lists have ended, or are zombies that nobody has reaped yet."""
    ids = file.read_text().split()
    assert len(ids) == count
    deadline = time.monotonic() + 5
    while any(map(is_alive, ids)):
        assert time.monotonic() < deadline, "still alive"
        time.sleep(0.02)


def is_alive(number):
    state = Path(f"/proc/{number}/stat")
    try:
        return state.read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


# ---------------------------------------------------------------------------------------------- how they end


def test_a_program_that_succeeds_has_no_failure(tmp_path):
    completed = run(["echo", "done"], tmp_path, tmp_path, 20)
    assert (completed.exit_code, completed.output, completed.failure) == (0, "done\n", None)


@pytest.mark.parametrize(
    ("word", "failure"),
    [
        ("exits-with-3", "ended with exit code 3"),
        ("kills-itself", "was ended by SIGSEGV"),
        ("kills-its-group", "was ended by SIGKILL"),
        ("closes-everything", "ended with exit code 4"),
    ],
)
def test_how_a_program_ended_is_said_in_words(tmp_path, word, failure):
    assert run_misbehaving(tmp_path, word).failure == failure


def test_a_signal_without_a_name_is_a_number(tmp_path):
    number = int(signal.SIGRTMIN) + 3
    assert run(["sh", "-c", f"kill -{number} $$"], tmp_path, tmp_path, 20).failure == f"was ended by signal {number}"


def test_output_and_errors_come_in_order(tmp_path):
    assert run_misbehaving(tmp_path, "exits-with-3").output == "reading the scene\nno such mesh: teapot.ply\n"


def test_a_program_that_hangs_is_stopped_at_its_limit(tmp_path):
    start = time.monotonic()
    completed = run_misbehaving(tmp_path, "hangs", timeout=0.3)
    assert 0.3 <= time.monotonic() - start < 5
    assert completed.failure == "did not finish within 0.3 s and was stopped"


def test_children_and_grandchildren_that_ignore_requests_are_gone_with_it(tmp_path):
    completed = run_misbehaving(tmp_path, "hangs-with-children", timeout=1.0)
    assert completed.exit_code is None
    assert_gone(tmp_path / "pids", 5)


def test_a_child_that_outlives_its_parent_is_gone_too(tmp_path):
    start = time.monotonic()
    assert run_misbehaving(tmp_path, "leaves-a-child").failure is None
    assert time.monotonic() - start < 5
    assert_gone(tmp_path / "pids", 1)


def test_a_daemon_that_keeps_the_pipe_open_does_not_stop_the_grading(tmp_path):
    start = time.monotonic()
    assert run_misbehaving(tmp_path, "leaves-a-daemon").failure is None
    assert time.monotonic() - start < 3


# ---------------------------------------------------------------------------------------------- what they print


@pytest.mark.parametrize("word", ["prints-endlessly", "prints-without-newline"])
def test_of_endless_output_only_the_end_is_kept(tmp_path, word):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    completed = run_misbehaving(tmp_path, word, timeout=0.5)
    assert completed.exit_code is None
    assert 0 < len(completed.output) <= 8192
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < (50 << 10 if sys.platform == "linux" else 50 << 20)


def test_long_output_is_kept_from_the_start_of_a_line(tmp_path):
    lines = run_misbehaving(tmp_path, "prints-a-lot").output.splitlines()
    assert lines[-1] == "sample 2999"
    assert lines == [f"sample {3000 - len(lines) + i}" for i in range(len(lines))]


def test_escapes_and_controls_become_harmless(tmp_path):
    output = run_misbehaving(tmp_path, "prints-escapes").output
    assert "\N{REPLACEMENT CHARACTER}gpj.exe" in output
    assert "ared  " in output
    assert output.splitlines()[1:3] == ["progress 10 %", "progress 100 %"]
    for forbidden in "\x1b\x07\0\x85\x9b\u202e\u061c\r":
        assert forbidden not in output


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (b"plain\ttext\n", "plain\ttext\n"),
        (b"\x1b[1;31mred\x1b[0m", "red"),
        (b"\x1b]8;;http://x\x1b\\link\x1b]8;;\x1b\\", "link"),
        (b"\x1b]0;no end", ""),
        (b"at the end \x1b", "at the end \N{REPLACEMENT CHARACTER}"),
        (b"a\rb\r\nc", "a\nb\nc"),
        (b"\xff\xfe", "\N{REPLACEMENT CHARACTER}" * 2),
        ("Grüße, 七".encode(), "Grüße, 七"),
        ("\u202e\u2066\u200f\ufeff\u061c\x9b\u2028".encode(), "\N{REPLACEMENT CHARACTER}" * 7),
    ],
)
def test_text_of_strangers_is_printable(raw, text):
    assert printable(raw) == text


def test_text_for_a_message_is_one_line():
    assert one_line(" a\n\tb\x1b[31m c\udcff  d\r\n") == "a b c? d"


# ------------------------------------------------------------------------------------------- what cannot start


def test_a_program_that_is_not_there_cannot_start(tmp_path):
    with pytest.raises(CannotStart, match=r"^cannot run /nowhere/render: No such file or directory$"):
        run(["/nowhere/render"], tmp_path, tmp_path, 20)
    with pytest.raises(CannotStart, match=r"^cannot run no-such-program: No such file or directory$"):
        run(["no-such-program"], tmp_path, tmp_path, 20)


@pytest.mark.parametrize(
    ("content", "mode", "reason"),
    [
        ("#!/bin/sh\n", 0o644, "Permission denied"),
        ("#!/nowhere/python\n", 0o755, "the interpreter in its first line does not exist"),
        ("echo without a first line\n", 0o755, "Exec format error"),
        ("\x7fELF but not really", 0o755, "Exec format error"),
        ("", 0o755, "Exec format error"),
    ],
)
def test_a_program_that_is_none_cannot_start(tmp_path, content, mode, reason):
    program = tmp_path / "render"
    program.write_text(content)
    program.chmod(mode)
    with pytest.raises(CannotStart) as caught:
        run([str(program)], tmp_path, tmp_path, 20)
    assert str(caught.value) == f"cannot run {program}: {reason}"


def test_folders_and_links_in_circles_cannot_start(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "circle").symlink_to("circle")
    with pytest.raises(CannotStart, match="Permission denied"):
        run([str(tmp_path / "folder")], tmp_path, tmp_path, 20)
    with pytest.raises(CannotStart, match="Too many levels of symbolic links"):
        run([str(tmp_path / "circle")], tmp_path, tmp_path, 20)


def test_arguments_that_no_program_can_take_are_its_own_fault(tmp_path):
    with pytest.raises(CannotStart, match="embedded null byte"):
        run(["echo", "a\0b"], tmp_path, tmp_path, 20)
    with pytest.raises(CannotStart, match=os.strerror(errno.E2BIG)):
        run(["echo", "x" * (4 << 20)], tmp_path, tmp_path, 20)


def test_a_missing_folder_is_the_fault_of_the_machine(tmp_path):
    with pytest.raises(InfrastructureError, match="cannot start a process: No such file or directory"):
        run(["echo"], tmp_path / "nowhere", tmp_path, 20)


def test_a_machine_without_room_for_a_process_is_at_fault(tmp_path):
    script = """
import resource, sys
from pathlib import Path
from graders.errors import InfrastructureError
from graders.processes import run
resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))
try:
    run(["echo"], Path("."), Path("."), 5)
except InfrastructureError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (result.stdout, result.stderr) == (f"cannot start a process: {os.strerror(errno.EMFILE)}\n", "")


# ---------------------------------------------------------------------------------------------- what they get


def test_a_program_gets_few_variables_and_no_secrets(tmp_path, monkeypatch):
    monkeypatch.setenv("CI_JOB_TOKEN", "secret")
    run_misbehaving(tmp_path, "shows-its-environment")
    found = dict(line.partition("=")[::2] for line in (tmp_path / "environment").read_text().splitlines())
    assert "secret" not in found.values()
    assert set(found) <= {"PATH", "HOME", "TMPDIR", "LANG", "CMAKE_GENERATOR", "PWD", "OLDPWD", "SHLVL", "_"}
    assert found["HOME"] == found["TMPDIR"] == str(tmp_path)
    assert Path(found["PATH"].split(os.pathsep)[0]) == Path(sys.executable).parent


def test_standard_input_is_empty(tmp_path):
    script = """
import sys
from pathlib import Path
from graders.processes import run
print(run([sys.argv[1], "reads-standard-input", "scene", "image"], Path("."), Path("."), 20).output)
"""
    result = subprocess.run(
        [sys.executable, "-c", script, MISBEHAVING],
        input="for the grader\n",
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout == "got ''\n\n"


# ---------------------------------------------------------------------------------------------- interruptions


def test_an_interruption_ends_what_runs_and_lets_nothing_start(tmp_path):
    outcome = []
    thread = threading.Thread(target=lambda: outcome.append(run_misbehaving(tmp_path, "hangs-with-children", 60)))
    thread.start()
    deadline = time.monotonic() + 10
    while not (tmp_path / "pids").exists() or len((tmp_path / "pids").read_text().split()) < 5:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    try:
        processes.stop_all()
        thread.join(10)
        assert outcome[0].failure == "was ended by SIGKILL"
        assert_gone(tmp_path / "pids", 5)
        with pytest.raises(InfrastructureError, match=r"^the grading was interrupted$"):
            run(["echo"], tmp_path, tmp_path, 20)
    finally:
        processes.allow_all()
    assert run(["echo"], tmp_path, tmp_path, 20).failure is None


def test_a_scratch_folder_goes_away_whatever_is_in_it():
    with ScratchFolder("oracle-test-") as name:
        subprocess.run(["mkdir", "-p", Path(name, "d/" * 1500)], check=True)
        locked = Path(name, "locked")
        locked.mkdir()
        (locked / "file").touch()
        locked.chmod(0)
    assert not Path(name).exists()
