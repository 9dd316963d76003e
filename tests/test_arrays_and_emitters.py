"""Arguments become checked, read-only float64 arrays, or an error that names them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from oracle.arrays import InvalidArgument, direction, dot, finite, spectrum, vector
from oracle.bounded import Bounded
from oracle.emitters import Area, Constant, CosineSky, Directional, Equirectangular, Line, Point, Receivers, Spot
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere

quick = settings(derandomize=True, deadline=None, max_examples=60)

NAN, INF = float("nan"), float("inf")
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
L = [1.0, 2.0, 3.0]
ONE_OF_EACH = [
    Receivers([0, 0, 0], [0, 0, 1]),
    Point([0, 0, 0], L),
    Spot([0, 0, 0], [0, 0, 1], L, 0.2, 0.4),
    Directional([0, 0, 1], L),
    Polygon(SQUARE),
    Disk([0, 0, 0], [0, 0, 1], 1.0),
    Sphere([0, 0, 0], 1.0),
    Rectangle([0, 0, 0], [1, 0, 0], [0, 2, 0]),
    Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    Line([0, 0, 0], [1, 0, 0], L),
    Area(Sphere([0, 0, 0], 1.0), L),
    Constant(L),
    CosineSky([0, 0, 1], L, L),
    Equirectangular(np.ones((2, 4, 3)), [0, 0, 1], [1, 0, 0]),
]


def arrays_of(instance):
    values = (getattr(instance, field.name) for field in dataclasses.fields(instance))
    return [value for value in values if isinstance(value, np.ndarray)]


def assert_refused(message, make):
    with pytest.raises(InvalidArgument) as caught:
        make()
    assert str(caught.value) == message


# ------------------------------------------------------------------------------------------------- arrays


def test_integers_and_lists_become_float64():
    assert finite("x", [[1, 2], [3, 4]]).dtype == np.float64
    assert spectrum("x", (1, 2)).dtype == np.float64


@pytest.mark.parametrize("make", [finite, vector, spectrum, direction])
def test_an_array_is_a_read_only_copy(make):
    given_array = np.array([0.0, 1.0, 0.0])
    result = make("x", given_array)
    assert not result.flags.writeable
    assert not np.shares_memory(result, given_array)


@quick
@given(arrays(np.float64, (4, 3), elements=st.floats(-1e300, 1e300)), st.integers(-300, 300))
def test_a_direction_has_length_1_whatever_its_scale(vectors, exponent):
    vectors = vectors[np.abs(vectors).max(axis=1) > 1e-290]
    with np.errstate(over="ignore"):
        scaled = vectors * 10.0**exponent
    scaled = scaled[(np.abs(scaled).max(axis=1) > 1e-290) & np.isfinite(scaled).all(axis=1)]
    # A few roundings of float64.
    np.testing.assert_allclose(np.linalg.norm(direction("x", scaled, any_length=True), axis=1), 1, rtol=1e-15)


@quick
@given(arrays(np.float64, (3,), elements=st.floats(-1e3, 1e3)).filter(lambda v: np.abs(v).max() > 1e-3))
def test_a_direction_keeps_where_it_points(v):
    np.testing.assert_allclose(direction("x", v, any_length=True) * np.linalg.norm(v), v, rtol=1e-14, atol=1e-300)


def test_dot_is_the_inner_product_of_the_last_axis():
    a, b = np.arange(24.0).reshape(2, 4, 3), np.array([1.0, -2.0, 3.0])
    np.testing.assert_array_equal(dot(a, np.broadcast_to(b, a.shape)), a @ b)


@pytest.mark.parametrize(
    ("message", "make"),
    [
        ("x[1, 2] is nan, not a finite number", lambda: finite("x", [[0, 0, 0], [0, 0, NAN]])),
        ("x[0] is -inf, not a finite number", lambda: finite("x", [-INF, NAN])),
        ("x is nan, not a finite number", lambda: finite("x", NAN)),
        ("x has shape (2,), its last axes must be (3,)", lambda: finite("x", [0, 0], (3,))),
        ("x has shape (), its last axes must be (3,)", lambda: finite("x", 0, (3,))),
        ("x has shape (2, 3), it must be (3,)", lambda: vector("x", np.zeros((2, 3)))),
        ("x[1] is -0.5, light is at least 0", lambda: spectrum("x", [1.0, -0.5, 1.0])),
        ("x[0] is nan, not a finite number", lambda: spectrum("x", [NAN])),
        ("x has shape (), it must be (C,) with one number for each channel", lambda: spectrum("x", 1.0)),
        ("x has shape (1, 3), it must be (C,) with one number for each channel", lambda: spectrum("x", [L])),
        ("x[1] has no length", lambda: direction("x", [[0, 0, 1], [0, 0, 0]])),
        ("x has no length", lambda: direction("x", [0, 0, 0])),
        ("x[1] has length 1.00001, it must be a unit vector", lambda: direction("x", [[0, 0, 1], [0, 0, 1.00001]])),
        ("x has length 2.0, it must be a unit vector", lambda: direction("x", [0, 2, 0])),
    ],
)
def test_an_array_that_is_wrong_is_named_with_its_index(message, make):
    assert_refused(message, make)


# ----------------------------------------------------------------------------------------------- emitters


@pytest.mark.parametrize("instance", ONE_OF_EACH, ids=lambda i: type(i).__name__)
def test_emitters_and_receivers_are_frozen(instance):
    for field in dataclasses.fields(instance):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(instance, field.name, 1.0)
    for array in arrays_of(instance):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize("instance", ONE_OF_EACH, ids=lambda i: type(i).__name__)
def test_emitters_shapes_and_receivers_hold_float64_and_int64(instance):
    assert {array.dtype for array in arrays_of(instance)} <= {np.dtype(np.float64), np.dtype(np.int64)}


def test_a_normal_whose_length_is_rounded_is_scaled_to_1():
    np.testing.assert_array_equal(Receivers([0, 0, 0], [0, 0, 1 + 1e-7]).normals, [0, 0, 1])
    np.testing.assert_array_equal(Disk([0, 0, 0], [0, -1 + 1e-7, 0], 1).normal, [0, -1, 0])


def test_a_unit_normal_is_not_turned_by_an_ulp():
    normal = [0.6, 0.0, 0.8]
    np.testing.assert_array_equal(Receivers([0, 0, 0], normal).normals, normal)


@pytest.mark.parametrize(
    ("points", "normals", "shape"),
    [((3,), (3,), (3,)), ((5, 3), (3,), (5, 3)), ((3,), (5, 3), (5, 3)), ((4, 1, 3), (5, 3), (4, 5, 3))],
)
def test_points_and_normals_take_one_shape(points, normals, shape):
    receivers = Receivers(np.zeros(points), np.broadcast_to([0, 0, 1], normals))
    assert receivers.points.shape == receivers.normals.shape == shape


def test_the_normal_of_a_polygon_follows_the_right_hand():
    np.testing.assert_array_equal(Polygon(SQUARE).normal, [0, 0, 1])
    np.testing.assert_array_equal(Polygon(SQUARE[::-1]).normal, [0, 0, -1])
    # The first corner of an L is as good a start as the inner one, where its outline turns the other way.
    ell = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]])
    for start in range(6):
        np.testing.assert_array_equal(Polygon(np.roll(ell, start, axis=0)).normal, [0, 0, 1])


def test_a_polygon_far_from_the_origin_is_as_flat_as_near():
    Polygon(np.array(SQUARE) @ np.array([[0.6, 0.8, 0], [-0.48, 0.36, 0.8], [0, 0, 1]]) + 1e5)


def test_a_polygon_may_touch_itself():
    # A frame: outer square, slit, inner square, slit.
    outer, inner = [[0, 0], [3, 0], [3, 3], [0, 3], [0, 0]], [[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]
    frame = Polygon(np.column_stack([outer + inner, np.zeros(10)]))
    np.testing.assert_array_equal(frame.normal, [0, 0, 1])


@pytest.mark.parametrize(
    ("message", "make"),
    [
        ("points[0, 1] is nan, not a finite number", lambda: Receivers([[0, NAN, 0]], [0, 0, 1])),
        ("points has shape (2,), its last axes must be (3,)", lambda: Receivers([0, 0], [0, 0, 1])),
        ("normals[2] has no length", lambda: Receivers([0, 0, 0], [[0, 0, 1], [1, 0, 0], [0, 0, 0]])),
        ("points (2, 3) and normals (4, 3) do not fit together", lambda: Receivers(np.ones((2, 3)), [[0, 0, 1]] * 4)),
        ("position[2] is inf, not a finite number", lambda: Point([0, 0, INF], L)),
        ("position has shape (1, 3), it must be (3,)", lambda: Point([[0, 0, 0]], L)),
        ("intensity[1] is -1.0, light is at least 0", lambda: Point([0, 0, 0], [0, -1, 0])),
        ("direction has no length", lambda: Spot([0, 0, 0], [0, 0, 0], L, 0.1, 0.2)),
        (
            "beam_width 0.2 and cutoff_angle 0.2 must satisfy 0 < beam_width < cutoff_angle < pi",
            lambda: Spot([0, 0, 0], [0, 0, 1], L, 0.2, 0.2),
        ),
        (
            "beam_width nan and cutoff_angle 0.2 must satisfy 0 < beam_width < cutoff_angle < pi",
            lambda: Spot([0, 0, 0], [0, 0, 1], L, NAN, 0.2),
        ),
        ("direction has no length", lambda: Directional([0, 0, 0], L)),
        ("irradiance[0] is -1e-09, light is at least 0", lambda: Directional([0, 0, 1], [-1e-9, 0, 0])),
        ("vertices has shape (2, 3), a polygon needs (N, 3) with N >= 3", lambda: Polygon([[0, 0, 0], [1, 0, 0]])),
        ("vertices[1, 0] is nan, not a finite number", lambda: Polygon([[0, 0, 0], [NAN, 0, 0], [0, 1, 0]])),
        ("vertices enclose no area", lambda: Polygon([[0, 0, 0], [1, 1, 1], [3, 3, 3]])),
        ("vertices enclose no area", lambda: Polygon(np.ones((4, 3)))),
        ("vertices[1] lies 0.2 m off the plane", lambda: Polygon([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]])),
        (
            "vertices: the edges that begin at [1] and [3] cross",
            lambda: Polygon([[0, 0, 0], [3, 0, 0], [0, 1, 0], [3, 2, 0], [0, 0.1, 0], [-1, 1, 0]]),
        ),
        ("radiance[2] is nan, not a finite number", lambda: Area(Sphere([0, 0, 0], 1), [0, 0, NAN])),
        ("normal has no length", lambda: Disk([0, 0, 0], [0, 0, 0], 1)),
        ("center[0] is nan, not a finite number", lambda: Disk([NAN, 0, 0], [0, 0, 1], 1)),
        ("radius is 0.0, it must be positive", lambda: Disk([0, 0, 0], [0, 0, 1], 0)),
        ("radius is nan, not a finite number", lambda: Disk([0, 0, 0], [0, 0, 1], NAN)),
        ("radius is -1.0, it must be positive", lambda: Sphere([0, 0, 0], -1)),
        ("radius is inf, not a finite number", lambda: Sphere([0, 0, 0], INF)),
        ("radiance[0] is -1.0, light is at least 0", lambda: Area(Sphere([0, 0, 0], 1), [-1, 0, 0])),
        ("radiance has shape (), it must be (C,) with one number for each channel", lambda: Constant(1.0)),
        ("radiance has shape (0,), it must be (C,) with one number for each channel", lambda: Constant([])),
        ("shape is a int, not one of oracle.shapes", lambda: Area(3, L)),
        ("start and end are the same point", lambda: Line([1, 0, 0], [1, 0, 0], L)),
        ("half_v has no length, so that the rectangle has no area", lambda: Rectangle([0, 0, 0], [1, 0, 0], [0, 0, 0])),
        (
            "half_u and half_v are not orthogonal; use a Polygon for a parallelogram",
            lambda: Rectangle([0, 0, 0], [1, 0, 0], [1, 1, 0]),
        ),
        ("triangles[0, 2] is 3, there are 3 vertices", lambda: Mesh(SQUARE[:3], [[0, 1, 3]])),
        ("triangles holds float64, it must hold integers", lambda: Mesh(SQUARE, [[0.0, 1.0, 2.0]])),
        ("triangles has shape (3,), it must be (M, 3) with M >= 1", lambda: Mesh(SQUARE, [0, 1, 2])),
        ("triangles[1] [0, 1, 1]: vertices enclose no area", lambda: Mesh(SQUARE, [[0, 1, 2], [0, 1, 1]])),
        ("horizon (3,) and zenith (1,) differ in shape", lambda: CosineSky([0, 0, 1], L, [1.0])),
        (
            "radiance has shape (2, 4), a map needs (H, W, C)",
            lambda: Equirectangular(np.ones((2, 4)), [0, 0, 1], [1, 0, 0]),
        ),
        (
            "radiance[1, 0, 0] is -1.0, light is at least 0",
            lambda: Equirectangular([[[1.0]], [[-1.0]]], [0, 0, 1], [1, 0, 0]),
        ),
        ("up and front are not orthogonal", lambda: Equirectangular(np.ones((1, 1, 1)), [0, 0, 1], [0.6, 0, 0.8])),
    ],
)
def test_an_emitter_that_cannot_be_is_refused_by_the_name_of_the_argument(message, make):
    assert_refused(message, make)


# ----------------------------------------------------------------------------------------- values with bounds


def test_bounds_of_sums_and_products_hold_what_rounding_does():
    # 0.1 + 0.2 is not 0.3 in binary, and 3 * 0.1 neither.
    a, b = Bounded(np.array([0.1]), np.array([1e-3])), Bounded(np.array([0.2]), np.array([1e-4]))
    total, product = a + b, a * -3.0
    assert total.value == 0.1 + 0.2
    assert 1.1e-3 < total.error < 1.1e-3 + 1e-15
    assert product.value == 0.1 * -3.0
    assert 3e-3 < product.error < 3e-3 + 1e-15


def test_the_relative_error_of_nothing_is_nothing_if_that_is_certain():
    bounded = Bounded(np.array([2.0, -2.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0, 0.0]))
    np.testing.assert_array_equal(bounded.relative_error, [0.5, 0.5, np.inf, 0.0])
