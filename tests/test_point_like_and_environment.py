"""Laws of lights without area, of lines and of environments; their digits are checked in ``tests/verified``."""

import re
import tracemalloc

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.emitters import Constant, CosineSky, Directional, Equirectangular, Line, Point, Receivers, Spot
from oracle.irradiances import irradiance

ORIGIN = np.zeros(3)
UP = np.array([0.0, 0.0, 1.0])
# What a value and its expectation may differ by, if both come with a bound on their error, is the bounds' sum; where
# the expectation is computed here, add some rounding of its own.
ROUNDING = 1e-14


def of(emitter, point=ORIGIN, normal=UP):
    return irradiance(emitter, Receivers(point, normal)).value[..., 0]


def normals(count, seed=1):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def assert_relative(actual, expected, tolerance=ROUNDING):
    np.testing.assert_allclose(actual, expected, rtol=tolerance, atol=0)


# -------------------------------------------------------------------------------------------------- without size


def test_a_point_follows_the_inverse_square_and_the_cosine_law():
    assert_relative(of(Point([0, 3, 4], [50.0])), 50 / 25 * 4 / 5)


def test_twice_the_distance_from_a_point_is_a_quarter_of_the_irradiance():
    near, far = of(Point([1, 2, 3], [1.0])), of(Point([2, 4, 6], [1.0]))
    assert near == 4 * far


def test_a_point_below_the_horizon_is_certainly_dark():
    found = irradiance(Point([5, 0, -1e-9], [1.0]), Receivers(ORIGIN, UP))
    assert found.value[0] == found.error[0] == 0


@pytest.mark.parametrize(("degrees", "part"), [(0, 1.0), (19, 1.0), (30, 0.5), (35, 0.25), (41, 0.0), (120, 0.0)])
def test_a_spot_falls_linearly_with_the_angle_between_beam_width_and_cutoff(degrees, part):
    angle = np.radians(degrees)
    spot = Spot(ORIGIN, UP, [1.0], np.radians(20), np.radians(40))
    towards = np.array([np.sin(angle), 0, np.cos(angle)])
    np.testing.assert_allclose(of(spot, 2 * towards, -towards), part / 4, rtol=0, atol=1e-15)


def test_directional_light_knows_no_distance():
    sun = Directional([0, -0.6, -0.8], [1000.0])
    assert_relative(of(sun, np.array([ORIGIN, 1e6 * UP])), 800.0)


@pytest.mark.parametrize(
    "emitter", [Point(UP, [1.0]), Spot(UP, UP, [1.0], 0.5, 1.0), Line([-1, 0, 1], [1, 0, 1], [1.0])]
)
def test_a_receiver_on_the_emitter_is_an_error_that_names_it(emitter):
    points = np.array([ORIGIN, UP, 2 * UP])
    with pytest.raises(InvalidArgument, match=re.escape("points[1] = [0.0, 0.0, 1.0] is ")):
        irradiance(emitter, Receivers(points, UP))
    # Among many, which are computed in pieces, it is named by its index among all.
    many = np.zeros((3, 40_000, 3))
    many[2, 30_001] = UP
    with pytest.raises(InvalidArgument, match=re.escape("points[2, 30001] = [0.0, 0.0, 1.0] is ")):
        irradiance([Constant([1.0]), emitter], Receivers(many, UP))
    with pytest.raises(InvalidArgument, match=re.escape("points = [0.0, 0.0, 1.0] is ")):
        irradiance(emitter, Receivers(UP, UP))


# ---------------------------------------------------------------------------------------------------------- lines


def test_an_infinite_line_falls_with_the_distance():
    # The integral of h^2/(h^2 + s^2)^2 is pi/(2 h); 1e6 distances of it leave out 1e-18.
    for distance in (1.0, 2.0):
        line = Line([-1e6, 0, distance], [1e6, 0, distance], [1.0])
        assert_relative(of(line), np.pi / 2 / distance)


def test_a_far_line_is_a_point_with_the_sine_of_the_angle_to_it():
    line = Line([30, 0, 40], [30 + 1e-6, 0, 40], [1.0])
    # Intensity 1e-6 x 0.8 at the distance 50 m, under the cosine 0.8; the difference is the 1e-6 m's shift by 1e-8.
    assert_relative(of(line), 1e-6 * 0.8 * 0.8 / 2500, 1e-7)


def test_a_line_is_the_sum_of_its_parts_also_where_the_horizon_cuts_it():
    a, m, b = np.array([-1, 0.5, -0.4]), np.array([0.5, 0.5, 0.35]), np.array([2, 0.5, 1.1])
    parts = of(Line(a, m, [1.0])) + of(Line(m, b, [1.0]))
    assert_relative(of(Line(a, b, [1.0])), parts)


def test_what_a_line_has_below_the_horizon_does_not_count():
    visible = of(Line([0, 1, 0], [1, 1, 2], [1.0]))
    assert_relative(of(Line([-3, 1, -6], [1, 1, 2], [1.0])), visible)


def test_the_direction_of_a_line_does_not_matter():
    a, b = np.array([-1, 0.5, -0.4]), np.array([2, 0.5, 1.1])
    assert_relative(of(Line(a, b, [1.0])), of(Line(b, a, [1.0])))


