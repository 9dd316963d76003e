"""How bright the whole image is, and how well that is known."""

from __future__ import annotations

import numpy as np
from scipy import stats

from oracle.arrays import Floats
from oracle.statistics.evidence import Interval
from oracle.statistics.forecast import Past
from oracle.statistics.null import Null

CONFIDENCE = 0.99
# The sequence of intervals is narrowest after so many samples per pixel.
_NARROWEST = 32.0


def anytime_intervals(null: Null, past: Past) -> dict[str, Interval]:
    """Observed over expected light for each plane, with intervals that hold at all times together.

    The normal mixture confidence sequence [Robbins 1970], asymptotic in the number of pixels and with the estimated
    variance [Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas 2024]. Pixels must be independent.
    """
    variance = past.variance(null)
    alpha = 1 - CONFIDENCE
    if not null.lit.any():
        return {}
    samples = float(past.samples.sum() / null.lit.sum())
    scale = (-2 * np.log(alpha) + np.log(-2 * np.log(alpha)) + 1) / _NARROWEST
    spread = samples * scale
    width = np.sqrt(2 * (spread + 1) / (spread * samples) * np.log(np.sqrt(spread + 1) / alpha))
    found = {}
    for plane, name in enumerate(null.channels):
        lit = null.lit[plane]
        if lit.any():
            weight = np.where(lit, null.mean[plane], 0.0)
            estimate = 1 + float(past.bias(null)[plane])
            error = float(np.sqrt(((weight**2).sum(axis=0) * variance[plane]).sum()) / weight.sum() * width)
            found[name] = Interval(estimate, max(estimate - error, 0.0), estimate + error)
    return found


def intervals_between_images(null: Null, observed: Floats, spp: Floats) -> dict[str, Interval]:
    """The same from how much images (K, P, 16, blocks) differ as a whole: Student's, for the number there is."""
    found = {}
    for plane, name in enumerate(null.channels):
        lit = null.lit[plane]
        if not lit.any():
            continue
        expected = float(null.mean[plane][lit].sum())
        each = observed[:, plane][:, lit].sum(axis=1) / expected
        estimate = float(np.average(each, weights=spp))
        count = len(each)
        if count == 1:
            found[name] = Interval(estimate, 0.0, np.inf)
            continue
        variance = float((spp * (each - estimate) ** 2).sum() / (count - 1) / spp.sum())
        quantile = float(stats.t.ppf((1 + CONFIDENCE) / 2, count - 1))
        error = quantile * np.sqrt(variance)
        found[name] = Interval(estimate, max(estimate - error, 0.0), estimate + error)
    return found
