"""Images beside scenes: textures read and written through OpenImageIO."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from oracle.arrays import Floats
from reference_scenes.model.textures import MOST_TEXELS

_MAGIC = {".png": b"\x89PNG\r\n\x1a\n", ".exr": b"\x76\x2f\x31\x01"}


class InvalidImage(ValueError):
    """An image that cannot be used; its message is one line and speaks of a file that was named before."""


def read_texels(folder: Path, name: str) -> Floats:
    """Read an image that lies in a folder or below it.

    Parameters
    ----------
    folder : Path
        Nothing outside of it is read, not by links either.
    name : str
        Path relative to it, with slashes; PNG or OpenEXR.

    Returns
    -------
    ndarray
        Linear RGB, shape (H, W, 3), top row first. PNG is decoded from sRGB, OpenEXR is linear; a single channel
        becomes all three.

    Raises
    ------
    InvalidImage
        If it is missing, lies elsewhere, or is no such image.
    """
    path = _inside(folder, name)
    suffix = path.suffix.lower()
    if suffix not in _MAGIC:
        raise InvalidImage("is neither .png nor .exr")
    try:
        with path.open("rb") as file:
            if not file.read(8).startswith(_MAGIC[suffix]):
                raise InvalidImage(f"is no {suffix[1:].upper()} file, whatever its name says")
    except OSError as error:
        raise InvalidImage(f"cannot be read: {error.strerror}") from None
    texels = _decoded(path)
    if isinstance(texels, str):
        raise InvalidImage(texels)
    return _linear(texels) if suffix == ".png" else texels


def _decoded(path: Path) -> Floats | str:
    """The values in a file, shape (H, W, 3), or what is wrong with it.

    No exception is raised here, as it would keep objects of the library alive beyond the library itself.
    """
    image = oiio.ImageInput.open(str(path))
    if image is None:
        return "is broken: " + " ".join(oiio.geterror().split())
    spec = image.spec()
    if spec.width * spec.height > MOST_TEXELS:
        return f"has {spec.width} x {spec.height} texels; {MOST_TEXELS} are the most"
    if spec.nchannels not in (1, 3):
        return f"has {spec.nchannels} channels; save it with three, or with one for grey"
    values = image.read_image(oiio.FLOAT)
    if values is None:
        return "is broken: " + " ".join(image.geterror().split())
    if not np.isfinite(values).all():
        return "holds NaN or infinite values"
    return np.broadcast_to(values.astype(np.float64), (spec.height, spec.width, 3))


def write_exr(path: Path, texels: Floats) -> None:
    """Write linear RGB, shape (H, W, 3), top row first, as float32."""
    spec = oiio.ImageSpec(texels.shape[1], texels.shape[0], 3, oiio.FLOAT)
    output = oiio.ImageOutput.create(str(path))
    if output is None or not output.open(str(path), spec) or not output.write_image(texels.astype(np.float32)):
        raise OSError(f"cannot write {path}: {oiio.geterror() if output is None else output.geterror()}")
    output.close()


def _inside(folder: Path, name: str) -> Path:
    try:
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise InvalidImage("lies outside of the scene's folder; copy it there")
        if path.is_file():
            return path
    except (OSError, RuntimeError):
        # Too long a name, or links that go round in a circle.
        pass
    raise InvalidImage("is no file in the scene's folder")


def _linear(encoded: Floats) -> Floats:
    """Decode sRGB [IEC 61966-2-1]."""
    decoded: Floats = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return decoded
