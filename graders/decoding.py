"""Reading a submission's images: exactly the announced format and size, finite, not negative."""

from __future__ import annotations

import errno
import os
import stat
import struct
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from graders.processes import one_line
from oracle.arrays import Floats

_MAGIC = {
    "exr": (b"\x76\x2f\x31\x01",),
    "pfm": (b"PF\n", b"PF\r", b"PF "),
    "hdr": (b"#?RADIANCE", b"#?RGBE"),
    "png": (b"\x89PNG\r\n\x1a\n",),
}
_NAMES = {"exr": "OpenEXR", "pfm": "colour PFM", "hdr": "Radiance HDR", "png": "PNG", "gray": "gray PFM"}
# An uncompressed image with a few extra channels stays below this many bytes per pixel.
_BYTES_PER_PIXEL = 256
_HEADER_BYTES = 1 << 20
# Header fields that say that pixels are something else than radiance, top row first, and their value if they are not.
_PLAIN = {"Orientation": 1, "hdr:exposure": 1.0, "oiio:Gamma": 1.0}
# Rounding, not light: values this far below 0, relative to the largest, are read as 0.
_NEGATIVE_ROUNDING = 1e-6


class BadImage(ValueError):
    """An image that cannot be judged; the message is one line, whatever the file's name and content are."""

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


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
    content = _content(path, output, width * height)
    if output == "png":
        content = _plain_png(name, content, width, height)
    # What is decoded is a copy that no submission can change any more, under a name that every library can open.
    with tempfile.NamedTemporaryFile(prefix="oracle-", suffix=f".{output}") as copy:
        copy.write(content)
        copy.flush()
        image = _decoded(name, copy.name, output, width, height)
    _check_pixels(name, image)
    return srgb_to_linear(image) if output == "png" else np.maximum(image, 0.0)


def _content(path: Path, output: str, pixels: int) -> bytes:
    """All bytes of a regular file of the right kind and of sensible size."""
    name = path.name
    most = _HEADER_BYTES + _BYTES_PER_PIXEL * pixels
    try:
        # Neither another file in its place nor a pipe without a writer can fool or stop this.
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise BadImage(f"{name}: not a regular file")
            if status.st_size > most:
                raise BadImage(f"{name}: {status.st_size} bytes are too many for {pixels} pixels")
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                content = file.read(most)
        finally:
            os.close(descriptor)
    except FileNotFoundError:
        raise BadImage(f"{name}: no such file") from None
    except OSError as error:
        is_link = error.errno == errno.ELOOP
        reason = "is a symbolic link, not a regular file" if is_link else f"cannot be read: {error.strerror}"
        raise BadImage(f"{name}: {reason}") from None
    if not content:
        raise BadImage(f"{name}: is empty")
    if not content.startswith(_MAGIC[output]):
        magics = _MAGIC | {"gray": (b"Pf\n", b"Pf\r", b"Pf ")}
        actual = next((_NAMES[kind] for kind, magic in magics.items() if content.startswith(magic)), None)
        what = f"is a {actual} file" if actual else f"starts with {content[:8]!r}"
        raise BadImage(f"{name}: {what}, not {_NAMES[output]} as the submission declares")
    return content


