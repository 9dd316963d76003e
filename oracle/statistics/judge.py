"""The judge: bets against a renderer that a right one almost never lets win.

A *component* is a suspicion such as "this tile is 4 % too bright". It starts with a wealth of 1 and stakes a fraction
of it on every pixel of every image, at odds that are fair for a renderer within the tolerance. Its wealth is then a
non-negative supermartingale, and so is the weighted mean over all components; by Ville's inequality (1939) that mean,
the e-value, ever exceeds 1/alpha with a probability of at most alpha, whatever the distribution of the noise.

References: Waudby-Smith and Ramdas 2024 (betting), Ramdas, Gruenwald, Vovk and Shafer 2023 (e-processes).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, special, stats

from oracle.arrays import Booleans, Floats
from oracle.expectation import Expectation
from oracle.statistics.evidence import Evidence, Interval, Place, Verdict
from oracle.statistics.independence import independent
from oracle.statistics.power import BRIGHTER, DARKER, MAX_STAKE, darker_limit, power
from oracle.statistics.regions import Scale, scales, single_pixels

# Fewer images cannot show that their pixels are independent.
MIN_IMAGES = 4

_BLACK_STAKES = np.array([0.05, 0.5])
# Without independent pixels one bet per image and box is left, with these stakes.
_BOX_STAKES = np.array([0.1, 0.3, 0.6, 0.9])

# How the initial wealth is shared: between the whole image, tiles of all sizes and pixels; then between lit pixels that
# are too bright, lit pixels that are too dark and pixels that should be black; then evenly.
_SCALE_SHARES = {"image": 0.5, "tiles": 0.45, "pixels": 0.05}
_SUSPICION_SHARES = {"brighter": 0.45, "darker": 0.45, "not black": 0.1}

# Less light than this fraction of the image's mean counts as none.
_BLACK_LEVEL = 1e-3
# A bet on "too dark" must know how bright a pixel can get: this many times the brightest seen before.
_HEADROOM = 2.0
# Neighbours that differ by this factor have an edge between them.
_EDGE = 1.5
# Such a bet is lost, rather than worth less than nothing, should a pixel exceed even that.
_LOST = 1e-6
# Standard errors by which a Monte Carlo expectation widens the interval of right values (union over 1e6 pixels).
_EXPECTATION_ERRORS = 7.0
_CONFIDENCE = 0.99
# Where the evidence is: a place is as good as another if the logarithm of its wealth is this part of the other's.
_NEARLY = 0.75
# Two images that differ by less than this fraction of their mean radiance are one.
_SAME_IMAGE = 1e-5


@dataclass(frozen=True, eq=False)
class _Null:
    """What a right renderer's pixels may average to, for "all" channels together and each, (P, height, width)."""

    channels: tuple[str, ...]
    mean: Floats
    low: Floats
    high: Floats
    lit: Booleans
    black: Booleans


@dataclass(frozen=True, eq=False)
class _Forecast:
    """What the images before image k say of it, relative to the mean: arrays (K, P, height, width).

    The pixels of an image from which its own forecast was made are not `open` to bets.
    """

    variance: Floats
    headroom: Floats
    open: Booleans


@dataclass(frozen=True, eq=False)
class _Wealth:
    """Logarithms of share times wealth, (components, P, boxes), of one suspicion at one scale."""

    suspicion: str
    scale: Scale
    logs: Floats


