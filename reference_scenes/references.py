"""References on disk: an image of the reference tracer, where it comes from, and the exact sums to go on from.

A folder holds `reference.exr`, `reference.json` and `state.npz`. The tracer's extension is needed for sums alone.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from pydantic import Field, model_validator

from reference_scenes import model
from reference_scenes.loading import InvalidFile, load_json, validate
from reference_scenes.model import Model

if TYPE_CHECKING:
    from oracle.tracer import Rendering

IMAGE, ABOUT, STATE, AOVS = "reference.exr", "reference.json", "state.npz", "aovs.exr"
# What is not finished lies here; only who holds the lock touches it.
_UNFINISHED, _LOCK = ".unfinished", ".lock"
_ABOUT_IN_STATE = "about.json"
# Whatever claims to be longer than this many bytes is not the description of a reference.
_MOST_TEXT = 1 << 20
# Room for what NumPy writes before an array.
_MOST_HEADER = 1 << 12
_SHA256 = r"^[0-9a-f]{64}$"

_Count = Annotated[int, Field(strict=True, ge=1, lt=1 << 32)]
# Several seeds have more.
_Total = Annotated[int, Field(strict=True, ge=1, le=1 << 53)]
_Measured = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Text = Annotated[str, Field(min_length=1, max_length=1000)]


class Samples(Model):
    """Samples ``first, ..., first + count - 1`` of every pixel, drawn with one seed."""

    seed: Annotated[int, Field(strict=True, ge=0, le=(1 << 64) - 1)]
    first: Annotated[int, Field(strict=True, ge=0, lt=1 << 32)]
    count: _Count


class Run(Model):
    """What rendered some of the samples, and how long that took [s]; runs that differ in time alone are one."""

    revision: _Text
    embree: _Text
    threads: Annotated[int, Field(strict=True, ge=1)]
    spp: _Total
    seconds: _Measured


class About(Model):
    """Where a reference comes from.

    Attributes
    ----------
    scene, member : str, int
        File name of the scene, or its name; the seed that drew it if it is a member of a family.
    scene_sha256 : str
        Digest of the scene model, see `scene_digest`.
    identity : str
        Digest of all that decides what is rendered but seed and samples: scene, sensor, film, method, `tracer`. Only
        references with the same one can be merged.
    tracer : int
        Version of the tracer's images.
    share, relative_error : float
        This part of the pixels with light has a standard error of at most so much of their mean; without a number
        where that is not known.
    image_sha256 : str
        Digest of the image file that belongs to this.
    """

    format: Literal["render-oracle-reference"] = "render-oracle-reference"
    version: Literal[1] = 1
    scene: _Text
    member: Annotated[int, Field(strict=True, ge=0)] | None = None
    scene_sha256: Annotated[str, Field(pattern=_SHA256)]
    identity: Annotated[str, Field(pattern=_SHA256)]
    tracer: Annotated[int, Field(strict=True, ge=1)]
    width: Annotated[int, Field(strict=True, ge=1, le=16384)]
    height: Annotated[int, Field(strict=True, ge=1, le=16384)]
    strategy: Literal["light", "bsdf", "hemisphere", "mis"]
    sampler: Literal["sobol", "independent"]
    bounces: Annotated[int, Field(strict=True, ge=0)] | None
    spp: _Total
    samples: Annotated[tuple[Samples, ...], Field(min_length=1)]
    share: Annotated[float, Field(gt=0, le=1)]
    relative_error: _Measured | None
    runs: Annotated[tuple[Run, ...], Field(min_length=1)]
    image_sha256: Annotated[str, Field(pattern=_SHA256)] | None = None

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        for name, total in (
            ("samples", sum(one.count for one in self.samples)),
            ("runs", sum(run.spp for run in self.runs)),
        ):
            if total != self.spp:
                raise ValueError(f"{name} has {total} samples per pixel where spp is {self.spp}")
        return self

    @property
    def seconds(self) -> float:
        """How long all runs took together."""
        return sum(run.seconds for run in self.runs)


def scene_digest(scene: model.Scene) -> str:
    """A digest of a scene, the same for the same model, whatever file it came from."""

    def short(texels: NDArray[np.float64]) -> list[Any]:
        return [*texels.shape, hashlib.sha256(np.ascontiguousarray(texels).data).hexdigest()]

    # pydantic leaves texels as they are, and would warn of that; as lists, large textures would need gigabytes.
    data = scene.model_dump(warnings=False)
    return hashlib.sha256(json.dumps(data, default=short).encode()).hexdigest()


def joined(runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """Runs of which those that differ in samples and time alone are one."""
    found: dict[tuple[str, str, int], Run] = {}
    for run in runs:
        key = run.revision, run.embree, run.threads
        if key in found:
            sums = {"spp": found[key].spp + run.spp, "seconds": found[key].seconds + run.seconds}
            found[key] = run.model_copy(update=sums)
        else:
            found[key] = run
    return tuple(found.values())


# -------------------------------------------------------------------------------------------------- reading


def is_reference(folder: Path) -> bool:
    """Whether a folder holds a reference, finished or not."""
    return (folder / STATE).exists() or (folder / ABOUT).exists()


def read_about(folder: Path) -> About:
    """Read what a reference is.

    Raises
    ------
    InvalidFile
        If it cannot be read, or the image is not the one it tells of.
    """
    about = load_json(folder / ABOUT, About)
    path = folder / IMAGE
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InvalidFile(f"{path}: {error.strerror or error}") from None
    if digest != about.image_sha256:
        raise InvalidFile(
            f"{path}: is not the image that {ABOUT} tells of (/image_sha256); delete both and render again"
        )
    return about


def read_state(folder: Path) -> tuple[About, Rendering]:
    """Read the exact sums of a reference, and what it is.

    Raises
    ------
    InvalidFile
        If they are missing or broken.
    """
    from oracle.tracer.rendering import Method, Range, Rendering

    path = folder / STATE
    try:
        with zipfile.ZipFile(path) as archive:
            about = validate(json.loads(_member(archive, _ABOUT_IN_STATE, _MOST_TEXT)), About, f"{path}: {STATE}")
            pixels = about.height, about.width
            replicates = Method(sampler=about.sampler).replicates
            sums = _array(archive, "sums", (*pixels, replicates, 3, 2), np.uint64)
            squares = _array(archive, "squares", (*pixels, 3, 2), np.uint64)
            exponent = _array(archive, "exponent", (), np.int64)
    except (FileNotFoundError, NotADirectoryError):
        raise InvalidFile(f"{path}: no such file; {folder} holds nothing to go on from") from None
    except InvalidFile:
        raise
    # All that the readers of ZIP archives, arrays and JSON say of a broken file.
    except (
        *(OSError, ValueError, EOFError, KeyError, RuntimeError, NotImplementedError, RecursionError, MemoryError),
        *(zipfile.BadZipFile, zlib.error),
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InvalidFile(f"{path}: is broken: {reason}; delete it and render again") from None
    ranges = tuple(Range(one.seed, one.first, one.count) for one in about.samples)
    return about, Rendering(sums, squares, ranges, int(exponent), about.identity)


def _member(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    if archive.getinfo(name).file_size > most:
        raise ValueError(f"{name} has {archive.getinfo(name).file_size} bytes, {most} are the most")
    return archive.read(name)


def _array(archive: zipfile.ZipFile, name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """One array; nothing is reserved for it unless as much is there."""
    size = archive.getinfo(f"{name}.npy").file_size
    length = int(np.prod(shape)) * np.dtype(dtype).itemsize
    if not length < size <= length + _MOST_HEADER:
        raise ValueError(f"{name} has {size} bytes where its shape needs {length} and a header")
    with archive.open(f"{name}.npy") as file:
        array: NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
        # Its checksum is compared only at its end.
        rest = file.read()
    if array.shape != shape or array.dtype != dtype or rest:
        raise ValueError(f"{name} is {array.dtype} of shape {array.shape}, it must be {np.dtype(dtype)} of {shape}")
    return array


# -------------------------------------------------------------------------------------------------- writing


@contextlib.contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """Keep all other runs from writing into a folder meanwhile; the lock ends with this process, however it ends.

    Raises
    ------
    InvalidFile
        If another run writes there.
    OSError
        If a lock is not possible there.
    """
    path = folder / _LOCK
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # The one before may have removed the file between its opening and its locking here.
            mine = path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat())
        except BlockingIOError:
            mine = False
        if not mine:
            raise InvalidFile(f"{folder}: another run writes there now; wait for its end, or choose another folder")
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


def write_reference(folder: Path, about: About, rendering: Rendering) -> About:
    """Write a reference; the files that were there stay until all new ones are complete. Needs `sole_writer`.

    Returns
    -------
    About
        As written: with the image's digest.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    mean, variance = rendering.mean, rendering.variance
    channels = {name: mean[..., index] for index, name in enumerate("RGB")}
    channels |= {f"variance.{name}": variance[..., index] for index, name in enumerate("RGB")}
    channels["samples"] = np.full(mean.shape[:2], float(rendering.spp))
    with _unfinished(folder) as new:
        _write_exr(new / IMAGE, channels, about)
        about = about.model_copy(update={"image_sha256": hashlib.sha256((new / IMAGE).read_bytes()).hexdigest()})
        _write_state(new / STATE, about, rendering)
        (new / ABOUT).write_text(about.model_dump_json(indent=1) + "\n", encoding="utf-8")
        # Whoever is stopped between these can go on from the first, and sees at the last whether it fits the second.
        _move(new, folder, (STATE, IMAGE, ABOUT))
    return about


