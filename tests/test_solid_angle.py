"""Solid angles: known values, limits, sums, symmetries and errors. Their precision is verified in ``verified``."""

from fractions import Fraction

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere
from oracle.solid_angles import area_to_solid_angle, cone, plane_angle, solid_angle, solid_angle_to_area

# A few ulp.
ROUNDING = 2e-15

SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
L_SHAPE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]])
UNIT_DISK = Disk([0, 0, 0], [0, 0, 1], 1)
UNIT_SQUARE = Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])


def of(shape, point):
    """Solid angle at one point."""
    return float(solid_angle(shape, point).value)


def assert_relative(bound, actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=bound, atol=0)


# ------------------------------------------------------------------------------------------------ known values


def test_each_face_of_a_cube_is_a_sixth_of_all_directions_seen_from_its_centre():
    assert_relative(ROUNDING, of(Polygon(SQUARE), [0, 0, 1]), 4 * np.pi / 6)
    assert_relative(ROUNDING, of(UNIT_SQUARE, [0, 0, 1]), 4 * np.pi / 6)


def test_an_octant_is_an_eighth_of_all_directions():
    assert_relative(ROUNDING, of(Polygon(np.eye(3)), [0, 0, 0]), np.pi / 2)


@pytest.mark.parametrize("height", [1e-6, 1e-3, 0.5, 1.8, 2.9, 3.1, 1e3, 1e6])
def test_a_disk_on_its_axis_is_a_cone(height):
    # At nearly three radii the elliptic integrals cancel by a digit.
    assert_relative(1e-14, of(UNIT_DISK, [0, 0, height]), cone(np.arctan2(1, height)))


@pytest.mark.parametrize("distance", [1.001, 2.0, 1e6])
def test_a_sphere_is_a_cone(distance):
    # Next to the surface the angle's ulp weighs by its derivative.
    assert_relative(1e-14, of(Sphere([0, 0, 0], 1), [0, distance, 0]), cone(np.arcsin(1 / distance)))


def test_cones_go_from_nothing_over_half_to_all_directions():
    assert_relative(ROUNDING, cone([0, np.pi / 2, np.pi]), [0, 2 * np.pi, 4 * np.pi])


def test_a_narrow_cone_has_pi_times_its_squared_angle():
    # The next term is a^2/12 of it.
    assert_relative(ROUNDING, cone(1e-8), np.pi * 1e-16)


def test_a_segment_subtends_the_angle_between_its_ends():
    angles = plane_angle([1, 0, 0], [1, 1, 0], [[0, 0, 0], [1, 0.5, 1e-30], [1, 2, 0], [1, 0.5, 0]])
    assert_relative(ROUNDING, angles.value, [np.pi / 4, np.pi, 0, np.pi])


def test_area_and_solid_angle_convert_into_each_other():
    there = area_to_solid_angle([0, 0, 0], [0, 0, 2], [0, 0.6, -0.8])
    assert_relative(ROUNDING, there, 0.8 / 4)
    assert_relative(ROUNDING, there * solid_angle_to_area([0, 0, 0], [0, 0, 2], [0, 0.6, 0.8]), 1)


def test_a_surface_seen_nearly_edge_on_keeps_its_digits():
    # In decimals the products cancel; in binary they leave 2e-14 m, of which plain float64 would keep no digit.
    point, normal = [800.0, 600.0, 0.0], [0.6, -0.8, 0.0]
    height = abs(sum(Fraction(x) * Fraction(n) for x, n in zip(point, normal, strict=True)))
    assert_relative(ROUNDING, area_to_solid_angle([0, 0, 0], point, normal), float(height) / 1000**3)


# ------------------------------------------------------------------------------------------------------ limits


@pytest.mark.parametrize("shape", [Polygon(SQUARE), UNIT_SQUARE, UNIT_DISK], ids=lambda shape: type(shape).__name__)
def test_in_its_own_plane_a_shape_fills_half_of_the_directions_or_none(shape):
    found = solid_angle(shape, [[0.2, 0.3, 0], [0, 0, 0], [1.5, 0.5, 0], [-7, 0, 0]])
    assert_relative(ROUNDING, found.value, [2 * np.pi, 2 * np.pi, 0, 0])
    assert (found.error < 1e-13).all()


@pytest.mark.parametrize("shape", [Polygon(SQUARE), UNIT_SQUARE, UNIT_DISK], ids=lambda shape: type(shape).__name__)
def test_on_the_edge_the_bound_covers_all_limits(shape):
    found = solid_angle(shape, [1, 0, 0])
    assert found.value - found.error <= 0
    assert found.value + found.error >= 2 * np.pi


def test_beside_the_notch_of_a_polygon_in_its_plane_there_is_nothing():
    assert of(Polygon(L_SHAPE), [1.5, 2, 0]) == 0
    assert_relative(ROUNDING, of(Polygon(L_SHAPE), [0.5, 2, 0]), 2 * np.pi)


@pytest.mark.parametrize("shape", [Polygon(SQUARE), UNIT_SQUARE, UNIT_DISK], ids=lambda shape: type(shape).__name__)
@pytest.mark.parametrize("distance", [1e6, 1e9])
def test_far_away_it_is_projected_area_over_squared_distance(shape, distance):
    # The next term is second order in size over distance.
    point = distance * np.array([0.48, 0.64, 0.6])
    assert_relative(1e-11, of(shape, point), 0.6 * shape.area / distance**2)


def test_inside_a_sphere_are_all_directions_and_on_it_half():
    found = solid_angle(Sphere([0, 0, 0], 1), [[0, 0, 0], [0, 0.5, 0.5], [0, 0, 1]])
    assert_relative(ROUNDING, found.value, [4 * np.pi, 4 * np.pi, 2 * np.pi])


