"""The regions that are judged: the whole image, overlapping tiles at several scales, single pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, Integers

_TILE_SIDES = (64, 32, 16, 8)


@dataclass(frozen=True, eq=False)
class Scale:
    """Boxes of one size: their corners ``x0 <= x < x1``, ``y0 <= y < y1``, shape (boxes,) each."""

    name: str
    x0: Integers
    x1: Integers
    y0: Integers
    y1: Integers

    @property
    def count(self) -> int:
        """How many boxes there are."""
        return len(self.x0)

    def sums(self, images: Floats) -> Floats:
        """Sums of images (..., height, width) over every box, shape (..., boxes)."""
        table = np.zeros((*images.shape[:-2], images.shape[-2] + 1, images.shape[-1] + 1))
        np.cumsum(np.cumsum(images, axis=-1), axis=-2, out=table[..., 1:, 1:])
        result: Floats = (
            table[..., self.y1, self.x1]
            - table[..., self.y0, self.x1]
            - table[..., self.y1, self.x0]
            + table[..., self.y0, self.x0]
        )
        return result


def scales(height: int, width: int) -> tuple[Scale, ...]:
    """The whole image and tiles that overlap by half, from the largest smaller than the image down to 8 pixels."""
    whole = Scale("image", np.array([0]), np.array([width]), np.array([0]), np.array([height]))
    tiles = [_tiles(height, width, side) for side in _TILE_SIDES if side < max(height, width)]
    return (whole, *tiles)


def _tiles(height: int, width: int, side: int) -> Scale:
    """Tiles of one side; those at the border are shifted inwards rather than cut."""

    def starts(extent: int) -> Integers:
        last = max(extent - side, 0)
        return np.unique(np.append(np.arange(0, last, side // 2), last))

    x0, y0 = (axis.ravel() for axis in np.meshgrid(starts(width), starts(height)))
    return Scale(f"{side}-pixel tiles", x0, np.minimum(x0 + side, width), y0, np.minimum(y0 + side, height))


def single_pixels(height: int, width: int) -> Scale:
    """Every pixel as its own box, row by row."""
    y0, x0 = (axis.ravel() for axis in np.mgrid[:height, :width])
    return Scale("pixels", x0, x0 + 1, y0, y0 + 1)
