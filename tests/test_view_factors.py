"""Laws of view factors: symmetry, sums over closed surfaces, limits, and what is refused."""

import itertools
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import ConvexHull

from oracle.arrays import InvalidArgument
from oracle.emitters import Receivers
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere
from oracle.view_factors import crossed_strings, view_factor, view_factors
from oracle.view_factors.over_surface import exchange_over_surface
from oracle.view_factors.polygons import exchange_area

UP = np.array([0.0, 0.0, 1.0])


def turned(seed):
    """A rotation of three dimensions."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.linalg.det(q)


def box(a, b, c, rotation):
    """The six walls of a box with half lengths a, b and c, their fronts inside."""
    walls = []
    for half, axis in zip((a, b, c), np.eye(3), strict=True):
        u, v = (h * e for h, e in zip((a, b, c), np.eye(3), strict=True) if not (e == axis).all())
        for side in (-1, 1):
            order = (u, v) if np.cross(u, v) @ axis * side < 0 else (v, u)
            walls.append(Rectangle(rotation @ (side * half * axis) + 3, rotation @ order[0], rotation @ order[1]))
    return walls


def hull(count, seed):
    """The triangles of a convex polyhedron, their fronts inside."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    faces = [points[corners] for corners in ConvexHull(points).simplices]
    inside = points.mean(axis=0)
    return [Polygon(f if np.cross(f[1] - f[0], f[2] - f[0]) @ (inside - f[0]) > 0 else f[::-1]) for f in faces]


def exchanged(shapes):
    """Exchange areas of all pairs."""
    return view_factors(shapes, shapes).value * np.array([shape.area for shape in shapes])[:, None]


def rectangle(center, u, v):
    return Rectangle(np.array(center, float), np.array(u, float), np.array(v, float))


@pytest.mark.parametrize(
    "shapes",
    [box(1, 1, 1, np.eye(3)), box(1, 2, 0.01, np.eye(3)), box(3, 1, 0.5, turned(1)), hull(4, 2), hull(7, 3)],
    ids=["cube", "flat box", "turned box", "tetrahedron", "polyhedron"],
)
def test_all_that_leaves_a_wall_of_a_closed_room_arrives(shapes):
    factors = view_factors(shapes, shapes)
    # 36 view factors of about 1e-16 rounding each, amplified by the contours of thin walls.
    np.testing.assert_allclose(factors.value.sum(axis=1), 1, rtol=0, atol=2e-14)
    assert (np.abs(factors.value.sum(axis=1) - 1) <= factors.error.sum(axis=1)).all()


@pytest.mark.parametrize("shapes", [box(1, 2, 0.3, turned(4)), hull(6, 5)], ids=["box", "polyhedron"])
def test_in_a_closed_room_the_flux_received_is_the_flux_emitted(shapes):
    areas = np.array([shape.area for shape in shapes])
    exitance = np.random.default_rng(6).uniform(0, 10, len(shapes))
    received = exitance * areas @ view_factors(shapes, shapes).value
    np.testing.assert_allclose(received.sum(), exitance @ areas, rtol=1e-13)


def test_a_furnace_of_grey_walls_has_the_radiosity_of_the_geometric_series():
    walls, rho = box(1, 2, 3, turned(7)), 0.5
    radiosity = np.linalg.solve(np.eye(6) - rho * view_factors(walls, walls).value, np.ones(6))
    np.testing.assert_allclose(radiosity, 1 / (1 - rho), rtol=1e-13)


