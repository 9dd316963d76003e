"""Direct light in the reference tracer, judged by closed forms of irradiance: every emitter, strategy and sampler."""

import numpy as np
import pytest
from renderings import CROWD, TOLERANCE, assert_right, irradiances, looking_down, scene_of, unit

from oracle import (
    Area,
    Constant,
    CosineSky,
    Directional,
    Disk,
    Equirectangular,
    Mesh,
    Point,
    Rectangle,
    Sphere,
    Spot,
)
from oracle.tracer import Diffuse, Film, IrradianceMeter, Object, Scene, render

LIGHT = np.array([3.0, 1.0, 0.25])
DOWN = np.array([0.0, 0.0, -1.0])
FLOOR = Rectangle([0.2, 0.1, 0], [1.2, 0, 0], [0, 0.8, 0])
# Not square, so that exchanged axes are seen; the shape of the floor.
FILM = Film(6, 4)


def lamp(center, half_u, half_v, two_sided=False):
    """A rectangle that shines downwards."""
    return Area(Rectangle(center, half_v, half_u), LIGHT, two_sided)


def sunny_map():
    """A map with one texel that is 10,000 times as bright as the others."""
    texels = np.random.default_rng(0).random((6, 8, 3)) * LIGHT
    texels[1, 3] *= 1e4
    return Equirectangular(texels, unit([0.3, 0.1, 1]), unit(np.cross([0.3, 0.1, 1], [0, 1, 0])))


