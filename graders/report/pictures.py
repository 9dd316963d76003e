"""Pictures for people: linear radiance for a display, relative differences in false colour, both as PNG."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from graders.errors import InfrastructureError
from oracle.arrays import Floats

# White is at most this many times the median of the lit pixels, so that an emitter in view leaves its scene visible.
_WHITE_OVER_MEDIAN = 8.0
# Light below this fraction of the image's mean counts as none, as for the judge.
_BLACK_LEVEL = 1e-3
_LIMITS = (0.01, 0.05, 0.25, 1.0)
# Fewer pixels than this may lie beyond the limit of the false colour.
_BEYOND_LIMIT = 0.05
# Darker to equal to brighter: the scale RdBu of ColorBrewer [Brewer 2003], colour-blind safe, its middle made white.
_COLOURS = np.array(
    [
        (0x21, 0x66, 0xAC), (0x43, 0x93, 0xC3), (0x92, 0xC5, 0xDE), (0xD1, 0xE5, 0xF0), (0xFF, 0xFF, 0xFF),
        (0xFD, 0xDB, 0xC7), (0xF4, 0xA5, 0x82), (0xD6, 0x60, 0x4D), (0xB2, 0x18, 0x2B),
    ],
    dtype=np.float64,
)  # fmt: skip
_LEGEND_WIDTH = 129


def read(path: Path) -> Floats:
    """Read an image of a result.

    Parameters
    ----------
    path : Path
        An EXR file with the channels R, G and B.

    Returns
    -------
    ndarray
        Its pixels, shape (height, width, 3), made finite.

    Raises
    ------
    InfrastructureError
        If it cannot be read: the result that names it was moved or is incomplete.
    """
    reader = oiio.ImageInput.open(str(path))
    if reader is None:
        raise InfrastructureError(f"{path}: image of the result cannot be read: {oiio.geterror().strip()}")
    try:
        pixels = reader.read_image("float")
    finally:
        reader.close()
    if pixels is None or pixels.ndim != 3 or pixels.shape[2] < 3:
        raise InfrastructureError(f"{path}: image of the result is broken or not RGB")
    # Written as half floats, the brightest light overflows.
    finite: Floats = np.nan_to_num(pixels[..., :3]).astype(np.float64)
    return finite


def white_level(expected: Floats) -> float:
    """The radiance to be shown as white, for the expected and the observed image alike.

    Parameters
    ----------
    expected : ndarray
        Radiance, shape (height, width, 3).

    Returns
    -------
    float
        The largest expected value or 8 times the median of the lit pixels, whichever is less, rounded up to two
        digits; 1 for a black image.
    """
    brightest = expected.max(axis=2)
    lit = brightest[brightest > _BLACK_LEVEL * brightest.mean()]
    if not lit.size:
        return 1.0
    level = min(float(lit.max()), _WHITE_OVER_MEDIAN * float(np.median(lit)))
    step = 10.0 ** (np.floor(np.log10(level)) - 1)
    # Without the small term 0.3 / 0.01 would be rounded up to 31 hundredths.
    return float(f"{np.ceil(level / step - 1e-6) * step:.2g}")


def display(radiance: Floats, white: float) -> bytes:
    """Radiance as a picture for an sRGB display [IEC 61966-2-1].

    Parameters
    ----------
    radiance : ndarray
        Shape (height, width, 3).
    white : float
        The radiance shown as 1; all above is cut off.

    Returns
    -------
    bytes
        PNG.
    """
    linear = np.clip(radiance / white, 0.0, 1.0)
    return _png(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))


def relative_difference(expected: Floats, observed: Floats) -> Floats:
    """The signed difference (observed - expected) / expected.

    Parameters
    ----------
    expected, observed : ndarray
        Light of the same shape, (height, width).

    Returns
    -------
    ndarray
        Same shape. Where less than a thousandth of the image's mean is expected, that takes the place of the
        divisor, so that rounding in the dark is not shown as a difference.
    """
    level = max(_BLACK_LEVEL * float(expected.mean()), float(np.finfo(np.float32).tiny))
    result: Floats = (observed - expected) / np.maximum(expected, level)
    return result


def colour_limit(difference: Floats) -> float:
    """The relative difference at which false colour ends: the least of 1, 5, 25 and 100 % that few pixels exceed."""
    bulk = float(np.quantile(np.abs(difference), 1 - _BEYOND_LIMIT))
    return next((candidate for candidate in _LIMITS if bulk <= candidate), _LIMITS[-1])


def false_colour(difference: Floats, limit: float) -> bytes:
    """Signed differences as colours: blue is darker, white is equal, red is brighter.

    Parameters
    ----------
    difference : ndarray
        Shape (height, width).
    limit : float
        Differences from here on have the last colour.

    Returns
    -------
    bytes
        PNG.
    """
    position = np.clip(difference / limit, -1.0, 1.0)
    stops = np.linspace(-1, 1, len(_COLOURS))
    return _png(np.stack([np.interp(position, stops, _COLOURS[:, c]) for c in range(3)], axis=-1))


def legend() -> bytes:
    """The colours of `false_colour` from minus to plus its limit, as a PNG of one row."""
    return false_colour(np.linspace(-1.0, 1.0, _LEGEND_WIDTH)[None, :], 1.0)


def _png(values: Floats) -> bytes:
    """Encode values in [0, 255], shape (height, width, 3)."""
    height, width, channels = values.shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    spec["oiio:ColorSpace"] = "sRGB"
    spec["png:compressionLevel"] = 9
    # OpenImageIO's Python binding writes to files only.
    with tempfile.TemporaryDirectory(prefix="oracle-picture-") as folder:
        path = Path(folder) / "picture.png"
        writer = oiio.ImageOutput.create(str(path))
        if writer is None or not writer.open(str(path), spec):
            raise InfrastructureError(f"no PNG can be written: {oiio.geterror().strip()}")
        written = writer.write_image(np.floor(values + 0.5).astype(np.uint8))
        if not (writer.close() and written):
            raise InfrastructureError(f"no PNG can be written: {writer.geterror().strip()}")
        return path.read_bytes()
