"""How small a bias the judge would have found: the power of its bets on the whole image."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
from scipy import stats

from oracle.arrays import Floats

# The stakes that the judge places on a whole image that is brighter or darker, see `oracle.statistics.judge`.
BRIGHTER = np.array([0.0025, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.5, 2.0])
DARKER = np.array([0.0025, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.75])
MAX_STAKE = 0.95

_QUANTILE = float(stats.norm.ppf(0.99))
_BIASES = np.geomspace(1e-3, 4.0, 120)
# More pixel values than this add nothing to what is known of their distribution.
_SAMPLE = 1 << 15
_LITTLE_NOISE = 1e-4
_CLOSE = 0.7


def power(
    ratios: Floats,
    variance: Floats,
    headroom: Floats,
    images: int,
    tolerance: float,
    threshold: float,
    detectable_bias: float,
) -> tuple[float | None, float | None, int | None]:
    """Smallest global biases that would have been found with 99 % probability, and images needed for a given one.

    Parameters
    ----------
    ratios : ndarray
        Observed over expected value of every pixel that was bet upon, in every image, shape (M,).
    variance, headroom : ndarray
        What was forecast of it: variance over squared mean, and largest value over mean, shape (M,).
    images : int
        Number of images judged.
    tolerance : float
        Relative bias that counts as right.
    threshold : float
        Logarithm of the wealth at which one component convicts.
    detectable_bias : float
        The bias that must be found with 99 % probability before "right" is said.

    Returns
    -------
    brighter, darker : float or None
        Smallest relative bias found in each direction; None if no bias up to the largest considered is.
    images_needed : int or None
        Images after which `detectable_bias` is found in both directions; None if never.

    Notes
    -----
    The pixels' own values, scaled to the bias in question, give mean and variance of the logarithm of a factor, with
    any skewness they have; sums over many pixels are normal.
    """
    if ratios.size == 0 or ratios.mean() == 0:
        return None, None, None
    bets = ratios.size
    sample = slice(None, None, max(1, bets // _SAMPLE))
    # A pixel above the headroom makes bets on "too dark" start again; where one came close, half of them may be lost.
    kept = 0.5 if (ratios > _CLOSE * headroom).any() else 1.0
    values, variance, headroom = ratios[sample], variance[sample], headroom[sample]
    # The renderer's own bias is taken out as well as it is known, that is, mostly from pixels with little noise.
    values = values / np.average(values, weights=1 / (variance + _LITTLE_NOISE))

    found: list[float | None] = []
    needed: list[float] = []
    for sign, amplitudes in ((1, BRIGHTER), (-1, DARKER)):
        limit = 1 + sign * tolerance

        def growth(
            bias: float, sign: int = sign, amplitudes: Floats = amplitudes, limit: float = limit
        ) -> tuple[Floats, Floats]:
            """Mean and variance of each component's gain from all bets if the renderer is off by `bias`."""
            biased = values * (1 + sign * bias)
            expected_square = variance * (1 + sign * bias) ** 2 + bias**2
            stakes = amplitudes[:, None] / (expected_square + amplitudes[:, None] ** 2)
            stakes = np.minimum(stakes, MAX_STAKE if sign > 0 else darker_limit(headroom, limit))
            gains = np.log(np.maximum(1 + sign * stakes * (biased / limit - 1), 1e-6))
            count = bets if sign > 0 else kept * bets
            return count * gains.mean(axis=1), count * gains.var(axis=1)

        def is_found(bias: float) -> bool:
            mean, variance_of_gain = growth(bias)
            return bool((mean - _QUANTILE * np.sqrt(variance_of_gain) >= threshold).any())

        largest = np.inf if sign > 0 else 1.0
        candidates = _BIASES[(tolerance < _BIASES) & (largest > _BIASES)]
        # Power grows with the bias, so that bisection finds the smallest.
        smallest = bisect_left(candidates, True, key=lambda bias: is_found(float(bias)))
        found.append(float(candidates[smallest]) if smallest < len(candidates) else None)

        mean, variance_of_gain = growth(detectable_bias)
        gaining = mean > 0
        if gaining.any():
            # f mean - q sqrt(f variance) = threshold, solved for sqrt(f), the factor of images.
            m, q = mean[gaining], _QUANTILE * np.sqrt(variance_of_gain[gaining])
            needed.append(images * float(((q + np.sqrt(q**2 + 4 * m * threshold)) / (2 * m)).min() ** 2))
        else:
            needed.append(np.inf)
    images_needed = int(np.ceil(max(needed))) if np.isfinite(max(needed)) else None
    return found[0], found[1], images_needed


def darker_limit(headroom: Floats, low_ratio: Floats | float) -> Floats:
    """Largest stake on "darker than low_ratio" that a pixel of `headroom` times its mean cannot bankrupt."""
    result: Floats = np.minimum(MAX_STAKE * low_ratio / np.maximum(headroom - low_ratio, 1e-9), MAX_STAKE)
    return result
