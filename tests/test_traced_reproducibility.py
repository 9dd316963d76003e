"""An image of the reference tracer depends on scene, seed and samples, and on nothing else."""

import numpy as np
import pytest

from oracle import Disk, InvalidArgument, Mesh, Point, Rectangle, Sphere
from oracle.tracer import (
    Dielectric,
    Diffuse,
    Film,
    Goal,
    Job,
    Method,
    Object,
    Perspective,
    Range,
    Rendering,
    RoughConductor,
    Scene,
    _core,
    first_hits,
    merge,
    render,
    stage,
)

GREY = Diffuse([0.5, 0.6, 0.7])
METAL = RoughConductor([0.2, 0.9, 1.1], [3.9, 2.5, 2.4], 0.3)
LAMP = Object(Rectangle([0, 0, 1.9], [0, 0.4, 0], [0.4, 0, 0]), radiance=[9.0, 7.0, 5.0])
ROOM = [
    Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), GREY),
    Object(Rectangle([0, 1, 1], [1, 0, 0], [0, 0, 1]), METAL),
    Object(Sphere([0.3, 0.2, 0.4], 0.4), Dielectric(1.5)),
    Object(Disk([-0.5, 0, 0.6], [0.6, -0.8, 0], 0.3), GREY),
]
SCENE = Scene([*ROOM, LAMP], [Point([0.5, -0.8, 1.5], [1.0, 1.0, 1.0])])
CAMERA = Perspective([0, -3, 1.2], [0, 0, 0.8], [0, 0, 1], 0.9)
# More than one tile each way, and a rest in both.
FILM = Film(37, 21)


def assert_same(a: Rendering, b: Rendering) -> None:
    np.testing.assert_array_equal(a.sums, b.sums)
    np.testing.assert_array_equal(a.squares, b.squares)
    assert (a.ranges, a.identity) == (b.ranges, b.identity)


@pytest.mark.parametrize("sampler", ["sobol", "independent"])
@pytest.mark.parametrize("threads", [2, 3, 64])
def test_any_number_of_threads_gives_the_same_bits(sampler, threads):
    one = render(SCENE, CAMERA, FILM, spp=16, sampler=sampler, threads=1)
    assert_same(one, render(SCENE, CAMERA, FILM, spp=16, sampler=sampler, threads=threads))


@pytest.mark.parametrize("sampler", ["sobol", "independent"])
@pytest.mark.parametrize("cut", [8, 16, 40])
def test_parts_merge_to_the_whole_bit_for_bit(sampler, cut):
    whole = render(SCENE, CAMERA, FILM, spp=48, seed=7, sampler=sampler)
    first = render(SCENE, CAMERA, FILM, spp=cut, seed=7, sampler=sampler)
    rest = render(SCENE, CAMERA, FILM, spp=48 - cut, seed=7, sampler=sampler, first_sample=cut)
    assert_same(whole, merge(first, rest))
    assert_same(whole, merge(rest, first))


def test_seeds_merge_in_any_order():
    a, b, c = (render(SCENE, CAMERA, FILM, spp=8, seed=seed) for seed in (1, 2, 3))
    together = merge(merge(a, b), c)
    assert_same(together, merge(a, merge(c, b)))
    assert together.spp == 24
    np.testing.assert_allclose(together.mean, (a.mean + b.mean + c.mean) / 3, rtol=1e-12, atol=1e-15)


def test_the_schedule_of_passes_does_not_matter():
    job = Job(SCENE, CAMERA, FILM)
    by_hand = job.nothing()
    for first, count in ((0, 8), (8, 24), (32, 8)):
        by_hand = job.extended(by_hand, Range(5, first, count))
    *_, by_itself = job.passes(Goal(spp=40), seed=5)
    assert_same(by_hand, by_itself)


def test_a_rendering_goes_on_where_it_was_left():
    job = Job(SCENE, CAMERA, FILM)
    *_, part = job.passes(Goal(spp=16), seed=5)
    *_, whole = job.passes(Goal(spp=40), seed=5, start=part)
    assert_same(whole, render(SCENE, CAMERA, FILM, spp=40, seed=5))


def test_what_has_samples_in_common_does_not_merge():
    a = render(SCENE, CAMERA, FILM, spp=16)
    b = render(SCENE, CAMERA, FILM, spp=16, first_sample=8)
    with pytest.raises(InvalidArgument, match="samples of seed 0 that a has as well"):
        merge(a, b)


@pytest.mark.parametrize(
    "other",
    [
        {"scene": Scene([*ROOM, LAMP])},
        {"film": Film(37, 22)},
        {"sensor": Perspective([0, -3, 1.2], [0, 0, 0.8], [0, 0, 1], 0.91)},
        {"bounces": 3},
        {"strategy": "light"},
        {"sampler": "independent"},
    ],
    ids=lambda other: next(iter(other)),
)
def test_what_shows_something_else_does_not_merge(other):
    arguments = {"scene": SCENE, "sensor": CAMERA, "film": FILM, "spp": 8}
    with pytest.raises(InvalidArgument, match="shows another scene, or was rendered otherwise"):
        merge(render(**arguments), render(**{**arguments, **other, "seed": 1}))


