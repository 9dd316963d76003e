"""Enclosures: bounces, energy, limits, and what is refused."""

import math

import numpy as np
import pytest

from oracle import enclosures
from oracle.arrays import InvalidArgument
from oracle.emitters import Area, Point
from oracle.shapes import Disk, Polygon, Rectangle, Sphere

EMISSION = [2.0, 1.0, 0.5]
REFLECTANCE = [0.0, 0.5, 0.9]
BALL = Sphere([1.0, -2.0, 3.0], 2.0)


def wall(count=12):
    """Directions and weights of a product rule over the sphere, exact for polynomials."""
    z, w = np.polynomial.legendre.leggauss(count)
    angle = np.arange(2 * count) * np.pi / count
    flat = np.sqrt(1 - z**2)[:, None]
    directions = np.stack(
        [flat * np.cos(angle), flat * np.sin(angle), np.broadcast_to(z[:, None], (count, 2 * count))], -1
    )
    return directions, np.broadcast_to(w[:, None] / (4 * count), directions.shape[:-1])[..., None]


def test_box_without_bounces_shows_its_emission():
    assert enclosures.closed_box(EMISSION, REFLECTANCE, 0).value == pytest.approx(EMISSION, rel=1e-15)


def test_each_bounce_adds_a_power_of_the_reflectance():
    sums = [enclosures.closed_box(EMISSION, REFLECTANCE, n).value for n in range(10)]
    for n, step in enumerate(np.diff(sums, axis=0)):
        assert step == pytest.approx(EMISSION * np.array(REFLECTANCE) ** (n + 1), rel=1e-13, abs=1e-15)


def test_many_bounces_are_all_bounces():
    endless = enclosures.closed_box(EMISSION, REFLECTANCE).value
    assert endless == pytest.approx(np.array(EMISSION) / (1 - np.array(REFLECTANCE)), rel=1e-15)
    assert enclosures.closed_box(EMISSION, REFLECTANCE, 1000).value == pytest.approx(endless, rel=1e-14)


def test_white_box_grows_by_the_emission_with_each_bounce():
    assert enclosures.closed_box(2.0, 1.0, 7).value == 16


@pytest.mark.parametrize("bounces", [0, 1, 5, 30])
def test_bounces_are_seen_in_every_channel(bounces):
    rho = [0.3, 0.9, 1.0]
    radiance = enclosures.closed_box(EMISSION, rho, bounces).value
    # The thirtieth bounce of a reflectance of 0.3 is 1e-16 of all light: which one it was is lost in rounding.
    tolerance = [1e-14 / 0.3**bounces if bounces < 20 else math.inf, 1e-12, 1e-12]
    assert (np.abs(enclosures.bounces_seen(radiance, EMISSION, rho) - bounces) <= tolerance).all()


def test_more_than_all_bounces_are_infinitely_many():
    assert enclosures.bounces_seen(2.1, 1.0, 0.5) == math.inf


def test_darkness_is_one_bounce_less_than_emission():
    assert enclosures.bounces_seen(0.0, 1.0, [0.5, 1.0]) == pytest.approx([-1, -1], abs=1e-15)


def test_equal_plates_are_a_box():
    plates = enclosures.parallel_plates([EMISSION, EMISSION], [REFLECTANCE, REFLECTANCE], 5).value
    box = enclosures.closed_box(EMISSION, REFLECTANCE, 5).value
    assert plates == pytest.approx(np.array([box, box]), rel=1e-14)


@pytest.mark.parametrize("bounces", [None, 0, 1, 2, 9])
def test_plates_are_two_patches_that_see_only_each_other(bounces):
    emission, rho = [EMISSION, [1.0, 0.0, 3.0]], [REFLECTANCE, [0.4, 0.8, 0.2]]
    plates = enclosures.parallel_plates(emission, rho, bounces).value
    patches = enclosures.radiosity([[0, 1], [1, 0]], emission, rho, bounces).value
    assert plates == pytest.approx(patches, rel=1e-14)


@pytest.mark.parametrize("bounces", [None, 0, 1, 2, 9])
def test_spheres_are_two_patches(bounces):
    emission, rho = [EMISSION, [1.0, 0.0, 3.0]], [REFLECTANCE, [0.4, 0.8, 0.2]]
    spheres = enclosures.concentric_spheres(1.0, 2.0, emission, rho, bounces).value
    patches = enclosures.radiosity([[0, 1], [0.25, 0.75]], emission, rho, bounces).value
    assert spheres == pytest.approx(patches, rel=1e-14)


