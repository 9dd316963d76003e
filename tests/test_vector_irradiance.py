"""Laws of the vector irradiance; its digits are checked in ``tests/verified``."""

import re

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.emitters import Area, Constant, CosineSky, Directional, Equirectangular, Line, Point, Receivers, Spot
from oracle.irradiances import irradiance
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere
from oracle.vector_irradiances import vector_irradiance

UP = np.array([0.0, 0.0, 1.0])
# Corners of the unit cube, and its sides' triangles with their fronts inside.
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
INWARDS = [
    *[[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6]],
    *[[0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7]],
    *[[0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]],
]
TRIANGLE = Polygon([[-1, 0, 2], [1, 1, 2.5], [0.5, -1, 3]])
EMITTERS = {
    "point": Point([1, 0, 2], [3.0]),
    "spot": Spot([1, 0, 2], [-0.6, 0, -0.8], [3.0], 0.1, 1.5),
    "directional": Directional([0.6, 0, -0.8], [3.0]),
    "line": Line([-1, 0, 2], [2, 1, 1], [3.0]),
    "triangle": Area(TRIANGLE, [3.0], two_sided=True),
    "notched polygon": Area(Polygon([[-1, -1, 2], [0, 0.3, 2], [1, -1, 2], [0, 1, 2]]), [3.0], two_sided=True),
    "rectangle": Area(Rectangle([0.5, 0, 2], [1, 0, 0], [0, -1, 0]), [3.0]),
    "far rectangle": Area(Rectangle([5, 0, 20], [1, 0, 0], [0, -1, 0]), [3.0]),
    "disk": Area(Disk([0.5, 0, 2], [0, -0.6, -0.8], 0.8), [3.0]),
    "sphere": Area(Sphere([0.5, 0, 2], 1.2), [3.0]),
    "mesh": Area(Mesh(CORNERS + UP, INWARDS), [3.0]),
    "constant": Constant([3.0]),
    "sky": CosineSky(UP, [1.0], [3.0]),
    "map": Equirectangular(np.random.default_rng(1).uniform(size=(4, 7, 1)), UP, [1, 0, 0]),
}


def of(emitter, points):
    return vector_irradiance(emitter, points).value[..., 0]


def normals(count, seed=1):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize("name", EMITTERS)
def test_along_a_normal_it_is_the_difference_of_the_irradiances_of_both_sides(name):
    emitter, point, sides = EMITTERS[name], np.array([0.1, 0.2, 0.3]), normals(60)
    vector = vector_irradiance(emitter, point)
    front, back = (irradiance(emitter, Receivers(point, side)) for side in (sides, -sides))
    difference = front.value[:, 0] - back.value[:, 0]
    # Normals are unit vectors up to rounding.
    bound = front.error[:, 0] + back.error[:, 0] + vector.error[:, 0].sum() + 4e-16 * np.abs(vector.value).sum()
    assert (np.abs(sides @ vector.value[:, 0] - difference) <= bound).all()


@pytest.mark.parametrize("name", ["point", "line", "triangle", "rectangle", "far rectangle", "disk"])
def test_its_divergence_vanishes_where_light_neither_begins_nor_ends(name):
    # By differences over 1e-4; the field's third derivatives are of order 10, hence 1e-7, and no rounding shows.
    step, point = 1e-4, np.array([0.1, 0.2, 0.3])
    jacobian = np.stack(
        [(of(EMITTERS[name], point + step * e) - of(EMITTERS[name], point - step * e)) / (2 * step) for e in np.eye(3)]
    )
    assert abs(np.trace(jacobian)) < 1e-6
    assert np.abs(jacobian).max() > 1e-3


def test_all_sides_of_a_uniform_box_cancel_inside_of_it():
    inside = np.random.default_rng(2).uniform(0.01, 0.99, size=(50, 3))
    sides = [of(Area(Mesh(CORNERS, INWARDS[i : i + 2]), [1.0]), inside) for i in range(0, 12, 2)]
    assert (np.linalg.norm(sides, axis=-1) > 0).all()
    # Twelve triangles of up to pi each are added up.
    assert np.abs(of(Area(Mesh(CORNERS, INWARDS), [1.0]), inside)).max() < 1e-14


def test_a_sphere_cancels_inside_of_itself():
    for two_sided in (False, True):
        assert (of(Area(Sphere([1, 1, 1], 2.0), [1.0], two_sided), [1, 0.5, 1]) == 0).all()