@pytest.mark.parametrize("shapes", [box(1, 2, 0.3, turned(8)), hull(6, 9)], ids=["box", "polyhedron"])
def test_exchange_is_mutual(shapes):
    areas = exchanged(shapes)
    # The polygons' inner and outer contours change roles.
    np.testing.assert_allclose(areas, areas.T, rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize(("first", "second"), list(itertools.combinations(range(6), 2)))
def test_closed_forms_of_rectangles_agree_with_contour_integrals(first, second):
    walls = box(1, 2, 0.3, np.eye(3))
    exact = view_factor(walls[first], walls[second])
    value, error = exchange_area(walls[first].polygon, walls[second].polygon)
    assert abs(value / walls[first].area - exact.value) <= error / walls[first].area + exact.error
    assert error < 1e-12


def test_a_turned_pair_of_rectangles_exchanges_as_much():
    walls, again = box(1, 2, 0.3, np.eye(3)), box(1, 2, 0.3, turned(10))
    np.testing.assert_allclose(view_factors(again, again).value, view_factors(walls, walls).value, atol=1e-14)


@pytest.mark.parametrize("gap", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_rectangles_at_any_gap_agree_with_polygons(gap):
    below = rectangle([0, 0, 0], [0.5, 0, 0], [0, 0.5, 0])
    above = rectangle([0.25, 0.125, gap], [0, 0.5, 0], [0.5, 0, 0])
    exact = view_factor(below, above)
    value, error = exchange_area(below.polygon, above.polygon)
    assert abs(value - exact.value) <= error + exact.error
    assert exact.error < 1e-12 * exact.value


def test_far_apart_the_view_factor_is_the_inverse_square_law():
    below, above = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), rectangle([0, 0, 1e6], [0, 2, 0], [1, 0, 0])
    # Sizes add 1e-12 relative.
    np.testing.assert_allclose(view_factor(below, above).value, 8 / (np.pi * 1e12), rtol=1e-11)


def test_a_tiny_source_has_the_view_factor_of_a_surface_element():
    target = Polygon([[3, -2, 0.5], [-2, -1, 1], [0, 3, 0.7]])
    tiny = Polygon(1e-6 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]))
    element = view_factor(Receivers(np.zeros(3), UP), target)
    # A centred element differs by the second order.
    np.testing.assert_allclose(view_factor(tiny, target).value, element.value, rtol=1e-11)


def test_a_surface_element_sees_the_projected_solid_angle_over_pi():
    receivers = Receivers(np.zeros((4, 3)), UP)
    target = rectangle([0.2, 0.1, 1], [0, 1, 0], [1, 0, 0])
    expected = projected_solid_angle(target, receivers)
    result = view_factor(receivers, target)
    assert result.value.shape == (4,)
    np.testing.assert_allclose(result.value, expected.value / np.pi, rtol=1e-15)


def test_parts_of_a_target_add_up():
    source = Polygon([[0, 0, 0], [1, 0.1, 0], [0.3, 1, 0]])
    a, b, c, d = np.array([[-1, -1, 0.3], [-1, 1, 1], [1, 1, 1.5], [1, -1, 0.8]])
    c = a + (b - a) + (d - a)
    whole, parts = view_factor(source, Polygon([a, b, c, d])), [Polygon([a, b, c]), Polygon([a, c, d])]
    np.testing.assert_allclose(view_factors([source], parts).value.sum(), whole.value, rtol=1e-13)