def test_images_of_different_seeds_differ():
    a, b = (render(SCENE, CAMERA, FILM, spp=8, seed=seed) for seed in (0, 1 << 63))
    assert (a.mean != b.mean).mean() > 0.5


def test_the_variance_is_as_large_as_stated():
    # The spread of 64 images against the variance that each of them states: the ratio of two means over 777 pixels and
    # three channels, whose own standard error is below 3 %.
    for sampler in ("sobol", "independent"):
        images = [render(SCENE, CAMERA, FILM, spp=16, seed=seed, sampler=sampler, bounces=1) for seed in range(64)]
        spread = np.var([image.mean for image in images], axis=0, ddof=1)
        stated = np.mean([image.variance for image in images], axis=0)
        brightness = images[0].mean.mean() ** 2
        lit = spread > 1e-6 * brightness
        assert lit.mean() > 0.3
        ratio = np.median(spread[lit] / stated[lit])
        assert 0.8 < ratio < 1.2, (sampler, ratio)


def test_noise_of_pixels_and_seeds_is_uncorrelated():
    # Neighbours in an evenly lit image; correlations of 40,000 pairs have a standard error of 0.005, five of which are
    # exceeded once in two million.
    lamp = Object(Sphere([0, 0, 0], 50.0), radiance=[1, 1, 1], two_sided=True)
    floor = Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), GREY)
    above = Perspective([0, 0, 1], [0, 0, 0], [0, 1, 0], 0.8)
    for sampler in ("sobol", "independent"):
        a, b = (
            render(Scene([floor, lamp]), above, Film(200, 200), spp=8, seed=seed, sampler=sampler).mean[..., 0]
            for seed in (1, 2)
        )
        assert a.std() > 0
        pairs = {"seeds": (a, b), "columns": (a[:, 1:], a[:, :-1]), "rows": (a[1:], a[:-1])}
        for name, (x, y) in pairs.items():
            correlation = np.corrcoef(x.ravel(), y.ravel())[0, 1]
            assert abs(correlation) < 0.025, (sampler, name, correlation)


def test_few_surfaces_look_as_embree_sees_them():
    # 32 triangles at random, with a disk and a sphere: small enough to be searched without Embree.
    draw = np.random.default_rng(3)
    corners = draw.uniform(-1, 1, (32, 1, 3)) + draw.uniform(-0.3, 0.3, (32, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(96).reshape(-1, 3))
    round_ones = [Object(Sphere([0.5, 0.2, 0.1], 0.3), GREY), Object(Disk([-0.5, 0, 0], [0.6, -0.8, 0], 0.4), GREY)]
    scene = Scene([Object(mesh, GREY), *round_ones])
    far = Object(Mesh(100 + mesh.vertices, np.tile(mesh.triangles, (2, 1))), GREY)
    film = Film(160, 120)
    few = first_hits(scene, CAMERA, film)
    many = first_hits(Scene([*scene.objects, far]), CAMERA, film)
    assert 0.1 < (few.object >= 0).mean() < 0.9
    # Rays along an edge may see either side of it.
    same = few.object == many.object
    assert same.mean() > 0.999
    near = np.isclose(few.distance, many.distance, rtol=2e-6) | ~same
    assert near.mean() > 0.999


def test_a_stage_is_not_rendered_before_it_is_committed():
    bare = _core.Stage()
    with pytest.raises(RuntimeError, match="not committed"):
        bare.first_hits(stage.sensor(CAMERA, FILM), _core.Film(4, 4, 0.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"spp": 12}, "spp is 12, it must be a multiple of 8"),
        ({"first_sample": 4}, "first_sample is 4, it must be a multiple of 8"),
        ({"seed": -1}, "seed is -1, it must be between 0 and"),
        ({"seed": 1 << 64}, "seed is 18446744073709551616, it must be between 0 and"),
        ({"strategy": "luck"}, "strategy is 'luck', it must be one of"),
        ({"sampler": "halton"}, "sampler is 'halton', it must be one of"),
        ({"bounces": -1}, "bounces is -1"),
    ],
)
def test_wrong_numbers_are_refused_by_name(arguments, message):
    with pytest.raises(InvalidArgument, match=message):
        render(SCENE, CAMERA, FILM, **{"spp": 8, **arguments})


def test_the_goal_of_an_error_is_reached():
    *_, rendering = Job(SCENE, CAMERA, FILM, Method(bounces=1)).passes(Goal(error=0.1, share=0.8))
    mean = rendering.mean.mean(axis=-1)
    relative = np.sqrt(rendering.variance.sum(axis=-1)) / 3 / np.where(mean > 0, mean, 1)
    assert np.mean(relative[mean > 0] <= 0.1) >= 0.8
