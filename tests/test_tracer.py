"""Rays against triangles, judged by a float64 Moeller-Trumbore test of every ray with every triangle."""

import doctest
import os
import shutil
import subprocess
import sys
import sysconfig
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import oracle.tracer
from oracle.tracer import RayCaster, embree_version

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
ONE = np.array([[0, 1, 2]], np.uint32)

# Embree works in float32 and errs by some units in the last place (6e-8) of the scene's size, more for slivers;
# the random scenes below are of size 1 and leave out rays within EDGE of an edge, seen in barycentric coordinates.
TOLERANCE = 2e-5
EDGE = 1e-4


def moeller_trumbore(vertices, triangles, origins, directions):
    """t, u, v of every ray with the plane of every triangle, shape (R, M); NaN or infinite where parallel."""
    a, b, c = np.asarray(vertices, float)[np.asarray(triangles, int)].swapaxes(0, 1)
    o, d = np.asarray(origins, float)[:, None], np.asarray(directions, float)[:, None]
    ab, ac = b - a, c - a
    p = np.cross(d, ac)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = 1 / (p * ab).sum(-1)
        u = ((o - a) * p).sum(-1) * inverse
        q = np.cross(o - a, ab)
        v = (q * d).sum(-1) * inverse
        t = (q * ac).sum(-1) * inverse
    return t, u, v


def soup(seed, triangle_count, ray_count):
    """Random triangles in the unit cube and rays from within it, in float32 so that both sides see the same."""
    rng = np.random.default_rng(seed)
    vertices = rng.random((3 * triangle_count, 3), np.float32)
    triangles = rng.permutation(3 * triangle_count).reshape(-1, 3).astype(np.uint32)
    origins = rng.random((ray_count, 3), np.float32)
    directions = rng.standard_normal((ray_count, 3), np.float32)
    return vertices, triangles, origins, directions


def icosahedron():
    golden = (1 + 5**0.5) / 2
    vertices = [(0, s, g * golden) for s in (1, -1) for g in (1, -1)]
    vertices = np.array([np.roll(v, k) for k in range(3) for v in vertices], np.float32)
    # Faces are the triples of vertices at the edge length 2 from one another.
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices[None], axis=-1), 2, atol=1e-3)
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    assert len(faces) == 20
    return vertices, np.array(faces, np.uint32)


@pytest.mark.parametrize("triangle_count", [1, 7, 300])
def test_closest_hit_agrees_with_brute_force(triangle_count):
    vertices, triangles, origins, directions = soup(triangle_count, triangle_count, 4000)
    t, triangle, uv = RayCaster(vertices, triangles).closest_hit(origins, directions)

    all_t, all_u, all_v = moeller_trumbore(vertices, triangles, origins, directions)
    from_edge = np.minimum(np.minimum(all_u, all_v), 1 - all_u - all_v)
    is_hit = (from_edge > 0) & (all_t > 0)
    expected = np.where(is_hit, all_t, np.inf)
    # Ambiguous in float32: an edge is grazed, the origin lies on a triangle, or two triangles are equally far.
    unsure = ((np.abs(from_edge) < EDGE) | (np.abs(all_t) < EDGE)).any(axis=1)
    two_nearest = np.sort(np.concatenate([expected, np.full((len(t), 2), np.inf)], axis=1), axis=1)[:, :2]
    with np.errstate(invalid="ignore"):
        unsure |= np.diff(two_nearest, axis=1)[:, 0] < EDGE
    sure = ~unsure
    assert sure.mean() > 0.5

    nearest = np.where(is_hit.any(axis=1), expected.argmin(axis=1), -1)
    np.testing.assert_array_equal(triangle[sure], nearest[sure])
    hit = sure & (nearest >= 0)
    rows, columns = np.flatnonzero(hit), nearest[hit]
    length = np.linalg.norm(directions[hit], axis=1)
    # Seen edge-on, a small error of the plane is a large one along the ray.
    grazing = 1 / np.abs(cosine_with_normal(vertices, triangles[columns], directions[hit]))
    assert np.all(np.abs(t[hit] - all_t[rows, columns]) * length < TOLERANCE * grazing)
    assert np.all(t[triangle < 0] == np.inf)
    assert np.all(np.isnan(uv[triangle < 0]))


