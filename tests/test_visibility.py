"""Penumbrae, shadow rays and the outlines of shadows: limits, laws and errors. See also verified/visibility.py."""

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.emitters import Directional, Point, Receivers, Spot
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere
from oracle.visibility import conic_shadow, polygon_shadow, visible, visible_projected_solid_angle
from oracle.visibility.convex import convex_parts

UP = np.array([0.0, 0.0, 1.0])
# Shines downwards from a height of 2 m.
LIGHT = Rectangle([0, 0, 2], [1, 0, 0], [0, -1, 0])
SCREEN = Polygon([[-0.5, -0.3, 1], [0.4, -0.6, 1], [0.3, 0.5, 1], [-0.6, 0.2, 1]])
SLANTED = Polygon([[-0.3, -0.4, 0.7], [0.5, -0.2, 1.2], [0.1, 0.6, 0.9]])
ELL = Polygon(
    [[-0.8, -0.8, 1.1], [0.8, -0.8, 1.1], [0.8, 0.8, 1.1], [0.5, 0.8, 1.1], [0.5, -0.5, 1.1], [-0.8, -0.5, 1.1]]
)
FLOOR = Rectangle([0, 0, 0], [3, 0, 0], [0, 3, 0])
LAMP = Point([0.2, -0.1, 2], [1.0])
SUN = Directional(np.array([0.3, 0.2, -1]) / np.sqrt(1.13), [1.0])
# Sums of a few pieces of the order of 1, each with some ulps.
ROUNDING = 1e-13


def on_the_floor(count=500, reach=3.0, seed=1):
    points = np.random.default_rng(seed).uniform(-reach, reach, (count, 3)) * [1, 1, 0]
    return Receivers(points, UP)


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def seen(occluders, receivers=None, light=LIGHT, two_sided=False):
    return visible_projected_solid_angle(light, receivers or on_the_floor(), occluders, two_sided)


def assert_same(a, b, tolerance=ROUNDING):
    np.testing.assert_allclose(a.value, b.value, rtol=0, atol=tolerance)


# ------------------------------------------------------------------------------------------------- penumbra


def test_without_occluders_the_whole_emitter_is_seen():
    assert_same(seen([]), projected_solid_angle(LIGHT, on_the_floor()), 0)


def test_bounds_hold_where_a_needle_s_own_normal_does_not_tell_the_side():
    needle = Polygon(
        [
            [0.9903945457354207, 0.13827018397879376, 0.0],
            [-0.9903945457354207, -0.13827018397879376, 0.0],
            [-0.8313674633608771, -0.11606823647622681, 2.7719696032510957e-07],
        ]
    )
    point = [-0.9659445634491785, -0.12915754053451892, -0.09642455089642986]
    normal = [0.8137347730452955, 0.07957613732039012, 0.5757632825268453]
    found = seen([], Receivers(point, normal), needle)
    # The contour integral in 60 digits.
    assert abs(found.value - 8.38195653158964e-18) <= found.error


def test_what_a_screen_hides_is_its_shadow_on_the_emitter():
    # The screen is halfway: seen from p it hides the part of the emitter's plane at 2 s - p.
    for point in np.random.default_rng(2).uniform(-0.2, 0.2, (20, 3)) * [1, 1, 0]:
        receiver = Receivers(point, UP)
        small = 0.3 * SCREEN.vertices + [0, 0, 0.7]
        hidden = projected_solid_angle(Polygon(2 * small[::-1] - point), receiver)
        part = seen([Polygon(small)], receiver)
        assert part.value + hidden.value == pytest.approx(projected_solid_angle(LIGHT, receiver).value, abs=ROUNDING)


def test_a_large_screen_hides_everything():
    assert (seen([Rectangle([0, 0, 1], [9, 0, 0], [0, 9, 0])]).value == 0).all()


@pytest.mark.parametrize("screen", [SCREEN, SLANTED, ELL], ids=["convex", "slanted", "L"])
def test_what_two_equal_occluders_hide_counts_once(screen):
    assert_same(seen([screen, screen]), seen([screen]))


