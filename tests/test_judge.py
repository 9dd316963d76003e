"""The judge: never wrong about right renderers, hardly ever blind for wrong ones.

All random numbers are seeded; bounds hold with a probability of at least 1 - 1e-6 for a judge that keeps its promises.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from calibration import BUDGET, DETECTABLE, TOLERANCE, false_alarms, picture, right_although_off
from noise import NOISES, dense, filtered, noiseless, shared, sparse
from scipy import ndimage

from oracle.statistics import MIN_IMAGES, Evidence, Verdict, judge
from oracle.statistics.independence import p_value


def verdict_of(images, expectation=None, **changes) -> Evidence:
    arguments = {"tolerance": TOLERANCE, "error_budget": BUDGET, "detectable_bias": DETECTABLE} | changes
    return judge(expectation or picture(), images, **arguments)


def rendered(noise=dense, count=8, seed=1):
    return noise(np.random.default_rng(seed), picture().radiance, count)


@pytest.mark.parametrize("name", NOISES)
def test_right_renderers_are_not_called_wrong(name):
    # P(E >= 10) <= 1/10 and P(E >= 100) <= 1/100 by Ville; of 60, 24 and 8 are exceeded with less than 1e-6.
    found = false_alarms(NOISES[name], images=MIN_IMAGES, gradings=60, seed=20)
    assert found.wrong == 0
    assert found.above_10 < 24
    assert found.above_100 < 8


@pytest.mark.parametrize("name", ["dense", "sparse", "coloured", "noiseless"])
def test_what_is_off_as_much_as_is_ruled_out_is_hardly_ever_called_right(name):
    # 1 % of 40, at most; more than 6 have a probability below 1e-6.
    assert right_although_off(NOISES[name], images=8, gradings=40, seed=21) <= 6


def test_a_right_renderer_is_called_right_once_its_noise_allows():
    # 10 % of 32 x 32 pixels with a relative variance of 3 take 15 images to be found with 99 %.
    first = verdict_of(rendered(sparse, count=4), detectable_bias=0.1)
    assert first.verdict == Verdict.UNDECIDED
    assert first.not_excluded
    last = verdict_of(rendered(sparse, count=60), detectable_bias=0.1)
    assert last.verdict == Verdict.RIGHT
    assert not last.not_excluded


def test_an_undecided_verdict_names_images_that_decide():
    evidence = verdict_of(rendered(sparse, count=6), detectable_bias=0.1)
    assert evidence.verdict == Verdict.UNDECIDED
    assert evidence.images_needed is not None
    enough = rendered(sparse, count=2 * evidence.images_needed)
    assert verdict_of(enough, detectable_bias=0.1).verdict == Verdict.RIGHT


@pytest.mark.parametrize("bias", [-0.06, 0.06, 1.0, -0.5, np.pi - 1])
def test_a_global_bias_is_wrong(bias):
    evidence = verdict_of((1 + bias) * rendered())
    assert evidence.verdict == Verdict.WRONG
    assert evidence.ratios["all"].low < 1 + bias < evidence.ratios["all"].high


def nearly_noiseless(factor):
    rng = np.random.default_rng(3)
    return factor * picture().radiance * (1 + 1e-3 * rng.normal(size=(16, 32, 32, 1)))


@pytest.mark.parametrize("factor", [0.9955, 1.0045])
def test_no_number_of_images_makes_a_tolerated_bias_wrong(factor):
    assert verdict_of(nearly_noiseless(factor)).verdict == Verdict.RIGHT


@pytest.mark.parametrize("factor", [0.992, 1.008])
def test_a_bias_just_above_the_tolerance_is_wrong(factor):
    assert verdict_of(nearly_noiseless(factor)).verdict == Verdict.WRONG


def test_a_bias_within_the_tolerance_is_not_wrong():
    for factor in (0.995, 1.005):
        assert verdict_of(factor * rendered(noiseless)).verdict != Verdict.WRONG
        assert verdict_of(factor * rendered(count=24)).verdict != Verdict.WRONG


def test_one_channel_alone_is_found_and_named():
    images = rendered(count=16)
    images[..., 1] *= 1.06
    evidence = verdict_of(images)
    assert evidence.verdict == Verdict.WRONG
    assert evidence.place.channel == "green"


@pytest.mark.parametrize(("y", "x"), [(0, 0), (16, 8), (24, 16)])
def test_a_wrong_tile_is_found_and_located(y, x):
    images = rendered(count=8)
    images[:, y : y + 8, x : x + 8] *= 1.3
    place = verdict_of(images).place
    assert place is not None
    assert place.suspicion == "brighter"
    assert x - 8 < place.x <= x + 4
    assert y - 8 < place.y <= y + 4
    assert 1.1 < place.ratio < 1.4


def test_light_in_a_black_region_is_found():
    images = rendered(noiseless)
    images[:, :, -3:] += 0.02
    evidence = verdict_of(images)
    assert evidence.verdict == Verdict.WRONG
    assert evidence.place.suspicion == "not black"
    assert evidence.place.ratio is None


def test_a_missing_shadow_edge_shift_is_found():
    expectation = picture()
    shifted = ndimage.shift(expectation.radiance, (0, 0.5, 0), order=1, mode="nearest")
    images = np.stack([shifted * (1 + 1e-3 * np.random.default_rng(k).normal(size=shifted.shape)) for k in range(8)])
    assert verdict_of(np.maximum(images, 0)).verdict == Verdict.WRONG


def test_pixels_that_may_not_be_judged_do_not_matter():
    expectation = picture()
    valid = np.ones((32, 32), dtype=np.bool_)
    valid[:8] = False
    images = rendered(count=24)
    images[:, :8] *= 5
    assert verdict_of(images).verdict == Verdict.WRONG
    assert verdict_of(images, dataclasses.replace(expectation, valid=valid)).verdict == Verdict.RIGHT


def test_an_uncertain_expectation_widens_what_is_right():
    expectation = picture()
    images = 1.03 * rendered(noiseless)
    uncertain = dataclasses.replace(expectation, standard_error=0.01 * expectation.radiance)
    assert verdict_of(images).verdict == Verdict.WRONG
    assert verdict_of(images, uncertain).verdict != Verdict.WRONG


def test_copies_of_an_image_are_no_evidence():
    one = rendered(sparse, count=1)
    once, often = verdict_of(one), verdict_of(np.repeat(one, 16, axis=0))
    assert often.distinct_images == 1
    assert often.log10_e_value == once.log10_e_value
    assert any("repeat another" in assumption for assumption in often.assumptions)


@pytest.mark.parametrize("noise", [shared, filtered])
def test_correlated_pixels_are_noticed_and_cost_power_not_points(noise):
    images = rendered(noise, count=8, seed=5)
    assert p_value(images[..., 0]) < 1e-6
    evidence = verdict_of(images)
    assert evidence.verdict == Verdict.UNDECIDED
    assert any("correlated" in assumption for assumption in evidence.assumptions)


@pytest.mark.parametrize("name", ["dense", "sparse", "heavy", "uneven"])
def test_independent_pixels_pass_for_independent(name):
    # 200 uniform p-values; less than 1e-6 times 200 to see one below the judge's level.
    rng = np.random.default_rng(6)
    values = [p_value(NOISES[name](rng, picture().radiance, 4)[..., 0]) for _ in range(200)]
    assert min(values) > 1e-6


def test_correlated_pixels_still_convict_a_gross_bug():
    assert verdict_of(np.pi * rendered(filtered, count=64)).verdict == Verdict.WRONG


def test_an_all_black_image_is_wrong_without_any_warning():
    evidence = verdict_of(np.zeros_like(rendered(count=4)))
    assert evidence.verdict == Verdict.WRONG
    assert evidence.place.suspicion == "darker"
    assert evidence.ratios["all"].estimate == 0


def test_a_black_expectation_admits_only_black():
    black = dataclasses.replace(picture(), radiance=np.zeros((32, 32, 3)))
    assert verdict_of(np.zeros((4, 32, 32, 3)), black).verdict != Verdict.WRONG
    assert verdict_of(np.full((4, 32, 32, 3), 1e-3), black).verdict == Verdict.WRONG


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (7, 3), (65, 2)])
def test_odd_sizes_are_judged(shape):
    zero = np.zeros((*shape, 3))
    expectation = dataclasses.replace(
        picture(), radiance=zero + 0.5, standard_error=zero, error_bound=zero.copy(), valid=np.ones(shape, dtype=bool)
    )
    images = np.full((8, *shape, 3), 0.5) * np.linspace(0.999, 1.001, 8)[:, None, None, None]
    assert verdict_of(images, expectation).verdict in (Verdict.RIGHT, Verdict.UNDECIDED)
    assert verdict_of(0 * images, expectation).verdict in (Verdict.WRONG, Verdict.UNDECIDED)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_impossible_pixels_are_refused(bad):
    images = rendered()
    images[2, 3, 4, 1] = bad
    with pytest.raises(ValueError, match="finite and at least 0"):
        verdict_of(images)


def test_another_size_is_refused():
    with pytest.raises(ValueError, match="an image has shape"):
        verdict_of(rendered()[:, :-1])


def test_evidence_does_not_depend_on_the_unit_of_light():
    expectation = picture()
    images = rendered(count=8)
    bright = dataclasses.replace(expectation, radiance=1e6 * expectation.radiance)
    small, large = verdict_of(images), verdict_of(1e6 * images, bright)
    assert small.verdict == large.verdict
    assert small.log10_e_value == pytest.approx(large.log10_e_value, rel=1e-9)