def judge(
    expectation: Expectation, images: Floats, tolerance: float, error_budget: float, detectable_bias: float
) -> Evidence:
    """Judge the images of one case.

    Parameters
    ----------
    expectation : Expectation
        What a right renderer shows, shape (height, width, channels).
    images : ndarray
        Independent images of the case, in the order in which they were rendered, shape (K, height, width, channels);
        finite and at least 0.
    tolerance : float
        Relative bias that still counts as right, in every pixel.
    error_budget : float
        Largest probability with which a right renderer may be called wrong, however often and late one looks.
    detectable_bias : float
        "Right" is said only if a global bias of this size would have been found with 99 % probability.

    Returns
    -------
    Evidence
        With the verdict right, wrong or undecided. What could not be checked is among its assumptions.

    Raises
    ------
    ValueError
        If the images do not fit the expectation, or hold negative or non-finite pixels.
    """
    if images.ndim != 4 or images.shape[1:] != expectation.radiance.shape or len(images) == 0:
        raise ValueError(f"images have shape {images.shape}, they must be (K, *{expectation.radiance.shape})")
    if not np.isfinite(images).all() or (images < 0).any():
        raise ValueError("images must be finite and at least 0 everywhere")

    null = _null(expectation, tolerance)
    observed = np.stack([_with_all(image) for image in _distinct(images)])
    count = len(observed)
    pixels_independent = count < MIN_IMAGES or independent(observed[:, 0] * expectation.valid)
    bank = scales(*expectation.valid.shape)

    brighter = darker = images_needed = None
    if pixels_independent:
        forecast = _forecast(null, observed)
        wealth = _bet_on_pixels(null, observed, forecast, bank)
        bet_upon = forecast.open[:, 0] & null.lit[0]
        brighter, darker, images_needed = power(
            ratios=_relative(null, observed)[:, 0][bet_upon],
            variance=forecast.variance[:, 0][bet_upon],
            headroom=forecast.headroom[:, 0][bet_upon],
            images=count,
            tolerance=tolerance,
            threshold=-np.log(error_budget * _share("image", "brighter", len(BRIGHTER) * len(observed[0]))),
            detectable_bias=detectable_bias,
        )
    else:
        wealth = _bet_on_boxes(null, observed, bank)

    log_e = float(special.logsumexp([special.logsumexp(w.logs) for w in wealth]))
    log_threshold = -float(np.log(error_budget))
    detectable = max(brighter, darker) if brighter is not None and darker is not None else None
    if log_e >= log_threshold:
        verdict = Verdict.WRONG
    elif detectable is not None and detectable <= detectable_bias:
        verdict = Verdict.RIGHT
    else:
        verdict = Verdict.UNDECIDED
    return Evidence(
        verdict=verdict,
        log10_e_value=log_e / float(np.log(10)),
        log10_threshold=log_threshold / float(np.log(10)),
        images=len(images),
        distinct_images=count,
        ratios=_ratios(null, observed, pixels_independent),
        # What a wrong renderer's images would have revealed had it been right, nobody knows.
        detectable_brighter=None if verdict == Verdict.WRONG else brighter,
        detectable_darker=None if verdict == Verdict.WRONG else darker,
        place=_place(null, observed, wealth) if verdict == Verdict.WRONG else None,
        images_needed=images_needed if verdict == Verdict.UNDECIDED else None,
        assumptions=_assumptions(len(images), count, pixels_independent),
    )


# ----------------------------------------------------------------------------------------------- preparation


def _distinct(images: Floats) -> Floats:
    """The images without repetitions: a copy, up to rounding, is no second observation."""
    kept: list[int] = []
    scale = np.abs(images).mean()
    for index, image in enumerate(images):
        if all(np.abs(image - images[k]).mean() > _SAME_IMAGE * scale for k in kept):
            kept.append(index)
    return images[kept] if kept else images[:1]


def _with_all(image: Floats) -> Floats:
    """Channels first, led by their mean: (height, width, C) to (C + 1, height, width), or (1, ...) for one channel."""
    channels = np.moveaxis(image, -1, 0)
    return channels if len(channels) == 1 else np.concatenate([channels.mean(axis=0, keepdims=True), channels])


def _null(expectation: Expectation, tolerance: float) -> _Null:
    mean = _with_all(expectation.radiance)
    slack = _with_all(expectation.error_bound + _EXPECTATION_ERRORS * expectation.standard_error)
    level = _BLACK_LEVEL * mean.mean(axis=(1, 2), keepdims=True)
    # An entirely black image has no mean to measure by; then any light is too much.
    level = np.maximum(level, np.finfo(np.float32).tiny)
    high = np.maximum(mean * (1 + tolerance) + slack, level)
    low = mean * (1 - tolerance) - slack
    lit = expectation.valid & (mean > level) & (low > 0.5 * mean)
    black = expectation.valid & (mean <= level)
    count = expectation.radiance.shape[2]
    names = ("red", "green", "blue") if count == 3 else tuple(f"channel {i}" for i in range(count))
    return _Null(("all",) if count == 1 else ("all", *names), mean, low, high, lit, black)


def _relative(null: _Null, observed: Floats) -> Floats:
    """Observed over expected light where light is expected, 1 elsewhere."""
    result: Floats = np.where(null.lit, observed / np.where(null.lit, null.mean, 1.0), 1.0)
    return result


def _forecast(null: _Null, observed: Floats) -> _Forecast:
    """Variance and brightest value to expect in each image, from the images before it.

    The first image is forecast from a quarter of its own pixels.
    """
    relative = _relative(null, observed)
    squares = (relative - 1) ** 2
    quarter = np.zeros(observed.shape[2:], dtype=np.bool_)
    quarter[::2, ::2] = True

    variance, headroom = np.empty_like(relative), np.empty_like(relative)
    is_open = np.broadcast_to(null.lit | null.black, relative.shape).copy()
    is_open[0] &= ~quarter
    smooth = null.lit & _is_smooth(null.mean)
    for k in range(len(observed)):
        known = null.lit & (quarter if k == 0 else True)
        past = slice(0, max(k, 1))
        variance[k] = _local_mean(squares[past].mean(axis=0), known, size=9 if k == 0 else 5)
        headroom[k] = _HEADROOM * np.where(
            smooth, _highest(relative[past], known & smooth), _highest(relative[past], known)
        )
    return _Forecast(variance, headroom, is_open)


