"""Writing a grading: one folder, every file complete or absent."""

from __future__ import annotations

import contextlib
import secrets
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
        str(folder).encode()
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except UnicodeEncodeError:
        # The libraries that write images and reports want text.
        raise UsageError(f"{folder}: its name is not UTF-8; choose another folder with --out") from None
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
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as file:
            file.write(content)
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def _write_images(folder: Path, judged: Judged) -> None:
    images = judged.result.images
    if images is None or judged.expected is None:
        return
    replace(folder / images.expected, _exr(judged.expected))
    if images.observed is not None and images.difference is not None and judged.observed is not None:
        expected, observed = judged.expected, judged.observed
        least = max(_DARKEST * float(expected.mean()), float(np.finfo(np.float32).tiny))
        replace(folder / images.observed, _exr(observed))
        replace(folder / images.difference, _exr((observed - expected) / np.maximum(expected, least)))


def _exr(image: Floats) -> bytes:
    """Linear RGB (height, width, 3) as a file in 32-bit OpenEXR, always the same bytes for the same image."""
    height, width, channels = image.shape
    spec = oiio.ImageSpec(width, height, channels, "float")
    spec["compression"] = "zip"
    # Otherwise the time of writing.
    spec["DateTime"] = "1970:01:01 00:00:00"
    # OpenImageIO writes only files.
    with tempfile.TemporaryDirectory(prefix="oracle-") as folder:
        path = Path(folder) / "image.exr"
        writer = oiio.ImageOutput.create(str(path))
        if (
            writer is None
            or not writer.open(str(path), spec)
            or not writer.write_image(np.ascontiguousarray(image, dtype=np.float32))
            or not writer.close()
        ):
            reason = (writer.geterror() if writer else oiio.geterror()) or "unknown error"
            raise InfrastructureError(f"{path}: cannot be written: {reason.splitlines()[0]}")
        return path.read_bytes()