CORNERS = np.array([[0, 0, 0.5], [1, 0, 0.7], [0, 1, 0.6], [0.2, 0.2, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
TRIANGLE = np.array([[-0.5, -0.3, 0.9], [0.8, -0.2, 1.2], [0.1, 0.9, 1.0]])
TILTED = unit([0.6, -0.2, 0.8])

LAMPS = {
    "a far rectangle": [lamp([0.3, 0.2, 20], [1, 0, 0], [0, 0.5, 0])],
    "a near rectangle": [lamp([0.3, 0.2, 0.4], [1, 0, 0], [0, 0.5, 0])],
    "a rectangle that shines on both sides": [lamp([0.3, 0.2, 1], [0.3, 0, 0.6], [0, 0.5, 0], two_sided=True)],
    "a wall that the horizon cuts": [lamp([2, 0.2, 0.1], [0, 0.5, 0], [0, 0, 1])],
    "a disk": [Area(Disk([0.3, 0.2, 1], unit([0.2, 0, -1]), 0.6), LIGHT)],
    "a near disk": [Area(Disk([0.3, 0.2, 0.3], DOWN, 0.6), LIGHT)],
    "a far sphere": [Area(Sphere([0.3, 0.2, 10], 0.6), LIGHT)],
    "a sphere that all but touches": [Area(Sphere([0.25, 0.15, 0.61], 0.6), LIGHT)],
    "a sphere half below the horizon": [Area(Sphere([2.2, 0.2, 0.1], 0.4), LIGHT)],
    "a mesh": [Area(Mesh(CORNERS, FACES), LIGHT)],
    "a triangle that shines on both sides": [Area(Mesh(TRIANGLE, [[0, 1, 2]]), LIGHT, two_sided=True)],
    "a point": [Point([0.3, 0.2, 0.5], LIGHT)],
    "a spot": [Spot([0.3, 0.2, 1.5], unit([0.2, 0.1, -1]), LIGHT, 0.2, 1.3)],
    "parallel light": [Directional(unit([0.3, 0.5, -1]), LIGHT)],
    "a constant environment": [Constant(LIGHT)],
    "a tilted sky": [CosineSky.cie_overcast(TILTED, LIGHT)],
    "a map with a sun": [sunny_map()],
    "several lights": [
        lamp([0.3, 0.2, 1.5], [0.5, 0, 0], [0, 0.5, 0]),
        Area(Disk([-1.5, 0.2, 0.5], unit([1, 0, -1]), 0.3), LIGHT[::-1]),
        Area(Sphere([0.3, -1.5, 0.4], 0.3), LIGHT),
        Point([3, 1, 1], LIGHT),
    ],
    "several lights without surfaces": [Point([0.3, 0.2, 0.5], LIGHT), Directional(DOWN, LIGHT[::-1]), sunny_map()],
}
WITHOUT_EXTENT = ("a point", "a spot", "parallel light")
SURFACES = pytest.mark.parametrize("crowd", [[], [CROWD]], ids=["few surfaces", "a hierarchy"])


@pytest.mark.parametrize("name", LAMPS)
@pytest.mark.parametrize("sampler", ["sobol", "independent"])
@SURFACES
def test_a_meter_measures_the_irradiance_of_every_emitter(name, sampler, crowd):
    measured = render(
        scene_of(LAMPS[name], *crowd), IrradianceMeter(FLOOR), FILM, spp=1 << 13, bounces=0, sampler=sampler
    )
    assert_right(measured, irradiances(LAMPS[name], FLOOR, FILM), known_to=4e-3)


@pytest.mark.parametrize("name", [name for name in LAMPS if name not in WITHOUT_EXTENT])
@pytest.mark.parametrize("strategy", ["light", "bsdf", "hemisphere", "mis"])
def test_all_strategies_find_the_light_of_every_emitter_with_extent(name, strategy):
    lit = [one for one in LAMPS[name] if not isinstance(one, Point | Directional)]
    shown = render(
        scene_of(lit, Object(FLOOR, Diffuse([0.8, 0.5, 0.2]))),
        looking_down(FLOOR),
        FILM,
        spp=1 << 13,
        strategy=strategy,
        bounces=1,
    )
    assert_right(shown, np.array([0.8, 0.5, 0.2]) / np.pi * irradiances(lit, FLOOR, FILM), known_to=0.1)


@pytest.mark.parametrize("name", LAMPS)
@SURFACES
def test_a_diffuse_surface_reflects_the_light_of_every_emitter(name, crowd):
    lit = scene_of(LAMPS[name], Object(FLOOR, Diffuse([0.8, 0.5, 0.2])), *crowd)
    shown = render(lit, looking_down(FLOOR), FILM, spp=1 << 13, bounces=1)
    assert_right(shown, np.array([0.8, 0.5, 0.2]) / np.pi * irradiances(LAMPS[name], FLOOR, FILM), known_to=4e-3)


@pytest.mark.parametrize(
    "shape",
    [
        Rectangle([0.3, 0.2, 0.4], [1, 0, 0], [0, 0.5, 0]),
        Mesh(TRIANGLE, [[0, 1, 2]]),
        Disk([0.3, 0.2, 0.4], [0, 0, 1], 0.5),
    ],
    ids=lambda shape: type(shape).__name__,
)
@pytest.mark.parametrize("strategy", ["light", "mis"])
def test_behind_a_lamp_that_shines_on_one_side_it_is_dark(shape, strategy):
    scene = scene_of([Area(shape, LIGHT)], Object(FLOOR, Diffuse([0.8] * 3)))
    assert (render(scene, looking_down(FLOOR), FILM, spp=256, strategy=strategy, bounces=1).mean == 0).all()
    assert (render(scene, IrradianceMeter(FLOOR), FILM, spp=256, strategy=strategy, bounces=0).mean == 0).all()


@pytest.mark.parametrize("strategy", ["light", "mis"])
def test_a_lit_surface_is_black_from_behind(strategy):
    scene = scene_of(LAMPS["a near rectangle"], Object(FLOOR, Diffuse([0.8] * 3)))
    below = looking_down(Rectangle(FLOOR.center, FLOOR.half_v, FLOOR.half_u))
    assert (render(scene, below, FILM, spp=256, strategy=strategy).mean == 0).all()


def test_a_lamp_hides_the_environment_behind_it():
    around, lamps = 0.1 * LIGHT, LAMPS["a disk"]
    more = Area(lamps[0].shape, LIGHT - around)
    back = Area(Disk(more.shape.center, -more.shape.normal, more.shape.radius), around)
    measured = render(scene_of([*lamps, Constant(around)]), IrradianceMeter(FLOOR), FILM, spp=1 << 15, bounces=0)
    assert (irradiances([back], FLOOR, FILM) == 0).all()
    assert_right(measured, irradiances([more, Constant(around)], FLOOR, FILM), known_to=5e-4)


# --------------------------------------------------------------------------------------------- many configurations


def random_case(kind, rng):
    """A small receiver and an emitter of this kind, oriented at random, whose distance and size are of any ratio."""
    normal = unit(rng.normal(size=3))
    along = unit(np.cross(normal, rng.normal(size=3)))
    across = np.cross(normal, along)
    size, height = 10.0 ** rng.uniform(-1, 1), 10.0 ** rng.uniform(-2, 1)
    center = rng.normal(size=3)
    aside = rng.normal(size=2) * 10.0 ** rng.uniform(-1, 0.5)
    # Single precision rounds corners; what is compared are the shapes after that.
    at = np.float32(center + height * normal + aside @ [along, across]).astype(float)
    facing = unit(center - at + rng.normal(size=3) * rng.choice([0.3, 3]))
    match kind:
        case "rectangle":
            shape = Rectangle(center, size * along, size * 10 ** rng.uniform(-1, 1) * across)
        case "triangle":
            angles = np.sort(rng.uniform(0, 2 * np.pi, 3))
            corners = center + size * (np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across)
            shape = Mesh(np.float32(corners).astype(float), [[0, 1, 2]])
        case "disk":
            shape = Disk(center, normal, size)
        case "sphere":
            height = size * 10.0 ** rng.uniform(-3, 1)
            shape = Sphere(at - (size + height) * unit(rng.normal(size=3)), size)
    u = unit(np.cross(facing, rng.normal(size=3)))
    return Rectangle(at, 0.01 * height * u, 0.01 * height * np.cross(facing, u)), Area(shape, np.ones(3))


@pytest.mark.parametrize("kind", ["rectangle", "triangle", "disk", "sphere"])
@pytest.mark.parametrize("receiver", ["meter", "surface"])
@SURFACES
def test_emitters_of_any_size_distance_and_orientation_are_right(kind, receiver, crowd):
    rng = np.random.default_rng(2)
    counted = 0
    for seed in range(150):
        surface, emitter = random_case(kind, rng)
        expected = irradiances([emitter], surface, Film(1, 1), nodes=4)
        # Light that comes along the surface, or from a plane seen edge-on, single precision does not know to 0.05 %.
        if expected[0, 0, 0] < 3e-3 * np.pi:
            continue
        # Points on surfaces are rounded to 5e-7 of their coordinates, which must be little against what is shown.
        if receiver == "surface" and np.linalg.norm(surface.half_u) < 1e-4 * np.abs(surface.center).max():
            continue
        if receiver == "meter":
            scene, sensor, bounces = scene_of([emitter], *crowd), IrradianceMeter(surface), 0
        else:
            # Larger than what is seen of it, as its outline is rounded.
            ground = Rectangle(surface.center, 2 * surface.half_u, 2 * surface.half_v)
            scene = scene_of([emitter], Object(ground, Diffuse([1.0] * 3)), *crowd)
            sensor, bounces = looking_down(surface, 0.1 * np.linalg.norm(surface.half_u)), 1
            expected = expected / np.pi
        measured = render(scene, sensor, Film(1, 1), spp=1 << 11, seed=seed, bounces=bounces)
        off, error = (
            measured.mean[0, 0, 0] / expected[0, 0, 0] - 1,
            measured.standard_error[0, 0, 0] / expected[0, 0, 0],
        )
        # Student's t of 8 replicates exceeds 15 once in a million.
        assert abs(off) < max(TOLERANCE, 15 * error), (seed, emitter, off, error)
        counted += 1
    assert counted > 40


def test_a_surface_is_lit_however_large_it_is():
    lamps = [lamp([0.3, 0.2, 0.4], [1, 0, 0], [0, 0.5, 0])]
    expected = irradiances(lamps, FLOOR, FILM) * 0.8 / np.pi
    for size in (1e1, 1e3, 1e5):
        ground = Rectangle([0.3 * size, -0.2 * size, 0], [size, 0, 0], [0, size, 0])
        corners = ground.polygon.vertices
        for shape in (ground, Mesh(corners, [[0, 1, 2], [0, 2, 3]])):
            scene = scene_of(lamps, Object(shape, Diffuse([0.8] * 3)))
            assert_right(render(scene, looking_down(FLOOR), FILM, spp=1 << 11, bounces=1), expected, known_to=1e-3)


def test_the_numbers_of_an_unlit_scene_are_zero():
    floor = Object(FLOOR, Diffuse([0.8] * 3))
    for strategy in ("light", "bsdf", "hemisphere", "mis"):
        dark = render(Scene([floor]), looking_down(FLOOR), FILM, spp=8, strategy=strategy)
        assert (dark.mean == 0).all()
        assert (dark.variance == 0).all()
