"""Media: limits, energy, symmetries, and what is refused."""

import math

import numpy as np
import pytest

from oracle import half_space, media
from oracle.arrays import InvalidArgument
from oracle.emitters import Directional, Point, Receivers
from oracle.irradiances import irradiance

GROUND = media.HalfSpace([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
FOG = media.Medium([0.1, 0.2], [0.3, 0.5], 0.4)
LAMP = Point([0.5, 1.0, -1.5], [2.0, 3.0])
SUN = Directional(np.array([0.0, 0.6, -0.8]), [5.0, 4.0])


def rays(count, seed):
    """Rays that stay below the ground."""
    random = np.random.default_rng(seed)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return media.Rays(random.uniform(-3, -2, (count, 3)), directions, random.uniform(0.1, 1.9, count))


def simpson(function, length, steps=4000):
    """Composite rule for smooth functions of the way along a ray."""
    t = np.linspace(0, length, 2 * steps + 1)
    weights = np.full(len(t), 2.0)
    weights[1::2] = 4
    weights[[0, -1]] = 1
    return (weights * function(t)).sum() * length / (6 * steps)


def test_way_through_two_slabs_is_the_product():
    once, rest, whole = (media.transmittance([0.5, 2.0], d).value for d in (1.5, 2.5, 4.0))
    assert once * rest == pytest.approx(whole, rel=1e-14, abs=0)


def test_vacuum_lets_everything_pass():
    assert (media.transmittance([0.0, 0.0], [0.0, 1e18]).value == 1).all()
    receivers = Receivers([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])
    vacuum = media.Medium([0.0, 0.0], [0.0, 0.0])
    assert media.point_irradiance(LAMP, receivers, vacuum).value == pytest.approx(
        irradiance(LAMP, receivers).value, rel=1e-15
    )


def test_fog_swallows_a_distant_light():
    receivers = Receivers([0.0, 0.0, 1e4], [0.0, 0.0, -1.0])
    assert (media.point_irradiance(LAMP, receivers, FOG).value == 0).all()


@pytest.mark.parametrize("g", [-0.99, -0.3, 0.0, 0.5, 0.999])
def test_phase_function_integrates_to_one_with_its_mean_cosine(g):
    # In the sharp peak the distance from it varies over many scales, so that its logarithm is the variable.
    x, w = np.polynomial.legendre.leggauss(400)
    y = (1 + x) / 2 * 40 - 40
    away = 2 * np.exp(y)
    p = media.henyey_greenstein(np.sign(g or 1) * (1 - away), g).value
    weights = 2 * np.pi * w * 20 * away
    # The cosine itself is rounded, by 1e-16 beside a peak 1e-6 wide at most.
    assert (weights * p).sum() == pytest.approx(1, rel=1e-9, abs=0)
    assert (weights * p * (np.sign(g or 1) * (1 - away))).sum() == pytest.approx(g, abs=1e-9)


def test_positive_asymmetry_is_forward():
    assert media.henyey_greenstein(1.0, 0.5).value > media.henyey_greenstein(-1.0, 0.5).value


def test_isotropic_phase_function_is_constant():
    assert media.henyey_greenstein([-1.0, 0.3, 1.0], 0.0).value == pytest.approx(
        [1 / (4 * math.pi)] * 3, rel=1e-15, abs=0
    )


def test_point_light_in_fog_is_the_integral_along_the_ray():
    some = rays(10, seed=1)
    found = media.scattered_point(LAMP, some, FOG).value
    for index in range(10):
        origin, along = some.origins[index], some.directions[index]

        def integrand(t, channel, origin=origin, along=along):
            away = origin + t[:, None] * along - LAMP.position
            r = np.linalg.norm(away, axis=-1)
            phase = media.henyey_greenstein(np.clip(-(away @ along) / r, -1, 1), FOG.asymmetry).value
            return phase * np.exp(-FOG.extinction[channel] * (t + r)) / r**2

        for channel in range(2):
            mean = simpson(lambda t, c=channel: integrand(t, c), some.lengths[index])
            expected = LAMP.intensity[channel] * FOG.scattering[channel] * mean
            assert found[index, channel] == pytest.approx(expected, rel=1e-10, abs=0)


def test_parallel_light_in_fog_is_the_integral_along_the_ray():
    some = rays(10, seed=2)
    found = media.scattered_directional(SUN, some, FOG, GROUND).value
    for index in range(10):
        height, slope = some.origins[index, 2], some.directions[index, 2]
        phase = media.henyey_greenstein(-(some.directions[index] @ SUN.direction), FOG.asymmetry).value

        def left(t, channel, height=height, slope=slope):
            return np.exp(-FOG.extinction[channel] * (t - (height + t * slope) / 0.8))

        for channel in range(2):
            mean = simpson(lambda t, c=channel: left(t, c), some.lengths[index])
            expected = FOG.scattering[channel] * SUN.irradiance[channel] * phase * mean
            assert found[index, channel] == pytest.approx(expected, rel=1e-12, abs=0)


def test_a_ray_is_the_sum_of_its_pieces():
    some = rays(50, seed=3)
    half = some.lengths / 2
    near = media.Rays(some.origins, some.directions, half)
    far = media.Rays(some.origins + half[:, None] * some.directions, some.directions, half)
    left = media.transmittance(FOG.extinction, half).value
    for scattered in (
        lambda part: media.scattered_point(LAMP, part, FOG),
        lambda part: media.scattered_directional(SUN, part, FOG, GROUND),
    ):
        assert scattered(near).value + left * scattered(far).value == pytest.approx(
            scattered(some).value, rel=1e-12, abs=0
        )


def test_a_distant_point_light_is_a_parallel_one():
    distance = 1e9
    far = Point([0.0, -0.6 * distance, 0.8 * distance], [distance**2, distance**2])
    thin = media.Medium([0.0, 0.0], [1e-15, 2e-15], 0.3)
    some = rays(20, seed=4)
    parallel = media.scattered_directional(Directional(SUN.direction, np.ones(2)), some, thin, GROUND)
    # The medium fills all space for the point light, which leaves 2e-6 of its light there.
    assert media.scattered_point(far, some, thin).value == pytest.approx(parallel.value, rel=1e-5, abs=0)


def test_endless_ray_in_a_dense_medium_sees_its_first_metres():
    down = media.Rays([0.0, 0.0, 0.0], [0.0, 0.0, -1.0], 1e9)
    sun = Directional([0.0, 0.0, -1.0], [1.0])
    medium = media.Medium([1.0], [3.0])
    found = media.scattered_directional(sun, down, medium, GROUND)
    # 1/(4 pi) sigma_s / (2 sigma_t): single scattering of the half-space for perpendicular light.
    assert found.value == pytest.approx([3 / (8 * 4 * math.pi)], rel=1e-14, abs=0)


def test_single_scattering_is_the_half_spaces_brdf_without_h():
    cosine_in, cosine_out = 0.8, 0.36
    along = np.array([math.sqrt(1 - cosine_out**2), 0.0, -cosine_out])
    medium = media.Medium([1.0], [3.0])
    found = media.scattered_directional(
        Directional(SUN.direction, [1.0]), media.Rays([0, 0, 0], along, 1e6), medium, GROUND
    )
    h = half_space.h_function([cosine_in, cosine_out], 0.75).value
    brdf = half_space.half_space_brdf(cosine_in, cosine_out, 0.75).value
    assert found.value == pytest.approx([brdf * cosine_in / h.prod()], rel=1e-13, abs=0)


def test_medium_that_does_not_scatter_is_dark():
    clear = media.Medium([0.5, 0.5], [0.0, 0.0])
    assert (media.scattered_point(LAMP, rays(5, seed=5), clear).value == 0).all()
    assert (media.scattered_directional(SUN, rays(5, seed=5), clear, GROUND).value == 0).all()


def test_ray_without_length_is_dark():
    none = media.Rays([0.0, 0.0, -1.0], [0.0, 0.0, -1.0], 0.0)
    assert (media.scattered_point(LAMP, none, FOG).value == 0).all()
    assert (media.scattered_directional(SUN, none, FOG, GROUND).value == 0).all()


def test_light_on_the_line_of_the_ray_but_beyond_it_is_no_harm():
    lamp, fog = Point([0.0, 0.0, 0.0], [1.0]), media.Medium([0.0], [1.0])
    towards = media.Rays([0.0, 0.0, 3.0], [0.0, 0.0, -1.0], 2.0)
    # The way from the lamp to any point of the ray and on to its origin is 3 m; the integral of 1/r^2 goes from 1 to 3.
    found = media.scattered_point(lamp, towards, fog)
    assert found.value == pytest.approx([(1 - 1 / 3) / (4 * math.pi) * math.exp(-3)], rel=1e-13, abs=0)


@pytest.mark.parametrize("albedo", [0.0, 0.1, 0.7, 0.999, 1.0])
def test_h_solves_its_integral_equation(albedo):
    # Nodes are dense at 0, where the solution has a logarithm.
    x, w = np.polynomial.legendre.leggauss(300)
    y = (1 + x) / 2
    nodes, weights = y**4, w / 2 * 4 * y**3
    h, mu = half_space.h_function(nodes, albedo).value, np.array([0.05, 0.3, 0.8, 1.0])
    here = half_space.h_function(mu, albedo).value
    integral = (weights * h / (mu[:, None] + nodes)).sum(axis=-1)
    assert here == pytest.approx(1 + albedo / 2 * mu * here * integral, rel=1e-12, abs=0)


@pytest.mark.parametrize("albedo", [0.1, 0.7, 0.999, 1.0])
def test_albedo_of_a_half_space_is_its_brdfs_integral(albedo):
    x, w = np.polynomial.legendre.leggauss(300)
    y = (1 + x) / 2
    nodes, weights = y**4, w / 2 * 4 * y**3
    brdf = half_space.half_space_brdf(0.6, nodes, albedo).value
    found = half_space.half_space_albedo(0.6, albedo).value
    assert found == pytest.approx(2 * np.pi * (weights * brdf * nodes).sum(), rel=1e-12, abs=0)


def test_half_space_that_absorbs_nothing_reflects_everything():
    assert half_space.half_space_albedo([0.0, 0.5, 1.0], 1.0).value == pytest.approx([1, 1, 1], rel=1e-15, abs=0)


def test_brdf_of_a_half_space_is_reciprocal():
    there, back = half_space.half_space_brdf(0.2, 0.9, 0.8), half_space.half_space_brdf(0.9, 0.2, 0.8)
    assert there.value == pytest.approx(back.value, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: media.Medium([0.1], [-0.1]), r"scattering\[0\] is -0.1"),
        (lambda: media.Medium([0.1], [0.1, 0.2]), "differ in shape"),
        (lambda: media.Medium([0.1], [0.1], 1.0), "asymmetry is 1"),
        (lambda: media.Rays([0, 0, 0], [0, 0, 2], 1.0), "directions has length 2"),
        (lambda: media.Rays([0, 0, 0], [0, 0, 1], -1.0), "lengths is -1"),
        (lambda: media.Rays(np.zeros((2, 3)), [0, 0, 1], np.ones(3)), "do not fit together"),
        (lambda: media.transmittance([0.1], math.nan), "distance is nan"),
        (lambda: media.henyey_greenstein(1.5, 0.5), "cosine is 1.5"),
        (
            lambda: media.scattered_point(LAMP, media.Rays([0.5, 1.0, 0.0], [0, 0, -1], 2.0), FOG),
            r"rays\[0\] pass through the light",
        ),
        (
            lambda: media.scattered_point(Point([0, 0, 0], [1.0]), rays(2, seed=6), FOG),
            "emitter has 1 channels, medium has 2",
        ),
        (
            lambda: media.scattered_directional(SUN, media.Rays([0, 0, -1.0], [0, 0, 1.0], 2.0), FOG, GROUND),
            "leave the half-space",
        ),
        (
            lambda: media.scattered_directional(Directional([0, 0, 1.0], [1.0, 1.0]), rays(2, seed=7), FOG, GROUND),
            "does not point into the half-space",
        ),
        (lambda: half_space.h_function(1.5, 0.5), "cosine is 1.5"),
        (lambda: half_space.half_space_brdf(0.0, 0.5, 0.5), "cosine_in is 0"),
        (lambda: half_space.half_space_albedo(0.5, 1.5), "albedo is 1.5"),
    ],
)
def test_what_cannot_be_is_refused_by_name(call, message):
    with pytest.raises(InvalidArgument, match=message):
        call()