def test_the_order_of_occluders_does_not_matter():
    assert_same(seen([SCREEN, SLANTED, ELL]), seen([ELL, SCREEN, SLANTED]))


def test_the_side_of_an_occluder_does_not_matter():
    assert_same(seen([Polygon(ELL.vertices[::-1])]), seen([ELL]))


def test_occluders_that_do_not_overlap_hide_as_much_as_the_sum_of_both():
    # From the receivers above 0, their projections are on different sides of x = 0.
    left, right = (Rectangle([x, 0, 1], [0.2, 0, 0], [0, 0.3, 0]) for x in (-0.4, 0.4))
    whole = projected_solid_angle(LIGHT, on_the_floor()).value
    both = (whole - seen([left]).value) + (whole - seen([right]).value)
    np.testing.assert_allclose(whole - seen([left, right]).value, both, atol=ROUNDING)


def test_a_mesh_hides_like_the_polygon_it_covers():
    v = SCREEN.vertices
    assert_same(seen([Mesh(v, [[0, 1, 2], [0, 2, 3]])]), seen([SCREEN]))


def test_a_polygon_that_is_not_convex_hides_like_its_parts():
    bars = [Polygon(ELL.vertices[[0, 1, 4, 5]]), Polygon(ELL.vertices[[1, 2, 3, 4]])]
    assert_same(seen([ELL]), seen(bars))


def test_a_hole_joined_to_the_outline_lets_light_through():
    outer, inner = SCREEN.vertices, 0.4 * SCREEN.vertices + [0, 0, 0.6]
    ring = Polygon(np.concatenate([outer, outer[:1], inner[:1], inner[:0:-1], inner[:1]]))
    # So many that some see slivers between the ring's triangles that are narrower than rounding.
    receivers = on_the_floor(8000)
    hidden = seen([Polygon(inner)], receivers).value - seen([SCREEN], receivers).value
    whole = projected_solid_angle(LIGHT, receivers).value
    np.testing.assert_allclose(whole - seen([ring], receivers).value, hidden, atol=ROUNDING)


def test_an_emitter_that_is_not_convex_is_seen_like_its_parts():
    light = Polygon(ELL.vertices[::-1] + 0.9 * UP)
    parts = [Polygon(light.vertices[i]) for i in ([0, 1, 4, 5], [1, 2, 3, 4])]
    total = sum(seen([SCREEN], light=part).value for part in parts)
    np.testing.assert_allclose(seen([SCREEN], light=light).value, total, atol=ROUNDING)


@pytest.mark.parametrize(
    "occluder",
    [
        Rectangle([0, 0, 2], [0.5, 0, 0], [0, 0.5, 0]),
        Rectangle([0, 0, 2.1], [9, 0, 0], [0, 9, 0]),
        Rectangle([0, 0, 0], [9, 0, 0], [0, 9, 0]),
        Rectangle([0, 0, -0.1], [9, 0, 0], [0, 9, 0]),
        Rectangle([0, 0, 3], [0, 1, 0], [0, 0, 1]),
    ],
    ids=["in the emitter's plane", "beyond it", "in the receivers' plane", "behind them", "standing on the emitter"],
)
def test_what_is_not_strictly_between_hides_nothing(occluder):
    assert_same(seen([occluder]), seen([]), 0)


@pytest.mark.parametrize("seed", range(3))
def test_a_tilted_floor_does_not_hide_its_own_points_from_light(seed):
    turn = rotation(seed)
    receivers = on_the_floor()
    there = Receivers(receivers.points @ turn.T, receivers.normals @ turn.T)
    floor, light = Polygon(FLOOR.polygon.vertices @ turn.T), Polygon(LIGHT.polygon.vertices @ turn.T)
    assert_same(seen([floor], there, light), seen([], there, light), 0)


def test_the_part_of_an_occluder_beyond_the_emitter_hides_nothing():
    through = Rectangle([0.1, 0, 2], [0.3, 0.2, 0], [0, 0, 0.8])
    below = Rectangle([0.1, 0, 1.6], [0.3, 0.2, 0], [0, 0, 0.4])
    assert_same(seen([through]), seen([below]))


