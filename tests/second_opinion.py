"""Renders the scenes without closed forms with Mitsuba; a test compares the tracer with what it wrote.

``make second-opinion`` runs it, ``python tests/second_opinion.py NAME...`` for some scenes only; most of an hour. A
file is made for a scene, a version of Mitsuba and fixed seeds, and says so; a test finds those whose scene has changed.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from reference_scenes.export import export
from reference_scenes.without_closed_form import SCENES

FOLDER = Path(__file__).parent / "mitsuba"
# Independent renderings, from whose spread the standard error is known.
RENDERINGS = 64
# What the mean of each channel over the image is to be known to, so that half a percent is seen beyond doubt.
WANTED = 4e-4
BLOCK = 8


@dataclass(frozen=True)
class Opinion:
    """Mean values of blocks and of the whole image, with their standard errors, from so many renderings."""

    scene: str
    renderer: str
    renderings: int
    spp: int
    blocks: list[list[list[float]]]
    block_errors: list[list[list[float]]]
    mean: list[float]
    error: list[float]


def identity(name: str) -> str:
    """What changes whenever the scene does; by how processors round a sine, it does not."""
    scene = json.loads(SCENES[name]().model_dump_json(), parse_float=lambda digits: float(f"{float(digits):.12g}"))
    return hashlib.sha256(json.dumps(scene).encode()).hexdigest()


def blocks(image):
    """Means over squares of 8 x 8 pixels, shape (..., H/8, W/8, 3); a single pixel is a block."""
    *front, height, width, channels = image.shape
    size = min(BLOCK, height, width)
    split = image.reshape(*front, height // size, size, width // size, size, channels)
    return split.mean(axis=(-4, -2))


def renderings(name, spp, seeds):
    """Images of a scene by Mitsuba, shape (N, H, W, 3)."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    with tempfile.TemporaryDirectory() as folder:
        scene = mitsuba.load_file(str(export(SCENES[name](), "mitsuba3", Path(folder))))
        return np.array([mitsuba.render(scene, spp=spp, seed=seed) for seed in seeds], dtype=np.float64)


def summary(images):
    """Mean over the first axis, and its standard error."""
    return images.mean(axis=0), images.std(axis=0, ddof=1) / np.sqrt(len(images))


def opinion(name: str) -> Opinion:
    """Render a scene until its mean is known well enough."""
    import mitsuba

    # A first look tells how many samples that takes; it is not used otherwise.
    first = 8 if SCENES[name]().film.width > 1 else 4096
    mean, error = summary(renderings(name, first, range(RENDERINGS)).mean(axis=(1, 2)))
    spp = max(16, int(np.ceil(first * (error / mean / WANTED).max() ** 2)))
    images = renderings(name, spp, range(1000, 1000 + RENDERINGS))
    mean, error = summary(images.mean(axis=(1, 2)))
    by_block, block_errors = summary(blocks(images))
    return Opinion(
        identity(name),
        f"Mitsuba {mitsuba.__version__}, scalar_rgb",
        RENDERINGS,
        spp,
        _rounded(by_block),
        _rounded(block_errors),
        _rounded(mean),
        _rounded(error),
    )


def _rounded(array):
    """Numbers with the seven digits that single precision has."""
    return json.loads(json.dumps(np.vectorize(lambda x: float(f"{x:.7g}"))(array).tolist()))


def load(name: str) -> Opinion:
    """What was written of a scene."""
    return Opinion(**json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")))


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for name in sys.argv[1:] or SCENES:
        made = opinion(name)
        text = json.dumps(asdict(made), indent=None, separators=(",", ":"))
        (FOLDER / f"{name}.json").write_text(text.replace("],[[", "],\n[[") + "\n", encoding="utf-8")
        relative = (np.array(made.error) / made.mean).max()
        print(f"{name}: {made.renderings} x {made.spp} samples per pixel, mean known to {relative:.2%}", flush=True)


if __name__ == "__main__":
    main()
