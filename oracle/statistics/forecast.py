"""What the past of a case says of the next image: the noise of its pixels, and how bright they can get."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from oracle.arrays import Floats
from oracle.statistics.bets import Pixels
from oracle.statistics.null import Null

# Where no contract bounds a pixel, it may be this many times as bright as the brightest seen before.
_HEADROOM = 2.0
# How many blocks with the noise of the whole image each neighbourhood is mixed with, for each unit of kurtosis.
_SHRINKING = 12.0
_LEAST_VARIANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Past:
    """What has been seen of each block, (P, blocks), but for the last two, (P,).

    Attributes
    ----------
    pixels : ndarray
        How many pixels, in all images together.
    samples, ratios, squares, fourths : ndarray
        Sums over these pixels of their samples times the powers 0, 1, 2 of observed over expected value less 1, and of
        squared samples times its fourth power.
    brightest, brightest_smooth : ndarray
        Largest observed over expected value, and that where the expectation has no edge.
    """

    pixels: Floats
    samples: Floats
    ratios: Floats
    squares: Floats
    fourths: Floats
    brightest: Floats
    brightest_smooth: Floats

    @classmethod
    def of(cls, null: Null) -> Past:
        """Of nothing yet."""
        zero = np.zeros(null.low.shape)
        return cls(zero, zero, zero, zero, zero, np.ones(len(zero)), np.ones(len(zero)))

    def having_seen(self, pixels: Pixels, spp: int, smooth: np.ndarray) -> Past:
        """With some pixels of one image more, and which of them have no edge, (P, pixels, blocks)."""
        zeroth, first, second, _, fourth = pixels.sums[:5]
        highest = np.where(smooth & pixels.included, pixels.values, 0.0).max(axis=(1, 2), initial=0.0)
        return Past(
            self.pixels + zeroth,
            self.samples + spp * zeroth,
            self.ratios + spp * first,
            self.squares + spp * second,
            self.fourths + spp**2 * fourth,
            np.maximum(self.brightest, 1 + pixels.highest.max(axis=1, initial=0.0)),
            np.maximum(self.brightest_smooth, 1 + highest),
        )

    def bias(self, null: Null) -> Floats:
        """By how much the whole image is brighter than expected, as a fraction, (P,)."""
        weight = null.mean.mean(axis=1)
        expected = (weight * self.samples).sum(axis=1)
        found: Floats = (weight * self.ratios).sum(axis=1) / np.where(expected > 0, expected, 1.0)
        return found

    def variance(self, null: Null) -> Floats:
        """Relative variance of one sample in the pixels of each block, (P, blocks)."""
        offset = self.bias(null)[:, None]
        # Residuals about the image's own ratio: a bias is no noise.
        squares = np.maximum(self.squares - offset * (2 * self.ratios - offset * self.samples), 0)
        mean = null.mean.mean(axis=1)
        planes = zip(squares, self.fourths, self.pixels, mean, strict=True)
        return np.stack([_smoothed(*plane, null.grid) for plane in planes])

    def headroom(self, null: Null) -> Floats:
        """Largest value over mean that a pixel of the next image may have, (P, blocks)."""
        has_edge = (null.lit & ~null.smooth).any(axis=1)
        guessed = _HEADROOM * np.where(has_edge, self.brightest[:, None], self.brightest_smooth[:, None])
        return np.where(np.isfinite(null.largest), null.largest, guessed)


def _smoothed(squares: Floats, fourths: Floats, pixels: Floats, mean: Floats, grid: tuple[int, int]) -> Floats:
    """Variances from sums of squares: a fit to the image, corrected by each neighbourhood as far as it can tell."""
    known = pixels > 0
    if not known.any():
        return np.ones_like(squares)
    # Samples that find the light or miss it have a relative variance that falls with the mean, others a constant one.
    darkness = mean[known].mean() / mean
    constant, falling = _fit(darkness[known], squares[known], pixels[known])
    model = constant + falling * darkness + _LEAST_VARIANCE
    relative = squares / model
    # Kurtosis within blocks: rare bright samples raise it, noise that is stronger in some places does not.
    noise = (relative[known] ** 2 / pixels[known]).sum()
    kurtosis = (fourths / model**2).sum() / noise if noise > 0 else 1.0
    trust = _SHRINKING * max(float(kurtosis), 1.0)

    kernel = np.array([1.0, 2.0, 1.0]) / 2
    total, number = relative.reshape(grid), pixels.reshape(grid)
    for axis in (0, 1):
        total = ndimage.correlate1d(total, kernel, axis, mode="constant")
        number = ndimage.correlate1d(number, kernel, axis, mode="constant")
    result: Floats = model * ((total + trust) / (number + trust)).ravel()
    return result


def _fit(darkness: Floats, squares: Floats, pixels: Floats) -> tuple[float, float]:
    """Least squares of ``squares = pixels (a + b darkness)`` with both at least 0, weighted by the fit itself."""
    a, b = float(squares.sum() / pixels.sum()), 0.0
    for _ in range(3):
        weights = 1 / (a + b * darkness + _LEAST_VARIANCE) ** 2
        s0, s1, s2 = ((weights * pixels * darkness**k).sum() for k in range(3))
        t0, t1 = ((weights * squares * darkness**k).sum() for k in range(2))
        determinant = s0 * s2 - s1 * s1
        if determinant <= 1e-9 * s0 * s2:
            return float(t0 / s0), 0.0
        a, b = float((t0 * s2 - t1 * s1) / determinant), float((s0 * t1 - s1 * t0) / determinant)
        if b < 0:
            a, b = float(t0 / s0), 0.0
        elif a < 0:
            a, b = 0.0, float(t1 / s1)
    return a, b
