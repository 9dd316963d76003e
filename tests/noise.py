"""Right renderers as random numbers: images whose pixels average to a given expectation, with every kind of noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from oracle.arrays import Floats

# (generator, expected radiance (height, width, 3), number of images) to images (K, height, width, 3).
Noise = Callable[[np.random.Generator, Floats, int], Floats]


def _grey(rng_values: Floats) -> Floats:
    """The same random factor in all channels, as when they share their samples."""
    return rng_values[..., None]


def dense(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Area sampling: every sample sees the light, 20 % noise."""
    return mean * _grey(rng.gamma(25.0, 1 / 25.0, (count, *mean.shape[:2])))


def sparse(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Hemisphere sampling: 2 % of 16 samples find the light."""
    return mean * _grey(rng.binomial(16, 0.02, (count, *mean.shape[:2])) / 0.32)


def heavy(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Log-normal with a relative standard deviation of 1.3."""
    return mean * _grey(rng.lognormal(-0.5, 1.0, (count, *mean.shape[:2])))


def coloured(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Independent noise in each channel."""
    return mean * rng.gamma(25.0, 1 / 25.0, (count, *mean.shape))


def uneven(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Almost no noise but in one column, as along a shadow's edge."""
    sigma = np.full(mean.shape[1], 1e-3)
    sigma[mean.shape[1] // 3] = 0.8
    shape = 1 / sigma**2
    return mean * _grey(rng.gamma(shape, 1 / shape, (count, *mean.shape[:2])))


def noiseless(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """The expectation itself, every time."""
    return np.broadcast_to(mean, (count, *mean.shape)).copy()


def filtered(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """A Gaussian pixel filter of half a pixel: neighbours share samples."""
    white = rng.normal(size=(count, *mean.shape[:2]))
    smooth = np.stack([ndimage.gaussian_filter(image, 0.5, mode="wrap") for image in white])
    return mean * _grey(np.maximum(1 + 0.2 * smooth, 0))


def shared(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """All pixels of an image use the same random numbers."""
    return mean * _grey(rng.gamma(25.0, 1 / 25.0, (count, 1, 1))) * np.ones_like(mean)


def biased_up(rng: np.random.Generator, mean: Floats, count: int) -> Floats:
    """Dense noise, and as bright as the tolerance of half a percent allows."""
    return 1.005 * dense(rng, mean, count)


NOISES: dict[str, Noise] = {
    noise.__name__: noise for noise in (dense, sparse, heavy, coloured, uneven, noiseless, filtered, shared, biased_up)
}
