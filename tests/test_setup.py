"""`.ci/setup` in a small checkout whose Python, compiler and apt are scripts that write down how they were called."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# What the script may use of a POSIX system, and nothing that could install anything.
TOOLS = ["bash", "cat", "cksum", "cp", "dirname", "env", "find", "head", "mkdir", "rm", "sh", "sort"]

# Answers what .ci/setup asks an interpreter. `-m venv` copies it into .venv; pip fails while a file `offline` exists.
PYTHON = """#!/bin/sh
echo "python $*" >>calls
case "$*" in
    *"version_info < "*) exit 0 ;;
    *"version_info[:2]"*) echo python3.11 ;;
    *get_path*) echo "$PWD/include" ;;
    *"-m venv"*) rm -rf .venv; mkdir -p .venv/bin; cp bin/python3 .venv/bin/python ;;
    *"-m pip"*) [ ! -e offline ] ;;
esac
"""


class Checkout:
    def __init__(self, folder):
        self.folder = folder
        (folder / ".ci").mkdir()
        shutil.copy(ROOT / ".ci" / "setup", folder / ".ci")
        for name in ("requirements.lock", "pyproject.toml", "oracle/tracer/module.cpp", "graders/cli.py",
                     "oracle/__init__.py", "reference_scenes/__init__.py",
                     "include/Python.h", "embree/include/embree4/rtcore.h"):  # fmt: skip
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(name)
        self.bin = folder / "bin"
        self.bin.mkdir()
        for tool in TOOLS:
            (self.bin / tool).symlink_to(shutil.which(tool))
        self.program("python3", PYTHON)
        self.program("c++", "#!/bin/sh\n")
        self.program("id", "#!/bin/sh\necho 1000\n")

    def program(self, name, text):
        (self.bin / name).write_text(text)
        (self.bin / name).chmod(0o755)

    def setup(self):
        """Run .ci/setup and return its result with the calls that the fake programs wrote down."""
        calls = self.folder / "calls"
        calls.write_text("")
        result = subprocess.run(
            [self.bin / "bash", ".ci/setup"], cwd=self.folder, capture_output=True, text=True, stdin=subprocess.DEVNULL,
            timeout=60, env={"PATH": str(self.bin), "CMAKE_PREFIX_PATH": str(self.folder / "embree")},
        )  # fmt: skip
        return result, calls.read_text()


@pytest.fixture(params=["checkout", "check out (1)"])
def checkout(tmp_path, request):
    folder = tmp_path / request.param
    folder.mkdir()
    return Checkout(folder)


def assert_names_what_is_missing(result, what, apt, dnf, brew):
    assert result.returncode == 1
    assert f"setup: missing: {what}\n" in result.stderr
    assert f"sudo apt-get install {apt}\n" in result.stderr
    assert f"sudo dnf install {dnf}\n" in result.stderr
    assert f"brew install {brew}\n" in result.stderr


def test_a_missing_compiler_is_named_with_three_commands(checkout):
    (checkout.bin / "c++").unlink()
    result, calls = checkout.setup()
    assert_names_what_is_missing(result, "a C++17 compiler", "g++", "gcc-c++", "gcc")
    assert "-m venv" not in calls
    assert not (checkout.folder / ".venv").exists()


def test_everything_missing_is_named_at_once(checkout):
    (checkout.bin / "c++").unlink()
    (checkout.folder / "include/Python.h").unlink()
    result, _ = checkout.setup()
    assert_names_what_is_missing(
        result, "Python's C headers (Python.h)", "python3.11-dev g++", "python3-devel gcc-c++", "python gcc"
    )


def test_an_old_python_is_named_with_three_commands(checkout):
    checkout.program("python3", "#!/bin/sh\nexit 1\n")
    result, _ = checkout.setup()
    assert_names_what_is_missing(
        result, "Python 3.11 or newer (found: none)", "python3.11 python3.11-venv python3.11-dev",
        "python3.12 python3.12-devel", "python@3.13",
    )  # fmt: skip


def test_a_newer_python_beside_an_old_python3_is_taken(checkout):
    (checkout.bin / "python3").rename(checkout.bin / "python3.12")
    checkout.program("python3", "#!/bin/sh\nexit 1\n")
    result, _ = checkout.setup()
    assert f"creating .venv with {checkout.bin / 'python3.12'}" in result.stderr


def test_apt_is_left_alone_where_it_may_not_install(checkout):
    (checkout.bin / "c++").unlink()
    checkout.program("apt-get", '#!/bin/sh\necho "apt-get $*" >>calls\n')
    checkout.program("sudo", "#!/bin/sh\necho a password is required >&2\nexit 1\n")
    result, calls = checkout.setup()
    assert "apt-get" not in calls
    assert_names_what_is_missing(result, "a C++17 compiler", "g++", "gcc-c++", "gcc")


@pytest.mark.parametrize("way", ["root", "sudo"])
def test_apt_installs_exactly_what_is_missing(checkout, way):
    (checkout.bin / "c++").unlink()
    (checkout.folder / "include/Python.h").unlink()
    checkout.program(
        "apt-get",
        '#!/bin/sh\necho "apt-get $*" >>calls\n'
        'case "$*" in *install*) cp bin/id bin/g++; echo >include/Python.h;; esac\n',
    )
    if way == "root":
        checkout.program("id", "#!/bin/sh\necho 0\n")
    else:
        checkout.program("sudo", '#!/bin/sh\n[ "$1" = -n ] && shift\nexec "$@"\n')
        checkout.program("true", "#!/bin/sh\n")
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    (apt,) = (line for line in calls.splitlines() if line.startswith("apt-get"))
    assert apt.endswith("install -y --no-install-recommends python3.11-dev g++")


def test_stale_package_lists_are_renewed(checkout):
    (checkout.bin / "c++").unlink()
    checkout.program("id", "#!/bin/sh\necho 0\n")
    checkout.program(
        "apt-get",
        '#!/bin/sh\ncase "$*" in\n*update*) echo >lists;;\n*install*) [ -e lists ] && cp bin/id bin/g++;;\nesac\n',
    )
    result, _ = checkout.setup()
    assert result.returncode == 0, result.stderr


def test_a_failing_apt_ends_in_the_three_commands(checkout):
    (checkout.bin / "c++").unlink()
    checkout.program("id", "#!/bin/sh\necho 0\n")
    checkout.program("apt-get", "#!/bin/sh\necho no network >&2\nexit 100\n")
    result, _ = checkout.setup()
    assert "no network" in result.stderr
    assert_names_what_is_missing(result, "a C++17 compiler", "g++", "gcc-c++", "gcc")


def test_the_lock_file_is_installed_by_hash_and_the_project_editable(checkout):
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    packages, project = (line for line in calls.splitlines() if "-m pip" in line)
    assert "--require-hashes -r requirements.lock" in packages
    assert project.endswith("--no-build-isolation --no-deps --editable .")


def test_the_second_run_does_nothing(checkout):
    checkout.setup()
    result, calls = checkout.setup()
    assert (result.returncode, result.stderr) == (0, "")
    assert {line.strip() for line in calls.splitlines()} == {"python -c"}  # whether the interpreter still runs


@pytest.mark.parametrize(
    ("name", "installs"),
    [
        ("requirements.lock", 2),
        ("pyproject.toml", 1),
        ("oracle/tracer/module.cpp", 1),
        ("oracle/tracer/CMakeLists.txt", 1),
        ("graders/__init__.py", 1),  # a new package, unknown to the editable install
        ("graders/cli.py", 0),
    ],
)
def test_a_change_redoes_what_depends_on_it(checkout, name, installs):
    checkout.setup()
    (checkout.folder / name).write_text("changed")
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    assert calls.count("-m pip") == installs
    assert "-m venv" not in calls


def test_an_interrupted_run_is_taken_up_by_the_next(checkout):
    (checkout.folder / "offline").touch()
    result, _ = checkout.setup()
    assert result.returncode == 1
    assert "with network access, run make again" in result.stderr
    (checkout.folder / "offline").unlink()
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    assert "-m venv --clear .venv" in calls  # whatever the first run left is not trusted


def test_a_venv_whose_interpreter_has_gone_is_made_anew(checkout):
    checkout.setup()
    (checkout.folder / ".venv/bin/python").unlink()
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    assert "-m venv --clear .venv" in calls


def test_a_moved_checkout_gets_its_own_venv(checkout):
    checkout.setup()
    moved = checkout.folder.with_name("moved")
    checkout.folder.rename(moved)
    checkout.folder, checkout.bin = moved, moved / "bin"
    result, calls = checkout.setup()
    assert result.returncode == 0, result.stderr
    assert "-m venv --clear .venv" in calls
