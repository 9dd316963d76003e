"""Evidence in words."""

from __future__ import annotations

from oracle.statistics import Evidence, Place, Verdict

# A box whose ratio differs from the image's by less than this fraction is the image.
_SAME = 1e-9


def reason(evidence: Evidence) -> str:
    """One sentence that says what was found."""
    match evidence.verdict:
        case Verdict.WRONG if evidence.place is not None:
            return _wrong(evidence, evidence.place)
        case Verdict.RIGHT:
            return (
                f"being off by {_percent(evidence.bias)} is ruled out with 99 % confidence in each of"
                f" {evidence.alternatives} ways"
            )
        case _ if evidence.distinct_images == 1 < evidence.images:
            return "all images are the same although their seeds differ, and one is too noisy for a verdict"
        case _:
            if evidence.alternatives == 0:
                return "the expected image is too dark or not known well enough for a verdict"
            if evidence.images_needed is None:
                return "the noise is too strong or too alike between pixels for a verdict; more images may not help"
            return f"the noise is too strong for a verdict; about {evidence.images_needed} images would decide"


def _wrong(evidence: Evidence, place: Place) -> str:
    overall = evidence.ratios.get("all")
    total = f"; the whole image has {_percent(overall.estimate)} of the expected light" if overall else ""
    where = f"in the {place.width} x {place.height} pixels at x = {place.x}, y = {place.y}"
    channel = "" if place.channel == "all" else f" in {place.channel}"
    if place.ratio is None:
        return f"light{channel} where there should be none, {where}{total}"
    comparison = "too bright" if place.suspicion == "brighter" else "too dark"
    same = evidence.ratios.get(place.channel)
    if same is not None and abs(place.ratio - same.estimate) < _SAME * same.estimate:
        return f"{comparison}{channel}: the whole image has {_percent(place.ratio)} of the expected light"
    return f"{comparison}{channel}: {_percent(place.ratio)} of the expected light {where}{total}"


def _percent(value: float) -> str:
    """A ratio in percent with three significant digits, and with those that matter near 100 %."""
    percent = 100 * value
    if 90 < percent < 110:
        return f"{percent:.2f} %"
    return f"{percent:.0f} %" if percent >= 100 else f"{percent:.3g} %"