def test_a_non_convex_target_is_its_triangles():
    a, b, c, d = np.array([[0, 0, 1], [0.2, 2, 1], [0.4, 0.5, 1], [2, 0.4, 1]], float)
    source = Polygon([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    parts = view_factors([source], [Polygon([a, b, c]), Polygon([a, c, d])])
    np.testing.assert_allclose(view_factor(source, Polygon([a, b, c, d])).value, parts.value.sum(), rtol=1e-13)


def test_what_lies_behind_the_plane_of_the_other_does_not_count():
    source = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    reaching_below = rectangle([0, 2, 0], [0, 0, 1], [1, 0, 0])
    above_only = rectangle([0, 2, 0.5], [0, 0, 0.5], [1, 0, 0])
    polygons = view_factor(source.polygon, reaching_below.polygon)
    np.testing.assert_allclose(view_factor(source, reaching_below).value, view_factor(source, above_only).value)
    np.testing.assert_allclose(polygons.value, view_factor(source, above_only).value, rtol=1e-12)


@pytest.mark.parametrize("convert", [lambda shape: shape, lambda shape: shape.polygon], ids=["rectangle", "polygon"])
def test_backs_and_coplanar_shapes_exchange_nothing(convert):
    source = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    away = rectangle([0, 0, 1], [1, 0, 0], [0, 1, 0])
    beside = rectangle([2, 0, 0], [1, 0, 0], [0, 1, 0])
    behind = rectangle([0, 0, -1], [0, 1, 0], [1, 0, 0])
    assert not view_factors([convert(source)], [convert(one) for one in (away, beside, behind)]).value.any()


def test_a_mesh_is_the_sum_of_its_triangles():
    corners = np.array([[-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]], float)
    mesh = Mesh(corners, [[0, 1, 2], [0, 2, 3]])
    source = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    np.testing.assert_allclose(view_factor(source, mesh).value, view_factor(source, Polygon(corners)).value)
    np.testing.assert_allclose(view_factor(mesh, source).value, view_factor(Polygon(corners), source).value)


def test_close_disks_see_only_each_other():
    assert abs(view_factor(Disk([0, 0, 0], UP, 1), Disk([0, 0, 1e-9], -UP, 1)).value - 1) < 2e-9


def test_coaxial_disks_keep_their_ratio_of_areas():
    small, large = Disk([0, 0, 0], UP, 0.5), Disk([0, 0, 2], -UP, 3)
    there, back = view_factor(small, large), view_factor(large, small)
    np.testing.assert_allclose(there.value * small.area, back.value * large.area, rtol=1e-15)


def test_a_sphere_gives_a_wall_of_its_box_a_sixth():
    for wall in box(1, 1, 1, turned(11)):
        result = view_factor(Sphere([3, 3, 3], 0.7), wall)
        assert abs(result.value - 1 / 6) <= result.error < 1e-14


def test_a_sphere_gives_a_huge_disk_a_half():
    np.testing.assert_allclose(view_factor(Sphere([0, 0, 1], 1), Disk([0, 0, 0], UP, 1e9)).value, 0.5, rtol=2e-9)


def test_a_sphere_behind_a_disk_gives_it_nothing():
    assert view_factor(Sphere([0, 0, -2], 1), Disk([0, 0, 0], UP, 1)).value == 0


def test_a_plane_element_sees_of_a_sphere_what_reciprocity_says():
    sphere, wall = Sphere([0, 0, 3], 0.5), rectangle([0, 0, 0], [1e-6, 0, 0], [0, 1e-6, 0])
    # A surface element below the centre sees (R / d)^2.
    np.testing.assert_allclose(view_factor(wall, sphere).value, 0.25 / 9, rtol=1e-11)


def test_strips_of_a_closed_duct_receive_all():
    corners = np.array([[0, 0], [2, 0.3], [2.5, 2], [0.7, 2.5], [-0.6, 1]])
    sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    np.testing.assert_allclose(crossed_strings(sides[:, None], sides).value.sum(axis=1), 1, rtol=1e-14)


def test_crossed_strings_are_long_rectangles():
    below, above = rectangle([0, 0, 0], [1, 0, 0], [0, 1e6, 0]), rectangle([0.5, 0, 2], [0, 1e6, 0], [1, 0, 0])
    strips = crossed_strings([[-1, 0], [1, 0]], [[1.5, 2], [-0.5, 2]])
    # The ends let out a part of order gap / length.
    np.testing.assert_allclose(view_factor(below, above).value, strips.value, rtol=3e-6)


@pytest.mark.parametrize("behind", [[[0, -1], [1, -1]], [[0, 1], [1, 1]]])
def test_strips_that_do_not_face_each_other_exchange_nothing(behind):
    assert crossed_strings([[0, 0], [1, 0]], behind).value == 0


def test_many_pairs_at_once_are_the_pairs_one_by_one():
    sources = [*box(1, 2, 3, np.eye(3)), *hull(4, 12)]
    together = view_factors(sources, sources)
    for i, j in [(0, 1), (0, 2), (3, 8), (7, 1), (8, 9)]:
        assert view_factor(sources[i], sources[j]).value == together.value[i, j]


# ---------------------------------------------------------------------------------- pairs without a closed form

TILTED = np.array([-0.6, 0.0, 0.8])


@pytest.mark.parametrize(
    "disk",
    [
        Disk([0.1, 0.2, 0.0], UP, 0.5),
        Disk([0.1, 0.2, 0.1], TILTED, 0.5),
        Disk([0, 0, -1], UP, 1),
        Disk([0, 0, 0], TILTED, 0.9),
        Disk([0.1, 0, -0.999], UP, 0.8),
    ],
    ids=["level", "tilted", "lying on the floor up to a wall", "large and tilted", "just above the floor"],
)
def test_all_that_leaves_a_disk_in_a_closed_room_arrives(disk):
    walls = box(1, 1.1, 1, np.eye(3))
    inside = Disk(disk.center + 3, disk.normal, disk.radius)
    factors = view_factors([inside], walls)
    np.testing.assert_allclose(factors.value.sum(), 1, rtol=1e-13)
    assert factors.error.sum() < 1e-9


@pytest.mark.parametrize(
    ("disk", "rest"),
    [
        # Of equal size, they are integrated over the one or the other.
        (Disk([0, 0, 0], UP, 1), Disk([0.5, 0.2, 0.3], TILTED * [1, 1, -1], 1)),
        (Disk([0, 0, 0], TILTED, 1), Disk([0.2, 0, 0], UP, 1)),
        (Disk([0, 0, 0], UP, 1), Polygon([[-0.5, 0, 0], [-0.5, 0, 1], [0.5, 0, 1], [0.5, 0, 0]])),
        (Disk([0, 0, 1], [1, 0, 0], 1), Polygon([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]])),
        (Disk([0, 0, 0], [1, 0, 0], 1), Polygon([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]])),
        (Disk([0, 0, 0], UP, 3), Sphere([1, 0, 1], 1)),
        (Disk([2, 0, 0], UP, 1), Sphere([0, 0, 0.5], 1)),
        (rectangle([3, 0, 0], [1, 0, 0], [0, 2, 0]), Sphere([0, 0, -0.5], 1)),
        (Sphere([0, 0, 0], 1), Sphere([0, 3, 0], 0.5)),
    ],
    ids=[
        *("disks cut by planes", "disks through each other", "polygon on a disk", "disk on a polygon"),
        *("half a disk on a polygon", "sphere on a disk", "sphere in the plane of a disk"),
        *("sphere in the plane of a rectangle", "spheres"),
    ],
)
def test_round_shapes_exchange_as_much_there_as_back(disk, rest):
    there, back = view_factor(disk, rest), view_factor(rest, disk)
    difference = abs(there.value * disk.area - back.value * rest.area)
    assert difference <= there.error * disk.area + back.error * rest.area
    assert 0 < there.error < 2e-10 * there.value


