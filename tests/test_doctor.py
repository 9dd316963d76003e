"""The doctor's findings, provoked with real programs and libraries that are missing, broken, aborting or hanging."""

import dataclasses
import json
import shlex
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from graders import doctor
from graders.doctor import Check, find_llvm, run_checks

NAMES = [
    "Python", "C++ compiler", "CMake", "ninja", "NumPy", "SciPy", "OpenImageIO", "Embree",
    "Mitsuba scalar_rgb", "LLVM", "Mitsuba llvm_ad_rgb", "sandbox", "dask", "Chromium",
]  # fmt: skip
OPTIONAL = {"LLVM", "Mitsuba llvm_ad_rgb", "sandbox", "dask", "Chromium"}


@pytest.fixture
def only_path(tmp_path, monkeypatch):
    """A folder that is the whole PATH."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.delenv("CXX", raising=False)
    return folder


def write_program(path, script):
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)


def one(checks, name) -> Check:
    (check,) = (check for check in checks if check.name == name)
    return check


def test_a_set_up_machine_is_healthy():
    start = time.monotonic()
    checks = run_checks()
    assert time.monotonic() - start < 60  # 2 s on two idle cores
    assert [check.name for check in checks] == NAMES
    assert {check.name for check in checks if not check.required} == OPTIONAL
    assert [check for check in checks if check.required and check.status != "ok"] == []


def test_every_finding_is_one_line_with_a_cure_and_goes_into_json(only_path):
    checks = run_checks()
    assert [check.name for check in checks] == NAMES
    for check in checks:
        assert check.status in ("ok", "missing", "broken")
        assert (check.mend == "") == (check.status == "ok"), check
        assert "\n" not in check.detail + check.mend + check.version
        assert json.loads(json.dumps(dataclasses.asdict(check)))["name"] == check.name


def test_an_empty_path_lacks_a_compiler_a_sandbox_and_a_browser(only_path):
    checks = run_checks()
    assert one(checks, "C++ compiler").detail == "none of c++, g++, clang++ is on PATH"
    assert one(checks, "sandbox").detail.startswith("tier: none")
    assert one(checks, "Chromium").status == "missing"
    assert one(checks, "CMake").status == "ok"  # beside the interpreter, as every pip install puts it


@pytest.mark.parametrize(("manager", "words"), [("apt-get", "apt-get install g++"), ("dnf", "dnf install gcc-c++")])
def test_the_cure_is_for_the_package_manager_at_hand(only_path, manager, words):
    write_program(only_path / manager, "exit 0")
    (check,) = doctor._compiler()
    assert check.mend.removeprefix("sudo ") == words


def test_a_compiler_that_cannot_link_is_broken(only_path):
    script = 'case "$1" in --version) echo fake 9.1.0;; *) echo "ld: error: no libstdc++" >&2; exit 1;; esac'
    write_program(only_path / "c++", script)
    (check,) = doctor._compiler()
    assert (check.status, check.version) == ("broken", "9.1.0")
    assert check.detail == "exit code 1: ld: error: no libstdc++"


def test_the_compiler_named_by_cxx_is_the_one_tried(monkeypatch):
    compiler = shutil.which("c++")
    monkeypatch.setenv("CXX", shlex.join(["env", compiler]))
    (check,) = doctor._compiler()
    assert check.status == "ok"
    monkeypatch.setenv("CXX", "no-such-compiler -O2")
    (check,) = doctor._compiler()
    assert check.detail == "none of no-such-compiler is on PATH"


def test_the_sandbox_is_believed_only_after_its_canary(only_path):
    write_program(only_path / "bwrap", '[ "$1" = --version ] && echo bubblewrap 0.8.0')
    (check,) = doctor._sandbox()
    assert (check.status, check.version) == ("broken", "0.8.0")
    assert check.detail.startswith("tier: none")
    assert check.mend
    write_program(only_path / "bwrap", "echo bubblewrap 0.8.0")
    (check,) = doctor._sandbox()
    assert (check.status, check.version, check.detail) == ("ok", "0.8.0", "tier: bubblewrap")


def test_a_program_that_hangs_is_killed_with_its_children(tmp_path):
    pid_file = tmp_path / "pid"
    start = time.monotonic()
    outcome = doctor._run(["sh", "-c", f"sleep 60 & echo $! > {shlex.quote(str(pid_file))}; wait"], seconds=0.5)
    assert time.monotonic() - start < 20
    assert (outcome.ok, outcome.failure) == (False, "no answer within 0.5 s")
    # Gone, or a zombie that nobody has reaped yet.
    state = Path(f"/proc/{pid_file.read_text().strip()}/stat")
    assert not state.exists() or state.read_text().split()[2] == "Z"


def test_a_program_that_is_none_is_no_exception(tmp_path):
    (tmp_path / "program").write_bytes(b"\x7fELF but not really")
    (tmp_path / "program").chmod(0o755)
    outcome = doctor._run([str(tmp_path / "program")])
    assert not outcome.ok
    assert outcome.failure


def test_a_library_that_fails_in_use_is_broken():
    def fail():
        raise AttributeError("module compiled against another ABI")

    check = doctor._library("NumPy", "numpy", fail, "pip install numpy")
    assert (check.status, check.detail) == ("broken", "AttributeError: module compiled against another ABI")
    check = doctor._library("X", "no-such-distribution", fail, "pip install x")
    assert (check.status, check.mend) == ("missing", "pip install x")


# --- LLVM --------------------------------------------------------------------------------------------------


def only_library(monkeypatch, *libraries):
    monkeypatch.setattr(doctor, "_llvm_candidates", lambda preferred: list(libraries))
    doctor._try_llvm.cache_clear()


@pytest.fixture(autouse=True)
def _forget_llvm():
    yield
    doctor._try_llvm.cache_clear()


def test_a_file_that_is_no_library_is_skipped_with_a_reason(tmp_path, monkeypatch):
    fake = tmp_path / "libLLVM.so.19.1"
    fake.write_text("not a library")
    only_library(monkeypatch, fake)
    llvm, variant = doctor._llvm()
    assert (llvm.status, variant.status, llvm.version) == ("broken", "broken", "19.1")
    assert "libLLVM.so.19.1" in llvm.detail
    assert "invalid ELF header" in llvm.detail or "file too short" in llvm.detail
    assert find_llvm() is None


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("std::abort();", "SIGABRT"),
        ("*static_cast<volatile int*>(nullptr) = 1;", "SIGSEGV"),
        ("_exit(0);", "ended without an image"),
    ],
)
def test_a_library_that_ends_the_process_ends_only_its_own(tmp_path, monkeypatch, statement, reason):
    source = tmp_path / "fake.cpp"
    constructor = f"__attribute__((constructor)) static void at_load() {{ {statement} }}\n"
    source.write_text("#include <cstdlib>\n#include <unistd.h>\n" + constructor)
    library = tmp_path / "libLLVM-15.so.1"
    subprocess.run(["c++", "-shared", "-fPIC", source, "-o", library], check=True)
    only_library(monkeypatch, library)
    llvm, variant = doctor._llvm()
    assert (llvm.status, variant.status) == ("broken", "broken")
    assert reason in llvm.detail
    assert find_llvm() is None


def test_no_library_at_all_is_missing_with_a_cure(monkeypatch):
    only_library(monkeypatch)
    llvm, variant = doctor._llvm()
    assert (llvm.status, variant.status) == ("missing", "missing")
    assert "llvm" in llvm.mend
    assert find_llvm() is None


def test_a_library_named_by_the_user_is_tried_first_and_a_bad_one_passed_over(tmp_path, monkeypatch):
    fake = tmp_path / "libLLVM.so.99"
    fake.touch()
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(fake))
    candidates = doctor._llvm_candidates(str(fake))
    assert candidates[0] == fake
    assert len(candidates) == len(set(candidates))
    assert find_llvm() != fake
    llvm, _ = doctor._llvm()
    assert "libLLVM.so.99" in llvm.detail


def test_finding_llvm_twice_costs_nothing():
    found = find_llvm()
    start = time.monotonic()
    assert find_llvm() == found
    assert time.monotonic() - start < 0.05


@pytest.mark.parametrize(
    ("path", "version"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", (19, 1)),
        ("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1", (15,)),
        ("/usr/lib/llvm-14/lib/libLLVM-14.0.6.so.1", (14, 0, 6)),
        ("/opt/homebrew/opt/llvm@18/lib/libLLVM.dylib", (18,)),
        ("/usr/lib/libLLVM.so", ()),
    ],
)
def test_the_version_is_read_from_the_name(path, version):
    assert doctor._llvm_version(Path(path)) == version


def test_an_image_that_is_wrong_is_not_accepted(monkeypatch):
    monkeypatch.setattr(doctor, "_PROBE", "print('3.9.9', 0.5, 0.45)")
    assert doctor._probe_mitsuba(["scalar_rgb", "llvm_ad_rgb"]) == (
        "3.9.9", "llvm_ad_rgb renders 0.4500 where 0.5 is right",
    )  # fmt: skip
    monkeypatch.setattr(doctor, "_PROBE", "print('3.9.9', 'nan')")
    assert doctor._probe_mitsuba(["scalar_rgb"])[1] == "scalar_rgb renders nan where 0.5 is right"
