"""Whether the noise of different pixels is independent, from differences between images."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats

_SIDES = (2, 8, 32)
# One-sided; at 5 standard deviations the normal tail is 3e-7 for each of the four scales.
_LIMIT = 5.0


def correlation(images: Floats) -> float:
    """How far pixels' noise is from independent: the largest standard score over blocks of several sizes.

    Parameters
    ----------
    images : ndarray
        At least two images of the same scene from different seeds, shape (K, height, width).

    Returns
    -------
    float
        Standard score of the excess of the block sums' variance over the sum of the pixels' variances. About normal
        for independent pixels of any distribution, above `_LIMIT` for filters wider than a pixel and for random
        numbers shared between pixels.

    Notes
    -----
    Differences of two images are symmetric around 0, so that under independence every pixel's sign is a fair coin
    given its size. That gives the exact mean and variance of the block sums' squares without any model of the noise.
    """
    pairs = len(images) // 2
    differences = images[0 : 2 * pairs : 2] - images[1 : 2 * pairs : 2]
    height, width = differences.shape[1:]
    highest = -np.inf
    for side in (*_SIDES, max(height, width)):
        tall, wide = min(side, height), min(side, width)
        rows, columns = height // tall, width // wide
        cut = differences[:, : rows * tall, : columns * wide]
        blocks = cut.reshape(pairs, rows, tall, columns, wide).swapaxes(2, 3).reshape(-1, tall * wide)
        squares = (blocks**2).sum(axis=1)
        excess = (blocks.sum(axis=1) ** 2 - squares).sum()
        variance = 2 * (squares**2 - (blocks**4).sum(axis=1)).sum()
        if variance > 0:
            highest = max(highest, float(excess / np.sqrt(variance)))
    return highest


def independent(images: Floats) -> bool:
    """Whether `correlation` gives no reason to doubt that pixels are independent."""
    return correlation(images) <= _LIMIT
