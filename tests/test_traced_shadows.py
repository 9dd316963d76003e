"""Shadows in the reference tracer, judged by closed forms: penumbrae, hard edges, what bodies hide, what leaks."""

import numpy as np
import pytest
from renderings import CROWD, assert_right, irradiances, looking_down, scene_of, unit

from oracle import Area, Constant, Directional, Disk, Mesh, Point, Receivers, Rectangle, Sphere, irradiance, visible
from oracle.pixels import average
from oracle.tracer import Diffuse, Film, Instances, IrradianceMeter, Object, TwoSided, render

LIGHT = np.array([3.0, 1.0, 0.25])
FLOOR = Rectangle([0.2, 0.1, 0], [1.2, 0, 0], [0, 0.8, 0])
FILM = Film(6, 4)
LAMP = Area(Rectangle([0.3, 0.2, 1.5], [0, 0.5, 0], [0.4, 0, 0.1]), LIGHT)

TETRAHEDRON = Mesh(
    np.array([[0, 0, 0.3], [0.7, 0, 0.4], [0, 0.6, 0.35], [0.2, 0.2, 0.8]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)
SURFACES = pytest.mark.parametrize("crowd", [[], [CROWD]], ids=["few surfaces", "a hierarchy"])
STRATEGIES = pytest.mark.parametrize("strategy", ["light", "bsdf", "mis"])


# --------------------------------------------------------------------------------------------------- area lights


@SURFACES
@STRATEGIES
def test_penumbrae_of_flat_lamps_past_flat_bodies_are_right(strategy, crowd):
    bodies = [
        Rectangle([0.1, 0.2, 0.7], [0.2, 0, 0.1], [0, 0.15, 0]),
        # Its shadow overlaps that of the first: what both hide counts once.
        Mesh(np.array([[0.2, 0.1, 0.5], [0.8, 0.2, 0.6], [0.5, 0.6, 0.4]]), [[0, 1, 2]]),
    ]
    measured = render(
        scene_of([LAMP], *[Object(body) for body in bodies], *crowd),
        IrradianceMeter(FLOOR),
        FILM,
        spp=1 << 13,
        strategy=strategy,
        bounces=0,
    )
    # The irradiance has kinks where an edge begins to hide another.
    assert_right(measured, irradiances([LAMP], FLOOR, FILM, bodies, nodes=24), known_to=1e-2)


def moved(mesh, transform):
    """The mesh after an affine map."""
    return Mesh(mesh.vertices @ transform[:, :3].T + transform[:, 3], mesh.triangles)


TURNED = np.array([[0.0, -1.2, 0, 0.3], [0.8, 0, 0, 0.2], [0.1, 0, 1, 0.1]])
MIRRORED = np.array([[-0.7, 0, 0.1, -1.9], [0, 1.1, 0, -0.4], [0, 0, 1, 0.05]])


def turned_inside_out(mesh):
    """The same triangles with their fronts where their backs were."""
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1])


# What is seen of a body from outside: shapes whose fronts, together, cover each direction once.
BODIES = {
    "a sphere": (Object(Sphere([0.3, 0.2, 0.5], 0.4)), [Sphere([0.3, 0.2, 0.5], 0.4)]),
    "a disk": (
        Object(Disk([0.3, 0.2, 0.5], unit([0.1, 0.2, 1]), 0.6)),
        [Disk([0.3, 0.2, 0.5], -unit([0.1, 0.2, 1]), 0.6)],
    ),
    "a rectangle": (Object(LAMP.shape), [LAMP.shape]),
    "a mesh": (Object(TETRAHEDRON), [TETRAHEDRON]),
    "instances, one of them mirrored": (
        Instances(TETRAHEDRON, None, [TURNED, MIRRORED]),
        [
            moved(TETRAHEDRON, TURNED),
            turned_inside_out(moved(TETRAHEDRON, MIRRORED)),
        ],
    ),
}


@pytest.mark.parametrize("name", BODIES)
@SURFACES
@STRATEGIES
def test_a_black_body_hides_what_it_covers_of_the_surroundings(name, strategy, crowd):
    body, seen = BODIES[name]
    scene = scene_of([Constant(LIGHT)], body, Object(FLOOR, Diffuse([0.5] * 3)), *crowd)
    shown = render(scene, looking_down(FLOOR), FILM, spp=1 << 13, strategy=strategy, bounces=1)
    hidden = sum(irradiances([Area(shape, LIGHT)], FLOOR, FILM, nodes=12) for shape in seen)
    assert_right(shown, 0.5 / np.pi * (np.pi * LIGHT - hidden), known_to=2e-3)


# ---------------------------------------------------------------------------------------------------- hard edges


@pytest.mark.parametrize(
    "body",
    [
        Sphere([0.3, 0.2, 0.5], 0.2),
        Disk([0.3, 0.2, 0.5], unit([0.1, 0.3, 1]), 0.3),
        Mesh(TETRAHEDRON.vertices, TETRAHEDRON.triangles[:1]),
    ],
    ids=["a sphere", "a disk", "a triangle"],
)
@pytest.mark.parametrize(
    "emitter",
    [Point([0.1, 0.3, 1.4], LIGHT), Directional(unit([0.2, 0.1, -1]), LIGHT)],
    ids=["a point", "parallel light"],
)
def test_hard_shadows_are_where_they_belong(body, emitter):
    film = Film(3, 2)

    def image(x, y):
        a, b = 2 * x / film.width - 1, 1 - 2 * y / film.height
        points = FLOOR.center + np.outer(a, FLOOR.half_u) + np.outer(b, FLOOR.half_v)
        lit = visible(emitter, points, [body])
        return irradiance(emitter, Receivers(points, FLOOR.normal)).value * lit[:, None], lit.astype(int)

    expected, _ = average(image, film.width, film.height, relative_tolerance=1e-4)
    for crowd in ([], [CROWD]):
        scene = scene_of([emitter], Object(body), *crowd)
        measured = render(scene, IrradianceMeter(FLOOR), film, spp=1 << 14, bounces=0)
        assert_right(measured, expected, known_to=1e-3)


