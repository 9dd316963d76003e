"""What this machine offers for grading, tried out rather than looked up, and how to mend what it lacks.

Everything that could abort, hang or print runs in a process of its own with a time limit: one broken library
must not take the report with it.
"""

import functools
import importlib
import importlib.metadata
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

__all__ = ["Check", "find_llvm", "run_checks"]


@dataclass(frozen=True, slots=True)
class Check:
    """One finding; `dataclasses.asdict` makes it JSON.

    Attributes
    ----------
    name : str
        What was looked at, unique within a run.
    status : {"ok", "missing", "broken"}
        Broken means present, but failing when tried.
    version : str
        Empty if unknown.
    detail : str
        One line: where it is, or what went wrong.
    mend : str
        The command that mends it; empty if all is well.
    required : bool
        Whether grading needs it at all.
    """

    name: str
    status: Literal["ok", "missing", "broken"]
    version: str
    detail: str
    mend: str
    required: bool = True


def run_checks() -> list[Check]:
    """Try out everything grading may use.

    Returns
    -------
    list of Check
        Always the same names in the same order. Never raises and always ends: each trial has a time limit.
    """
    groups: list[Callable[[], list[Check]]] = [
        _python, _compiler, _build_tools, _libraries, _mitsuba_scalar, _llvm, _sandbox, _dask, _chromium
    ]  # fmt: skip
    with ThreadPoolExecutor(len(groups)) as pool:
        return [check for checks in pool.map(lambda group: group(), groups) for check in checks]


# --- Running other programs --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Outcome:
    ok: bool
    output: str
    failure: str  # one line, empty if ok


def _run(command: list[str], *, stdin: str = "", seconds: float = 20, **environment: str) -> _Outcome:
    """Run a command in an empty folder; kill it with all its children when time is up."""
    try:
        with (
            tempfile.TemporaryDirectory(prefix="oracle-doctor-") as folder,
            subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder,
                # Kernels that another LLVM compiled must not make this one look usable.
                env={**os.environ, "DRJIT_CACHE_DIR": folder, **environment},
                text=True, errors="replace", start_new_session=True,
            ) as process,
        ):  # fmt: skip
            try:
                output, errors = process.communicate(stdin, timeout=seconds)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                return _Outcome(False, "", f"no answer within {seconds:g} s")
    except OSError as error:
        return _Outcome(False, "", str(error))
    if process.returncode == 0:
        return _Outcome(True, output.strip(), "")
    ended = signal.Signals(-process.returncode).name if process.returncode < 0 else f"exit code {process.returncode}"
    return _Outcome(False, output.strip(), f"{ended}: {_telling_line(errors)}".rstrip(": "))


def _telling_line(errors: str) -> str:
    """The line that says what went wrong: the first that speaks of an error, else the last."""
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    telling = next((line for line in lines if re.search(r"\berror\b|Error:", line, re.IGNORECASE)), "")
    return (telling or (lines[-1] if lines else ""))[:200]


def _first_version(text: str) -> str:
    found = re.search(r"\d+(\.\d+)+", text)
    return found.group() if found else ""


def _install(apt: str, dnf: str, brew: str) -> str:
    """The command that installs a system package here."""
    sudo = "" if os.geteuid() == 0 else "sudo "
    if shutil.which("apt-get"):
        return f"{sudo}apt-get install {apt}"
    if shutil.which("dnf"):
        return f"{sudo}dnf install {dnf}"
    return f"brew install {brew}"


def _pip_install(package: str) -> str:
    return shlex.join([sys.executable, "-m", "pip", "install", "--force-reinstall", package])


# --- Python and its libraries ------------------------------------------------------------------------------


def _python() -> list[Check]:
    detail = f"{platform.python_implementation()} on {platform.platform()}, {os.cpu_count()} cores"
    return [Check("Python", "ok", platform.python_version(), detail, "")]


def _libraries() -> list[Check]:
    # One after the other: imports in several threads at once can see half-initialised modules.
    return [
        _library("NumPy", "numpy", lambda: importlib.import_module("numpy.linalg"), _pip_install("numpy")),
        _library("SciPy", "scipy", lambda: importlib.import_module("scipy.integrate"), _pip_install("scipy")),
        _library("OpenImageIO", "openimageio", _exercise_openimageio, _pip_install("openimageio")),
        _embree(),
    ]


