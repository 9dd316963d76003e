"""Rays against shapes in float64: judged by linear algebra, by 40 digits, and by Embree on the same or finer meshes."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from quadrature import orthonormal, unit

from oracle import intersection

quick = settings(derandomize=True, deadline=None, max_examples=60)

CENTER = np.array([0.3, -0.2, 0.5])
U, V = 1.5 * unit([1, 2, -1]), 0.7 * unit([1, 0, 1])
NORMAL = unit(np.cross(U, V))
RADIUS = 1.1
# Embree computes in single precision; its errors grow towards edges and grazing rays, which are left out.
SINGLE = 2e-5


def rays(seed, count=4000):
    """Rays from around the shapes towards them and past them; in float32, so that Embree sees the same."""
    rng = np.random.default_rng(seed)
    origins = CENTER + rng.normal(size=(count, 3)) * 3
    aims = CENTER + rng.uniform(-2, 2, (count, 3))
    directions = (aims - origins) * rng.uniform(0.1, 3, (count, 1))
    return origins.astype(np.float32).astype(float), directions.astype(np.float32).astype(float)


def shape(name):
    """Intersection with one of the shapes, as a function of origins, directions and t_min."""
    return {
        "rectangle": lambda o, d, *t_min: intersection.rectangle(o, d, CENTER, U, V, *t_min),
        "disk": lambda o, d, *t_min: intersection.disk(o, d, CENTER, NORMAL, RADIUS, *t_min),
        "sphere": lambda o, d, *t_min: intersection.sphere(o, d, CENTER, RADIUS, *t_min),
        "mesh": lambda o, d, *t_min: intersection.mesh(o, d, *icosahedron(), *t_min)[0],
    }[name]


SHAPES = ["rectangle", "disk", "sphere", "mesh"]


def icosahedron():
    golden = (1 + 5**0.5) / 2
    vertices = np.array([np.roll([0, s, g * golden], k) for s in (1, -1) for g in (1, -1) for k in range(3)])
    # Faces are the triples of vertices at the edge length 2 from one another.
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices[None], axis=-1), 2)
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    assert len(faces) == 20
    return CENTER + 0.6 * vertices, np.array(faces)


def positions(origins, directions, t):
    hit = np.isfinite(t)
    return origins[hit] + t[hit, None] * directions[hit]


def assert_same_hits(t, expected, sure, tolerance):
    """Where it is sure, the same rays hit, at the same ray parameter."""
    assert sure.mean() > 0.9
    np.testing.assert_array_equal(np.isfinite(t[sure]), np.isfinite(expected[sure]))
    both = sure & np.isfinite(t)
    assert both.mean() > 0.1
    np.testing.assert_allclose(t[both], expected[both], rtol=tolerance)


# --------------------------------------------------------------------------------------------- brute force


@pytest.mark.parametrize("name", ["rectangle", "disk"])
def test_flat_shapes_agree_with_linear_equations(name):
    origins, directions = rays(1)
    u, v = (U, V) if name == "rectangle" else orthonormal(NORMAL)
    # center + a u + b v = origin + t direction, solved for a, b, t.
    matrices = np.stack([np.broadcast_to(u, origins.shape), np.broadcast_to(v, origins.shape), -directions], axis=-1)
    a, b, t = np.linalg.solve(matrices, (origins - CENTER)[..., None])[..., 0].T
    inside = np.maximum(abs(a), abs(b)) <= 1 if name == "rectangle" else a**2 + b**2 <= RADIUS**2
    expected = np.where(inside & (t > 0), t, np.inf)
    # Rounding of a badly conditioned system.
    assert_same_hits(shape(name)(origins, directions), expected, np.ones(len(t), bool), 1e-9)


@pytest.mark.parametrize("distance", [0.0, 2.0, 1e3, 1e6])
def test_sphere_agrees_with_the_quadratic_equation_in_40_digits(distance):
    rng = np.random.default_rng(2)
    count = 200
    origins = CENTER + distance * np.array([unit(v) for v in rng.normal(size=(count, 3))])
    directions = CENTER + RADIUS * rng.uniform(-0.6, 0.6, (count, 3)) - origins
    directions[np.abs(directions).max(axis=1) < 1e-3] = [1, 0, 0]
    found = shape("sphere")(origins, directions)
    for o, d, t in zip(origins, directions, found, strict=True):
        with mpmath.workdps(40):
            offset = [mpmath.mpf(float(a)) - mpmath.mpf(float(b)) for a, b in zip(o, CENTER, strict=True)]
            way = [mpmath.mpf(float(a)) for a in d]
            a, b = sum(x * x for x in way), sum(x * y for x, y in zip(offset, way, strict=True))
            root = b * b - a * (sum(x * x for x in offset) - mpmath.mpf(RADIUS) ** 2)
            both = [(-b + sign * mpmath.sqrt(root)) / a for sign in (-1, 1)] if root >= 0 else []
            expected = min([t for t in both if t > 0], default=mpmath.inf)
        # A few roundings of the position, which is as large as the distance.
        assert abs(t - float(expected)) * np.linalg.norm(d) <= 1e-15 * (distance + 10 * RADIUS)


def test_mesh_agrees_with_linear_equations():
    origins, directions = rays(3, 1000)
    vertices, faces = icosahedron()
    t, face = intersection.mesh(origins, directions, vertices, faces)
    a, b, c = vertices[faces].swapaxes(0, 1)
    columns = [np.broadcast_to(side, (1000, 20, 3)) for side in (b - a, c - a)]
    matrices = np.stack([*columns, np.broadcast_to(-directions[:, None], (1000, 20, 3))], axis=-1)
    u, v, all_t = np.moveaxis(np.linalg.solve(matrices, (origins[:, None] - a)[..., None])[..., 0], -1, 0)
    all_t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (all_t > 0), all_t, np.inf)
    assert_same_hits(t, all_t.min(axis=1), np.ones(1000, bool), 1e-9)
    np.testing.assert_array_equal(face, np.where(np.isfinite(t), all_t.argmin(axis=1), -1))


# -------------------------------------------------------------------------------------------------- Embree


def cast(vertices, triangles, origins, directions):
    from oracle.tracer import RayCaster

    return RayCaster(vertices, triangles).closest_hit(origins, directions)


def test_rectangle_agrees_with_embree_on_two_triangles():
    origins, directions = rays(4)
    corners = [CENTER - U - V, CENTER + U - V, CENTER + U + V, CENTER - U + V]
    expected, _, _ = cast(corners, [[0, 1, 2], [0, 2, 3]], origins, directions)
    wide, narrow = (
        intersection.rectangle(origins, directions, CENTER, scale * U, scale * V) for scale in (1.001, 0.999)
    )
    sure = np.isfinite(wide) == np.isfinite(narrow)
    grazing = np.abs(directions @ NORMAL) < 0.02 * np.linalg.norm(directions, axis=1)
    assert_same_hits(shape("rectangle")(origins, directions), expected, sure & ~grazing, 50 * SINGLE)


def test_disk_agrees_with_embree_on_512_triangles():
    origins, directions = rays(5)
    u, v = orthonormal(NORMAL)
    angles = np.linspace(0, 2 * np.pi, 512, endpoint=False)
    rim = CENTER + RADIUS * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    fan = [(512, i, (i + 1) % 512) for i in range(512)]
    expected, _, _ = cast([*rim, CENTER], fan, origins, directions)
    wide, narrow = (intersection.disk(origins, directions, CENTER, NORMAL, s * RADIUS) for s in (1.001, 0.999))
    sure = np.isfinite(wide) == np.isfinite(narrow)
    grazing = np.abs(directions @ NORMAL) < 0.02 * np.linalg.norm(directions, axis=1)
    assert_same_hits(shape("disk")(origins, directions), expected, sure & ~grazing, 50 * SINGLE)


def globe(rows=256, columns=512):
    """A sphere of triangles, whose corners lie on it."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    corner = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return points.reshape(-1, 3), np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])


