"""Blocks of pixels far enough apart to be independent although neighbouring pixels are not.

A reconstruction filter makes pixels share samples. The sums over blocks that are separated by more than the filter's
support are independent again, and stay at least 0: they are the pixels of a coarse image. Several sizes of blocks and
places of the grid give several e-values, each as valid as the other, and so is their mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats
from oracle.expectation import Expectation
from oracle.statistics.independence import independent

# Supports of filters that are tried: pixels this far apart are independent.
_DISTANCES = (2, 4, 6, 8, 12, 16, 24)
_SIDES = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class Grid:
    """Square blocks of `side` pixels, one every `stride` pixels from `top` and `left` on."""

    side: int
    stride: int
    top: int
    left: int

    def sums(self, image: Floats) -> Floats:
        """Sums of an image (..., height, width) over every block; 0 where the image ends."""
        *rest, height, width = image.shape
        rows, columns = self._count(height, self.top), self._count(width, self.left)
        down, right = self.top + rows * self.stride, self.left + columns * self.stride
        margins = [(0, 0)] * len(rest) + [(0, max(down - height, 0)), (0, max(right - width, 0))]
        cut = np.pad(image, margins)[..., self.top : down, self.left : right]
        blocks = cut.reshape(*rest, rows, self.stride, columns, self.stride)
        result: Floats = blocks[..., : self.side, :, : self.side].sum(axis=(-3, -1))
        return result

    def _count(self, extent: int, start: int) -> int:
        """How many blocks lie within the image as a whole, and at least one."""
        return max((extent - start - self.side) // self.stride + 1, 1)


def grids(images: Floats) -> tuple[Grid, ...]:
    """Grids whose blocks are independent in images (K, height, width), as far as these tell.

    If nothing is far enough apart, the image is one block.
    """
    size = max(images.shape[1:])
    for distance in _DISTANCES:
        if 2 * distance >= size:
            break
        if independent(Grid(1, distance, 0, 0).sums(images)):
            # A correlation too weak to be found may reach further.
            gap = distance + distance // 2 - 1
            sides = [side for side in _SIDES if side == 1 or 2 * (side + gap) <= size]
            return tuple(
                Grid(side, side + gap, top, left)
                for side in sides
                for top, left in ((0, 0), ((side + gap) // 2, (side + gap) // 2))
            )
    return (Grid(size, size, 0, 0),)


def coarse_expectation(expectation: Expectation, grid: Grid) -> Expectation:
    """What the valid pixels of each block of a right image add up to."""
    valid = expectation.valid

    def sums(values: Floats) -> Floats:
        return np.moveaxis(coarse_image(np.moveaxis(values, -1, 0), valid, grid), 0, -1)

    return Expectation(
        radiance=sums(expectation.radiance),
        standard_error=sums(expectation.standard_error),
        error_bound=sums(expectation.error_bound),
        valid=grid.sums(valid.astype(np.float64)) > 0,
        provenance=expectation.provenance,
        largest=None if expectation.largest is None else sums(expectation.largest),
    )


def coarse_image(image: Floats, valid: Booleans, grid: Grid) -> Floats:
    """Sums of the valid pixels of an image (..., height, width)."""
    return grid.sums(np.where(valid, image, 0.0))


def coarse_deviations(mean: Floats, lit: Booleans, deviations: Floats, grid: Grid) -> Floats:
    """Deviations of blocks from those of their pixels."""
    expected = grid.sums(np.where(lit, mean, 0.0))
    wrong = grid.sums(np.where(lit, mean * deviations, 0.0))
    return np.where(expected > 0, wrong / np.where(expected > 0, expected, 1.0), 0.0)