def cosine_with_normal(vertices, triangles, directions):
    a, b, c = vertices.astype(float)[triangles].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    return (normal * directions).sum(-1) / np.linalg.norm(normal, axis=-1) / np.linalg.norm(directions, axis=-1)


# On a grid degenerate cases are common: shared points, rays in the plane of a triangle, triangles without area.
# Finer than that, a triangle 1e-25 wide underflows within Embree, which then reports hits beside it.
coordinates = st.integers(-1024, 1024).map(lambda i: i / 1024)


@settings(deadline=None)  # the machine may be busy
@given(
    vertices=arrays(np.float32, (6, 3), elements=coordinates),
    origins=arrays(np.float32, (4, 3), elements=coordinates),
    directions=arrays(np.float32, (4, 3), elements=coordinates.filter(bool)),
)
def test_a_hit_lies_on_its_triangle_and_on_its_ray(vertices, origins, directions):
    triangles = np.array([[0, 1, 2], [3, 4, 5], [0, 2, 4]], np.uint32)
    t, triangle, uv = RayCaster(vertices, triangles).closest_hit(origins, directions)
    hit = triangle >= 0
    assert np.all(t[hit] >= 0)
    u, v = uv[hit].T.astype(float)
    assert np.all((u >= -TOLERANCE) & (v >= -TOLERANCE) & (u + v <= 1 + TOLERANCE))
    a, b, c = vertices.astype(float)[triangles[triangle[hit]]].swapaxes(0, 1)
    on_triangle = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    d = directions[hit].astype(float)
    # Distance of the point from the ray's line; along the line the error grows with grazing incidence.
    away = np.cross(on_triangle - origins[hit], d / np.linalg.norm(d, axis=1, keepdims=True))
    cosine = np.abs(cosine_with_normal(vertices, triangles[triangle[hit]], d))
    assert np.all(np.linalg.norm(away, axis=1) * cosine < TOLERANCE)


def test_occlusion_agrees_with_the_closest_hit():
    vertices, triangles, origins, directions = soup(5, 20, 20_000)
    caster = RayCaster(vertices, triangles)
    t, triangle, _ = caster.closest_hit(origins, directions)
    hit = triangle >= 0
    assert 0.1 < hit.mean() < 0.9
    np.testing.assert_array_equal(caster.occluded(origins, directions, np.inf), hit)
    margin = 1e-4  # above the rounding of t to float32
    assert not caster.occluded(origins, directions, np.where(hit, t, 1) * (1 - margin)).any()
    np.testing.assert_array_equal(caster.occluded(origins, directions, np.where(hit, t, 1) * (1 + margin)), hit)


@pytest.mark.parametrize("exponent", [-120, -60, -1, 1, 40])
def test_distance_is_measured_in_lengths_of_the_direction(exponent):
    vertices, triangles, origins, directions = soup(6, 20, 500)
    caster = RayCaster(vertices, triangles)
    t, triangle, uv = caster.closest_hit(origins, directions)
    scaled = np.ldexp(directions, exponent)
    t_scaled, triangle_scaled, uv_scaled = caster.closest_hit(origins, scaled)
    # A power of two changes no digit, so neither may the answer.
    np.testing.assert_array_equal(t_scaled, np.ldexp(t, -exponent))
    np.testing.assert_array_equal(triangle_scaled, triangle)
    np.testing.assert_array_equal(uv_scaled, uv)
    t_far = np.where(triangle >= 0, t_scaled * 1.001, np.inf)
    np.testing.assert_array_equal(caster.occluded(origins, scaled, t_far), triangle >= 0)


def test_no_ray_slips_between_triangles():
    vertices, faces = icosahedron()
    caster = RayCaster(vertices, faces)
    corners = vertices[faces].astype(float)
    rng = np.random.default_rng(0)
    along = rng.random((20, 3, 2000, 1))
    edges = along * corners[:, :, None] + (1 - along) * np.roll(corners, 1, axis=1)[:, :, None]
    directions = np.concatenate([edges.reshape(-1, 3), vertices])
    _, triangle, _ = caster.closest_hit(np.zeros_like(directions), directions)
    assert (triangle >= 0).all()


