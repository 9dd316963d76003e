"""What each mistake shows, where that is known by other reasoning than the package's."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from quadrature import converged
from scipy.integrate import dblquad, quad

from oracle.arrays import InvalidArgument
from oracle.emitters import Area, Constant, CosineSky, Directional, Equirectangular, Line, Point, Receivers, Spot
from oracle.irradiances import irradiance
from oracle.mistakes import MISTAKES, applies, mistaken_irradiance
from oracle.mistakes.quadrature import Kernel, over_line, over_shape
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere

UP, DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
FLOOR = Receivers([0, 0, 0], UP)
# The integrals' own aim is 1e-8.
PRECISE = 1e-8
ROUNDING = 1e-13

# A disk of radius 3 at height 4, seen straight: the rim is 5 away, at the cosine 4/5.
DISK = Area(Disk([0, 0, 4], DOWN, 3.0), [2.0])
HALF, CUBIC = 2 * np.pi * (1 - 0.8), 2 * np.pi / 3 * (1 - 0.8**3)
# A sphere of radius 3 whose center is 5 away: it fills the cone with the sine 3/5.
SPHERE = Area(Sphere([0, 0, 5], 3.0), [2.0])
# A line of length 6 at height 4.
LINE = Line([-3, 0, 4], [3, 0, 4], [2.0])
POINT = Point([3, 0, 4], [2.0])
SPOT = Spot([0, 0, 2], DOWN, [2.0], 0.3, 0.9)
SLANTED = Directional([0.6, 0, -0.8], [2.0])
RECTANGLE = Area(Rectangle([1, 0, 4], [0, 1, 0], [2, 0, 0]), [2.0])

EMITTERS = {
    "point": POINT,
    "spot": SPOT,
    "directional": SLANTED,
    "line": LINE,
    "constant": Constant([2.0]),
    "sky": CosineSky(np.array([0.6, 0, 0.8]), [1.0], [3.0]),
    "disk": DISK,
    "rectangle": RECTANGLE,
    "sphere": SPHERE,
    "polygon": Area(Polygon([[0, 1, 4], [0.3, 0.3, 4], [1, 0, 4], [0, 0, 4]]), [2.0]),
    "mesh": Area(Mesh([[0, 0, 4], [0, 1, 4], [1, 0, 4], [0, 0, 5]], [[0, 1, 2], [0, 2, 3]]), [2.0]),
}
AROUND = Receivers([[0, 0, 0], [0.2, 0.1, 0], [1, 1, 0]], [[0, 0, 1], [0.6, 0, 0.8], [-0.8, 0, 0.6]])


def shown(name, emitter, receivers=FLOOR, **more):
    return mistaken_irradiance(MISTAKES[name], emitter, receivers, **more).value.ravel()


@pytest.mark.parametrize(
    ("name", "emitter", "expected"),
    [
        ("no receiver cosine", POINT, 2 / 25),
        ("receiver cosine squared", POINT, 2 * 0.8**2 / 25),
        ("distance to the power 1", POINT, 2 * 0.8 / 5),
        ("distance to the power 3", POINT, 2 * 0.8 / 125),
        ("no distance", POINT, 2 * 0.8),
        ("no receiver cosine", SLANTED, 2.0),
        ("receiver cosine squared", SLANTED, 2 * 0.64),
        ("no receiver cosine", Constant([2.0]), 4 * np.pi),
        ("receiver cosine squared", Constant([2.0]), 4 * np.pi / 3),
        ("no receiver cosine", SPOT, 2 / 4),
        ("distance to the power 1", SPOT, 2 / 2),
    ],
)
def test_without_size_the_wrong_law_is_elementary(name, emitter, expected):
    np.testing.assert_allclose(shown(name, emitter), expected, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("no receiver cosine", HALF),
        ("receiver cosine squared", CUBIC),
        ("no light cosine", HALF),
        ("light cosine squared", CUBIC),
        ("distance to the power 1", 4 * HALF),
        ("distance to the power 3", CUBIC / 4),
        ("no distance", np.pi * 16 * np.log(25 / 16)),
    ],
)
def test_below_a_disk_the_wrong_integral_has_an_antiderivative(name, expected):
    np.testing.assert_allclose(shown(name, DISK), 2 * expected, rtol=PRECISE)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("no receiver cosine", 6 / (4 * 5)),
        ("no light cosine", 6 / (4 * 5)),
        ("no distance", 2 * 4 * np.arctan(3 / 4)),
        ("distance to the power 1", 6 / 5 * 4 / 4),
    ],
)
def test_below_a_line_the_wrong_integral_has_an_antiderivative(name, expected):
    np.testing.assert_allclose(shown(name, LINE), 2 * expected, rtol=PRECISE)


def test_without_its_cosine_a_receiver_sees_the_solid_angle():
    np.testing.assert_allclose(shown("no receiver cosine", SPHERE), 2 * 2 * np.pi * (1 - 0.8), rtol=PRECISE)
    # Half of a sphere at the horizon.
    sideways = Receivers([0, 0, 0], [1, 0, 0])
    np.testing.assert_allclose(shown("no receiver cosine", SPHERE, sideways), 2 * np.pi * (1 - 0.8), rtol=PRECISE)
    # A corner of a cube fills an eighth of all directions: half a cube's face, by symmetry, a third of a quarter.
    face = Area(Rectangle([0, 0, 1], [0, 1, 0], [1, 0, 0]), [1.0])
    np.testing.assert_allclose(shown("no receiver cosine", face), 4 * np.pi / 6, rtol=PRECISE)


@pytest.mark.parametrize("tilt", [0.0, 0.4, 0.9, 1.2, 1.6, 2.0])
@pytest.mark.parametrize(("name", "power"), [("no receiver cosine", 0), ("receiver cosine squared", 2)])
def test_a_sphere_cut_by_the_horizon_agrees_with_rings_of_directions(name, power, tilt):
    sigma = np.arcsin(0.6)

    def ring(theta):
        """Width of the sphere's disk in the sky at the angle theta from the normal."""
        around = np.sin(theta) * np.sin(tilt)
        if around < 1e-300:
            return 2 * np.pi * (abs(theta - tilt) < sigma)
        return 2 * np.arccos(np.clip((np.cos(sigma) - np.cos(theta) * np.cos(tilt)) / around, -1, 1))

    low, high = max(0.0, tilt - sigma), min(np.pi / 2, tilt + sigma)
    kinks = [p for p in (abs(tilt - sigma), sigma - tilt) if low < p < high]
    pieces = [low, *sorted(set(kinks)), high]
    expected = sum(
        quad(lambda a: np.cos(a) ** power * np.sin(a) * ring(a), x, y, epsabs=1e-12, epsrel=1e-11, limit=200)[0]
        for x, y in pairwise(pieces)
    )
    tilted = Receivers([0, 0, 0], [np.sin(tilt), 0, np.cos(tilt)])
    np.testing.assert_allclose(shown(name, SPHERE, tilted), 2 * expected, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "light", "distance"),
    [
        ("distance to the power 1", 1, 1),
        ("distance to the power 3", 1, 3),
        ("no distance", 1, 0),
        ("no light cosine", 0, 2),
        ("light cosine squared", 2, 2),
    ],
)
def test_a_sphere_above_the_horizon_agrees_with_an_integral_over_its_disk_in_the_sky(name, light, distance):
    tilt = 0.5

    def integrand(psi):
        r = 5 * np.cos(psi) - np.sqrt(max(9 - 25 * np.sin(psi) ** 2, 0.0))
        cosine = (5 * np.cos(psi) - r) / 3
        return 2 * np.pi * np.cos(tilt) * np.cos(psi) * np.sin(psi) * r ** (2 - distance) * cosine ** (light - 1)

    # Towards the rim the square root is steep; the substitution psi = sigma (1 - u^2) flattens it.
    sigma = np.arcsin(0.6)
    expected = quad(lambda u: integrand(sigma * (1 - u * u)) * 2 * sigma * u, 0, 1, epsrel=1e-11)[0]
    tilted = Receivers([0, 0, 0], [np.sin(tilt), 0, np.cos(tilt)])
    np.testing.assert_allclose(shown(name, SPHERE, tilted), 2 * expected, rtol=1e-7)