@pytest.mark.parametrize("angle", [1.3, 1.6, 2.5, 3.0])
def test_disks_cut_out_of_one_sphere_exchange_what_their_caps_do(angle):
    # Each cap of a sphere sends to each part of the sphere its part of the area [Feingold 1978].
    radius, heights = 0.5, np.array([0.45, 0.35])
    axes = np.array([[0, 0, 1], [np.sin(angle), 0, np.cos(angle)]])
    # The planes meet outside of the sphere.
    assert angle > np.arccos(heights / radius).sum()
    disks = [Disk(h * n, -n, np.sqrt(radius**2 - h**2)) for h, n in zip(heights, axes, strict=True)]
    first, second = 2 * np.pi * radius * (radius - heights)
    result = view_factor(*disks)
    np.testing.assert_allclose(result.value * disks[0].area, first * second / (4 * np.pi * radius**2), rtol=1e-12)
    assert result.error < 1e-9 * result.value


def test_published_view_factors_are_found():
    # Howell, C-41, with its radii 0.1 and 0.2 at a distance of 0.5; and a sphere above the corner of a square
    # [Tripp, Hwang and Crank 1962]: the square is a face's quarter of a cube around the sphere.
    disks = view_factor(Disk([0, 0, 0], UP, 0.1), Disk([0, 0, 0.5], -UP, 0.2))
    np.testing.assert_allclose(disks.value, 0.1339, atol=5e-5)
    square = rectangle([0.25, 0.25, 0], [0.25, 0, 0], [0, 0.25, 0])
    np.testing.assert_allclose(view_factor(Sphere([0, 0, 0.5], 0.1), square).value, 1 / 24, rtol=1e-14)


