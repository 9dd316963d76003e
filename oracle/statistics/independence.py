"""Whether the noise of different pixels is independent, from differences between images."""

from __future__ import annotations

from scipy import stats

from oracle.arrays import Floats

_SIDES = (2, 8, 32)
# A false doubt costs samples first; missing a true one could cost a right renderer its points.
_LEVEL = 1e-4


def p_value(images: Floats) -> float:
    """Probability of noise that is at least so much alike between pixels, if their noise is independent.

    Parameters
    ----------
    images : ndarray
        At least two images of the same scene from different seeds, shape (K, height, width).

    Returns
    -------
    float
        Smallest p-value over blocks of 2, 8, 32 pixels and the whole image, times their number. Small for filters wider
        than a pixel and for random numbers shared between pixels.

    Notes
    -----
    Differences of two images are symmetric around 0, so that under independence every pixel's sign is a fair coin
    given its size. That gives the exact mean and variance of the sum of squared block sums without any model of the
    noise; its tail is that of the chi-square distribution with the same two moments [Satterthwaite 1946].
    """
    pairs = len(images) // 2
    differences = images[0 : 2 * pairs : 2] - images[1 : 2 * pairs : 2]
    height, width = differences.shape[1:]
    sides = (*_SIDES, max(height, width))
    smallest = 1.0
    for side in sides:
        tall, wide = min(side, height), min(side, width)
        rows, columns = height // tall, width // wide
        cut = differences[:, : rows * tall, : columns * wide]
        blocks = cut.reshape(pairs, rows, tall, columns, wide).swapaxes(2, 3).reshape(-1, tall * wide)
        squares = (blocks**2).sum(axis=1)
        mean = squares.sum()
        variance = 2 * (squares**2 - (blocks**4).sum(axis=1)).sum()
        if variance > 0:
            freedom = 2 * mean**2 / variance
            statistic = (blocks.sum(axis=1) ** 2).sum() * freedom / mean
            smallest = min(smallest, float(stats.chi2.sf(statistic, freedom)))
    return min(1.0, len(sides) * smallest)


def independent(images: Floats) -> bool:
    """Whether `p_value` gives no reason to doubt that pixels are independent."""
    return p_value(images) > _LEVEL