def _is_smooth(mean: Floats) -> Booleans:
    """Where the expected image has no edge: there, values far above the mean are the renderer's own."""
    window = (1, 3, 3)
    result: Booleans = ndimage.maximum_filter(mean, window) < _EDGE * ndimage.minimum_filter(mean, window)
    return result


def _highest(relative: Floats, known: Booleans) -> Floats:
    """Largest observed over expected value among known pixels of images (K, P, height, width), shape (P, 1, 1)."""
    highest: Floats = np.where(known, relative, 1.0).max(axis=(0, 2, 3))[:, None, None]
    return highest


def _local_mean(squares: Floats, known: Booleans, size: int) -> Floats:
    """Local means of squared deviations over the known pixels; their global mean where none is near."""
    weights = known.astype(np.float64)
    total = weights.sum(axis=(1, 2), keepdims=True)
    overall = (squares * weights).sum(axis=(1, 2), keepdims=True) / np.maximum(total, 1)
    window = (1, size, size)
    near = ndimage.uniform_filter(weights, window, mode="constant")
    local = ndimage.uniform_filter(squares * weights, window, mode="constant")
    result: Floats = np.where(near > 1e-9, np.maximum(local, 0) / np.maximum(near, 1e-9), overall)
    return result


# ---------------------------------------------------------------------------------------------------- bets


def _share(scale: str, suspicion: str, components: int) -> float:
    return _SCALE_SHARES[scale] * _SUSPICION_SHARES[suspicion] / components


def _bet_on_pixels(null: _Null, observed: Floats, forecast: _Forecast, bank: tuple[Scale, ...]) -> list[_Wealth]:
    """Stake on every pixel of every image; the wealth of a box is the product over its pixels."""
    lit, black = forecast.open & null.lit, forecast.open & null.black
    above = observed / null.high - 1
    below = observed / np.where(null.lit, null.low, 1.0) - 1
    # 1 - l below stays positive up to the headroom.
    low_ratio = np.where(null.lit, null.low / np.where(null.lit, null.mean, 1.0), 1.0)
    most = darker_limit(forecast.headroom, low_ratio)

    def brighter(amplitude: float) -> Floats:
        stake = np.minimum(amplitude / (forecast.variance + amplitude**2), MAX_STAKE)
        return np.log1p(np.where(lit, stake, 0.0) * above)

    # A pixel above the headroom shows that such bets were unfair so far: they start again with the next image.
    surprised = (lit & (observed > forecast.headroom * null.mean)).any(axis=(1, 2, 3))
    fair = np.arange(len(observed)) > np.flatnonzero(np.append(True, surprised))[-1] - 1
    dark_bets = lit & fair[:, None, None, None]

    def darker(amplitude: float) -> Floats:
        stake = np.minimum(amplitude / (forecast.variance + amplitude**2), most)
        return np.log(np.maximum(1 - np.where(dark_bets, stake, 0.0) * below, _LOST))

    def not_black(stake: float) -> Floats:
        return np.log1p(np.where(black, stake, 0.0) * above)

    wealth: list[_Wealth] = []
    for suspicion, bet, parameters in (
        ("brighter", brighter, BRIGHTER),
        ("darker", darker, DARKER),
        ("not black", not_black, _BLACK_STAKES),
    ):
        # Gains of all images, (components, P, height, width).
        gains = np.stack([bet(parameter).sum(axis=0) for parameter in parameters])
        wealth += _shared(suspicion, [(scale, scale.sums(gains)) for scale in bank])
        pixels = gains.reshape(*gains.shape[:2], -1)
        wealth.append(
            _Wealth(
                suspicion, single_pixels(*gains.shape[2:]), pixels + np.log(_share("pixels", suspicion, pixels.size))
            )
        )
    return wealth


