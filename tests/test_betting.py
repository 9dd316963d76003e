"""What the judge is made of: bets that are fair, forecasts that know the past alone, blocks that do not touch."""

from __future__ import annotations

import numpy as np
import pytest
from calibration import DETECTABLE, TOLERANCE, picture
from noise import dense, filtered, sparse

from oracle.statistics import Bank, Judge
from oracle.statistics.bets import Pixels, stakes
from oracle.statistics.coarse import Grid, coarse_expectation, grids
from oracle.statistics.directions import direction
from oracle.statistics.independence import independent
from oracle.statistics.null import from_blocks, null_of, planes, to_blocks
from oracle.statistics.process import Process


@pytest.mark.parametrize("spread", [1e-6, 0.01, 0.2, 1.0, 30.0])
@pytest.mark.parametrize("limit", [1.0, 0.99, 1.2])
def test_gains_of_blocks_are_those_of_their_pixels_and_never_more(spread, limit):
    rng = np.random.default_rng(5)
    values = rng.gamma(1 / spread**2, spread**2, (2, 16, 300)) - 1
    included = rng.random(values.shape) < 0.8
    of_blocks = Pixels.of(values, included).about(np.full((2, 300), limit))
    for wanted in (0.004, 0.1, 0.9, -0.03):
        stake = np.full((2, 300), wanted if wanted > 0 else wanted / (1 + 5 * spread))
        factors = np.where(included, 1 + stake[:, None] * ((1 + values) / limit - 1), 1.0)
        exact = np.log(np.maximum(factors, 1e-6)).sum(axis=1)
        found = of_blocks.gains(stake)
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=16 * 0.08 * 0.3**6)
        assert (found <= exact + 1e-12 * (1 + np.abs(exact))).all()


def test_upward_stakes_stay_below_one_and_downward_ones_below_what_a_pixel_can_cost():
    rng = np.random.default_rng(1)
    found = stakes(rng.normal(size=1000), rng.exponential(size=1000) * 1e-3, np.full(1000, 0.2))
    assert -0.2 == found.min() < 0 < found.max() == 0.95


@pytest.mark.parametrize("shape", [(8, 12), (5, 7), (1, 1), (4, 3)])
def test_blocks_are_put_together_again(shape):
    image = np.arange(2 * shape[0] * shape[1], dtype=np.float64).reshape(2, *shape)
    grid = (-(-shape[0] // 4), -(-shape[1] // 4))
    np.testing.assert_array_equal(from_blocks(to_blocks(image), grid)[:, : shape[0], : shape[1]], image)


def wealth_with(image, before):
    bank = Bank.of(picture(), TOLERANCE, DETECTABLE)
    process = Process(bank.null, bank.suspicions, bank.alternatives)
    for one in (*before, image):
        process.see(to_blocks(planes(one)), 1)
    return np.exp(process.log_e), np.exp(process._against.logs)


@pytest.mark.parametrize("number", [0, 1, 3])
@pytest.mark.parametrize("pixel", [(0, 2), (17, 10), (30, 20)])
def test_wealth_is_linear_in_every_pixel_of_the_newest_image(number, pixel):
    # It is if stakes do not know the pixel they are placed on, and only then; of these none is only looked at at first.
    rng = np.random.default_rng(11)
    images = dense(rng, picture().radiance, number + 1)
    found = []
    for factor in (0.8, 1.0, 1.2):
        image = images[-1].copy()
        image[pixel] *= factor
        found.append(wealth_with(image, images[:-1]))
    for low, middle, high in zip(*found, strict=True):
        # The series for logarithms costs some of the digits.
        np.testing.assert_allclose(middle, (low + high) / 2, rtol=2e-4)


@pytest.mark.parametrize("grid", [Grid(1, 5, 0, 0), Grid(2, 6, 3, 3), Grid(4, 9, 4, 4), Grid(40, 40, 0, 0)])
def test_blocks_of_a_grid_hold_the_pixels_they_should(grid):
    image = np.random.default_rng(2).random((33, 30))
    found = grid.sums(image)
    for row in range(found.shape[0]):
        for column in range(found.shape[1]):
            y, x = grid.top + row * grid.stride, grid.left + column * grid.stride
            assert found[row, column] == pytest.approx(image[y : y + grid.side, x : x + grid.side].sum(), rel=1e-12)


def test_a_coarse_expectation_is_what_coarse_images_average_to():
    grid, expectation = Grid(2, 7, 0, 0), picture()
    images = np.moveaxis(sparse(np.random.default_rng(3), expectation.radiance, 4000), -1, 1)
    mean = np.moveaxis(grid.sums(images).mean(axis=0), 0, -1)
    coarse = coarse_expectation(expectation, grid)
    # Sums of four pixels with a relative variance of 3; six standard errors.
    np.testing.assert_allclose(mean, coarse.radiance, rtol=6 * np.sqrt(3 / 4000), atol=1e-12)


def test_grids_for_filtered_images_are_coarse_enough():
    images = filtered(np.random.default_rng(4), picture(64).radiance, 8)[..., 0]
    assert not independent(images)
    for grid in grids(images):
        assert grid.stride - grid.side >= 1
        assert independent(grid.sums(images))


def test_a_direction_is_kept_by_pixels_where_they_differ_and_by_blocks_elsewhere():
    lit = np.ones((8, 8), dtype=np.bool_)
    deviations = np.full((8, 8), 0.1)
    deviations[5, 6] = 0.5
    found = direction("a spot", 0, deviations, lit)
    assert found.uneven.tolist() == [3]
    np.testing.assert_allclose(found.even, [0.1, 0.1, 0.1, 0.0])
    assert sorted(set(np.round(found.pixels.ravel(), 9))) == [0.1, 0.5]


def test_intervals_hold_at_all_times_together():
    # Of 200 renderers, 2 may leave the interval ever; more than 12 have a probability below 1e-6.
    bank = Bank.of(picture(16), TOLERANCE, DETECTABLE)
    rng = np.random.default_rng(8)
    missed = 0
    for _ in range(200):
        court = Judge(bank, 1e-4)
        looks = [court.look(image).ratios["all"] for image in sparse(rng, picture(16).radiance, 8)]
        missed += any(not one.low <= 1 <= one.high for one in looks)
    assert missed <= 12


def test_a_large_expectation_error_leaves_nothing_to_rule_out():
    expectation = picture()
    vague = expectation.__class__(
        expectation.radiance,
        0.05 * expectation.radiance,
        expectation.error_bound.copy(),
        expectation.valid.copy(),
        expectation.provenance,
    )
    assert not Bank.of(vague, TOLERANCE, DETECTABLE).alternatives
    assert len(Bank.of(expectation, TOLERANCE, DETECTABLE).alternatives) >= 34


def test_a_contract_bounds_the_stakes_on_too_dark():
    expectation = picture()
    bound = expectation.__class__(
        expectation.radiance,
        expectation.standard_error.copy(),
        expectation.error_bound.copy(),
        expectation.valid.copy(),
        expectation.provenance,
        100 * expectation.radiance.max() * np.ones_like(expectation.radiance),
    )
    images = dense(np.random.default_rng(9), 0.9 * expectation.radiance, 2)
    free, bounded = (Judge(Bank.of(one, TOLERANCE, DETECTABLE), 1e-4) for one in (expectation, bound))
    strong, weak = ([court.look(image) for image in images][-1] for court in (free, bounded))
    assert weak.log10_e_value < strong.log10_e_value - 5
    assert any("customary" in one for one in weak.assumptions)
    null = null_of(bound, TOLERANCE)
    assert null.largest[null.lit.any(axis=1)].min() >= 100