def _library(name: str, distribution: str, exercise: Callable[[], object], mend: str) -> Check:
    try:
        version = importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return Check(name, "missing", "", f"the Python package {distribution} is not installed", mend)
    try:
        exercise()
    except Exception as error:  # a library built for another version of NumPy or Python can raise anything
        return Check(name, "broken", version, _telling_line(f"{type(error).__name__}: {error}"), mend)
    return Check(name, "ok", version, "", "")


def _exercise_openimageio() -> None:
    """Write an EXR file and read it back."""
    import OpenImageIO as oiio

    with tempfile.TemporaryDirectory(prefix="oracle-doctor-") as folder:
        path = str(Path(folder) / "pixel.exr")
        image = oiio.ImageBuf(oiio.ImageSpec(1, 1, 3, "float"))
        image.setpixel(0, 0, (0.25, 1.5, 1e4))
        if not image.write(path):
            raise RuntimeError(f"cannot write EXR: {image.geterror()}")
        if tuple(oiio.ImageBuf(path).getpixel(0, 0)) != (0.25, 1.5, 1e4):
            raise RuntimeError("an EXR file came back with other values")


def _embree() -> Check:
    mend = _install("libembree-dev", "embree-devel", "embree")
    try:
        from oracle.tracer import embree_version

        return Check("Embree", "ok", embree_version(), "", "")
    except ImportError as error:
        if isinstance(error.__cause__, ModuleNotFoundError):
            mend = "make setup"  # Embree may be there; it is the extension that was not built
        return Check("Embree", "missing", "", str(error), mend)
    except RuntimeError as error:
        return Check("Embree", "broken", "", str(error), mend)


def _dask() -> list[Check]:
    try:
        version = importlib.metadata.version("distributed")
    except importlib.metadata.PackageNotFoundError:
        detail = "optional: spreads a class over many machines"
        return [Check("dask", "missing", "", detail, _pip_install("distributed"), required=False)]
    return [Check("dask", "ok", version, "", "", required=False)]


# --- What builds a submission ------------------------------------------------------------------------------


def _compiler() -> list[Check]:
    name = "C++ compiler"
    mend = _install("g++", "gcc-c++", "gcc")
    wanted = [shlex.split(os.environ["CXX"])] if os.environ.get("CXX") else [["c++"], ["g++"], ["clang++"]]
    command = next((words for words in wanted if shutil.which(words[0])), None)
    if command is None:
        tried = ", ".join(words[0] for words in wanted)
        return [Check(name, "missing", "", f"none of {tried} is on PATH", mend)]
    version = _first_version(_run([*command, "--version"]).output)
    # Linking finds a missing standard library, which compiling alone does not.
    source = "#include <iostream>\n#include <optional>\nint main() { std::cout << std::optional<int>{17}.value(); }\n"
    outcome = _run([*command, "-std=c++17", "-x", "c++", "-", "-o", "probe"], stdin=source)
    if not outcome.ok:
        return [Check(name, "broken", version, outcome.failure, mend)]
    return [Check(name, "ok", version, str(shutil.which(command[0])), "")]


def _build_tools() -> list[Check]:
    return [_build_tool("CMake", "cmake"), _build_tool("ninja", "ninja")]


def _build_tool(name: str, program: str) -> Check:
    # The Python packages of the same name put the programs beside the interpreter.
    beside = Path(sys.executable).parent
    path = shutil.which(program, path=str(beside)) or shutil.which(program)
    if path is None:
        return Check(name, "missing", "", f"neither in {beside} nor on PATH", _pip_install(program))
    outcome = _run([path, "--version"])
    if not outcome.ok:
        return Check(name, "broken", "", outcome.failure, _pip_install(program))
    return Check(name, "ok", _first_version(outcome.output), path, "")


# --- Mitsuba -----------------------------------------------------------------------------------------------