def test_sphere_agrees_with_embree_on_a_fine_globe():
    origins, directions = rays(6)
    points, triangles = globe()
    expected, _, _ = cast(CENTER + RADIUS * points, triangles, origins, directions)
    t = shape("sphere")(origins, directions)
    # The triangles lie up to 1e-4 radii inside, which makes a difference for rays that all but touch, and for origins
    # between the two.
    nearest = np.linalg.norm(np.cross(origins - CENTER, directions), axis=1) / np.linalg.norm(directions, axis=1)
    sure = (np.abs(nearest / RADIUS - 1) > 0.01) & (
        np.abs(np.linalg.norm(origins - CENTER, axis=1) / RADIUS - 1) > 0.01
    )
    assert sure.mean() > 0.95
    np.testing.assert_array_equal(np.isfinite(t[sure]), np.isfinite(expected[sure]))
    both = sure & np.isfinite(t)
    apart = np.abs(t[both] - expected[both]) * np.linalg.norm(directions[both], axis=1)
    # 1e-4 radii, divided by the cosine of incidence, which is at least 0.14.
    assert apart.max() < 1e-4 * RADIUS / 0.14


@pytest.mark.parametrize("triangle_count", [1, 7, 60])
def test_mesh_agrees_with_embree(triangle_count):
    rng = np.random.default_rng(triangle_count)
    vertices = rng.random((3 * triangle_count, 3), np.float32).astype(float)
    triangles = rng.permutation(3 * triangle_count).reshape(-1, 3)
    origins = rng.random((4000, 3), np.float32).astype(float)
    directions = rng.standard_normal((4000, 3), np.float32).astype(float)
    t, face = intersection.mesh(origins, directions, vertices, triangles)
    expected_t, expected_face, _ = cast(vertices, triangles, origins, directions)
    # Single precision may decide otherwise for about one ray in a thousand, near an edge or on one of two triangles.
    same = face == expected_face
    assert same.mean() > 0.998
    hit = same & (face >= 0)
    # Half of the digits are left for the worst of the grazing rays.
    np.testing.assert_allclose(t[hit], expected_t[hit], rtol=1e-3, atol=1e-4)