@pytest.mark.parametrize(
    ("name", "powers"),
    [
        ("no receiver cosine", (0, 1, 2)),
        ("receiver cosine squared", (2, 1, 2)),
        ("no light cosine", (1, 0, 2)),
        ("light cosine squared", (1, 2, 2)),
        ("distance to the power 1", (1, 1, 1)),
        ("distance to the power 3", (1, 1, 3)),
        ("no distance", (1, 1, 0)),
    ],
)
@pytest.mark.parametrize("light", ["rectangle", "disk"])
def test_a_light_cut_by_the_horizon_agrees_with_quadrature_over_its_upper_part(name, powers, light):
    # Where the plane 0.8 x + 0.6 z through the receiver meets the light.
    normal, point = np.array([0.8, 0.0, 0.6]), np.array([0.2, 0.1, 3.6 - 0.8 / 3])
    receiver = Receivers(point, normal)
    edge = point[0] - 0.75 * (4 - point[2])

    def density(y, x):
        offset = np.array([x, y, 4.0]) - point
        r = np.linalg.norm(offset)
        a, b, k = powers
        return 2 * (normal @ offset / r) ** a * (offset[2] / r) ** b / r**k

    if light == "rectangle":
        low, high, half = max(edge, -1.0), 3.0, lambda x: 1.0
    else:
        low, high, half = max(edge, -3.0), 3.0, lambda x: np.sqrt(max(9 - x * x, 0.0))
    assert low == edge
    expected = dblquad(density, low, high, lambda x: -half(x), half, epsabs=1e-9, epsrel=1e-9)[0]
    # Scipy's own precision at the disk's rim.
    np.testing.assert_allclose(shown(name, EMITTERS[light], receiver), expected, rtol=1e-7)