def test_a_line_does_not_shine_along_itself():
    line = Line([0, 0, 1], [0, 0, 2], [1.0])
    assert of(line) == 0
    assert of(line, 3 * UP, -UP) == 0


def test_a_line_below_the_horizon_is_certainly_dark():
    found = irradiance(Line([0, 0, -1], [1, 0, -2], [1.0]), Receivers(ORIGIN, UP))
    assert found.value[0] == found.error[0] == 0


def test_a_line_keeps_its_digits_in_any_unit_of_length():
    for scale in (1e-18, 1e17):
        line = Line(scale * np.array([0.3, 0, 1]), scale * np.array([2.0, 1, 1]), [1.0])
        assert_relative(of(line) * scale, of(Line([0.3, 0, 1], [2.0, 1, 1], [1.0])))


# -------------------------------------------------------------------------------------------------- environments


def test_a_constant_environment_gives_pi_times_its_radiance_to_everyone():
    assert_relative(of(Constant([2.0]), normal=normals(20)), 2 * np.pi)


def test_a_uniform_sky_gives_the_visible_part_of_the_hemisphere():
    receivers = normals(50)
    assert_relative(of(CosineSky(UP, [2.0], [2.0]), normal=receivers), np.pi * (1 + receivers[:, 2]), 1e-13)


def test_the_overcast_sky_is_seven_ninths_of_a_uniform_one_for_a_horizontal_receiver():
    assert_relative(of(CosineSky.cie_overcast(UP, [9.0])), 7 * np.pi)


def test_the_overcast_sky_over_tilted_receivers_is_the_known_formula():
    b = np.linspace(0, 3, 31)
    tilted = np.stack([np.sin(b), 0 * b, np.cos(b)], axis=-1)
    known = np.pi * (1 + np.cos(b)) / 6 + 4 / 9 * ((np.pi - b) * np.cos(b) + np.sin(b))
    np.testing.assert_allclose(of(CosineSky.cie_overcast(UP, [1.0]), normal=tilted), known, rtol=0, atol=ROUNDING)


def test_a_receiver_that_faces_the_ground_sees_no_sky():
    assert of(CosineSky(UP, [1.0], [1.0]), normal=-UP) == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (3, 2), (40, 64)])
def test_a_uniform_map_gives_pi_times_its_radiance_to_everyone(shape):
    texels = Equirectangular(np.full((*shape, 1), 2.0), UP, [1, 0, 0])
    everyone = np.concatenate([normals(50), np.eye(3), -np.eye(3)])
    assert_relative(of(texels, normal=everyone), 2 * np.pi)


def test_a_map_that_is_bright_above_gives_what_a_uniform_sky_gives():
    up = np.array([0.6, 0, 0.8])
    texels = Equirectangular(np.repeat([1.0, 0.0], 7)[:, None, None] * np.ones((1, 9, 1)), up, [0, 1, 0])
    everyone = normals(50)
    sky = of(CosineSky(up, [1.0], [1.0]), normal=everyone)
    np.testing.assert_allclose(of(texels, normal=everyone), sky, rtol=0, atol=ROUNDING)


def test_cutting_texels_in_pieces_changes_nothing():
    radiance = np.random.default_rng(2).lognormal(0, 3, size=(5, 7, 1))
    pieces = np.repeat(np.repeat(radiance, 9, axis=0), 11, axis=1)
    coarse, fine = (Equirectangular(image, UP, [1, 0, 0]) for image in (radiance, pieces))
    everyone = normals(50)
    assert_relative(of(fine, normal=everyone), of(coarse, normal=everyone), 1e-12)


def test_columns_go_round_counter_clockwise_from_the_front():
    # One bright column in four, from 0 to 90 degrees: between the directions front and up x front.
    radiance = np.zeros((1, 4, 1))
    radiance[0, 0] = 1
    texels = Equirectangular(radiance, UP, [1, 0, 0])
    lit = of(texels, normal=[[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    np.testing.assert_allclose(lit, [np.pi / 2, np.pi / 2, 0, 0], rtol=0, atol=ROUNDING)


def test_turning_the_map_is_turning_its_front():
    radiance = np.random.default_rng(3).uniform(size=(6, 12, 1))
    turned = Equirectangular(np.roll(radiance, 3, axis=1), UP, [1, 0, 0])
    everyone = normals(50)
    expected = of(Equirectangular(radiance, UP, [0, 1, 0]), normal=everyone)
    np.testing.assert_allclose(of(turned, normal=everyone), expected, rtol=ROUNDING)


def test_each_channel_of_a_map_stands_for_itself():
    radiance = np.random.default_rng(4).uniform(size=(6, 12, 3))
    together = irradiance(Equirectangular(radiance, UP, [1, 0, 0]), Receivers(ORIGIN, normals(9))).value
    alone = [of(Equirectangular(radiance[..., c : c + 1], UP, [1, 0, 0]), normal=normals(9)) for c in range(3)]
    assert_relative(together, np.stack(alone, axis=-1))


def test_a_large_map_stays_within_its_memory():
    texels = Equirectangular(np.ones((512, 1024, 3)), UP, [1, 0, 0])
    tracemalloc.start()
    irradiance(texels, Receivers(ORIGIN, normals(20)))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # The map itself has 13 MB.
    assert peak < 100e6