def test_a_disk_and_a_polygon_near_to_it_agree_with_a_polygon_in_place_of_the_disk():
    angles = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    # Of the same area; second moments then differ by 1e-3.
    radius = np.sqrt(np.pi / (64 * np.sin(2 * np.pi / 128)))
    outline = radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    target = Polygon([[-1, -2, 0.7], [0, 3, 0.5], [2, 0, 0.9]])
    round_one, many_corners = view_factor(Disk([0, 0, 0], UP, 1), target), view_factor(Polygon(outline), target)
    np.testing.assert_allclose(round_one.value, many_corners.value, rtol=1e-5)


@pytest.mark.parametrize("gap", [0.0, 0.01, 1.0, 100.0])
def test_spheres_exchange_what_rays_between_their_surfaces_say(gap):
    radius, distance = 0.5, 1.5 + gap

    def received(cosine):
        """Directions from a point on the first sphere, around the one to the second's centre, above its horizon."""
        height = distance * cosine - radius
        away = np.sqrt(distance**2 + radius**2 - 2 * radius * distance * cosine)
        sigma, tilt = np.arcsin(min(1 / away, 1)), np.arccos(height / away)

        def ring(psi):
            # Integral of max(0, cos) over a circle of directions.
            a, b = np.cos(psi) * np.cos(tilt), np.sin(psi) * np.sin(tilt)
            half = np.arccos(np.clip(-a / b, -1, 1)) if b > 0 else np.pi * (a > 0)
            return np.sin(psi) * 2 * (a * half + b * np.sin(half))

        kinks = [abs(np.pi / 2 - tilt)] if abs(np.pi / 2 - tilt) < sigma else []
        return quad(ring, 0, sigma, points=kinks or None, epsabs=1e-13, epsrel=1e-11, limit=200)[0]

    ends = [(radius - 1) / distance, (radius + 1) / distance, 1]
    expected = sum(quad(received, a, b, epsabs=1e-12, epsrel=1e-9, limit=200)[0] for a, b in pairwise(ends))
    result = view_factor(Sphere([0, 0, 0], radius), Sphere([0, 0, distance], 1))
    # The quadrature's own precision.
    np.testing.assert_allclose(result.value, expected / (2 * np.pi), rtol=3e-8)


def test_a_small_sphere_on_a_huge_one_sees_it_as_a_plane():
    # All below its equator, and above it nothing: half of what leaves a sphere goes down.
    np.testing.assert_allclose(view_factor(Sphere([0, 0, 1], 1), Sphere([0, 0, -1e8], 1e8)).value, 0.5, rtol=1e-3)


def test_in_the_plane_of_a_disk_half_a_sphere_is_lit_from_its_side():
    # By symmetry the plane through the centre halves what a far sphere gets: the disk sends to the upper half only.
    disk, half = Disk([1000, 0, 0], UP, 1), Sphere([0, 0, 0], 1)
    # 1/pi times the integral of cos over half a disk of directions, (2/3) s^3 with s = R/d.
    np.testing.assert_allclose(view_factor(disk, half).value, 2 / (3 * np.pi) * 1e-9, rtol=1e-5)


def test_parts_of_a_disk_add_up():
    disk = Disk([0, 0, 0], UP, 1)
    a, b, c, d = np.array([[-1, -2, 0.7], [0, 3, 0.5], [2, 0, 0.9], [1, -2, 0.9]])
    d = a + (c - b)
    whole = view_factor(disk, Polygon([a, b, c, d]))
    parts = view_factors([disk], [Polygon([a, b, c]), Polygon([a, c, d])])
    np.testing.assert_allclose(whole.value, parts.value.sum(), rtol=1e-13)


def test_a_non_convex_polygon_and_a_disk_exchange_what_its_triangles_do():
    a, b, c, d = np.array([[0, 0, 1], [0.2, 2, 1], [0.4, 0.5, 1], [2, 0.4, 1]], float)
    # Larger, and smaller than the disk.
    for radius in (0.3, 30.0):
        disk = Disk([0.1, 0, 0], UP, radius)
        parts = view_factors([disk], [Polygon([a, b, c]), Polygon([a, c, d])])
        np.testing.assert_allclose(view_factor(disk, Polygon([a, b, c, d])).value, parts.value.sum(), rtol=1e-13)


