"""Reading a submission's images: exactly the announced format and size, finite, not negative."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from oracle.arrays import Floats

_MAGIC = {
    "exr": (b"\x76\x2f\x31\x01",),
    "pfm": (b"PF\n", b"PF\r", b"PF "),
    "hdr": (b"#?RADIANCE", b"#?RGBE"),
    "png": (b"\x89PNG\r\n\x1a\n",),
}
_NAMES = {"exr": "OpenEXR", "pfm": "colour PFM", "hdr": "Radiance HDR", "png": "PNG"}
# An uncompressed image with a few extra channels stays below this many bytes per pixel.
_BYTES_PER_PIXEL = 256
_HEADER_BYTES = 1 << 20
# Rounding, not light: values this far below 0, relative to the largest, are read as 0.
_NEGATIVE_ROUNDING = 1e-6


class BadImage(ValueError):
    """An image that cannot be judged; the message is one line."""


def read_image(path: Path, output: str, width: int, height: int) -> Floats:
    """Read a linear RGB image.

    Parameters
    ----------
    path : Path
        The file.
    output : {"exr", "pfm", "hdr", "png"}
        What it must be; png is decoded from sRGB.
    width, height : int
        The size it must have [pixels].

    Returns
    -------
    ndarray
        Radiance, shape (height, width, 3), top row first.

    Raises
    ------
    BadImage
        If it is missing, something else, broken, of another size, or holds NaN, infinite or negative pixels.
    """
    name = path.name
    _check_file(path, output, width * height)
    # PFM files start with the bottom row, which OpenImageIO turns only if asked. No other reader may have a try.
    config = oiio.ImageSpec()
    config["pnm:pfmflip"] = 1
    oiio.attribute("try_all_readers", 0)
    try:
        reader = oiio.ImageInput.open(str(path), config)
    except UnicodeDecodeError:
        reader = None
    if reader is None:
        raise BadImage(f"{name}: broken {_NAMES[output]} file: {_reason(oiio.geterror())}")
    try:
        spec = reader.spec()
        channels = _check_header(name, reader, width, height)
        pixels = reader.read_image(0, 0, 0, spec.nchannels, "float")
        if pixels is None:
            raise BadImage(f"{name}: broken or truncated {_NAMES[output]} file: {_reason(reader.geterror())}")
    except UnicodeDecodeError:
        raise BadImage(f"{name}: broken {_NAMES[output]} file: its header is not text") from None
    finally:
        reader.close()
    image = np.asarray(pixels, dtype=np.float64).reshape(height, width, -1)[..., channels]
    _check_pixels(name, image)
    return srgb_to_linear(image) if output == "png" else np.maximum(image, 0.0)


def _check_file(path: Path, output: str, pixels: int) -> None:
    name = path.name
    try:
        if not path.is_file() or path.is_symlink():
            raise BadImage(f"{name}: {'not a regular file' if path.exists() else 'no such file'}")
        size = path.stat().st_size
        if size > _HEADER_BYTES + _BYTES_PER_PIXEL * pixels:
            raise BadImage(f"{name}: {size} bytes are too many for {pixels} pixels")
        with path.open("rb") as file:
            start = file.read(10)
    except OSError as error:
        raise BadImage(f"{name}: cannot be read: {error.strerror}") from None
    if not start:
        raise BadImage(f"{name}: is empty")
    if not start.startswith(_MAGIC[output]):
        actual = next((_NAMES[kind] for kind, magic in _MAGIC.items() if start.startswith(magic)), None)
        what = f"is a {actual} file" if actual else f"starts with {start[:8]!r}"
        raise BadImage(f"{name}: {what}, not {_NAMES[output]} as the submission declares")


def _check_header(name: str, reader: oiio.ImageInput, width: int, height: int) -> list[int]:
    """Make sure that the header announces what is expected; return the indices of red, green and blue."""
    spec = reader.spec()
    if (spec.width, spec.height) != (width, height):
        raise BadImage(f"{name}: is {spec.width} x {spec.height} pixels, the scene's film has {width} x {height}")
    if spec.deep or spec.depth > 1:
        raise BadImage(f"{name}: deep and volumetric images are not accepted")
    window = (spec.x, spec.y, spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if window != (0, 0, 0, 0, width, height):
        raise BadImage(f"{name}: data window and display window differ; write the whole film from (0, 0)")
    names = [channel.upper() for channel in spec.channelnames]
    if reader.seek_subimage(1, 0):
        raise BadImage(f"{name}: has several parts; write one RGB image")
    reader.seek_subimage(0, 0)
    if not {"R", "G", "B"} <= set(names):
        raise BadImage(f"{name}: has the channels {', '.join(spec.channelnames)}; R, G and B are needed")
    return [names.index(channel) for channel in "RGB"]


def _check_pixels(name: str, image: Floats) -> None:
    nan, infinite = np.isnan(image).any(axis=2), np.isinf(image).any(axis=2)
    if nan.any() or infinite.any():
        y, x = (int(i) for i in np.argwhere(nan | infinite)[0])
        counts = " and ".join(
            f"{int(mask.sum())} {what}" for mask, what in ((nan, "NaN"), (infinite, "infinite")) if mask.any()
        )
        raise BadImage(f"{name}: {counts} of {nan.size} pixels, first at x = {x}, y = {y}")
    largest = float(np.abs(image).max())
    negative = (image < -_NEGATIVE_ROUNDING * largest).any(axis=2)
    if negative.any():
        y, x = (int(i) for i in np.argwhere(negative)[0])
        value = float(image[y, x].min())
        raise BadImage(
            f"{name}: {int(negative.sum())} of {negative.size} pixels are negative, first at x = {x}, y = {y} ({value:g});"
            " radiance is at least 0"
        )


def srgb_to_linear(encoded: Floats) -> Floats:
    """Decode sRGB values in [0, 1] [IEC 61966-2-1]."""
    result: Floats = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return result


def srgb_quantisation(linear: Floats) -> Floats:
    """Half of the step between neighbouring 8-bit sRGB values, in linear units, at linear values in [0, 1]."""
    slope = np.where(linear <= 0.0031308, 12.92, 1.055 / 2.4 * np.maximum(linear, 0.0031308) ** (1 / 2.4 - 1))
    result: Floats = 0.5 / 255 / slope
    return result


def _reason(message: str) -> str:
    """An error of OpenImageIO on one line, without the file's path."""
    first = message.strip().splitlines()[0] if message.strip() else "unknown error"
    return first[:200]