def write_aovs(folder: Path, about: About, channels: Mapping[str, NDArray[np.floating[Any]]]) -> None:
    """Write further images of shape (H, W) by name, as `write_reference` does."""
    with _unfinished(folder) as new:
        _write_exr(new / AOVS, channels, about)
        _move(new, folder, (AOVS,))


@contextlib.contextmanager
def _unfinished(folder: Path) -> Iterator[Path]:
    """A folder for files that are not finished, on the same disk, empty before and gone afterwards."""
    new = folder / _UNFINISHED
    shutil.rmtree(new, ignore_errors=True)
    new.mkdir()
    try:
        yield new
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _move(new: Path, folder: Path, names: tuple[str, ...]) -> None:
    for name in names:
        # Some disks are full only when the content really goes there.
        with (new / name).open("rb+") as file:
            os.fsync(file.fileno())
    for name in names:
        (new / name).replace(folder / name)


def _write_state(path: Path, about: About, rendering: Rendering) -> None:
    arrays = {"sums": rendering.sums, "squares": rendering.squares, "exponent": np.int64(rendering.exponent)}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(zipfile.ZipInfo(_ABOUT_IN_STATE), about.model_dump_json())
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


def _write_exr(path: Path, channels: Mapping[str, NDArray[np.floating[Any]]], about: About) -> None:
    """A 32-bit OpenEXR file, always the same bytes for the same samples."""
    with np.errstate(over="ignore"):
        image = np.stack([channel.astype(np.float32) for channel in channels.values()], axis=-1)
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], oiio.FLOAT)
    spec.channelnames = tuple(channels)
    spec["compression"] = "zip"
    # Otherwise the time of writing.
    spec["DateTime"] = "1970:01:01 00:00:00"
    for name, value in _attributes(about).items():
        spec[f"oracle:{name}"] = value
    writer = oiio.ImageOutput.create(str(path))
    if (
        writer is None
        or not writer.open(str(path), spec)
        or not writer.write_image(np.ascontiguousarray(image))
        or not writer.close()
    ):
        reason = (writer.geterror() if writer else oiio.geterror()) or "unknown error"
        raise OSError(f"{path.name} cannot be written: {' '.join(reason.split())}")


def _attributes(about: About) -> dict[str, str | int | float]:
    """What the header of an image says: all but times, so that the same samples give the same file."""
    data = about.model_dump(mode="json", exclude={"runs", "image_sha256", "samples"})
    data["samples"] = ", ".join(f"seed {one.seed}: {one.first}+{one.count}" for one in about.samples)
    data["revision"] = ", ".join(sorted({run.revision for run in about.runs}))
    data["embree"] = ", ".join(sorted({run.embree for run in about.runs}))
    return {
        # Counts above 2**31 - 1 are no integers of OpenEXR.
        name: value if isinstance(value, str | float) or -(1 << 31) <= value < 1 << 31 else str(value)
        for name, value in data.items()
        if value is not None
    }
