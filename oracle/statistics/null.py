"""What a right renderer's pixels may average to, prepared for betting.

Images are cut into blocks of 4 x 4 pixels, (..., height, width) to (..., 16, blocks): what is said of a block's pixels
together is then a sum or an extreme along one axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from oracle.arrays import Booleans, Floats
from oracle.expectation import Expectation

SIDE = 4
# Less light than this fraction of the image's mean counts as none.
_BLACK_LEVEL = 1e-3
# Neighbours that differ by this factor have an edge between them.
_EDGE = 1.5
# Standard errors by which a Monte Carlo expectation widens the interval of right values (union over 1e6 pixels).
_EXPECTATION_ERRORS = 7.0


@dataclass(frozen=True, eq=False)
class Null:
    """Right values of every pixel, for "all" channels together and each: (P, 16, blocks) where nothing else is said.

    Attributes
    ----------
    channels : tuple of str
        Names of the P planes.
    grid : tuple of int
        Rows and columns of blocks.
    mean : ndarray
        Radiance; 1 where it is none.
    low, high : ndarray
        Bounds of a right pixel's mean over `mean`; the same for each block, (P, blocks).
    error : ndarray
        What `mean` itself may be wrong by, relative to it, (P, blocks).
    largest : ndarray
        Bound of a single sample over `mean`, (P, blocks); infinite where no contract says anything.
    black_level : ndarray
        Radiance that is still taken for none, (P, 1, 1).
    lit, black : ndarray
        Where light is expected, and where none is; neither holds where nothing may be judged.
    smooth : ndarray
        Where the expected image is lit and has no edge: values far above the mean there are the renderer's own.
    """

    channels: tuple[str, ...]
    grid: tuple[int, int]
    mean: Floats
    low: Floats
    high: Floats
    error: Floats
    largest: Floats
    black_level: Floats
    lit: Booleans
    black: Booleans
    smooth: Booleans


def null_of(expectation: Expectation, tolerance: float) -> Null:
    """The interval of right values: the expectation, its errors and the tolerance."""
    mean = planes(expectation.radiance)
    slack = planes(expectation.error_bound + _EXPECTATION_ERRORS * expectation.standard_error)
    largest = np.full_like(mean, np.inf) if expectation.largest is None else planes(expectation.largest)
    count = expectation.radiance.shape[2]
    names = ("red", "green", "blue") if count == 3 else tuple(f"channel {i}" for i in range(count))
    return _null(("all",) if count == 1 else ("all", *names), mean, slack, largest, expectation.valid, tolerance)


def _null(
    channels: tuple[str, ...], mean: Floats, slack: Floats, largest: Floats, valid: Booleans, tolerance: float
) -> Null:
    # An entirely black image has no mean to measure by; then any light is too much.
    level = np.maximum(_BLACK_LEVEL * mean.mean(axis=(1, 2), keepdims=True), np.finfo(np.float32).tiny)
    lit = valid & (mean > level) & (mean * (1 - tolerance) - slack > 0.5 * mean)
    safe = np.where(lit, mean, 1.0)
    error = np.where(lit, slack / safe, 0.0)
    smooth = lit & _is_smooth(mean)
    blocked_error = to_blocks(error).max(axis=-2)
    return Null(
        channels=channels,
        grid=(-(-mean.shape[1] // SIDE), -(-mean.shape[2] // SIDE)),
        mean=to_blocks(safe, 1.0),
        low=1 - tolerance - blocked_error,
        high=1 + tolerance + blocked_error,
        error=blocked_error,
        largest=to_blocks(np.where(lit, largest / safe, 0.0)).max(axis=-2),
        black_level=level + to_blocks(slack).max(axis=(1, 2), keepdims=True),
        lit=to_blocks(lit),
        black=to_blocks(valid & (mean <= level)),
        smooth=to_blocks(smooth),
    )


def planes(image: Floats) -> Floats:
    """Channels first, led by their mean: (height, width, C) to (C + 1, height, width), or (1, ...) for one channel."""
    channels = np.moveaxis(image, -1, 0)
    return channels if len(channels) == 1 else np.concatenate([channels.mean(axis=0, keepdims=True), channels])


def to_blocks(image: np.ndarray, outside: float = 0.0) -> np.ndarray:
    """Cut an image (..., height, width) into blocks; where they reach beyond it, its pixels are `outside`."""
    *rest, height, width = image.shape
    if height % SIDE or width % SIDE:
        margins = [(0, 0)] * len(rest) + [(0, -height % SIDE), (0, -width % SIDE)]
        image = np.pad(image, margins, constant_values=outside)
    rows, columns = image.shape[-2] // SIDE, image.shape[-1] // SIDE
    cut = np.moveaxis(image.reshape(*rest, rows, SIDE, columns, SIDE), (-3, -1), (-4, -3))
    return np.ascontiguousarray(cut).reshape(*rest, SIDE * SIDE, rows * columns)


def from_blocks(blocks: np.ndarray, grid: tuple[int, int]) -> np.ndarray:
    """Put blocks (..., 16, blocks) together again."""
    *rest, _, _ = blocks.shape
    rows, columns = grid
    image = np.moveaxis(blocks.reshape(*rest, SIDE, SIDE, rows, columns), (-4, -3), (-3, -1))
    return image.reshape(*rest, rows * SIDE, columns * SIDE)


def _is_smooth(mean: Floats) -> Booleans:
    """Whether neighbours are alike."""
    window = (1, 3, 3)
    result: Booleans = ndimage.maximum_filter(mean, window) < _EDGE * ndimage.minimum_filter(mean, window)
    return result