def test_a_mesh_and_a_disk_exchange_what_the_triangles_do():
    corners = np.array([[-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]], float)
    disk = Disk([0.3, 0, 0], TILTED, 0.5)
    mesh, plain = Mesh(corners, [[0, 1, 2], [0, 2, 3]]), Polygon(corners)
    np.testing.assert_allclose(view_factor(disk, mesh).value, view_factor(disk, plain).value, rtol=1e-13)
    np.testing.assert_allclose(view_factor(mesh, disk).value, view_factor(plain, disk).value, rtol=1e-13)


def test_disks_that_nearly_touch_all_along_their_rims_have_a_bound_that_holds():
    # Coaxial ones, by the quadrature instead of their closed form.
    for gap in (1e-2, 1e-4):
        first, second = Disk([0, 0, 0], UP, 1), Disk([0, 0, gap], -UP, 1)
        exact = view_factor(first, second)
        value, error = exchange_over_surface(first, second)
        assert abs(value / first.area - exact.value) <= error / first.area + exact.error
        assert error < 1e-6


@pytest.mark.parametrize(
    ("source", "target"),
    [
        (Disk([0, 0, 0], UP, 1), Disk([3, 0, 0], UP, 1)),
        (Disk([0, 0, 0], UP, 1), Disk([3, 0, 1], UP, 1)),
        (Disk([0, 0, 0], UP, 1), Polygon([[0, 0, 1], [1, 0, 1], [0, 1, 1]])),
        (Disk([0, 0, 0], UP, 1), Polygon([[5, 0, -1], [5, 0, -2], [5, 1, -2]])),
        (Disk([0, 0, 0], UP, 1), Sphere([0, 0, 0], 2)),
        (Polygon([[0, 0, 1], [1, 0, 1], [0, 1, 1]]), Sphere([0, 0, 0], 2)),
        (Sphere([0, 0, 0], 1), Sphere([0, 0, 0.5], 2)),
        (Sphere([0, 0, 0], 1), Sphere([0, 0, 0], 1)),
        (Sphere([0, 0, 0], 1), Sphere([0, 0, 1], 2)),
    ],
    ids=[
        *("side by side", "seen from behind", "back of a polygon", "polygon behind", "disk in a sphere"),
        *("polygon in a sphere", "sphere in a sphere", "the same sphere", "sphere that touches from inside"),
    ],
)
def test_round_shapes_whose_fronts_do_not_see_each_other_exchange_nothing(source, target):
    assert view_factor(source, target).value == 0
    assert view_factor(target, source).value == 0


@pytest.mark.parametrize(
    ("source", "target"),
    [
        (Sphere([0, 0, 0.5], 1), Disk([0, 0, 0], UP, 1)),
        (Sphere([0, 0, 0.5], 1), Disk([1.5, 0, 0], UP, 0.7)),
        (Sphere([0, 0, 0.5], 1), rectangle([0, 0, 0], [5, 0, 0], [0, 5, 0])),
        (Sphere([0, 0, 0.5], 1), Mesh([[0.5, -1, 0], [2, 0, 0], [0.5, 1, 0]], [[0, 1, 2]])),
        (Sphere([0, 0, 0], 1), Sphere([1.9, 0, 0], 1)),
    ],
)
def test_a_sphere_that_passes_through_its_partner_is_refused(source, target):
    with pytest.raises(InvalidArgument, match=r"target: the sphere.* pass through each other; they may only touch"):
        view_factor(source, target)


def test_an_empty_sequence_is_refused():
    with pytest.raises(InvalidArgument, match="targets is an empty sequence"):
        view_factors([Sphere([0, 0, 0], 1)], [])


def test_a_strip_without_width_is_refused():
    with pytest.raises(InvalidArgument, match="target has a segment without length"):
        crossed_strings([[0, 0], [1, 0]], [[1, 1], [1, 1]])