def test_the_vector_points_towards_the_light():
    below, above = of(Area(Disk([0, 0, 1], UP, 0.5), [1.0], two_sided=True), [[0, 0, 0], [0, 0, 2.0]])
    np.testing.assert_allclose(below, [0, 0, np.pi * 0.25 / 1.25], rtol=1e-15)
    np.testing.assert_allclose(above, -below, rtol=1e-15)


@pytest.mark.parametrize("shape", [TRIANGLE, Disk([0, 0, 2], UP, 0.5), Rectangle([0, 0, 2], [1, 0, 0], [0, 1, 0])])
def test_only_the_front_of_a_one_sided_shape_shines(shape):
    point = np.array([0.1, 0.2, 0.3])
    mirrored = point + 2 * (np.array([0, 0, 2.2]) - point)
    one, two = (of(Area(shape, [1.0], two_sided), [point, mirrored]) for two_sided in (False, True))
    dark = (one == 0).all(axis=-1)
    assert sorted(dark) == [False, True]
    np.testing.assert_array_equal(one[~dark], two[~dark])
    assert (two != 0).any(axis=-1).all()


@pytest.mark.parametrize("shape", [TRIANGLE, Disk([0, 0, 2], UP, 0.5), Rectangle([0, 0, 2], [1, 0, 0], [0, 1, 0])])
def test_in_its_own_plane_a_shape_is_not_seen(shape):
    corner = shape.vertices[0] if isinstance(shape, Polygon) else shape.center
    assert (of(Area(shape, [1.0], two_sided=True), corner) == 0).all()


def test_a_far_shape_gives_area_times_cosine_over_distance_squared():
    towards = np.array([0.6, 0, 0.8])
    expected = 2 * 1.5 * 0.8 / 1e12 * towards
    found = of(Area(Rectangle([0, 0, 0], [1, 0, 0], [0, -0.75, 0]), [1.0]), -1e6 * towards)
    # The next term is 1e-6 squared.
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-27)


def test_a_rectangle_is_the_polygon_of_its_corners():
    rectangle = Rectangle([0.5, 0, 2], [1, 0, 0], [0, -1, 0])
    points = np.random.default_rng(3).uniform(-1, 1, size=(20, 3))
    polygon = of(Area(rectangle.polygon, [1.0]), points)
    np.testing.assert_allclose(of(Area(rectangle, [1.0]), points), polygon, rtol=0, atol=1e-15)


def test_several_emitters_add_up():
    points = np.array([[0.1, 0.2, 0.3], [0.5, 0.0, 0.1]])
    separate = sum(of(emitter, points) for emitter in EMITTERS.values())
    np.testing.assert_allclose(of(list(EMITTERS.values()), points), separate, rtol=1e-14)


@pytest.mark.parametrize("name", EMITTERS)
def test_the_result_has_three_components_of_every_channel(name):
    found = vector_irradiance(EMITTERS[name], np.full((2, 5, 3), 0.25))
    assert found.value.shape == found.error.shape == (2, 5, 3, 1)


def test_each_channel_is_multiplied_by_its_own_light():
    colours = vector_irradiance(Point([0, 0, 2], [1.0, 2.0, 4.0]), np.zeros(3))
    np.testing.assert_array_equal(colours.value[2], [0.25, 0.5, 1.0])


def test_a_receiver_on_an_emitter_is_named_by_its_index():
    points = np.ones((3, 40_000, 3))
    points[2, 30_001] = [1, 0, 2]
    with pytest.raises(InvalidArgument, match=re.escape("points[2, 30001] = [1.0, 0.0, 2.0] is at the emitter's")):
        vector_irradiance(EMITTERS["point"], points)
    with pytest.raises(InvalidArgument, match=re.escape("points[1] = [1.0, 0.0, 2.0] is at the emitter's")):
        vector_irradiance(EMITTERS["point"], [[0, 0, 0], [1, 0, 2]])
    with pytest.raises(InvalidArgument, match=re.escape("points = [1.0, 0.0, 2.0] is at the emitter's")):
        vector_irradiance(EMITTERS["point"], [1, 0, 2])


@pytest.mark.parametrize(
    ("emitter", "points", "complaint"),
    [
        ([], [0, 0, 0], "emitter is an empty sequence"),
        ([EMITTERS["point"], Constant([1, 1])], [0, 0, 0], "emitter[1] has 2 channels, emitter[0] has 1"),
        (EMITTERS["point"], [[0, 0, 0], [0, np.nan, 0]], "points[1, 1] is nan"),
        (EMITTERS["point"], [0, 0], "points has shape (2,)"),
    ],
)
def test_senseless_arguments_are_named(emitter, points, complaint):
    with pytest.raises(InvalidArgument, match=re.escape(complaint)):
        vector_irradiance(emitter, points)