def test_shapes_of_extreme_sizes_do_not_overflow():
    for size in (1e-18, 1e17):
        for shape in (Disk([0, 0, 0], [0, 0, 1], size), Sphere([0, 0, 0], size), Polygon(SQUARE * size)):
            assert np.isfinite(of(shape, [1, 2, 3]))
            assert_relative(1e-9, of(shape, [0, 0, 2 * size]), of(type(shape)(*rescaled(shape, size)), [0, 0, 2]))


def rescaled(shape, size):
    """The arguments of the same shape of size 1."""
    match shape:
        case Disk():
            return shape.center, shape.normal, 1
        case Sphere():
            return shape.center, 1
        case Polygon():
            return (shape.vertices / size,)


# ----------------------------------------------------------------------------------------- symmetries and sums


def test_the_faces_of_a_closed_box_fill_all_directions():
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.999, 0.999, (200, 3))
    total = np.zeros(200)
    for axis in range(3):
        for side in (-1, 1):
            center = side * np.eye(3)[axis]
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            total += solid_angle(Rectangle(center, u, v), points).value
    # Six terms of a few ulp each.
    assert_relative(1e-14, total, np.full(200, 4 * np.pi))


def test_the_parts_of_a_non_convex_polygon_add_up():
    rng = np.random.default_rng(2)
    points = rng.uniform(-3, 3, (200, 3))
    parts = [L_SHAPE[[0, 1, 2, 3]], L_SHAPE[[0, 3, 4, 5]]]
    total = sum(solid_angle(Polygon(part), points).value for part in parts)
    assert_relative(1e-13, solid_angle(Polygon(L_SHAPE), points).value, total)


def test_both_sides_look_the_same():
    for shape in (Polygon(L_SHAPE), UNIT_SQUARE, UNIT_DISK):
        assert of(shape, [0.3, 0.4, 0.5]) == of(shape, [0.3, 0.4, -0.5])


def test_the_order_of_corners_does_not_count():
    point = [0.3, 0.7, 0.2]
    turned = Polygon(np.roll(L_SHAPE, 2, axis=0)), Polygon(L_SHAPE[::-1])
    assert_relative(1e-14, [of(shape, point) for shape in turned], of(Polygon(L_SHAPE), point))


def test_a_disk_is_the_limit_of_polygons_with_many_corners():
    angles = 2 * np.pi * np.arange(400) / 400
    rim = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(400)])
    # With the same area, the polygon errs by the fourth power of its angle.
    rim *= np.sqrt(np.pi / (200 * np.sin(2 * np.pi / 400)))
    for point in ([0, 0, 0.5], [2, 0, 0.5], [3, 0, 2]):
        assert_relative(1e-4, of(UNIT_DISK, point), of(Polygon(rim), point))


def test_the_series_of_far_disks_continues_the_elliptic_integrals():
    # At three radii from the centre.
    direction = np.array([0.8, 0.0, 0.6])
    near, far = (of(UNIT_DISK, 3 * (1 + step) * direction) for step in (-1e-13, 1e-13))
    assert_relative(1e-12, near, far)


def test_points_of_any_shape_are_taken_one_by_one():
    points = np.random.default_rng(3).uniform(-2, 2, (4, 5, 3))
    for shape in (Polygon(L_SHAPE), UNIT_SQUARE, UNIT_DISK, Sphere([0, 0, 0], 1)):
        found = solid_angle(shape, points)
        assert found.value.shape == found.error.shape == (4, 5)
        assert_relative(1e-13, found.value[2, 3], of(shape, points[2, 3]))
    assert solid_angle(UNIT_DISK, np.empty((0, 3))).value.shape == (0,)


def test_bounds_are_tight_where_nothing_is_special():
    points = np.random.default_rng(4).uniform(1, 2, (1000, 3))
    for shape in (Polygon(SQUARE), UNIT_SQUARE, UNIT_DISK, Sphere([0, 0, 0], 1)):
        assert solid_angle(shape, points).relative_error.max() < 1e-13


# ------------------------------------------------------------------------------------------------------ errors


def test_a_mesh_has_no_solid_angle_of_its_own():
    with pytest.raises(InvalidArgument, match="may hide each other"):
        solid_angle(Mesh(np.eye(3), [[0, 1, 2]]), [0, 0, 0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: solid_angle(UNIT_DISK, [0, np.nan, 0]), r"points\[1\] is nan"),
        (lambda: solid_angle(UNIT_DISK, [0, 0]), r"points has shape \(2,\)"),
        (lambda: cone([0.1, 4]), r"half_angle\[1\] is 4.0, it must be in \[0, pi\]"),
        (lambda: plane_angle([1, 2, 3], [1, 2, 3], [0, 0, 0]), "start and end are the same point"),
        (lambda: area_to_solid_angle([0, 0, 0], [[1, 0, 0], [0, 0, 0]], [1, 0, 0]), r"points\[1\] lies on"),
        (lambda: area_to_solid_angle([0, 0, 0], [1, 0, 0], [2, 0, 0]), "must be a unit vector"),
        (lambda: area_to_solid_angle(np.zeros((2, 3)), np.ones((3, 3)), [1, 0, 0]), "do not fit together"),
        (lambda: solid_angle_to_area([0, 0, 0], [1, 0, 0], [0, 1, 0]), "seen edge-on"),
    ],
)
def test_wrong_arguments_are_named(call, message):
    with pytest.raises(InvalidArgument, match=message):
        call()
