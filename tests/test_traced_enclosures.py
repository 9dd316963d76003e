"""Light between surfaces that see each other, in the reference tracer, judged by closed forms of enclosures."""

import numpy as np
import pytest
from renderings import TOLERANCE, scene_of, unit

from oracle import Area, Disk, Point, Rectangle, Sphere
from oracle.enclosures import concentric_spheres, integrating_sphere, parallel_plates
from oracle.tracer import Diffuse, Film, Object, RadianceMeter, TwoSided, render

EMISSION = np.array([[3.0, 1.0, 0.5], [0.2, 0.7, 1.0]])
REFLECTANCE = np.array([[0.3, 0.6, 0.9], [0.8, 0.5, 0.95]])


def assert_shows(scene, origin, direction, expected, known_to=5e-3, spp=64, **options):
    """The radiance along a ray, by the mean of all pixels, is right to 0.05 % or five standard errors."""
    shown = render(scene, RadianceMeter(origin, unit(direction)), Film(16, 16), spp=spp, **options)
    mean, error = shown.mean.mean(axis=(0, 1)), np.sqrt(shown.variance.sum(axis=(0, 1))) / 256
    assert (error <= known_to * expected).all(), error / expected
    assert (np.abs(mean - expected) <= np.maximum(TOLERANCE * expected, 5 * error)).all(), (mean / expected, error)


@pytest.mark.parametrize("bounces", [0, 1, 2, 5, None])
@pytest.mark.parametrize("strategy", ["mis", "light", "bsdf"])
def test_one_sphere_in_another(bounces, strategy):
    inner = Object(Sphere([0.5, 0.2, -0.3], 0.6), Diffuse(REFLECTANCE[0]), EMISSION[0])
    outer = Object(Sphere([0.5, 0.2, -0.3], 1.1), TwoSided(Diffuse(REFLECTANCE[1])), EMISSION[1], two_sided=True)
    expected = concentric_spheres(0.6, 1.1, EMISSION, REFLECTANCE, bounces).value
    between = [0.5, 1.0, -0.3]
    scene = scene_of([], inner, outer)
    options = {"strategy": strategy, "bounces": bounces, "known_to": 0.04}
    assert_shows(scene, between, [0.1, -1, 0.2], expected[0], **options)
    assert_shows(scene, between, [1, 0.3, 0.1], expected[1], **options)


@pytest.mark.parametrize("bounces", [0, 1, 2, 3, 8, None])
@pytest.mark.parametrize("alone", [False, True], ids=["all bounces", "the last one alone"])
def test_two_plates_that_see_nothing_but_each_other(bounces, alone):
    # Plates 20,000 times as wide as their distance lose 1e-8 of the light at each reflection in the middle.
    plates = [
        Object(Rectangle([0, 0, 0], [1e4, 0, 0], [0, 1e4, 0]), Diffuse(REFLECTANCE[0]), EMISSION[0]),
        Object(Rectangle([0, 0, 1], [0, 1e4, 0], [1e4, 0, 0]), Diffuse(REFLECTANCE[1]), EMISSION[1]),
    ]
    expected = parallel_plates(EMISSION, REFLECTANCE, bounces).value
    options = {"strategy": "bsdf", "bounces": bounces, "known_to": 0.01}
    if alone:
        if bounces is None:
            return
        expected = expected - (parallel_plates(EMISSION, REFLECTANCE, bounces - 1).value if bounces else 0)
        options["first_bounce"] = bounces
    for direction, radiance in (([0.1, 0.3, -1], expected[0]), ([-0.2, 0.5, 1], expected[1])):
        assert_shows(scene_of([], *plates), [0.3, 0.2, 0.4], direction, radiance, **options)


@pytest.mark.parametrize(
    ("bounces", "alone"), [(1, False), (2, False), (4, False), (None, False), (2, True), (3, True)]
)
@pytest.mark.parametrize(
    "source",
    [
        Point([0.3, -0.2, 0.4], [3.0, 2.0, 1.0]),
        Area(Sphere([0.3, -0.2, 0.4], 0.001), [3e5, 2e5, 1e5]),
        Area(Disk([0.1, 0.2, 0.3], unit([0.2, 0.1, 1]), 0.001), [3e6, 2e6, 1e6], two_sided=True),
    ],
    ids=["a point", "a small sphere", "a small disk"],
)
def test_an_integrating_sphere_with_a_source_off_its_centre(source, bounces, alone):
    # The sources hide a millionth of the wall.
    sphere, rho = Sphere([0, 0, 0], 1.0), np.array([0.5, 0.7, 0.9])
    scene = scene_of([source], Object(sphere, TwoSided(Diffuse(rho))))
    for towards in (unit([1, 0.2, 0.1]), unit([-0.3, -0.5, 1])):
        # One reflection more than at the wall point itself.
        reflected = None if bounces is None else bounces - 1
        irradiance = integrating_sphere(sphere, source, towards, rho, reflected).value
        if alone:
            irradiance = irradiance - integrating_sphere(sphere, source, towards, rho, reflected - 1).value
        origin = np.array([0.1, 0.4, -0.2])
        meter = {"bounces": bounces, "first_bounce": bounces if alone else 0, "known_to": 0.01, "spp": 128}
        assert_shows(scene, origin, towards - origin, rho / np.pi * irradiance, **meter)