def test_ties_are_settled_the_same_way_every_time():
    vertices, faces = icosahedron()
    answers = [RayCaster(vertices, faces).closest_hit(np.zeros_like(vertices), vertices)[1] for _ in range(3)]
    np.testing.assert_array_equal(answers[0], answers[1])
    np.testing.assert_array_equal(answers[0], answers[2])


def test_both_sides_are_hit():
    t, triangle, uv = RayCaster(TRIANGLE, ONE).closest_hit([[0.25, 0.5, 2], [0.25, 0.5, -3]], [[0, 0, -1], [0, 0, 1]])
    # Embree divides by an approximate reciprocal, which differs by some ulp from processor to processor.
    np.testing.assert_allclose(t, [2, 3], rtol=5e-7)
    np.testing.assert_array_equal(triangle, [0, 0])
    np.testing.assert_allclose(uv, [[0.25, 0.5], [0.25, 0.5]], rtol=5e-7)


def test_the_surface_that_a_ray_starts_on_is_hit_at_once():
    caster = RayCaster(TRIANGLE, ONE)
    t, triangle, _ = caster.closest_hit([[0.25, 0.25, 0]], [[0, 0, 1]])
    assert (t[0], triangle[0]) == (0, 0)
    assert caster.occluded([[0.25, 0.25, 0]], [[0, 0, 1]], 0)[0]


def test_what_lies_behind_the_origin_is_not_hit():
    assert RayCaster(TRIANGLE, ONE).closest_hit([[0.25, 0.25, 1]], [[0, 0, 1]])[1] == [-1]


def test_no_triangles_hit_nothing():
    caster = RayCaster(np.empty((0, 3), np.float32), np.empty((0, 3), np.uint32))
    t, triangle, uv = caster.closest_hit([[0, 0, 0]], [[0, 0, 1]])
    assert (t[0], triangle[0]) == (np.inf, -1)
    assert np.isnan(uv).all()
    assert not caster.occluded([[0, 0, 0]], [[0, 0, 1]], np.inf).any()


def test_no_rays_give_empty_arrays_of_the_right_shape():
    t, triangle, uv = RayCaster(TRIANGLE, ONE).closest_hit(np.empty((0, 3)), np.empty((0, 3)))
    assert (t.shape, triangle.shape, uv.shape) == ((0,), (0,), (0, 2))
    assert (t.dtype, triangle.dtype, uv.dtype) == (np.float64, np.int64, np.float32)
    assert RayCaster(TRIANGLE, ONE).occluded(np.empty((0, 3)), np.empty((0, 3)), 1).shape == (0,)


def test_a_triangle_without_area_is_never_hit():
    caster = RayCaster([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2], [1, 1, 1]])
    assert caster.closest_hit([[0.5, 0, 1], [1, 0, 1]], [[0, 0, -1], [0, 0, -1]])[1].tolist() == [-1, -1]


def test_any_layout_and_real_dtype_is_taken_and_left_alone():
    vertices, triangles, origins, directions = soup(8, 30, 200)
    expected = RayCaster(vertices, triangles).closest_hit(origins, directions)
    for change in (np.asfortranarray, lambda x: np.repeat(x, 2, axis=0)[::2], lambda x: x.tolist()):
        inputs = [change(x) for x in (vertices, triangles, origins, directions)]
        answer = RayCaster(*inputs[:2]).closest_hit(*inputs[2:])
        for a, b in zip(answer, expected, strict=True):
            np.testing.assert_array_equal(a, b)
    frozen = [x.astype(kind) for x, kind in ((vertices, float), (triangles, np.int16), (origins, float))]
    for array in frozen:
        array.flags.writeable = False
    np.testing.assert_array_equal(RayCaster(*frozen[:2]).closest_hit(frozen[2], directions)[0], expected[0])