# ------------------------------------------------------------------------------------ the integrator, without mistake


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("name", ["disk", "rectangle", "sphere", "polygon", "mesh"])
def test_with_the_right_integrand_the_integrator_finds_irradiance(name, two_sided):
    random = np.random.default_rng(3)
    normals = random.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    scale = 10 ** random.uniform(-4, 2, (40, 1))
    points = np.array([0.3, 0.2, 4.0]) + scale * random.normal(size=(40, 3))
    emitter = dataclasses.replace(EMITTERS[name], radiance=[1.0], two_sided=two_sided)
    found = over_shape(Kernel(1, 1, 2), emitter.shape, two_sided, points, normals)
    right = irradiance(emitter, Receivers(points, normals))
    difference = np.abs(found.value - right.value[..., 0])
    assert (difference <= found.error + right.error[..., 0]).all()
    # Very near the light, or where little of it is above the horizon, rounding takes its part of the digits.
    assert (found.error <= 1e-6 * np.abs(right.value[..., 0]) + 1e-9).all()


def test_with_the_right_integrand_the_integrator_finds_the_irradiance_of_lines():
    random = np.random.default_rng(4)
    normals = random.normal(size=(60, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    points = np.array([0.3, 0.2, 4.0]) + 10 ** random.uniform(-2, 2, (60, 1)) * random.normal(size=(60, 3))
    found = over_line(Kernel(1, 1, 2), LINE.start, LINE.end, points, normals)
    right = irradiance(dataclasses.replace(LINE, intensity_per_length=[1.0]), Receivers(points, normals))
    assert (np.abs(found.value - right.value[..., 0]) <= found.error + right.error[..., 0]).all()
    assert (found.error <= 1e-6 * right.value[..., 0] + 1e-12).all()


POWERS = {
    "no receiver cosine": (0, 1, 2),
    "receiver cosine squared": (2, 1, 2),
    "no light cosine": (1, 0, 2),
    "light cosine squared": (1, 2, 2),
    "distance to the power 1": (1, 1, 1),
    "distance to the power 3": (1, 1, 3),
    "no distance": (1, 1, 0),
}
# A point of the light and its normal, each (N, 3), and the area per unit square, (N,), for places (N, 2) in that.
SURFACES = {
    "rectangle": lambda st: (
        np.array([-1, -1, 4]) + st @ np.array([[4, 0, 0], [0, 2, 0]]),
        np.broadcast_to(DOWN, (len(st), 3)),
        np.full(len(st), 8.0),
    ),
    "disk": lambda st: (
        np.array([0, 0, 4]) + 3 * st[:, :1] * around(2 * np.pi * st[:, 1]),
        np.broadcast_to(DOWN, (len(st), 3)),
        18 * np.pi * st[:, 0],
    ),
}


def around(angle):
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)


@pytest.mark.parametrize("mistake", POWERS)
@pytest.mark.parametrize("light", SURFACES)
def test_the_estimate_of_the_error_covers_it(mistake, light):
    # Receivers around the light's height, down to a tenth of its size away, that have all of it above their horizon.
    random = np.random.default_rng(7)
    a, b, k = POWERS[mistake]
    for distance in (0.3, 1.0, 4.0, 40.0):
        point = np.array([*random.uniform(-1, 1, 2), 4 - distance])

        def density(st, point=point):
            places, normals, area = SURFACES[light](st)
            offset = places - point
            r = np.linalg.norm(offset, axis=1)
            return 2 * (offset[:, 2] / r) ** a * (-(offset * normals).sum(axis=1) / r) ** b / r**k * area

        expected = converged(density, [0, 0], [1, 1])
        found = mistaken_irradiance(MISTAKES[mistake], EMITTERS[light], Receivers(point, UP))
        # The reference itself is right to 1e-11.
        assert abs(found.value[0] - expected) <= found.error[0] + 1e-11 * expected
        # An estimate that is no use would hold as well.
        assert found.error[0] <= 1e-7 * expected


def test_a_millionth_of_its_size_from_a_light_the_integrator_still_finds_it():
    # So near, the light fills half of all directions.
    near = Receivers([[0.3, 0.2, 4 - 1e-6]], [[0, 0, 1]])
    np.testing.assert_allclose(shown("no receiver cosine", RECTANGLE, near), 4 * np.pi, rtol=1e-5)


# ----------------------------------------------------------------------------------------- the other kinds of mistake


@pytest.mark.parametrize("emitter", EMITTERS.values(), ids=EMITTERS)
def test_below_the_horizon_light_is_folded_up_or_subtracted(emitter):
    opposite = Receivers(AROUND.points, -AROUND.normals)
    above, below = irradiance(emitter, AROUND).value.ravel(), irradiance(emitter, opposite).value.ravel()
    np.testing.assert_allclose(shown("horizon folded", emitter, AROUND), above + below, rtol=ROUNDING, atol=1e-13)
    np.testing.assert_allclose(shown("horizon subtracted", emitter, AROUND), above - below, rtol=ROUNDING, atol=1e-13)


def test_a_sphere_on_the_horizon_shines_from_both_its_halves():
    sideways = Receivers([0, 0, 0], [1, 0, 0])
    np.testing.assert_allclose(shown("horizon subtracted", SPHERE, sideways), 0, atol=1e-14)
    np.testing.assert_allclose(
        shown("horizon folded", SPHERE, sideways), 2 * irradiance(SPHERE, sideways).value[..., 0], rtol=ROUNDING
    )


def test_signed_cosines_below_the_horizon_give_the_vector_irradiance():
    # Of a whole sphere that is pi L (R/d)^2 cos, however the receiver is tilted.
    for tilt in (0.3, 1.2, 1.7):
        tilted = Receivers([0, 0, 0], [np.sin(tilt), 0, np.cos(tilt)])
        expected = 2 * np.pi * 0.36 * np.cos(tilt)
        np.testing.assert_allclose(shown("horizon subtracted", SPHERE, tilted), expected, rtol=1e-12)


def test_from_behind_a_light_only_mistakes_about_its_sides_shine():
    above = Receivers([0, 0, 6], DOWN)
    front = irradiance(DISK, Receivers([0, 0, 2], UP)).value[..., 0]
    assert irradiance(DISK, above).value[..., 0] == 0
    for name in ("two-sided light", "light reversed"):
        np.testing.assert_allclose(shown(name, DISK, above), front, rtol=ROUNDING)
    np.testing.assert_array_equal(shown("light reversed", DISK), 0)
    np.testing.assert_allclose(shown("two-sided light", DISK), irradiance(DISK, FLOOR).value[..., 0], rtol=ROUNDING)


def test_a_reversed_direction_lights_the_other_side():
    np.testing.assert_array_equal(shown("direction reversed", SLANTED), 0)
    np.testing.assert_allclose(shown("direction reversed", SLANTED, Receivers([0, 0, 0], DOWN)), 1.6, rtol=ROUNDING)
    np.testing.assert_array_equal(shown("direction reversed", SPOT), 0)


@pytest.mark.parametrize(
    ("name", "emitter", "factor"),
    [
        ("light area doubled", DISK, 2),
        ("light area halved", RECTANGLE, 1 / 2),
        ("half extents as extents", RECTANGLE, 1 / 4),
        ("extents as half extents", RECTANGLE, 4),
        ("radius not squared", DISK, 1 / 3),
        ("radius not squared", SPHERE, 1 / 3),
        ("radiance as flux", RECTANGLE, 1 / (8 * np.pi)),
        ("radiance as flux", dataclasses.replace(DISK, two_sided=True), 1 / (18 * np.pi**2)),
        ("radiance as exitance", SPHERE, 1 / np.pi),
        ("intensity as flux", POINT, 1 / (4 * np.pi)),
        ("no visibility", DISK, 1),
        ("no 1/pi", Constant([2.0]), np.pi),
        ("1/pi twice", POINT, 1 / np.pi),
        ("1/(2 pi) for 1/pi", SPOT, 1 / 2),
    ],
)
def test_some_mistakes_are_factors(name, emitter, factor):
    np.testing.assert_allclose(shown(name, emitter), factor * irradiance(emitter, FLOOR).value.ravel(), rtol=ROUNDING)


def test_reflectance_twice_shows_the_reflectance_of_each_channel():
    point = Point([3, 0, 4], [2.0, 2.0])
    np.testing.assert_allclose(
        shown("reflectance twice", point, reflectance=[0.5, 0.1]), 2 * 0.8 / 25 * np.array([0.5, 0.1]), rtol=ROUNDING
    )


def test_a_light_in_one_point_obeys_the_inverse_square_of_its_center():
    # The rectangle's center is sqrt(17) away at the cosine 4/sqrt(17) on both sides; its area is 8, its radiance 2.
    np.testing.assert_allclose(
        shown("light sampled in its center only", RECTANGLE), 2 * 8 * 16 / 17 / 17, rtol=ROUNDING
    )
    np.testing.assert_allclose(shown("light as an isotropic point", RECTANGLE), 2 * 8 * 4 / 17**1.5, rtol=ROUNDING)
    np.testing.assert_allclose(shown("radiance as intensity", RECTANGLE), 2 * 4 / 17**1.5, rtol=ROUNDING)
    np.testing.assert_allclose(shown("radiance as intensity", SPHERE), 2 / 25, rtol=ROUNDING)


def test_far_away_sampling_the_center_alone_changes_nothing():
    far = Receivers([0, 0, -1e6], UP)
    np.testing.assert_allclose(
        shown("light sampled in its center only", DISK, far), irradiance(DISK, far).value[..., 0], rtol=1e-10
    )


def at_angle(angle, distance=2.0):
    """A receiver that faces the spot, so many radians off its axis."""
    direction = np.array([np.sin(angle), 0, -np.cos(angle)])
    return Receivers(np.array([0, 0, 2.0]) + distance * direction, -direction)


@pytest.mark.parametrize(
    ("name", "angle", "falloff"),
    [
        ("spot without falloff", 0.6, 1.0),
        ("spot without falloff", 0.95, 0.0),
        ("spot without cone", 2.0, 1.0),
        ("spot falloff linear in the cosine", 0.6, (np.cos(0.6) - np.cos(0.9)) / (np.cos(0.3) - np.cos(0.9))),
        ("spot's half angles as full angles", 0.3, 0.5),
        ("spot's half angles as full angles", 0.5, 0.0),
        ("degrees as radians", 2.0, 1.0),
        ("radians as degrees", 0.3, 0.0),
        ("radians as degrees", np.radians(0.6), 0.5),
    ],
)
def test_a_spot_with_another_cone_has_another_falloff(name, angle, falloff):
    np.testing.assert_allclose(shown(name, SPOT, at_angle(angle)), 2 / 4 * falloff, rtol=1e-12)


def test_a_smooth_falloff_is_half_where_the_cosine_is_halfway():
    angle = np.arccos((np.cos(0.3) + np.cos(0.9)) / 2)
    np.testing.assert_allclose(shown("spot falloff smooth in the cosine", SPOT, at_angle(angle)), 1 / 4, rtol=1e-12)
    # At a quarter of the way smoothstep is 3/16 - 2/64.
    angle = np.arccos(np.cos(0.9) + (np.cos(0.3) - np.cos(0.9)) / 4)
    np.testing.assert_allclose(
        shown("spot falloff smooth in the cosine", SPOT, at_angle(angle)), 0.5 * 0.15625, rtol=1e-12
    )


# ------------------------------------------------------------------------------------------------------ as a whole


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_shows_on_every_emitter_that_it_applies_to_and_on_no_other(mistake):
    more = {"reflectance": 0.5} if mistake.needs_reflectance else {}
    # Behind, beside and below the lights, and within the cone of the spot, narrowed by whatever mistake.
    random = np.random.default_rng(5)
    normals = random.normal(size=(34, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    points = np.array([0, 0, 3]) + 4 * random.normal(size=(34, 3))
    for index, angle in enumerate((0.01, 0.2, 0.45, 0.6)):
        points[index] = at_angle(angle, 1.5).points
        normals[index] = [0.6, 0, 0.8]
    everywhere = Receivers(points, normals)
    seen = 0
    for emitter in EMITTERS.values():
        if not applies(mistake, emitter):
            with pytest.raises(InvalidArgument, match="cannot be made with"):
                mistaken_irradiance(mistake, emitter, everywhere, **more)
            continue
        seen += 1
        wrong, right = mistaken_irradiance(mistake, emitter, everywhere, **more), irradiance(emitter, everywhere)
        assert np.isfinite(wrong.value).all()
        assert wrong.value.shape == wrong.error.shape == (34, 1)
        if mistake.name != "horizon subtracted":
            assert (wrong.value >= -wrong.error).all()
        changed = np.abs(wrong.value - right.value) > 1e-3 * right.value + wrong.error + right.error
        # A closed light shows the same from everywhere outside.
        closed = mistake.name == "two-sided light" and isinstance(emitter.shape, Sphere)
        uniform = mistake.name == "horizon subtracted" and isinstance(emitter, Constant)
        assert changed.any() == (mistake.name != "no visibility" and not closed) or uniform, emitter
    assert seen


def test_every_mistake_says_what_to_look_for():
    for mistake in MISTAKES.values():
        assert mistake.advice.endswith(".")
        assert mistake.concept


def test_receivers_of_any_shape_and_channels_keep_their_places():
    points = np.stack(np.meshgrid([0.0, 0.5], [0.0, 0.2, 0.4], [0.0]), axis=-1)
    receivers = Receivers(points, UP)
    emitter = Area(Rectangle([0, 0, 1], [0, 1, 0], [1, 0, 0]), [1.0, 2.0])
    together = mistaken_irradiance(MISTAKES["no light cosine"], emitter, receivers)
    assert together.value.shape == (*receivers.shape, 2)
    one = mistaken_irradiance(MISTAKES["no light cosine"], emitter, Receivers(points[2, 1, 0], UP))
    np.testing.assert_allclose(together.value[2, 1, 0], one.value, rtol=ROUNDING)
    np.testing.assert_array_equal(together.value[..., 1], 2 * together.value[..., 0])


def test_more_receivers_than_fit_at_once_are_all_there():
    points = np.zeros((2500, 3))
    points[:, 0] = np.linspace(0, 1, 2500)
    many = shown("no receiver cosine", DISK, Receivers(points, UP))
    np.testing.assert_allclose(many[[0, 2499]], shown("no receiver cosine", DISK, Receivers(points[[0, 2499]], UP)))


def test_no_receivers_have_no_irradiance():
    none = Receivers(np.zeros((0, 3)), UP)
    assert mistaken_irradiance(MISTAKES["no receiver cosine"], DISK, none).value.shape == (0, 1)


@pytest.mark.parametrize("reflectance", [None, [0.5, 0.5, 0.5], 1.5, -0.1, np.nan, [[0.5]]])
def test_reflectance_twice_needs_one_reflectance_for_each_channel(reflectance):
    with pytest.raises(InvalidArgument, match="reflectance"):
        shown("reflectance twice", Point([0, 0, 1], [1, 2]), reflectance=reflectance)


@pytest.mark.parametrize("emitter", [POINT, SPOT, LINE], ids=["point", "spot", "line"])
def test_on_a_light_without_area_there_is_no_direction_to_it(emitter):
    there = (emitter.start + emitter.end) / 2 if isinstance(emitter, Line) else emitter.position
    with pytest.raises(InvalidArgument, match="receivers"):
        shown("no receiver cosine", emitter, Receivers(there, UP))


def test_in_the_plane_of_a_light_and_on_a_sphere_nothing_arrives():
    assert shown("no light cosine", DISK, Receivers([5, 0, 4], UP)) == 0
    assert shown("no light cosine", DISK, Receivers([0, 0, 4], UP)) == 0
    assert np.isfinite(shown("no light cosine", SPHERE, Receivers([0, 0, 2], UP))).all()


def test_a_map_is_an_emitter_like_others():
    environment = Equirectangular(np.ones((4, 8, 1)), UP, np.array([1.0, 0, 0]))
    try:
        right = irradiance(environment, FLOOR).value
    except NotImplementedError:
        pytest.skip("maps are not written yet")
    np.testing.assert_allclose(shown("no 1/pi", environment), np.pi * right[..., 0], rtol=ROUNDING)
