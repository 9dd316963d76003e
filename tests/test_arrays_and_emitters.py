"""Arguments become checked, read-only float64 arrays, or an error that names them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from oracle.arrays import InvalidArgument, direction, dot, finite, spectrum, vector
from oracle.emitters import Constant, Directional, Disk, Point, Polygon, Receivers, Sphere, Spot

quick = settings(derandomize=True, deadline=None, max_examples=60)

NAN, INF = float("nan"), float("inf")
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
L = [1.0, 2.0, 3.0]
ONE_OF_EACH = [
    Receivers([0, 0, 0], [0, 0, 1]),
    Point([0, 0, 0], L),
    Spot([0, 0, 0], [0, 0, 1], L, 0.2, 0.4),
    Directional([0, 0, 1], L),
    Polygon(SQUARE, L),
    Disk([0, 0, 0], [0, 0, 1], 1.0, L),
    Sphere([0, 0, 0], 1.0, L),
    Constant(L),
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
    given_array = np.array([1.0, 2.0, 3.0])
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
    np.testing.assert_allclose(np.linalg.norm(direction("x", scaled), axis=1), 1, rtol=1e-15)


@quick
@given(arrays(np.float64, (3,), elements=st.floats(-1e3, 1e3)).filter(lambda v: np.abs(v).max() > 1e-3))
def test_a_direction_keeps_where_it_points(v):
    np.testing.assert_allclose(direction("x", v) * np.linalg.norm(v), v, rtol=1e-14, atol=1e-300)


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
def test_emitters_and_receivers_hold_float64(instance):
    assert {array.dtype for array in arrays_of(instance)} == {np.dtype(np.float64)}


def test_normals_are_scaled_to_length_1():
    np.testing.assert_array_equal(Receivers([0, 0, 0], [0, 0, 5]).normals, [0, 0, 1])
    np.testing.assert_array_equal(Disk([0, 0, 0], [0, -2, 0], 1, L).normal, [0, -1, 0])
    np.testing.assert_array_equal(Spot([0, 0, 0], [3, 0, 0], L, 0.1, 0.2).direction, [1, 0, 0])


@pytest.mark.parametrize(
    ("points", "normals", "shape"),
    [((3,), (3,), (3,)), ((5, 3), (3,), (5, 3)), ((3,), (5, 3), (5, 3)), ((4, 1, 3), (5, 3), (4, 5, 3))],
)
def test_points_and_normals_take_one_shape(points, normals, shape):
    receivers = Receivers(np.zeros(points), np.ones(normals))
    assert receivers.points.shape == receivers.normals.shape == shape


def test_the_normal_of_a_polygon_follows_the_right_hand():
    np.testing.assert_array_equal(Polygon(SQUARE, L).normal, [0, 0, 1])
    np.testing.assert_array_equal(Polygon(SQUARE[::-1], L).normal, [0, 0, -1])
    # The first corner of an L is as good a start as the inner one, where its outline turns the other way.
    ell = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]])
    for start in range(6):
        np.testing.assert_array_equal(Polygon(np.roll(ell, start, axis=0), L).normal, [0, 0, 1])


def test_a_polygon_far_from_the_origin_is_as_flat_as_near():
    Polygon(np.array(SQUARE) @ np.array([[0.6, 0.8, 0], [-0.48, 0.36, 0.8], [0, 0, 1]]) + 1e5, L)


def test_a_polygon_may_touch_itself():
    # A frame: outer square, slit, inner square, slit.
    outer, inner = [[0, 0], [3, 0], [3, 3], [0, 3], [0, 0]], [[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]
    frame = Polygon(np.column_stack([outer + inner, np.zeros(10)]), L)
    np.testing.assert_array_equal(frame.normal, [0, 0, 1])


@pytest.mark.parametrize(
    ("message", "make"),
    [
        ("points[0, 1] is nan, not a finite number", lambda: Receivers([[0, NAN, 0]], [0, 0, 1])),
        ("points has shape (2,), its last axes must be (3,)", lambda: Receivers([0, 0], [0, 0, 1])),
        ("normals[2] has no length", lambda: Receivers([0, 0, 0], [[0, 0, 1], [1, 0, 0], [0, 0, 0]])),
        ("points (2, 3) and normals (4, 3) do not fit together", lambda: Receivers(np.ones((2, 3)), np.ones((4, 3)))),
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
        ("vertices has shape (2, 3), a polygon needs (N, 3) with N >= 3", lambda: Polygon([[0, 0, 0], [1, 0, 0]], L)),
        ("vertices[1, 0] is nan, not a finite number", lambda: Polygon([[0, 0, 0], [NAN, 0, 0], [0, 1, 0]], L)),
        ("vertices enclose no area", lambda: Polygon([[0, 0, 0], [1, 1, 1], [3, 3, 3]], L)),
        ("vertices enclose no area", lambda: Polygon(np.ones((4, 3)), L)),
        ("vertices[1] lies 0.2 m off the plane", lambda: Polygon([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]], L)),
        (
            "vertices: the edges that begin at [1] and [3] cross",
            lambda: Polygon([[0, 0, 0], [3, 0, 0], [0, 1, 0], [3, 2, 0], [0, 0.1, 0], [-1, 1, 0]], L),
        ),
        ("radiance[2] is nan, not a finite number", lambda: Polygon(SQUARE, [0, 0, NAN])),
        ("normal has no length", lambda: Disk([0, 0, 0], [0, 0, 0], 1, L)),
        ("center[0] is nan, not a finite number", lambda: Disk([NAN, 0, 0], [0, 0, 1], 1, L)),
        ("radius is 0, a disk needs a positive one", lambda: Disk([0, 0, 0], [0, 0, 1], 0, L)),
        ("radius is nan, a disk needs a positive one", lambda: Disk([0, 0, 0], [0, 0, 1], NAN, L)),
        ("radius is -1, a sphere needs a positive one", lambda: Sphere([0, 0, 0], -1, L)),
        ("radius is inf, a sphere needs a positive one", lambda: Sphere([0, 0, 0], INF, L)),
        ("radiance[0] is -1.0, light is at least 0", lambda: Sphere([0, 0, 0], 1, [-1, 0, 0])),
        ("radiance has shape (), it must be (C,) with one number for each channel", lambda: Constant(1.0)),
    ],
)
def test_an_emitter_that_cannot_be_is_refused_by_the_name_of_the_argument(message, make):
    assert_refused(message, make)