def test_the_caster_keeps_its_own_copy_of_the_triangles():
    vertices, triangles = TRIANGLE.copy(), ONE.copy()
    caster = RayCaster(vertices, triangles)
    vertices[:] = 0
    triangles[:] = 0
    assert caster.closest_hit([[0.25, 0.25, 1]], [[0, 0, -1]])[1] == [0]


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((4, 2)), ONE, r"vertices has shape \(4, 2\); expected \(N, 3\)"),
        (np.zeros(3), ONE, r"vertices has shape \(3,\); expected \(N, 3\)"),
        (TRIANGLE, np.zeros((1, 4), int), r"triangles has shape \(1, 4\); expected \(M, 3\)"),
        (TRIANGLE, [], r"triangles must be an array of integers, not of float64"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], r"triangles must be an array of integers, not of float64"),
        (TRIANGLE.astype(complex), ONE, r"vertices must be an array of real numbers, not of complex128"),
        ([["a", "b", "c"]], ONE, r"vertices must be an array of real numbers, not of <U1"),
        ([[0, 0, 0], [1, 0]], ONE, r"vertices must be an array of real numbers"),
        (None, ONE, r"vertices must be an array of real numbers, not of object"),
        ([[0, 0, 0], [0, NAN, 0], [0, 0, 1]], ONE, r"vertex 1: \(0, nan, 0\) is not finite"),
        ([[0, 0, 0], [1, 0, 0], [0, 0, -INF]], ONE, r"vertex 2: \(0, 0, -inf\) is not finite"),
        ([[1e300, 0, 0]] * 3, ONE, r"vertex 0: \(1e\+300, 0, 0\) lies beyond 1e\+18"),
        (TRIANGLE, [[0, 1, 2], [0, 1, 3]], r"triangle 1: vertex index 3 is out of range; there are 3 vertices"),
        (TRIANGLE, [[0, -1, 2]], r"triangle 0: vertex index -1 is out of range"),
        (TRIANGLE, np.array([[0, 1, 2**63]], np.uint64), r"triangle 0: vertex index -?\d+ is out of range"),
        (np.empty((0, 3)), ONE, r"triangle 0: vertex index 0 is out of range; there are 0 vertices"),
    ],
)
def test_a_wrong_mesh_is_named(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        RayCaster(vertices, triangles)


@pytest.mark.parametrize(
    ("origins", "directions", "message"),
    [
        ([[0, 0]], [[0, 0, 1]], r"origins has shape \(1, 2\); expected \(R, 3\)"),
        ([[0, 0, 0]], [0, 0, 1], r"directions has shape \(3,\); expected \(R, 3\)"),
        (np.zeros((2, 3)), np.ones((3, 3)), r"origins has 2 rows, directions 3"),
        ([[0, 0, 0], [0, INF, 0]], np.ones((2, 3)), r"origin of ray 1: \(0, inf, 0\) is not finite"),
        ([[0, 2e18, 0]], [[0, 0, 1]], r"origin of ray 0: \(0, 2e\+18, 0\) lies beyond 1e\+18"),
        (np.zeros((2, 3)), [[0, 0, 1], [NAN, 0, 1]], r"direction of ray 1: \(nan, 0, 1\) is not finite"),
        (np.zeros((2, 3)), [[0, 0, 1], [0, 0, 0]], r"direction of ray 1: \(0, 0, 0\) is zero"),
        (np.zeros((1, 3)), [[1e-60, 0, 0]], r"direction of ray 0: \(1e-60, 0, 0\) is zero in single precision"),
        (np.zeros((1, 3)), "up", r"directions must be an array of real numbers, not of <U2"),
    ],
)
def test_a_wrong_ray_is_named(origins, directions, message):
    caster = RayCaster(TRIANGLE, ONE)
    with pytest.raises(ValueError, match=message):
        caster.closest_hit(origins, directions)
    with pytest.raises(ValueError, match=message):
        caster.occluded(origins, directions, 1.0)


@pytest.mark.parametrize(
    ("t_far", "message"),
    [
        (-1.0, r"t_far: -1 is not a distance; it must be at least 0"),
        ([1.0, NAN], r"t_far of ray 1: nan is not a distance"),
        ([1.0, 1.0, 1.0], r"t_far has shape \(3,\); expected \(\) or \(2,\)"),
        ("far", r"t_far must be an array of real numbers"),
    ],
)
def test_a_wrong_length_is_named(t_far, message):
    with pytest.raises(ValueError, match=message):
        RayCaster(TRIANGLE, ONE).occluded(np.zeros((2, 3)), np.ones((2, 3)), t_far)


def test_huge_lengths_are_as_good_as_infinite():
    caster = RayCaster(TRIANGLE, ONE)
    assert caster.occluded([[0.25, 0.25, 1]] * 2, [[0, 0, -1], [0, 0, -1e17]], [1e300, 1e308]).all()


def test_threads_share_a_caster_and_agree():
    vertices, triangles, origins, directions = soup(9, 500, 20_000)
    caster = RayCaster(vertices, triangles)
    expected = caster.closest_hit(origins, directions)
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: caster.closest_hit(origins, directions), range(16)))
        shadows = list(pool.map(lambda _: caster.occluded(origins, directions, np.inf), range(16)))
    for answer in answers:
        for a, b in zip(answer, expected, strict=True):
            np.testing.assert_array_equal(a, b)
    for shadow in shadows:
        np.testing.assert_array_equal(shadow, expected[1] >= 0)