# Prints Mitsuba's version and the mean of a tiny image for each variant named. The scene has a closed form: a
# diffuse surface of reflectance 1/2 under a sky of radiance 1 shows 1/2 everywhere.
_PROBE = """
import ctypes, os, resource, sys
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
if library := os.environ.get("DRJIT_LIBLLVM_PATH"):
    ctypes.CDLL(library)  # says why a file is not a library; Dr.Jit would only say that it found none
import mitsuba as mi
import numpy as np
means = []
for variant in sys.argv[1:]:
    mi.set_variant(variant)
    camera = mi.ScalarTransform4f().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0])
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3},
        "sensor": {"type": "perspective", "fov": 60, "to_world": camera,
                   "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}},
        "sky": {"type": "constant"},
        "surface": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
    })
    means.append(float(np.mean(np.array(mi.render(scene, spp=256, seed=1)))))
print(mi.__version__, *means)
"""
_PROBE_MEAN = 0.5
# 16,384 samples whose relative deviation is below 1: four standard errors are 3 %.
_PROBE_TOLERANCE = 0.03


def _probe_mitsuba(variants: list[str], llvm: str = "") -> tuple[str, str]:
    """Mitsuba's version and why the variants are of no use here (empty if they are)."""
    outcome = _run([sys.executable, "-P", "-c", _PROBE, *variants], seconds=30, DRJIT_LIBLLVM_PATH=llvm)
    if not outcome.ok:
        return "", outcome.failure
    version, *means = outcome.output.split()[-1 - len(variants) :] or [""]
    if len(means) != len(variants):
        return version, "ended without an image"
    for variant, mean in zip(variants, means, strict=True):
        if not abs(float(mean) / _PROBE_MEAN - 1) <= _PROBE_TOLERANCE:
            return version, f"{variant} renders {float(mean):.4f} where {_PROBE_MEAN} is right"
    return version, ""


def _mitsuba_scalar() -> list[Check]:
    version, failure = _probe_mitsuba(["scalar_rgb"])
    if not failure:
        return [Check("Mitsuba scalar_rgb", "ok", version, "a test image is right", "")]
    status: Literal["missing", "broken"] = "missing" if "ModuleNotFoundError" in failure else "broken"
    return [Check("Mitsuba scalar_rgb", status, version, failure, _pip_install("mitsuba"))]


# --- LLVM, for Mitsuba's llvm_ad_rgb -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Trial:
    library: Path
    failure: str  # empty if a test image was right

    @property
    def version(self) -> str:
        return ".".join(map(str, _llvm_version(self.library)))


def find_llvm() -> Path | None:
    """Find a libLLVM with which Mitsuba's `llvm_ad_rgb` renders a right image.

    Returns
    -------
    Path or None
        Value for the environment variable ``DRJIT_LIBLLVM_PATH``; None if no installed version works. The newest
        that works is preferred, one named by that variable already is tried first.

    Notes
    -----
    Takes about a second the first time and nothing afterwards. A wrong version aborts the whole process (LLVM 15:
    "Cannot select: fminimum"), so each candidate renders in a process of its own.
    """
    trials = _try_llvm(os.environ.get("DRJIT_LIBLLVM_PATH", ""))
    return trials[-1].library if trials and not trials[-1].failure else None


@functools.cache
def _try_llvm(preferred: str) -> tuple[_Trial, ...]:
    """Try libraries until one works; that one is the last."""
    trials: list[_Trial] = []
    for library in _llvm_candidates(preferred):
        _, failure = _probe_mitsuba(["scalar_rgb", "llvm_ad_rgb"], str(library))
        trials.append(_Trial(library, failure))
        if not failure:
            break
    return tuple(trials)


def _llvm_candidates(preferred: str) -> list[Path]:
    """Every libLLVM in the usual places, each once: the preferred one, then the newest first."""
    patterns = [
        "usr/lib/llvm-*/lib/libLLVM*.so*",
        "usr/lib/*-linux-gnu/libLLVM*.so*",
        "usr/lib64/libLLVM*.so*",
        "usr/lib64/llvm*/lib*/libLLVM*.so*",
        "usr/lib/libLLVM*.so*",
        "usr/local/lib/libLLVM*.so*",
        "opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
        "usr/local/opt/llvm*/lib/libLLVM*.dylib",
    ]
    found = {path.resolve() for pattern in patterns for path in Path("/").glob(pattern)}
    newest_first = sorted(found, key=lambda path: (_llvm_version(path), str(path)), reverse=True)
    first = [Path(preferred).resolve()] if preferred else []
    return [*first, *(path for path in newest_first if path not in first)]


