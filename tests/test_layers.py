"""The three rooms: light falls from `oracle` through `reference_scenes` into `graders`, never back."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import graders
import oracle
import reference_scenes

ROOMS = {"oracle": oracle, "reference_scenes": reference_scenes, "graders": graders}
# What reads or writes files, starts processes or opens connections.
DOORS = {
    *("asyncio", "ftplib", "glob", "http", "io", "mmap", "multiprocessing", "os", "pathlib", "pickle", "shelve"),
    *("shutil", "socket", "sqlite3", "subprocess", "tempfile", "urllib", "OpenImageIO", "requests"),
}
NUMPY_FILES = {"fromfile", "genfromtxt", "load", "loadtxt", "memmap", "save", "savetxt", "savez", "tofile"}
HEAVY = ("mitsuba", "drjit", "dask", "skimage", "OpenImageIO", "numpy", "scipy", "pydantic", "oracle.tracer")


def sources(room):
    """All Python files of a room, by their path within it."""
    folder = Path(ROOMS[room].__file__).parent
    files = {path.relative_to(folder).as_posix(): ast.parse(path.read_bytes()) for path in sorted(folder.rglob("*.py"))}
    assert files
    return files


def imported(tree):
    """The full names of all modules that a file imports, wherever in the file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "a relative import hides from which room it comes"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def calls(tree):
    """What a file calls: the name of a function, or a dot and that of a method or a module's function."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield getattr(node.func, "id", f".{getattr(node.func, 'attr', '')}")


def loaded_by(statement):
    """The modules that a fresh interpreter with this one's path has loaded after a statement."""
    # -S: no start-up hook of the environment, such as that of an editable install, loads anything by itself.
    path = [str(Path(oracle.__file__).parents[1]), *filter(None, sys.path)]
    finished = subprocess.run(
        [sys.executable, "-S", "-c", f"{statement}\nimport sys; print(*sys.modules)"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert finished.returncode == 0, finished.stderr
    return set(finished.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("room", "forbidden"), [("oracle", {"reference_scenes", "graders"}), ("reference_scenes", {"graders"})]
)
def test_no_room_imports_from_a_higher_one(room, forbidden):
    for name, tree in sources(room).items():
        assert not forbidden & {module.split(".")[0] for module in imported(tree)}, name


def test_every_room_imports_from_the_one_below():
    # So that the test above is known to see imports.
    for room, below in (("reference_scenes", "oracle"), ("graders", "reference_scenes")):
        assert any(module.split(".")[0] == below for tree in sources(room).values() for module in imported(tree))


def test_in_oracle_only_the_tracer_imports_what_opens_files_or_starts_processes():
    for name, tree in sources("oracle").items():
        if not name.startswith("tracer/"):
            assert not DOORS & {module.split(".")[0] for module in imported(tree)}, name


def test_in_oracle_only_the_tracer_calls_what_opens_files_or_runs_code():
    forbidden = {"open", "exec", "eval", "compile", "__import__", "print", "input"} | {f".{n}" for n in NUMPY_FILES}
    for name, tree in sources("oracle").items():
        if not name.startswith("tracer/"):
            assert not forbidden & set(calls(tree)), name


def test_no_room_imports_mitsuba_dask_or_skimage_at_the_top_of_a_file():
    for room in ROOMS:
        for name, tree in sources(room).items():
            top = ast.Module([node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)], [])
            assert not {"mitsuba", "drjit", "dask", "skimage"} & {m.split(".")[0] for m in imported(top)}, (room, name)


@pytest.mark.parametrize(
    "statement",
    [
        "import oracle",
        "import graders.cli",
        "from graders.cli.commands import oracle; oracle.main(['--help'], standalone_mode=False)",
    ],
)
def test_the_door_is_light(statement):
    assert not set(HEAVY) & loaded_by(statement)


def test_what_is_loaded_is_seen():
    # So that the test above is known to see modules.
    assert {"numpy", "oracle.irradiances"} <= loaded_by("import oracle.irradiances")