# ------------------------------------------------------------------------------------------------------ laws


@pytest.mark.parametrize("name", SHAPES)
def test_a_hit_lies_on_the_shape(name):
    origins, directions = rays(7)
    points = positions(origins, directions, shape(name)(origins, directions)) - CENTER
    assert len(points) > 100
    # A few roundings of positions of size 10.
    match name:
        case "rectangle":
            assert np.all(np.abs(points @ NORMAL) < 1e-13)
            assert np.all(np.abs(points @ U) <= U @ U + 1e-13)
            assert np.all(np.abs(points @ V) <= V @ V + 1e-13)
        case "disk":
            assert np.all(np.abs(points @ NORMAL) < 1e-13)
            assert np.all(np.linalg.norm(points, axis=1) <= RADIUS + 1e-13)
        case "sphere":
            np.testing.assert_allclose(np.linalg.norm(points, axis=1), RADIUS, rtol=1e-12)
        case "mesh":
            vertices, faces = icosahedron()
            a, b, c = vertices[faces].swapaxes(0, 1) - CENTER
            outwards = np.cross(b - a, c - a)
            outwards *= np.sign((outwards * a).sum(axis=1, keepdims=True))
            heights = (points @ outwards.T - (outwards * a).sum(axis=1)) / np.linalg.norm(outwards, axis=1)
            assert np.all(np.abs(heights.max(axis=1)) < 1e-13)


@pytest.mark.parametrize("name", SHAPES)
@quick
@given(exponent=st.integers(-30, 30))
def test_distance_is_measured_in_lengths_of_the_direction(name, exponent):
    origins, directions = rays(8, 300)
    t = shape(name)(origins, directions)
    # A power of two changes no digit, so neither may the answer.
    np.testing.assert_array_equal(shape(name)(origins, np.ldexp(directions, exponent)), np.ldexp(t, -exponent))


@pytest.mark.parametrize("name", SHAPES)
def test_hits_up_to_t_min_do_not_count(name):
    origins, directions = rays(9)
    t = shape(name)(origins, directions)
    hit = np.isfinite(t)
    origins, directions, t = origins[hit], directions[hit], t[hit]
    margin = 1e-9
    for t_min in np.quantile(t, [0.1, 0.5, 0.9]):
        again = shape(name)(origins, directions, t_min)
        later = t > t_min + margin
        np.testing.assert_array_equal(again[later], t[later])
        earlier = t < t_min - margin
        assert np.all(again[earlier] > t_min)
    if name in ("rectangle", "disk"):
        assert np.all(shape(name)(origins, directions, t.max() + margin) == np.inf)


@pytest.mark.parametrize("name", ["sphere", "mesh"])
def test_behind_the_first_hit_of_a_closed_shape_is_a_second(name):
    origins, directions = rays(10)
    outside = np.linalg.norm(origins - CENTER, axis=1) > 1.3
    origins, directions = origins[outside], directions[outside]
    first = shape(name)(origins, directions)
    hit = np.isfinite(first)
    entry = origins[hit] + first[hit, None] * directions[hit]
    second = shape(name)(entry, directions[hit], 1e-9)
    through = positions(entry, directions[hit], second / 2)
    # Half-way between the two one is inside; a ray that only touches may miss the second.
    assert np.isfinite(second).mean() > 0.99
    assert np.all(np.linalg.norm(through - CENTER, axis=1) <= 1.15)


