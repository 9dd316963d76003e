"""The regions that are judged: the whole image and overlapping tiles at several scales, in blocks of pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, Integers

# In blocks; tiles overlap by half.
_TILE_SIDES = (16, 8, 4, 2, 1)


@dataclass(frozen=True, eq=False)
class Scale:
    """Boxes of one size: their corners ``x0 <= x < x1``, ``y0 <= y < y1`` in blocks, shape (boxes,) each."""

    is_whole: bool
    x0: Integers
    x1: Integers
    y0: Integers
    y1: Integers

    @property
    def count(self) -> int:
        """How many boxes there are."""
        return len(self.x0)

    def sums(self, table: Floats) -> Floats:
        """Sums over every box, shape (..., boxes), from a `summed_area_table`."""
        result: Floats = (
            table[..., self.y1, self.x1]
            - table[..., self.y0, self.x1]
            - table[..., self.y1, self.x0]
            + table[..., self.y0, self.x0]
        )
        return result


def summed_area_table(blocks: Floats) -> Floats:
    """Sums of blocks (..., height, width) above and to the left of every corner [Crow 1984]."""
    table = np.zeros((*blocks.shape[:-2], blocks.shape[-2] + 1, blocks.shape[-1] + 1))
    np.cumsum(np.cumsum(blocks, axis=-1), axis=-2, out=table[..., 1:, 1:])
    return table


def scales(height: int, width: int) -> tuple[Scale, ...]:
    """The whole image of so many blocks, and tiles from the largest smaller than the image down to single blocks."""
    whole = Scale(True, np.array([0]), np.array([width]), np.array([0]), np.array([height]))
    tiles = [_tiles(height, width, side) for side in _TILE_SIDES if side < max(height, width)]
    return (whole, *tiles)


def _tiles(height: int, width: int, side: int) -> Scale:
    """Tiles of one side; those at the border are shifted inwards rather than cut."""

    def starts(extent: int) -> Integers:
        last = max(extent - side, 0)
        return np.unique(np.append(np.arange(0, last, max(side // 2, 1)), last))

    x0, y0 = (axis.ravel() for axis in np.meshgrid(starts(width), starts(height)))
    return Scale(False, x0, np.minimum(x0 + side, width), y0, np.minimum(y0 + side, height))