def test_narrow_gap_between_spheres_is_one_between_plates():
    emission, rho = [EMISSION, [1.0, 0.0, 3.0]], [REFLECTANCE, [0.4, 0.8, 0.2]]
    spheres = enclosures.concentric_spheres(1 - 1e-9, 1.0, emission, rho).value
    # The view factor is 2e-9 from 1.
    assert spheres == pytest.approx(enclosures.parallel_plates(emission, rho).value, rel=1e-7)


def test_tiny_inner_sphere_leaves_the_outer_one_a_box():
    spheres = enclosures.concentric_spheres(1e-9, 1.0, [EMISSION, EMISSION], [[0.5] * 3, REFLECTANCE]).value
    assert spheres[1] == pytest.approx(enclosures.closed_box(EMISSION, REFLECTANCE).value, rel=1e-14)


def test_many_bounces_between_patches_are_all_bounces():
    factors, emission = [[0.1, 0.6, 0.2], [0.0, 0.5, 0.5], [0.3, 0.3, 0.3]], [[1.0], [2.0], [0.0]]
    rho = [[0.9], [0.2], [0.5]]
    endless = enclosures.radiosity(factors, emission, rho).value
    assert enclosures.radiosity(factors, emission, rho, 200).value == pytest.approx(endless, rel=1e-13)


def test_patches_absorb_what_they_emit():
    factors, areas = np.array([[0, 1], [0.25, 0.75]]), np.array([[1.0], [4.0]])
    emission, rho = np.array([EMISSION, [1.0, 0.0, 3.0]]), np.array([REFLECTANCE, [0.4, 0.8, 0.2]])
    value = enclosures.radiosity(factors, emission, rho).value
    absorbed = areas * (1 - rho) * (factors @ value)
    # All that leaves the surfaces in a closed enclosure ends in them.
    assert absorbed.sum(axis=0) == pytest.approx((areas * emission).sum(axis=0), rel=1e-14)


def test_wall_of_an_integrating_sphere_receives_its_mean_flux():
    source = Point(BALL.center + np.array([0.4, 0.3, -0.2]), [1.0, 2.0, 3.0])
    directions, weights = wall(40)
    found = enclosures.integrating_sphere(BALL, source, directions, REFLECTANCE)
    mean = (found.value * weights).sum(axis=(0, 1))
    # An 80th-degree rule; the source is at a quarter of the radius.
    assert mean == pytest.approx(4 * np.pi * source.intensity / BALL.area / (1 - np.array(REFLECTANCE)), rel=1e-13)


def test_reflected_light_is_the_same_everywhere_in_a_sphere():
    source = Point(BALL.center + np.array([1.0, 0.0, 0.5]), [1.0, 2.0, 3.0])
    directions, _ = wall()
    total = enclosures.integrating_sphere(BALL, source, directions, REFLECTANCE).value
    reflected = total - enclosures.integrating_sphere(BALL, source, directions, REFLECTANCE, 0).value
    assert np.ptp(reflected, axis=(0, 1)) == pytest.approx([0, 0, 0], abs=1e-13)


def test_central_point_lights_all_of_the_sphere_equally():
    directions, _ = wall()
    found = enclosures.integrating_sphere(BALL, Point(BALL.center, [1.0]), directions, [0.5]).value
    assert found == pytest.approx(np.full_like(found, 2 / BALL.radius**2), rel=1e-14)


@pytest.mark.parametrize("two_sided", [False, True])
def test_square_in_a_sphere_gives_all_its_flux(two_sided):
    square = Rectangle(BALL.center, [0.01, 0, 0], [0, 0.01, 0])
    directions, weights = wall(100)
    found = enclosures.integrating_sphere(BALL, Area(square, [5.0], two_sided), directions, [0.8], 0)
    flux = np.pi * square.area * 5 * (2 if two_sided else 1)
    # The irradiance has a kink in the square's plane.
    assert (found.value * weights).sum() * BALL.area == pytest.approx(flux, rel=1e-3)