@pytest.mark.parametrize("name", SHAPES)
def test_from_behind_and_from_before_the_same_point_is_hit(name):
    origins, directions = rays(11)
    t = shape(name)(origins, directions)
    hit = np.isfinite(t)
    points = origins[hit] + t[hit, None] * directions[hit]
    # From just before the first hit, looking back from behind it: only what lies there is between the two.
    behind = points + 1e-3 * directions[hit]
    back = shape(name)(behind, -directions[hit])
    found = np.isfinite(back) & (back < 1.5e-3)
    assert found.mean() > 0.97  # a thin corner may let another hit come first
    np.testing.assert_allclose(back[found].min(), 1e-3, rtol=0.6)


def test_a_ray_in_the_plane_of_a_flat_shape_misses_it():
    origins = np.array([CENTER - 5 * U, CENTER - 5 * V, CENTER])
    directions = np.array([U, V, U + V])
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    in_plane = np.array([[-1.0, 0.25, 0], [0.25, 0.25, 0]])
    ahead = np.array([[1.0, 0, 0], [0, 1, 0]])
    zero = np.zeros(3)
    for t in (
        intersection.rectangle(in_plane, ahead, zero, flat[1], flat[2]),
        intersection.disk(in_plane, ahead, zero, np.array([0.0, 0, 1]), 1.0),
        intersection.mesh(in_plane, ahead, flat, np.array([[0, 1, 2]]))[0],
    ):
        assert np.all(t == np.inf)
    # Not exactly in the plane of a turned one, but nothing that is no number either.
    assert not np.isnan(shape("rectangle")(origins, directions)).any()


@pytest.mark.parametrize("name", SHAPES)
def test_what_lies_behind_the_origin_is_not_hit(name):
    away = np.array([unit(v) for v in np.random.default_rng(12).normal(size=(50, 3))])
    assert np.all(shape(name)(CENTER + 5 * away, away) == np.inf)


@pytest.mark.parametrize("name", SHAPES)
def test_no_rays_hit_nothing(name):
    assert shape(name)(np.empty((0, 3)), np.empty((0, 3))).shape == (0,)


def test_from_inside_a_sphere_its_far_side_is_hit():
    t = intersection.sphere(np.array([[0.5, 0, 0]]), np.array([[1.0, 0, 0], [-1.0, 0, 0]])[:1], np.zeros(3), 1.0)
    assert t == [0.5]


def test_no_ray_slips_between_the_triangles_of_a_mesh():
    vertices, faces = icosahedron()
    corners = vertices[faces]
    rng = np.random.default_rng(13)
    along = rng.random((20, 3, 500, 1))
    on_edges = (along * corners[:, :, None] + (1 - along) * np.roll(corners, 1, axis=1)[:, :, None]).reshape(-1, 3)
    targets = np.concatenate([on_edges, vertices])
    for origins in (np.broadcast_to(CENTER, targets.shape), CENTER + rng.uniform(-0.4, 0.4, targets.shape)):
        t, face = intersection.mesh(origins, targets - origins, vertices, faces)
        assert np.isfinite(t).all()
        assert (face >= 0).all()


@quick
@given(
    vertices=arrays(np.float64, (6, 3), elements=st.integers(-8, 8).map(float)),
    origins=arrays(np.float64, (4, 3), elements=st.integers(-8, 8).map(float)),
    directions=arrays(np.float64, (4, 3), elements=st.integers(-8, 8).map(float)).filter(lambda d: d.any(axis=1).all()),
)
def test_degenerate_rays_and_triangles_give_numbers(vertices, origins, directions):
    # On a grid, shared points, rays in the plane of a triangle and triangles without area are common.
    triangles = np.array([[0, 1, 2], [3, 4, 5], [0, 2, 4]])
    t, face = intersection.mesh(origins, directions, vertices, triangles)
    hit = face >= 0
    np.testing.assert_array_equal(hit, np.isfinite(t))
    assert np.all(t > 0)
    a, b, c = vertices[triangles[face[hit]]].swapaxes(0, 1)
    points = origins[hit] + t[hit, None] * directions[hit]
    normals = np.cross(b - a, c - a)
    assert np.all(np.abs(((points - a) * normals).sum(axis=1)) <= 1e-12 * np.linalg.norm(normals, axis=1) * 100)