def test_the_part_of_an_occluder_behind_the_receiver_hides_nothing():
    # A wall that reaches below the floor.
    wall, above = (Polygon([[1, -2, z], [1, 2, z], [1, 2, 1.5], [1, -2, 1.5]]) for z in (-7.0, 0.0))
    assert_same(seen([wall]), seen([above]))


@pytest.mark.parametrize("seed", range(5))
def test_the_world_may_be_turned_and_moved(seed):
    turn, shift = rotation(seed), np.array([3.0, -5.0, 2.0])

    def moved(shape):
        return Polygon(shape.vertices @ turn.T + shift)

    receivers = on_the_floor(seed=seed)
    there = Receivers(receivers.points @ turn.T + shift, receivers.normals @ turn.T)
    occluders = [SCREEN, SLANTED, ELL]
    # Coordinates of 10 m round a hundred times coarser than the light's angles.
    assert_same(seen([moved(one) for one in occluders], there, moved(LIGHT.polygon)), seen(occluders, receivers), 1e-12)


def test_both_sides_of_an_emitter_see_its_occluders():
    mirror = [1, 1, -1]
    screen = Polygon(SCREEN.vertices * mirror + [0, 0, 4])
    above = Receivers(on_the_floor().points + 4 * UP, -UP)
    assert_same(seen([screen], above, two_sided=True), seen([SCREEN]))
    assert (seen([screen], above).value == 0).all()