def _bet_on_boxes(null: _Null, observed: Floats, bank: tuple[Scale, ...]) -> list[_Wealth]:
    """Stake once per image and box, on its mean: valid however the pixels of an image depend on each other."""
    wealth: list[_Wealth] = []
    for suspicion, mask, limit in (
        ("brighter", null.lit, null.high),
        ("darker", null.lit, null.low),
        ("not black", null.black, null.high),
    ):
        entries = []
        for scale in bank:
            expected = scale.sums(np.where(mask, limit, 0.0))
            measured = np.maximum(scale.sums(np.where(mask, observed, 0.0)), 0.0)
            # Differences of sums leave rounding errors where nothing is expected.
            matters = expected > 1e-9 * expected.max()
            deviation = np.where(matters, measured / np.where(matters, expected, 1.0) - 1, 0.0)
            stakes = _BOX_STAKES[:, None, None, None] * np.ones_like(deviation)
            if suspicion == "darker":
                # How bright a box can get is known only from the images before.
                highest = np.maximum.accumulate(np.maximum(deviation, 0.0), axis=0).max(axis=2, keepdims=True)
                most = MAX_STAKE / np.maximum(_HEADROOM * (1 + highest) - 1, 1.0)
                stakes[:, 1:] = np.minimum(stakes[:, 1:], most[:-1])
                stakes[:, 0] = 0
                gains = np.log(np.maximum(1 - stakes * deviation, _LOST))
            else:
                gains = np.log1p(stakes * deviation)
            entries.append((scale, gains.sum(axis=1)))
        wealth += _shared(suspicion, entries)
    return wealth


def _shared(suspicion: str, entries: list[tuple[Scale, Floats]]) -> list[_Wealth]:
    """Give the components of the whole image and of all tile scales their shares."""
    tile_scales = len(entries) - 1
    wealth = []
    for scale, gains in entries:
        kind, scales_of_kind = ("image", 1) if scale.name == "image" else ("tiles", tile_scales)
        share = _share(kind, suspicion, gains.size * scales_of_kind)
        wealth.append(_Wealth(suspicion, scale, gains + np.log(share)))
    return wealth


# ------------------------------------------------------------------------------------------- what is reported


def _ratios(null: _Null, observed: Floats, pixels_independent: bool) -> dict[str, Interval]:
    """Observed over expected light of the whole image and its confidence interval, for each channel."""
    result = {}
    count = len(observed)
    for p, name in enumerate(null.channels):
        lit = null.lit[p]
        expected = float(null.mean[p][lit].sum())
        if expected == 0:
            continue
        each = observed[:, p][:, lit].sum(axis=1) / expected
        estimate = float(each.mean())
        quantile = float(stats.norm.ppf((1 + _CONFIDENCE) / 2))
        if count == 1:
            residuals = observed[0, p][lit] - estimate * null.mean[p][lit]
            error = float(np.sqrt((residuals**2).sum())) / expected
        elif pixels_independent:
            error = float(np.sqrt(observed[:, p][:, lit].var(axis=0, ddof=1).sum() / count)) / expected
        else:
            error = float(each.std(ddof=1)) / np.sqrt(count)
            quantile = float(stats.t.ppf((1 + _CONFIDENCE) / 2, count - 1))
        result[name] = Interval(estimate, estimate - quantile * error, estimate + quantile * error)
    return result


def _place(null: _Null, observed: Floats, wealth: list[_Wealth]) -> Place:
    """The smallest box in which some suspicion has grown nearly as rich as any has."""
    richest = max(float(w.logs.max()) for w in wealth)
    by_size = sorted(wealth, key=lambda w: int(((w.scale.x1 - w.scale.x0) * (w.scale.y1 - w.scale.y0)).max()))
    best = next(w for w in by_size if w.logs.max() >= _NEARLY * richest)
    # All channels together are preferred to one in the same way.
    logs = best.logs[:, :1] if best.logs[:, 0].max() >= _NEARLY * best.logs.max() else best.logs
    _, p, box = np.unravel_index(int(logs.argmax()), logs.shape)
    scale = best.scale
    x0, x1, y0, y1 = (int(bound[box]) for bound in (scale.x0, scale.x1, scale.y0, scale.y1))
    mask = (null.black if best.suspicion == "not black" else null.lit)[p, y0:y1, x0:x1]
    expected = float(null.mean[p, y0:y1, x0:x1][mask].sum())
    measured = float(observed[:, p, y0:y1, x0:x1].mean(axis=0)[mask].sum())
    ratio = None if best.suspicion == "not black" or expected == 0 else measured / expected
    return Place(x0, y0, x1 - x0, y1 - y0, null.channels[p], best.suspicion, ratio)


def _assumptions(count: int, distinct: int, pixels_independent: bool) -> tuple[str, ...]:
    statements = []
    if distinct < count:
        statements.append(f"{count - distinct} of {count} images repeat another and are not counted")
    if not pixels_independent:
        statements.append("the noise of different pixels is correlated: only one bet per image and region is made")
    elif distinct < MIN_IMAGES:
        statements.append(f"the noise of different pixels is independent (not checked: fewer than {MIN_IMAGES} images)")
    else:
        statements.append("the noise of different pixels is independent (checked)")
    statements.append("different images are independent")
    statements.append(
        f"no pixel of an image is brighter than {_HEADROOM:g} times the brightest before it (only for bets on too dark)"
    )
    return tuple(statements)
