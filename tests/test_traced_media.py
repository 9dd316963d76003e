"""Media in the reference tracer, judged by closed forms of attenuation and single scattering."""

import numpy as np
import pytest
from renderings import TOLERANCE, assert_right, pixel_means, scene_of, unit

from oracle import Area, Point, Receivers, Rectangle, Sphere, Spot
from oracle.media import Medium, Rays, point_irradiance, scattered_point
from oracle.tracer import Diffuse, Film, IrradianceMeter, Object, RadianceMeter, Scene, TwoSided, render

LIGHT = np.array([3.0, 1.0, 0.25])
ABSORBING = Medium([0.1, 0.5, 2.0], [0, 0, 0])
# One channel that neither absorbs nor scatters.
HAZE = Medium([0.1, 0.05, 0.0], [0.3, 0.8, 0.0], 0.4)


def within(medium, scene):
    """The same scene, filled with a medium."""
    return Scene(scene.objects, scene.emitters, medium)


def averaged(rendering):
    """Mean over the pixels and its standard error."""
    return rendering.mean.mean(axis=(0, 1)), np.sqrt(rendering.variance.sum(axis=(0, 1))) / rendering.mean[..., 0].size


@pytest.mark.parametrize("distance", [1e-3, 1, 30])
@pytest.mark.parametrize("strategy", ["mis", "bsdf"])
def test_a_lamp_fades_exponentially_through_a_medium_that_absorbs(distance, strategy):
    lamp = Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), None, LIGHT)
    meter = RadianceMeter([0.1, 0.2, distance], [0, 0, -1])
    shown = render(within(ABSORBING, Scene([lamp])), meter, Film(1, 1), spp=8, strategy=strategy)
    np.testing.assert_allclose(
        shown.mean[0, 0], LIGHT * np.exp(-ABSORBING.absorption * distance), rtol=1e-5, atol=1e-18
    )


FLOOR = Rectangle([0.2, 0.1, 0], [1.2, 0, 0], [0, 0.8, 0])
FILM = Film(6, 4)


@pytest.mark.parametrize("medium", [ABSORBING, HAZE], ids=["absorbing", "scattering as well"])
def test_direct_light_of_a_point_is_attenuated(medium):
    point = Point([0.3, 0.2, 0.9], LIGHT)
    measured = render(within(medium, scene_of([point])), IrradianceMeter(FLOOR), FILM, spp=1 << 10, bounces=0)
    expected = pixel_means(lambda p: point_irradiance(point, Receivers(p, FLOOR.normal), medium).value, FLOOR, FILM)
    assert_right(measured, expected, known_to=1e-3)


@pytest.mark.parametrize("asymmetry", [-0.6, 0.0, 0.4, 0.85])
@pytest.mark.parametrize("length", [0.5, 4.0])
@pytest.mark.parametrize("aside", [0.05, 1.0])
def test_the_halo_of_a_point_in_fog_is_known(asymmetry, length, aside):
    fog = Medium([0.1, 0.05, 0.0], [0.3, 0.8, 0.4], asymmetry)
    point = Point([1.0, aside, 0], LIGHT)
    # A black wall ends the line of sight, too small to shade any of it.
    wall = Object(Rectangle([length, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]))
    expected = scattered_point(point, Rays([0.0, 0, 0], [1.0, 0, 0], length), fog).value
    scene = within(fog, scene_of([point], wall))
    meter, film = RadianceMeter([0, 0, 0], [1, 0, 0]), Film(32, 32)
    mean, error = averaged(render(scene, meter, film, spp=256, bounces=1, first_bounce=1))
    assert (error < 0.02 * expected).all()
    assert (np.abs(mean - expected) < np.maximum(TOLERANCE * expected, 5 * error)).all()


def test_a_channel_that_meets_nothing_is_unchanged():
    lamp = Area(Sphere([0, 0, 2], 0.5), LIGHT)
    meter = RadianceMeter([0, 0, 0], [0, 0, 1])
    mean, error = averaged(render(within(HAZE, scene_of([lamp])), meter, Film(16, 16), spp=64))
    assert error[2] < 0.01 * LIGHT[2]
    assert abs(mean[2] - LIGHT[2]) < 5 * error[2]


@pytest.mark.parametrize("asymmetry", [-0.7, 0.0, 0.7])
def test_all_strategies_agree_on_light_scattered_once(asymmetry):
    fog = Medium([0.1, 0.05, 0.0], [0.3, 0.8, 0.4], asymmetry)
    lamps = [
        Area(Sphere([1.0, 0.7, 0], 0.3), LIGHT),
        Area(Rectangle([1.0, -0.8, 0], [0.4, 0, 0], [0, 0, -0.4]), LIGHT[::-1], two_sided=True),
    ]
    wall = Object(Rectangle([2, 0, 0], [0, 0.4, 0], [0, 0, -0.4]), TwoSided(Diffuse([0.5, 0.6, 0.7])))
    scene = within(fog, scene_of(lamps, wall))
    meter, film = RadianceMeter([0, 0, 0], [1, 0, 0]), Film(32, 32)
    found = {
        strategy: averaged(render(scene, meter, film, spp=128, seed=seed, strategy=strategy, bounces=1))
        for seed, strategy in enumerate(("mis", "light", "bsdf", "hemisphere"))
    }
    mean, error = found["mis"]
    for other, other_error in found.values():
        assert (other_error < 0.03 * mean).all()
        assert (np.abs(other - mean) < 5 * np.hypot(error, other_error)).all()


@pytest.mark.parametrize("scattering", [[2.0, 2.0, 2.0], [1.0, 1.5, 2.0]], ids=["grey", "coloured"])
@pytest.mark.parametrize("asymmetry", [0.0, 0.5])
@pytest.mark.parametrize("strategy", ["mis", "bsdf"])
def test_a_medium_that_absorbs_nothing_vanishes_in_a_furnace(scattering, asymmetry, strategy):
    fog = Medium([0, 0, 0], scattering, asymmetry)
    furnace = Object(Sphere([0, 0, 0], 1.5), None, [1, 1, 1], two_sided=True)
    meter = RadianceMeter([0.5, 0.2, -0.3], unit([0.3, -0.5, 0.7]))
    mean, error = averaged(render(within(fog, Scene([furnace])), meter, Film(16, 16), spp=64, strategy=strategy))
    assert (error < 0.03).all()
    assert (np.abs(mean - 1) < 5 * error + 1e-5).all()
    if strategy == "bsdf" and len(set(scattering)) == 1:
        assert (error < 1e-5).all()


def test_what_a_diffuse_wall_reflects_is_attenuated_on_both_ways():
    # Parallel to the line of sight the light comes along, so that both ways are known.
    wall = Object(Rectangle([0, 0, 0], [5, 0, 0], [0, 5, 0]), Diffuse([0.8, 0.8, 0.8]))
    spot = Spot([0, 0, 2], [0, 0, -1], LIGHT, 0.5, 0.6)
    meter = RadianceMeter([0, 0, 1.5], [0, 0, -1])
    shown = render(within(ABSORBING, scene_of([spot], wall)), meter, Film(1, 1), spp=8, bounces=1)
    expected = 0.8 / np.pi * LIGHT / 4 * np.exp(-ABSORBING.absorption * 3.5)
    np.testing.assert_allclose(shown.mean[0, 0], expected, rtol=1e-5)