def test_a_closed_convex_mesh_does_not_hide_itself():
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (1.0, 1.7)]) @ rotation(3).T
    corners += [0, 0, 3]
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]]
    box = Mesh(corners, [*faces, [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])
    assert_same(seen([box], light=box), projected_solid_angle(box, on_the_floor()), 0)


def test_a_mesh_among_its_occluders_hides_its_own_parts():
    # A fin hangs from the light.
    vertices = np.concatenate([LIGHT.polygon.vertices, [[0.5, -0.5, 2], [0.5, 0.5, 2], [0.5, 0, 1]]])
    mesh = Mesh(vertices, [[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    fin = Polygon(vertices[4:])
    expected = seen([fin]).value + projected_solid_angle(fin, on_the_floor()).value
    np.testing.assert_allclose(seen([mesh], light=mesh).value, expected, atol=ROUNDING)
    assert (seen([mesh], light=mesh).value < seen([], light=mesh).value - 1e-3).any()


def test_a_tilted_receiver_sees_only_what_is_above_its_horizon():
    normal = np.array([1.0, 0, 0.1]) / np.hypot(1, 0.1)
    # The plane of the horizon through (0, 0, 0) cuts the emitter's at x = -0.2; SCREEN hides half the rest.
    receiver = Receivers(np.zeros(3), normal)
    right = Rectangle([0.4, 0, 2], [0.6, 0, 0], [0, -1, 0])
    assert_same(seen([SCREEN], receiver), seen([SCREEN], receiver, right))


def test_a_scene_may_have_many_occluders_and_any_shape_of_receivers():
    rng = np.random.default_rng(4)
    triangles = [Polygon(rng.uniform(-1, 1, 3) + [0, 0, 1] + 0.3 * rng.normal(size=(3, 3))) for _ in range(12)]
    grid = Receivers(rng.uniform(-1, 1, (7, 5, 3)) * [1, 1, 0], UP)
    part = seen(triangles, grid)
    assert part.value.shape == part.error.shape == (7, 5)
    one = seen(triangles, Receivers(grid.points[3, 2], UP))
    assert part.value[3, 2] == pytest.approx(float(one.value), abs=ROUNDING)
    assert (part.error < 1e-11).all()


def test_no_receivers_see_nothing():
    assert seen([SCREEN], Receivers(np.empty((0, 3)), UP)).value.shape == (0,)


@pytest.mark.parametrize(
    ("light", "occluder", "message"),
    [
        (Disk([0, 0, 2], -UP, 1), SCREEN, "shape is a Disk; a Polygon, Rectangle or Mesh is supported"),
        (LIGHT, Sphere([0, 0, 1], 0.5), r"occluders\[0\] is a Sphere; a Polygon"),
    ],
)
def test_round_shapes_are_refused(light, occluder, message):
    with pytest.raises(InvalidArgument, match=message):
        seen([occluder], light=light)


@pytest.mark.parametrize("seed", range(20))
def test_triangles_of_a_polygon_cover_it_once(seed):
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 12))
    outline = rng.uniform(0.2, 1, 12)[:, None] * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    polygon = Polygon(outline @ rotation(seed).T)
    parts = [Polygon(part) for part in convex_parts(polygon)]
    assert len(parts) == 10
    assert sum(part.area for part in parts) == pytest.approx(polygon.area, rel=1e-12)
    assert all(part.normal @ polygon.normal > 0.999999 for part in parts)


def test_a_diagonal_through_another_corner_is_no_side_of_a_triangle():
    # The diagonal of the L's bars passes through its inner corner, but for rounding.
    ell = np.array([[-1, -1], [1, -1], [1, -0.25], [0, 0], [0.25, 1], [-1, 1]])
    rng = np.random.default_rng(0)
    for _ in range(100):
        angle = rng.uniform(0, 6.25)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        corners = rng.uniform(-1, 1, 2) + rng.uniform(0.1, 1) * (ell @ turn.T)
        polygon = Polygon(np.column_stack([corners, np.zeros(6)]))
        assert sum(Polygon(part).area for part in convex_parts(polygon)) == pytest.approx(polygon.area, rel=1e-12)


# ------------------------------------------------------------------------------------------------- shadow rays


@pytest.mark.parametrize("emitter", [LAMP, SUN], ids=["point", "directional"])
@pytest.mark.parametrize("shape", [SCREEN, SLANTED, ELL], ids=["convex", "slanted", "L"])
def test_a_ray_is_blocked_where_a_small_light_is_hidden(emitter, shape):
    points = on_the_floor(3000).points
    to_light = -SUN.direction * 100 if emitter is SUN else LAMP.position - points
    small = 1e-9
    blocked = ~visible(emitter, points, [shape])
    # A tiny light at the same place is either seen or not; its few penumbrae aside.
    at = np.broadcast_to(to_light, points.shape) + points
    for index in range(0, 3000, 30):
        light = Rectangle(at[index], [small, 0, 0], [0, -small, 0])
        receiver = Receivers(points[index], UP)
        part = seen([shape], receiver, light).value / projected_solid_angle(light, receiver).value
        assert part == pytest.approx(0.0 if blocked[index] else 1.0, abs=1e-6)
    assert blocked.any()
    assert not blocked.all()


def test_a_disk_blocks_like_the_polygon_between_inner_and_outer_circle():
    disk = Disk([0.1, 0.1, 1], rotation(5)[2], 0.5)
    across = np.cross(disk.normal, UP)
    across /= np.linalg.norm(across)
    along = np.cross(disk.normal, across)
    angles = 2 * np.pi * np.arange(64) / 64
    ring = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * along
    points = on_the_floor(3000).points
    for emitter in (LAMP, SUN):
        outside, inside = (
            ~visible(emitter, points, [Polygon(disk.center + r * ring)]) for r in (0.5 / np.cos(np.pi / 64), 0.5)
        )
        blocked = ~visible(emitter, points, [disk])
        assert (inside <= blocked).all()
        assert (blocked <= outside).all()
        assert blocked.any()


def test_a_sphere_blocks_rays_that_pass_nearer_than_its_radius():
    sphere = Sphere([0.1, 0.2, 1], 0.3)
    points = on_the_floor(2000).points
    ray = LAMP.position - points
    distance = np.linalg.norm(np.cross(sphere.center - points, ray), axis=1) / np.linalg.norm(ray, axis=1)
    np.testing.assert_array_equal(visible(LAMP, points, [sphere]), distance >= 0.3)


def test_a_hollow_sphere_hides_inside_from_outside_but_not_inside_from_inside():
    around_lamp = Sphere([0, 0, 2], 1)
    points = np.array([[0, 0, 0.0], [0, 0, 1.5], [0.3, 0.3, 2.5]])
    np.testing.assert_array_equal(visible(LAMP, points, [around_lamp]), [False, True, True])
    assert not visible(SUN, points[1], [around_lamp])


def test_an_occluder_that_touches_the_receiver_hides_only_what_is_behind_it():
    ball = Sphere([0, 0, 0], 1)
    directions = on_the_floor(100, seed=8).points + 1e-3 * UP
    surface = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    lamp = Point([0, 0, 1e6], [1.0])
    assert visible(lamp, surface, [ball]).all()
    assert not visible(lamp, -surface, [ball]).any()
    assert visible(LAMP, on_the_floor().points, [FLOOR]).all()


def test_an_occluder_that_touches_the_emitter_hides_nothing():
    touching = [Rectangle(LAMP.position, [1, 0, 0], [0, 1, 0]), Sphere(LAMP.position + 0.5 * UP, 0.5)]
    assert visible(LAMP, on_the_floor().points, touching).all()
    assert visible(LAMP, LAMP.position, touching)


@pytest.mark.parametrize("shape", [Sphere([0, 0, -1], 0.5), Disk([0, 0, -1], UP, 9), SCREEN], ids=type)
@pytest.mark.parametrize("emitter", [LAMP, SUN], ids=["point", "directional"])
def test_an_occluder_behind_the_receiver_blocks_no_ray(shape, emitter):
    assert visible(emitter, on_the_floor(100, 0.5).points + 1.5 * UP, [shape]).all()


def test_a_tangent_ray_passes_a_sphere():
    assert visible(Point([0, 0, 2], [1.0]), [0.0, 0, 0], [Sphere([1, 0, 1], 1)])


def test_no_ray_slips_through_between_the_triangles_of_a_mesh():
    rng = np.random.default_rng(6)
    rim = [[np.cos(a), np.sin(a), 1 + 0.2 * np.sin(5 * a)] for a in np.linspace(0, 6, 9)]
    mesh = Mesh([[0.1, 0.05, 1.3], *rim], [[0, i, i % 9 + 1] for i in range(1, 10)])
    # Through points of the common edges, which rounding puts on either side.
    start = mesh.vertices[rng.integers(1, 10, 3000)]
    through = mesh.vertices[0] + rng.uniform(0, 0.9, (3000, 1)) * (start - mesh.vertices[0])
    points = LAMP.position + (through - LAMP.position) * rng.uniform(1.5, 4, (3000, 1))
    assert not visible(LAMP, points, [mesh]).any()


def test_a_spot_is_seen_like_a_point():
    spot = Spot(LAMP.position, -UP, [1.0], 0.1, 0.2)
    points = on_the_floor().points
    np.testing.assert_array_equal(visible(spot, points, [ELL]), visible(LAMP, points, [ELL]))


def test_rays_to_emitters_with_a_size_are_refused():
    with pytest.raises(InvalidArgument, match="emitter is a Rectangle; a Point, Spot or Directional is supported"):
        visible(LIGHT, [0, 0, 0], [])
    with pytest.raises(InvalidArgument, match=r"occluders\[0\] is a Point"):
        visible(LAMP, [0, 0, 0], [LAMP])


# ------------------------------------------------------------------------------------------------- shadow edges


def inside(polygon, points, margin):
    """Whether points are within a convex polygon on the floor by a margin, or outside by one; None in between."""
    if not len(polygon):
        return np.zeros(len(points), bool), np.ones(len(points), bool)
    edges = np.roll(polygon, -1, axis=0) - polygon
    inwards = np.cross(UP, edges)
    lengths = np.linalg.norm(inwards, axis=1)
    distances = np.einsum("pei,ei->pe", points[:, None] - polygon, inwards) / np.where(lengths == 0, 1, lengths)
    distances = np.where(lengths > 1e-9, distances, np.inf)
    return (distances > margin).all(axis=1), (distances < -margin).any(axis=1)


@pytest.mark.parametrize(
    "occluder",
    [
        Rectangle([0.2, 0.1, 1.5], [0.4, 0, 0], [0, 0.3, 0]),
        Rectangle([0, 0, 1.9], [0.9, 0, 0], [0, 0.9, 0]),
        Polygon([[-0.8, -0.4, 1.3], [0.9, -0.2, 1.8], [0.3, 0.9, 1.0]]),
        Rectangle([0.2, 0, 2], [0, 0.5, 0], [0.1, 0, 0.6]),
        Rectangle([0.2, 0, 0.2], [0, 0.8, 0], [0, 0, 0.5]),
        Polygon([[1.2, -0.5, 1.2], [1.2, 0.5, 1.2], [1.3, 0.5, 4], [1.3, -0.5, 4]]),
        Rectangle([1, 0, 1.6], [0, 1.5, 0], [0, 0, 0.4]),
    ],
    ids=[
        "screen",
        "near the light",
        "slanted",
        "through the light",
        "through the floor",
        "beside",
        "on the light's edge",
    ],
)
def test_shadows_part_the_floor_where_penumbrae_begin_and_end(occluder):
    shadow = polygon_shadow(LIGHT, occluder, FLOOR)
    receivers = on_the_floor(4000)
    whole = projected_solid_angle(LIGHT, receivers).value
    part = seen([occluder], receivers).value / whole
    within, without = inside(shadow.penumbra, receivers.points, 1e-3)
    assert within.any()
    # A light's corner counts from a thousandth of its size on.
    assert (part[within] < 1 - 1e-13).all()
    assert (part[without] > 1 - 1e-13).all()
    within, without = inside(shadow.umbra, receivers.points, 1e-3)
    assert (part[within] < 1e-13).all()
    assert (part[without] > 1e-13).all()


@pytest.mark.parametrize("emitter", [LAMP, SUN], ids=["point", "directional"])
def test_a_shadow_of_a_light_without_size_is_where_rays_are_blocked(emitter):
    for occluder in (SCREEN, SLANTED, Rectangle([0, 0, 1.5], [0.4, 0, 0.2], [-0.45, 0.1, 0.9])):
        shadow = polygon_shadow(emitter, occluder, FLOOR)
        points = on_the_floor(4000).points
        blocked = ~visible(emitter, points, [occluder])
        within, without = inside(shadow.umbra, points, 1e-9)
        assert within.any()
        np.testing.assert_array_equal(blocked, within)
        np.testing.assert_array_equal(blocked, ~without)
        np.testing.assert_allclose(shadow.umbra, shadow.penumbra, atol=1e-14)


@pytest.mark.parametrize(
    ("emitter", "occluder"),
    [
        (LAMP, Rectangle([0, 0, -1], [1, 0, 0], [0, 1, 0])),
        (LAMP, FLOOR),
        (LIGHT, Rectangle([0, 0, 2], [2, 0, 0], [0, 2, 0])),
        (Rectangle([0, 0, 2], [1, 0, 0], [0, 1, 0]), SCREEN),
        (Directional(UP, [1.0]), SCREEN),
        (Point([0, 0, -1], [1.0]), SCREEN),
    ],
    ids=[
        "below the floor",
        "the floor itself",
        "in the light's plane",
        "light turned away",
        "light from below",
        "below",
    ],
)
def test_no_shadow_falls_where_nothing_is_between(emitter, occluder):
    shadow = polygon_shadow(emitter, occluder, FLOOR)
    assert shadow.umbra.shape == shadow.penumbra.shape == (0, 3)


def test_shadows_of_shapes_that_are_not_convex_are_refused():
    with pytest.raises(InvalidArgument, match="occluder is not convex"):
        polygon_shadow(LIGHT, ELL, FLOOR)
    with pytest.raises(InvalidArgument, match="receiver is a Disk"):
        polygon_shadow(LIGHT, SCREEN, Disk([0, 0, 0], UP, 1))
    with pytest.raises(InvalidArgument, match="emitter is a Sphere"):
        polygon_shadow(Sphere([0, 0, 3], 1), SCREEN, FLOOR)


ROUND = {
    "sphere": Sphere([0.3, 0.1, 1], 0.4),
    "disk": Disk([0.3, 0.1, 1], rotation(1)[0], 0.4),
    "sphere above the light": Sphere([0.9, 0.1, 1.8], 0.4),
    "disk above the light": Disk([0.9, 0.1, 1.8], rotation(1)[0], 0.4),
}


@pytest.mark.parametrize("emitter", [LAMP, SUN], ids=["point", "directional"])
@pytest.mark.parametrize("occluder", ROUND.values(), ids=ROUND.keys())
def test_rays_are_blocked_inside_of_the_conic(emitter, occluder):
    shadow = conic_shadow(emitter, occluder, FLOOR)
    points = on_the_floor(4000).points
    local = np.column_stack([(points - shadow.origin) @ shadow.u, (points - shadow.origin) @ shadow.v, np.ones(4000)])
    form = np.einsum("ni,ij,nj->n", local, shadow.matrix, local)
    blocked = ~visible(emitter, points, [occluder])
    assert blocked.any()
    assert (form[blocked] < 0).all()
    # The second branch of a hyperbola is not a shadow.
    if occluder.center[2] < 1.5 or emitter is SUN:
        np.testing.assert_array_equal(blocked, form < 0)


@pytest.mark.parametrize("emitter", [LAMP, SUN], ids=["point", "directional"])
@pytest.mark.parametrize("occluder", ROUND.values(), ids=ROUND.keys())
def test_arcs_follow_the_conic_where_visibility_changes(emitter, occluder):
    shadow = conic_shadow(emitter, occluder, FLOOR)
    arcs = shadow.arcs(1e-4)
    assert arcs
    for arc in arcs:
        local = np.column_stack([(arc - shadow.origin) @ shadow.u, (arc - shadow.origin) @ shadow.v, np.ones(len(arc))])
        form = np.einsum("ni,ij,nj->n", local, shadow.matrix, local)
        scale = np.einsum("ni,ij,nj->n", np.abs(local), np.abs(shadow.matrix), np.abs(local))
        assert (np.abs(form) < 1e-13 * scale).all()
        # On both sides of the middle of each segment, further than the tolerance away.
        along = np.diff(arc, axis=0)
        across = np.cross(UP, along / np.linalg.norm(along, axis=1, keepdims=True))
        middle = (arc[1:] + arc[:-1]) / 2
        one, other = (visible(emitter, middle + side * 1.001e-4 * across, [occluder]) for side in (1, -1))
        assert (one != other).all()


def test_an_outline_that_lies_on_the_receiver_is_one_closed_arc():
    (arc,) = conic_shadow(LAMP, ROUND["sphere"], FLOOR).arcs(1e-3)
    np.testing.assert_allclose(arc[0], arc[-1], atol=1e-14)


def test_the_shadow_of_a_sphere_in_parallel_light_is_an_ellipse_of_known_area():
    (arc,) = conic_shadow(SUN, ROUND["sphere"], FLOOR).arcs(1e-6)
    area = np.cross(arc[:-1], arc[1:])[:, 2].sum() / 2
    # The inscribed polygon lacks two thirds of the tolerance times the perimeter, which is below 4 m.
    assert abs(area) == pytest.approx(np.pi * 0.4**2 / -SUN.direction[2], abs=4e-6)


@pytest.mark.parametrize(
    ("emitter", "occluder", "message"),
    [
        (Point([0.3, 0.1, 1.1], [1.0]), ROUND["sphere"], "emitter is inside the sphere"),
        (Point([0, 0, -1], [1.0]), ROUND["sphere"], "emitter is behind the receiver"),
        (Directional(UP, [1.0]), ROUND["disk"], "emitter is behind the receiver"),
        (LAMP, Sphere([0, 0, 0.3], 0.4), "occluder reaches to the receiver's plane"),
        (LAMP, SCREEN, "occluder is a Polygon; a Disk or a Sphere is supported"),
        (LIGHT, ROUND["disk"], "emitter is a Rectangle; a Point"),
        (Point([0, 0, 1], [1.0]), Disk([2, 0, 1], UP, 1), "emitter is in the disk's plane"),
    ],
)
def test_what_casts_no_conic_is_refused(emitter, occluder, message):
    with pytest.raises(InvalidArgument, match=message):
        conic_shadow(emitter, occluder, FLOOR)