def _llvm_version(library: Path) -> tuple[int, ...]:
    """The version in a file name such as libLLVM.so.19.1 or libLLVM-14.0.6.so.1, else in its folder's."""
    found = re.search(r"libLLVM(?:-|\.so\.)(\d+(?:\.\d+)*)", library.name) or re.search(r"llvm[-@]?(\d+)", str(library))
    return tuple(map(int, found.group(1).split("."))) if found else ()


def _llvm() -> list[Check]:
    variant = "Mitsuba llvm_ad_rgb"
    mend = _install("libllvm19", "llvm-libs", "llvm")
    trials = _try_llvm(os.environ.get("DRJIT_LIBLLVM_PATH", ""))
    failures = "; ".join(f"{trial.library}: {trial.failure}" for trial in trials if trial.failure)
    if not trials:
        detail = "optional: no libLLVM found; Mitsuba runs as scalar_rgb, which is slower"
        return [
            Check("LLVM", "missing", "", detail, mend, required=False),
            Check(variant, "missing", "", "needs LLVM", mend, required=False),
        ]
    last = trials[-1]
    if last.failure:
        return [
            Check("LLVM", "broken", last.version, f"not usable by Mitsuba: {failures}", mend, required=False),
            Check(variant, "broken", "", "not offered: no installed LLVM renders a test image", mend, required=False),
        ]
    detail = str(last.library) + (f" (passed over {failures})" if failures else "")
    return [
        Check("LLVM", "ok", last.version, detail, "", required=False),
        Check(
            variant,
            "ok",
            importlib.metadata.version("mitsuba"),
            f"a test image is right with {last.library}",
            "",
            required=False,
        ),
    ]


# --- Sandbox and browser -----------------------------------------------------------------------------------


def _sandbox() -> list[Check]:
    name = "sandbox"
    path = shutil.which("bwrap")
    if path is None:
        mend = _install("bubblewrap", "bubblewrap", "bubblewrap")
        return [Check(name, "missing", "", "tier: none (bubblewrap is not installed)", mend, required=False)]
    version = _first_version(_run([path, "--version"]).output)
    canary = _run([path, "--unshare-all", "--die-with-parent", "--ro-bind", "/", "/", "true"])
    if not canary.ok:
        detail = f"tier: none (bubblewrap cannot confine here: {canary.failure})"
        return [Check(name, "broken", version, detail, _mend_namespaces(), required=False)]
    return [Check(name, "ok", version, "tier: bubblewrap", "", required=False)]


def _mend_namespaces() -> str:
    """The command that allows user namespaces, from the switch that forbids them."""
    sudo = "" if os.geteuid() == 0 else "sudo "
    switches = {
        "kernel.apparmor_restrict_unprivileged_userns": ("1", "0"),  # Ubuntu 24.04
        "kernel.unprivileged_userns_clone": ("0", "1"),  # Debian before 11
        "user.max_user_namespaces": ("0", "15000"),  # RHEL
    }
    for switch, (forbids, allows) in switches.items():
        setting = Path("/proc/sys") / switch.replace(".", "/")
        if setting.is_file() and setting.read_text().strip() == forbids:
            return f"{sudo}sysctl -w {switch}={allows}"
    return "in a container: docker run --security-opt seccomp=unconfined --cap-add SYS_ADMIN"


def _chromium() -> list[Check]:
    programs = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    path = next((found for program in programs if (found := shutil.which(program))), None)
    mend = _install("chromium", "chromium", "--cask chromium")
    if path is None:
        return [Check("Chromium", "missing", "", "optional: draws reports for the tests", mend, required=False)]
    outcome = _run([path, "--version"])
    if not outcome.ok:
        return [Check("Chromium", "broken", "", outcome.failure, mend, required=False)]
    return [Check("Chromium", "ok", _first_version(outcome.output), path, "", required=False)]
