"""Writing a grading: one folder, every file complete or absent."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from graders.errors import InfrastructureError, UsageError
from graders.grading import Judged, with_images
from graders.result import Result
from oracle.arrays import Floats

RESULT, REPORT, JUNIT = "result.json", "report.html", "junit.xml"
# The difference is relative to the expected radiance, or to this fraction of its mean where there is less.
_DARKEST = 1e-3


def require_writable(folder: Path) -> None:
    """Make the folder if needed and be sure that files can be written there, before any work is done.

    Raises
    ------
    UsageError
        If they cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UsageError(f"{folder}: cannot write there: {error.strerror}; choose another folder with --out") from None


def write_grading(folder: Path, result: Result, judged: Sequence[Judged]) -> Result:
    """Write result.json, the images, report.html and junit.xml; return the result as written.

    Raises
    ------
    InfrastructureError
        If the disk does not take it.
    """
    from graders.report.html import write_html
    from graders.report.junit import junit_xml

    named = [with_images(one) for one in judged]
    result = result.model_copy(update={"cases": tuple(one.result for one in named)})
    try:
        (folder / "images").mkdir(parents=True, exist_ok=True)
        for one in named:
            _write_images(folder, one)
        replace(folder / RESULT, (result.model_dump_json(indent=1) + "\n").encode())
        replace(folder / JUNIT, junit_xml(result))
        replace(folder / REPORT, write_html(result, folder).encode())
    except OSError as error:
        raise InfrastructureError(f"{folder}: writing failed: {error.strerror or error}") from error
    return result


def replace(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there, so that nobody ever sees half of it."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        # mkstemp makes private files; results are for everybody whom the folder admits.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def _write_images(folder: Path, judged: Judged) -> None:
    images = judged.result.images
    if images is None or judged.expected is None:
        return
    _write_exr(folder / images.expected, judged.expected)
    if images.observed is not None and images.difference is not None and judged.observed is not None:
        expected, observed = judged.expected, judged.observed
        least = max(_DARKEST * float(expected.mean()), float(np.finfo(np.float32).tiny))
        _write_exr(folder / images.observed, observed)
        _write_exr(folder / images.difference, (observed - expected) / np.maximum(expected, least))


def _write_exr(path: Path, image: Floats) -> None:
    """Write linear RGB (height, width, 3) as 32-bit OpenEXR, always the same bytes for the same image."""
    height, width, channels = image.shape
    temporary = path.with_name(f".{path.name}.{os.getpid()}.exr")
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec["compression"] = "zip"
    writer = oiio.ImageOutput.create(str(temporary))
    try:
        if (
            writer is None
            or not writer.open(str(temporary), spec)
            or not writer.write_image(np.ascontiguousarray(image, dtype=np.float32))
            or not writer.close()
        ):
            reason = (writer.geterror() if writer else oiio.geterror()) or "unknown error"
            raise InfrastructureError(f"{path}: cannot be written: {reason.splitlines()[0]}")
        os.replace(temporary, path)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()