def test_both_sides_of_a_square_are_reflected():
    square = Rectangle(BALL.center, [0.01, 0, 0], [0, 0.01, 0])
    one, both = (
        enclosures.integrating_sphere(BALL, Area(square, [5.0], two_sided), [0, 0, 1], [0.8], None).value
        - enclosures.integrating_sphere(BALL, Area(square, [5.0], two_sided), [0, 0, 1], [0.8], 0).value
        for two_sided in (False, True)
    )
    assert both == pytest.approx(2 * one, rel=1e-12)


def test_one_bounce_in_a_sphere_adds_one_reflection():
    source = Point(BALL.center, [1.0])
    direct, once = (enclosures.integrating_sphere(BALL, source, [0, 0, 1], [0.5], n).value for n in (0, 1))
    assert once == pytest.approx(1.5 * direct, rel=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: enclosures.closed_box(1.0, 1.0), "reflectance is 1, so that light never ends"),
        (lambda: enclosures.closed_box([1, 1, 1], [0.5, 1.0, 0.5]), r"reflectance\[1\] is 1"),
        (lambda: enclosures.closed_box(1.0, 1.1), "reflectance is 1.1"),
        (lambda: enclosures.closed_box(-1.0, 0.5), "emission is -1"),
        (lambda: enclosures.closed_box(1.0, 0.5, -1), "bounces is -1"),
        (lambda: enclosures.closed_box(1.0, 0.5, 1.5), "bounces is 1.5"),
        (lambda: enclosures.closed_box([1, 1], [0.5, 0.5, 0.5]), "do not fit together"),
        (lambda: enclosures.bounces_seen(1.0, 0.0, 0.5), "emission is 0"),
        (lambda: enclosures.bounces_seen(1.0, 1.0, 0.0), "reflectance is 0"),
        (lambda: enclosures.parallel_plates([[1.0], [1.0]], [[1.0], [1.0]]), "light never ends"),
        (lambda: enclosures.parallel_plates([1.0, 1.0], [0.5, 0.5]), r"it must be \(2, C\)"),
        (lambda: enclosures.concentric_spheres(2.0, 1.0, [[1.0], [1.0]], [[0.5], [0.5]]), "inner_radius is 2"),
        (lambda: enclosures.concentric_spheres(1.0, 2.0, [[1.0], [1.0]], [[1.0], [1.0]]), "light never ends"),
        (lambda: enclosures.radiosity([[0.6, 0.5], [0, 1]], [[1], [1]], [[0.5], [0.5]]), r"view_factors\[0\] is 1.1"),
        (lambda: enclosures.radiosity([[0, 1], [1, 0]], [[1], [1]], [[1], [1]]), "light never ends"),
        (lambda: enclosures.radiosity([[0, 1]], [[1], [1]], [[1], [1]]), r"it must be \(N, N\)"),
        (lambda: enclosures.integrating_sphere(BALL, Point([9, 0, 0], [1]), [0, 0, 1], [0.5]), "source reaches"),
        (
            lambda: enclosures.integrating_sphere(
                BALL, Area(Disk(BALL.center, [0, 0, 1], 2.5), [1.0]), [0, 0, 1], [0.5]
            ),
            "source reaches 0.5 m beyond",
        ),
        (lambda: enclosures.integrating_sphere(BALL, Point(BALL.center, [1]), [0, 0, 1], [0.5, 0.5]), "channels"),
        (lambda: enclosures.integrating_sphere(BALL, Point(BALL.center, [1]), [0, 0, 1], [1.0]), "light never ends"),
    ],
)
def test_what_cannot_be_is_refused_by_name(call, message):
    with pytest.raises(InvalidArgument, match=message):
        call()


def test_one_lossless_patch_among_others_is_no_harm():
    found = enclosures.radiosity([[0, 1], [1, 0]], [[1.0], [0.0]], [[1.0], [0.5]])
    assert found.value == pytest.approx(np.array([[2.0], [1.0]]), rel=1e-14)


def test_sources_of_every_flat_shape_fit_into_the_sphere():
    triangle = Polygon(BALL.center + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    found = enclosures.integrating_sphere(BALL, Area(triangle, [1.0]), [0, 0, -1], [0.5])
    assert found.value == pytest.approx([np.pi * 0.5 / BALL.area], rel=1e-14)