LIGHTS = {
    "a rectangle": LAMP,
    "a triangle": Area(Mesh([[0, 0, 1.5], [0, 1, 1.4], [1, 0, 1.6]], [[0, 1, 2]]), LIGHT),
    "a disk": Area(Disk([0.3, 0.2, 1.5], [0, 0, -1], 0.5), LIGHT),
    "a sphere": Area(Sphere([0.3, 0.2, 1.5], 0.5), LIGHT),
    "a point": Point([0.3, 0.2, 1.5], LIGHT),
}


def lids(emitter, gap):
    """What covers an emitter as seen from the floor, at this distance before it, or behind it if that is negative."""
    if isinstance(emitter, Point):
        return [Object(Rectangle(emitter.position - [0, 0, gap], [3, 0, 0], [0, 3, 0]))]
    if isinstance(emitter.shape, Sphere):
        return [Object(Sphere(emitter.shape.center, emitter.shape.radius + gap))]
    lamp = emitter.shape
    if isinstance(lamp, Mesh):
        a, b, c = lamp.vertices
        normal = unit(np.cross(b - a, c - a))
        return [Object(Mesh(lamp.vertices * 1.5 - lamp.vertices.mean(axis=0) * 0.5 + gap * normal, lamp.triangles))]
    if isinstance(lamp, Disk):
        return [Object(Disk(lamp.center + gap * lamp.normal, lamp.normal, 1.5 * lamp.radius))]
    return [Object(Rectangle(lamp.center + gap * lamp.normal, 1.5 * lamp.half_u, 1.5 * lamp.half_v))]


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("floor", ["a meter", "a surface"])
@SURFACES
def test_a_body_next_to_a_light_hides_it_from_the_front_only(name, floor, crowd):
    emitter, ground = LIGHTS[name], Object(FLOOR, Diffuse([0.8] * 3))
    expected = irradiances([emitter], FLOOR, FILM)
    for gap in (1e-4, -1e-4):
        scene = scene_of([emitter], *lids(emitter, gap), *([ground] if floor == "a surface" else []), *crowd)
        sensor = looking_down(FLOOR) if floor == "a surface" else IrradianceMeter(FLOOR)
        shown = render(scene, sensor, FILM, spp=1 << 10, bounces=int(floor == "a surface"))
        if gap > 0:
            assert (shown.mean == 0).all()
        else:
            assert_right(shown, expected * (0.8 / np.pi if floor == "a surface" else 1), known_to=2e-2)


# --------------------------------------------------------------------------------------------------------- leaks


def box(size, center=(0.0, 0.0, 0.0)):
    """A cube whose triangles face inwards."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size + center
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Mesh(corners, [triangle for a, b, c, d in sides for triangle in ([a, c, b], [a, d, c])])


@pytest.mark.parametrize("strategy", ["light", "bsdf"])
@pytest.mark.parametrize(("size", "aside", "most"), [(1e-3, 1, 0), (1, 10, 0), (1e6, 0, 0), (1, 1e3, 1e-4)])
def test_no_light_leaks_into_a_closed_box(size, aside, most, strategy):
    # A thousand times its size from the origin the box is no longer closed to single precision.
    middle = np.full(3, float(size * aside))
    outside = [Constant(LIGHT), Point(middle + size * np.array([3, 2, 5]), size**2 * LIGHT)]
    walls = Object(box(size, middle), TwoSided(Diffuse([0.9] * 3)))
    floor = Rectangle(middle - [0, 0, 0.99 * size], [0.99 * size, 0, 0], [0, 0.99 * size, 0])
    measured = render(scene_of(outside, walls), IrradianceMeter(floor), Film(16, 16), spp=128, strategy=strategy)
    assert (measured.mean.mean(axis=(0, 1)) <= most * np.pi * LIGHT).all()


def test_a_slit_lets_through_what_it_shows():
    # A millimetre wide and half a metre away; the lamp above is seen through 0.5 m of its length.
    gap = 1e-3
    plates = [Rectangle([side * (5 + gap / 2), 0, 0.5], [5, 0, 0], [0, 10, 0]) for side in (-1, 1)]
    receiver = Rectangle([0, 0, 0], [1e-5, 0, 0], [0, 1e-5, 0])
    lamp = Area(Rectangle([0, 0, 0.6], [0, 0.3, 0], [0.3, 0, 0]), LIGHT)
    measured = render(
        scene_of([lamp], *[Object(plate) for plate in plates]),
        IrradianceMeter(receiver),
        Film(1, 1),
        spp=1 << 17,
        bounces=0,
    )
    seen = Area(Rectangle([0, 0, 0.5], [0, 0.25, 0], [gap / 2, 0, 0]), LIGHT)
    assert_right(measured, irradiances([seen], receiver, Film(1, 1)), known_to=1e-2)