def test_threads_build_casters_at_once():
    meshes = [soup(seed, 400, 100) for seed in range(16)]

    def trace(mesh):
        return RayCaster(*mesh[:2]).closest_hit(*mesh[2:])[1]

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(trace, meshes))
    for mesh, answer in zip(meshes, answers, strict=True):
        np.testing.assert_array_equal(answer, trace(mesh))


def test_python_runs_on_while_rays_are_traced():
    vertices, triangles, origins, directions = soup(10, 5000, 80_000)
    caster = RayCaster(vertices, triangles)
    tracing = threading.Thread(target=caster.closest_hit, args=(origins, directions))
    tracing.start()
    ticks = 0
    while tracing.is_alive():
        time.sleep(0.001)
        ticks += 1
    # With the GIL held, this thread would wake once or twice, at the call's two ends.
    assert ticks > 20


def test_the_version_is_one_we_support():
    major, minor, patch = map(int, embree_version().split("."))
    assert major in (3, 4)
    assert minor >= 0
    assert patch >= 0


def test_the_docstring_example_runs():
    (example,) = (test for test in doctest.DocTestFinder().find(RayCaster, "RayCaster") if test.examples)
    assert doctest.DocTestRunner().run(example).failed == 0


def run_python(code, *path):
    """Run code in a fresh interpreter that sees only the given folders, not the installed project."""
    return subprocess.run(
        [sys.executable, "-S", "-P", "-c", code], capture_output=True, text=True, timeout=60,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))},
    )  # fmt: skip


def test_importing_oracle_leaves_the_tracer_alone():
    root = Path(oracle.tracer.__file__).parents[2]
    code = "import sys, oracle; sys.exit('oracle.tracer' in sys.modules)"
    result = run_python(code, root, sysconfig.get_path("purelib"))
    assert result.returncode == 0, result.stderr


def package_copy(folder):
    """The tracer's package without its extension, below `folder`."""
    package = folder / "oracle" / "tracer"
    package.mkdir(parents=True)
    (folder / "oracle" / "__init__.py").touch()
    shutil.copy(oracle.tracer.__file__, package)
    return package


def test_a_missing_embree_is_named_with_its_cure(tmp_path):
    built = Path(oracle.tracer._core.__file__)
    # The very extension, made to ask for a library that no system has.
    asks_for = f"libembree{embree_version()[0]}".encode()
    extension = built.read_bytes()
    assert asks_for in extension
    (package_copy(tmp_path) / built.name).write_bytes(extension.replace(asks_for, b"libembreeX"))
    result = run_python("import oracle.tracer", tmp_path, sysconfig.get_path("purelib"))
    last = result.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: oracle.tracer needs the Embree library (libembreeX")
    assert "apt-get install libembree-dev" in last


def test_an_extension_that_was_not_built_is_named_with_its_cure(tmp_path):
    package_copy(tmp_path)
    result = run_python("import oracle.tracer", tmp_path, sysconfig.get_path("purelib"))
    assert result.stderr.strip().endswith("oracle.tracer is not built here; run `make setup` in the checkout")