def _plain_png(name: str, content: bytes, width: int, height: int) -> bytes:
    """The image of a PNG file without all else in it, checked so that libpng has nothing to say.

    libpng writes its complaints to standard error, in the middle of whatever is shown there, and lets other chunks
    change what the pixels mean.
    """
    chunks: dict[bytes, list[bytes]] = {}
    position = 8
    while b"IEND" not in chunks:
        length, kind = struct.unpack_from(">I4s", content.ljust(position + 8, b"\0"), position)
        body = content[position + 8 : position + 8 + length]
        position += 12 + length
        if position > len(content) or content[position - 4 : position] != zlib.crc32(kind + body).to_bytes(4):
            raise BadImage(f"{name}: broken or truncated PNG file")
        chunks.setdefault(kind, []).append(body)

    header, data = chunks.get(b"IHDR", [b""])[0], b"".join(chunks.get(b"IDAT", []))
    if len(header) != 13:
        raise BadImage(f"{name}: broken PNG file: no header")
    columns, rows, bits, colour, *rest = struct.unpack(">IIBBBBB", header)
    if (columns, rows) != (width, height):
        raise BadImage(_wrong_size(name, columns, rows, width, height))
    if bits not in (8, 16) or colour not in (2, 6) or rest != [0, 0, 0]:
        raise BadImage(f"{name}: is no plain PNG; write RGB or RGBA with 8 or 16 bits, not interlaced")
    stride = 1 + width * (3 if colour == 2 else 4) * bits // 8
    try:
        inflate = zlib.decompressobj()
        scanlines = inflate.decompress(data, height * stride + 1)
    except zlib.error:
        scanlines = b""
    if len(scanlines) != height * stride or not inflate.eof or max(scanlines[::stride]) > 4:
        raise BadImage(f"{name}: broken PNG file: its pixels cannot be unpacked")

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    return content[:8] + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def _decoded(name: str, file: str, output: str, width: int, height: int) -> Floats:
    """The file's pixels as they are stored, red, green and blue."""
    config = oiio.ImageSpec()
    # PFM files start with the bottom row, which OpenImageIO turns only if asked. Alpha must not darken colours, and
    # no other reader may have a try.
    config["pnm:pfmflip"] = 1
    config["oiio:UnassociatedAlpha"] = 1
    oiio.attribute("try_all_readers", 0)
    reader = oiio.ImageInput.open(file, config)
    if reader is None:
        raise BadImage(f"{name}: broken {_NAMES[output]} file: {_reason(oiio.geterror, file)}")
    try:
        spec = reader.spec()
        channels = _check_header(name, reader, width, height)
        # Integers are read as such and divided in double precision.
        pixels = reader.read_image(0, 0, 0, spec.nchannels, "uint16" if output == "png" else "float")
        if pixels is None:
            raise BadImage(f"{name}: broken or truncated {_NAMES[output]} file: {_reason(reader.geterror, file)}")
    except UnicodeDecodeError:
        raise BadImage(f"{name}: broken {_NAMES[output]} file: its header is not text") from None
    finally:
        reader.close()
    # A signalling NaN is no reason to warn: all of them are found later.
    with np.errstate(invalid="ignore"):
        image = np.asarray(pixels).reshape(height, width, -1)[..., channels].astype(np.float64)
    return image / 65535 if output == "png" else image


def _check_header(name: str, reader: oiio.ImageInput, width: int, height: int) -> list[int]:
    """Make sure that the header announces what is expected; return the indices of red, green and blue."""
    spec = reader.spec()
    if (spec.width, spec.height) != (width, height):
        raise BadImage(_wrong_size(name, spec.width, spec.height, width, height))
    if spec.deep or spec.depth > 1:
        raise BadImage(f"{name}: deep and volumetric images are not accepted")
    window = (spec.x, spec.y, spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if window != (0, 0, 0, 0, width, height):
        raise BadImage(f"{name}: data window and display window differ; write the whole film from (0, 0)")
    for attribute, plain in _PLAIN.items():
        value = spec.getattribute(attribute)
        if value is not None and value != plain:
            raise BadImage(f"{name}: {attribute.rpartition(':')[2].lower()} is {value}; write it with {plain}")
    names = [channel.upper() for channel in spec.channelnames]
    if reader.seek_subimage(1, 0):
        raise BadImage(f"{name}: has several parts; write one RGB image")
    reader.seek_subimage(0, 0)
    if not {"R", "G", "B"} <= set(names):
        raise BadImage(f"{name}: has the channels {', '.join(spec.channelnames)[:200]}; R, G and B are needed")
    colours = [names.index(channel) for channel in "RGB"]
    formats = spec.channelformats or (spec.format,) * len(names)
    if any(formats[i].basetype == oiio.UINT32 for i in colours):
        raise BadImage(f"{name}: R, G and B are whole numbers; write half or float")
    return colours


def _wrong_size(name: str, columns: int, rows: int, width: int, height: int) -> str:
    return f"{name}: is {columns} x {rows} pixels, the scene's film has {width} x {height}"


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
            f"{name}: {int(negative.sum())} of {negative.size} pixels are negative, first at x = {x}, y = {y}"
            f" ({value:g}); radiance is at least 0"
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


def rgbe_quantisation(linear: Floats) -> Floats:
    """The step between neighbouring Radiance HDR values, (height, width, 3): the brightest channel's, at its largest.

    Three mantissas of 8 bits share an exponent [Ward 1991, Real pixels], and most writers cut off what does not fit.
    """
    result: Floats = np.broadcast_to(linear.max(axis=2, keepdims=True) / 128, linear.shape)
    return result


def _reason(geterror: Callable[[], str], file: str) -> str:
    """The first line of an error of OpenImageIO, without the file's path."""
    try:
        message = geterror().replace(file, "file").strip()
    except UnicodeDecodeError:
        message = "its header is not text"
    return message.splitlines()[0][:200] if message else "unknown error"
