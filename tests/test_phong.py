"""Diffuse and Phong-type reflection: furnaces, limits, symmetries and what is refused."""

import math

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.bounded import Bounded
from oracle.emitters import Area, Directional, Receivers
from oracle.irradiances import projected_solid_angle
from oracle.reflection import lambert, phong
from oracle.shapes import Disk, Polygon, Rectangle, Sphere

SQUARE = Rectangle([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
NORMALS = [0.0, 0.0, -1.0]
EXPONENTS = [0, 1, 2, 7, 64, 1001]


def unit(*components):
    return np.array(components) / np.linalg.norm(components)


def anywhere(count, seed):
    """Receivers in front of the square, turned at random, and axes."""
    random = np.random.default_rng(seed)
    points = np.column_stack([random.uniform(-2, 2, (count, 2)), random.uniform(0.1, 3, count)])
    normals, axes = random.normal(size=(2, count, 3))
    normals[:, 2] = -np.abs(normals[:, 2]) - 0.5
    axes = axes - 2 * points / np.linalg.norm(points, axis=-1, keepdims=True)
    return (
        Receivers(points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)),
        axes / np.linalg.norm(axes, axis=-1, keepdims=True),
    )


def by_area(polygon, point, normal, axis, exponent, double, nodes=120):
    """The definition: a sum over the area of a polygon without horizons, in its plane's coordinates."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    x, w = (1 + x) / 2, w / 2
    total = 0.0
    first = polygon.vertices[0]
    for a, b in zip(polygon.vertices[1:-1] - first, polygon.vertices[2:] - first, strict=True):
        place = first + x[:, None, None] * (a + x[:, None] * (b - a)) - point
        r = np.linalg.norm(place, axis=-1)
        cosine = np.maximum(place @ normal, 0) / r if double else place @ normal > 0
        facing = -(place @ polygon.normal) / r
        area = np.cross(a, b) @ polygon.normal
        total += (
            area * ((w * x)[:, None] * w * np.maximum(place @ axis / r, 0) ** exponent * cosine * facing / r**2).sum()
        )
    return total


@pytest.mark.parametrize("exponent", EXPONENTS[:-1])
@pytest.mark.parametrize("double", [False, True])
def test_moments_are_the_integrals_that_define_them(exponent, double):
    polygon = Polygon([[-1.0, -1, 0], [1, -1, 0], [1, 0, 0], [0, 0.25, 0], [-0.5, 1, 0]])
    # All of the polygon is above both horizons, so that the integrand is smooth.
    point, normal, axis = np.array([0.3, 0.2, 1.5]), unit(0.1, 0.2, -1), unit(-0.3, 0.1, -1)
    function = phong.double_axis_moment if double else phong.axial_moment
    found = function(polygon, Receivers(point, normal), axis, exponent)
    # The sum has 120^2 nodes for each triangle: 1e-12 is its rounding.
    assert found.value == pytest.approx(by_area(polygon, point, normal, axis, exponent, double), 1e-12, 0)


def test_clipped_moments_are_the_integrals_that_define_them():
    receivers, axes = anywhere(12, seed=1)
    found = phong.double_axis_moment(SQUARE, receivers, axes, 3)
    for index in range(12):
        where = receivers.points[index], receivers.normals[index], axes[index]
        # The integrand has a kink at both horizons, where a Gauss rule is good to some digits only.
        assert found.value[index] == pytest.approx(by_area(SQUARE.polygon, *where, 3, True, 400), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_huge_light_at_normal_incidence_gives_its_radiance_times_the_reflectance(exponent):
    huge = Rectangle([0.0, 0.0, 0.0], [1e9, 0.0, 0.0], [0.0, 1e9, 0.0])
    light = Area(huge, np.array([3.0]))
    receivers = Receivers([0.0, 0.0, 1.0], NORMALS)
    found = phong.reflected_radiance(light, receivers, NORMALS, exponent, [0.5])
    # The light ends 1e-9 rad above the horizon.
    assert found.value == pytest.approx([1.5], rel=1e-8)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("cosine", [1e-6, 0.2, 0.7, 1.0])
def test_albedo_is_what_a_huge_light_shows(exponent, cosine):
    huge = Rectangle([0.0, 0.0, 0.0], [1e9, 0.0, 0.0], [0.0, 1e9, 0.0])
    view = [math.sqrt((1 - cosine) * (1 + cosine)), 0.0, -cosine]
    receivers = Receivers([0.0, 0.0, 1.0], NORMALS)
    found = phong.reflected_radiance(Area(huge, np.ones(1)), receivers, view, exponent, [1.0])
    assert found.value[0] == pytest.approx(phong.directional_albedo(cosine, exponent).value, rel=1e-7)


def test_albedo_is_one_at_normal_incidence():
    assert [phong.directional_albedo(1.0, n).value for n in EXPONENTS] == pytest.approx([1] * len(EXPONENTS), rel=1e-14)


def test_albedo_at_grazing_incidence_is_the_half_lobe():
    # int cos^n sin^2 over the half circle, times the integral of the elevation; for n = 0 a half, for n = 1 1/pi.
    assert phong.directional_albedo(0.0, 0).value == pytest.approx(1 / 2, rel=1e-14)
    assert phong.directional_albedo(0.0, 1).value == pytest.approx(1 / math.pi, rel=1e-14)


def test_albedo_never_grows_towards_grazing_angles():
    for exponent in EXPONENTS:
        assert (np.diff(phong.directional_albedo(np.linspace(0, 1, 200), exponent).value) > -1e-14).all()


def test_lobe_around_the_normal_with_exponent_zero_is_the_irradiance():
    receivers, _ = anywhere(200, seed=2)
    found = phong.double_axis_moment(SQUARE, receivers, receivers.normals, 0)
    expected = projected_solid_angle(SQUARE, receivers)
    assert (np.abs(found.value - expected.value) <= found.error + expected.error).all()


@pytest.mark.parametrize("exponent", EXPONENTS[1:])
def test_double_axis_moment_around_the_normal_is_an_axial_one(exponent):
    receivers, _ = anywhere(200, seed=3)
    double = phong.double_axis_moment(SQUARE, receivers, receivers.normals, exponent)
    axial = phong.axial_moment(SQUARE, receivers, receivers.normals, exponent + 1)
    assert (np.abs(double.value - axial.value) <= double.error + axial.error).all()


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_two_halves_make_a_whole(exponent):
    receivers, axes = anywhere(300, seed=4)
    half = [0.5, 0.0, 0.0]
    halves = [Rectangle([x, 0.0, 0.0], half, SQUARE.half_v) for x in (-0.5, 0.5)]
    whole = phong.double_axis_moment(SQUARE, receivers, axes, exponent)
    parts = [phong.double_axis_moment(part, receivers, axes, exponent) for part in halves]
    difference = np.abs(parts[0].value + parts[1].value - whole.value)
    assert (difference <= whole.error + parts[0].error + parts[1].error).all()


def test_moments_do_not_depend_on_the_unit_of_length():
    receivers, axes = anywhere(100, seed=5)
    larger = Receivers(receivers.points * 1024, receivers.normals)
    square = Rectangle(SQUARE.center, 1024 * SQUARE.half_u, 1024 * SQUARE.half_v)
    assert_same = phong.axial_moment(SQUARE, receivers, axes, 9), phong.axial_moment(square, larger, axes, 9)
    assert assert_same[1].value == pytest.approx(assert_same[0].value, rel=1e-12, abs=1e-18)


def test_light_is_dark_from_behind_and_below_the_horizon():
    axis = [0.0, 0.0, 1.0]
    assert phong.axial_moment(SQUARE, Receivers([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]), axis, 4).value == 0
    assert phong.axial_moment(SQUARE, Receivers([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), [0.0, 0.0, -1.0], 4).value == 0
    assert phong.axial_moment(SQUARE, Receivers([0.0, 0.0, 1.0], NORMALS), axis, 4).value == 0


@pytest.mark.parametrize("height", [0.3, 20.0])
def test_half_of_a_square_is_behind_a_lobe_that_lies_flat(height):
    receivers = Receivers([0.0, 0.0, height], NORMALS)
    # Flat lobes, of exponent 0, end at their own horizon: here the plane through the square's middle.
    half = phong.axial_moment(SQUARE, receivers, [1.0, 0.0, 0.0], 0).value
    assert half == pytest.approx(phong.axial_moment(SQUARE, receivers, NORMALS, 0).value / 2, rel=1e-13, abs=0)


def test_viewer_below_the_horizon_sees_nothing():
    light = Area(SQUARE, np.ones(3))
    receivers = Receivers([0.0, 0.0, 1.0], NORMALS)
    assert (phong.reflected_radiance(light, receivers, [0.0, 0.6, 0.8], 2, np.ones(3)).value == 0).all()


def test_a_viewer_along_the_surface_may_see_the_light_or_not():
    light, receivers = Area(SQUARE, np.ones(1)), Receivers([0.3, -0.2, 1.0], [0.6, 0.48, -0.64])
    along, above = np.array([-0.8, 0.36, -0.48]), np.array([0.6, 0.48, -0.64])
    for slope in (1e-13, 1e-17, -1e-17):
        found = phong.reflected_radiance(light, receivers, along + slope * above, 2, np.ones(1))
        at_most = float((found.value + found.error)[0])
        assert at_most == pytest.approx(4.88e-4, rel=1e-2)
        assert bool(found.error[0] > 1e-4) == (abs(slope) < 1e-15)


def test_receivers_and_axes_broadcast():
    receivers, axes = anywhere(6, seed=6)
    grid = Receivers(receivers.points[:, None], receivers.normals[:, None])
    assert phong.axial_moment(SQUARE, grid, axes, 2).value.shape == (6, 6)
    assert phong.reflected_radiance(Area(SQUARE, np.ones(3)), grid, axes, 2, np.ones(3)).value.shape == (6, 6, 3)


def test_white_diffuse_surface_in_a_uniform_surrounding_is_invisible():
    assert lambert.radiance(Bounded(np.array([math.pi]), np.zeros(1)), 1.0).value == pytest.approx([1], rel=1e-15)


def test_diffuse_exitance_is_pi_times_the_radiance():
    received = Bounded(np.array([1.0, 2.0, 3.0]), np.full(3, 1e-15))
    reflectance = [0.1, 0.5, 1.0]
    exitance, radiance = lambert.exitance(received, reflectance), lambert.radiance(received, reflectance)
    assert exitance.value == pytest.approx(math.pi * radiance.value, rel=1e-15)


def test_mean_of_a_diffuse_sphere_is_that_of_its_points():
    ball = Sphere([1.0, 2.0, 3.0], 2.0)
    sun = Directional(unit(-1.0, -0.5, -0.3), np.array([5.0]))
    viewer = unit(0.2, -1.0, 0.4)
    # The viewer's disk in polar coordinates, with a rule that is fine enough for the kink at the terminator.
    r, angle = np.meshgrid((np.arange(600) + 0.5) / 600, (np.arange(600) + 0.5) / 600 * 2 * np.pi, indexing="ij")
    u = unit(*np.cross(viewer, [0.0, 0.0, 1.0]))
    v = np.cross(viewer, u)
    across = r[..., None] * (np.cos(angle)[..., None] * u + np.sin(angle)[..., None] * v)
    directions = across + np.sqrt(1 - r**2)[..., None] * viewer
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    seen = lambert.sphere(ball, sun, directions, [0.5]).value[..., 0]
    mean = (seen * r).sum() / r.sum()
    phase = math.acos(-sun.direction @ viewer)
    assert lambert.disk_mean(sun.irradiance, phase, [0.5]).value == pytest.approx([mean], rel=1e-5)


def test_full_and_new_phase():
    assert lambert.phase_function([0.0, math.pi / 2]).value == pytest.approx([1, 1 / math.pi], rel=1e-15)
    # float64 has no pi: what is missing, x, leaves a crescent of x^3 / (3 pi).
    missing = 1.2246467991473532e-16
    assert lambert.phase_function(math.pi).value == pytest.approx(missing**3 / 3 / math.pi, rel=1e-14, abs=0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: phong.axial_moment(SQUARE, Receivers([0, 0, 1], NORMALS), [0, 0, 2], 1), "axes has length 2"),
        (lambda: phong.axial_moment(SQUARE, Receivers([0, 0, 1], NORMALS), NORMALS, -1), "exponent is -1"),
        (lambda: phong.axial_moment(SQUARE, Receivers([0, 0, 1], NORMALS), NORMALS, 2.5), "exponent is 2.5"),
        (lambda: phong.axial_moment(SQUARE, Receivers(np.zeros((4, 3)), NORMALS), np.ones((3, 3)) / 3**0.5, 1), "axes"),
        (lambda: phong.directional_albedo([0.5, 1.5], 1), r"cosine\[1\] is 1.5"),
        (lambda: phong.directional_albedo(math.nan, 1), "cosine is nan"),
        (
            lambda: phong.reflected_radiance(
                Area(Disk([0, 0, 0], [0, 0, 1], 1.0), [1.0]), Receivers([0, 0, 1], NORMALS), NORMALS, 1, [1.0]
            ),
            "emitter is a Disk",
        ),
        (
            lambda: phong.reflected_radiance(
                Area(SQUARE, [1.0], two_sided=True), Receivers([0, 0, 1], NORMALS), NORMALS, 1, [1.0]
            ),
            "two-sided",
        ),
        (
            lambda: phong.reflected_radiance(Area(SQUARE, [1.0]), Receivers([0, 0, 1], NORMALS), NORMALS, 1, [1.5]),
            r"reflectance\[0\] is 1.5",
        ),
        (lambda: lambert.radiance(Bounded(np.ones(1), np.zeros(1)), -0.1), "reflectance is -0.1"),
        (lambda: lambert.phase_function(4.0), "phase_angle is 4"),
    ],
)
def test_what_cannot_be_is_refused_by_name(call, message):
    with pytest.raises(InvalidArgument, match=message):
        call()
