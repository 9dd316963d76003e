"""The canonical families: reproducible, different from seed to seed, and each able to show what it is there to show."""

import hashlib
import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import oracle
from reference_scenes import model
from reference_scenes.closed_form import camera_rays, film_radiance, hit_shape, require_closed_form
from reference_scenes.export import FORMATS, export
from reference_scenes.families import FAMILIES

SEEDS = range(60)
every_family = pytest.mark.parametrize("name", FAMILIES)
# A difference of this size, relative to the mean of the image, is ten times the tolerance of a rubric.
VISIBLE = 0.05


@cache
def member(name, seed):
    return FAMILIES[name].member(seed)


def image_of(scene, width=24, height=16, per_axis=2):
    """A small image of a scene, from a few rays through each pixel."""
    small = scene.model_copy(update={"film": model.Film(width=width, height=height)})
    x, y = np.meshgrid(*((np.arange(n * per_axis) + 0.5) / per_axis for n in (width, height)))
    radiance, _ = film_radiance(small)(x.ravel(), y.ravel())
    return radiance.reshape(height, per_axis, width, per_axis, 3).mean(axis=(1, 3))


@cache
def small_image(name, seed):
    return image_of(member(name, seed))


def difference(image, other):
    """Mean absolute difference, relative to the mean of the image."""
    return np.abs(image - other).mean() / image.mean()


def numbers_in(schema, definitions):
    """The schemas of all numbers in a JSON Schema, by the name of their field."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].split("/")[-1]]
    for name, field in schema.get("properties", {}).items():
        for found in [field, *field.get("prefixItems", [])]:
            if found.get("type") in ("number", "integer"):
                yield name, found
        if "$ref" in field:
            yield from numbers_in(field, definitions)


# ------------------------------------------------------------------------------------------- reproducibility


def digests():
    return {name: [digest(member(name, seed)) for seed in (0, 1, 2**40)] for name in FAMILIES}


def digest(scene):
    return hashlib.sha256(scene.model_dump_json().encode()).hexdigest()


@every_family
def test_the_same_seed_gives_the_same_scene(name):
    for seed in SEEDS:
        assert FAMILIES[name].member(seed) == FAMILIES[name].member(seed)


def test_another_process_draws_the_same_scenes():
    code = (
        "import json, hashlib; from reference_scenes.families import FAMILIES; print(json.dumps({name: [hashlib.sha256("
        "f.member(s).model_dump_json().encode()).hexdigest() for s in (0, 1, 2**40)] for name, f in FAMILIES.items()}))"
    )
    path = os.pathsep.join([str(Path(oracle.__file__).parents[1]), *filter(None, sys.path)])
    # Other hash seeds and another order of sets must not matter.
    env = {**os.environ, "PYTHONPATH": path, "PYTHONHASHSEED": "12345"}
    printed = subprocess.run([sys.executable, "-S", "-c", code], env=env, capture_output=True, check=True).stdout
    assert json.loads(printed) == digests()


@every_family
def test_different_seeds_give_different_scenes(name):
    assert len({digest(member(name, seed)) for seed in SEEDS}) == len(SEEDS)


@every_family
def test_every_parameter_is_drawn(name):
    family = FAMILIES[name]
    drawn = [family.draw(family.generator(seed)).model_dump() for seed in SEEDS]
    for field in drawn[0]:
        assert len({str(parameters[field]) for parameters in drawn}) > 1, field


def test_families_draw_independently_of_each_other():
    assert len({FAMILIES[name].generator(0).random() for name in FAMILIES}) == len(FAMILIES)


# ------------------------------------------------------------------------------------------------ declarations


def test_families_are_filed_under_their_names():
    assert all(name == family.name for name, family in FAMILIES.items())
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", name) for name in FAMILIES)


@every_family
def test_a_family_states_its_law_concept_formula_and_source(name):
    family = FAMILIES[name]
    assert family.law.endswith(".")
    assert family.concept
    assert family.formula.startswith("L = ")
    assert re.search(r"[A-Z]\w+ .*\d", family.source), "author and year, or number in a catalogue"
    assert family.parameters.__doc__.strip().endswith(".")
    assert family.spp >= 1


@every_family
def test_every_number_among_the_parameters_has_a_range(name):
    schema = FAMILIES[name].parameters.model_json_schema()
    found = list(numbers_in(schema, schema.get("$defs", {})))
    assert found
    for field, number in found:
        assert {"minimum", "exclusiveMinimum"} & set(number), field
        assert {"maximum", "exclusiveMaximum"} & set(number), field


@every_family
def test_what_is_drawn_is_within_the_declared_ranges(name):
    family = FAMILIES[name]
    for seed in SEEDS:
        parameters = family.draw(family.generator(seed))
        assert family.parameters.model_validate_json(parameters.model_dump_json()) == parameters


# ---------------------------------------------------------------------------------------------------- images


@every_family
def test_every_member_has_a_closed_form(name):
    for seed in SEEDS:
        require_closed_form(member(name, seed))


@every_family
def test_every_image_is_finite_and_neither_black_nor_constant(name):
    for seed in SEEDS:
        image = small_image(name, seed)
        assert np.isfinite(image).all()
        assert image.min() >= 0
        assert image.mean() > 0.005
        assert np.ptp(image, axis=(0, 1)).max() > 0.2 * image.mean()


@every_family
@pytest.mark.parametrize(
    ("flip", "axes"), [("left to right", (1,)), ("upside down", (0,)), ("half a turn", (0, 1))], ids=lambda x: str(x)
)
def test_a_flipped_image_shows(name, flip, axes):
    for seed in SEEDS:
        image = small_image(name, seed)
        assert difference(image, np.flip(image, axes)) > VISIBLE, (flip, seed)


@every_family
def test_exchanged_channels_show(name):
    for seed in SEEDS:
        image = small_image(name, seed)
        for order in ([1, 0, 2], [0, 2, 1], [2, 1, 0]):
            assert difference(image, image[..., order]) > VISIBLE / 2, (order, seed)


@every_family
def test_light_is_coloured(name):
    emission = {"radiance", "intensity", "irradiance"}
    for seed in SEEDS:
        for emitter in member(name, seed).emitters:
            (colour,) = (getattr(emitter, field) for field in emission & set(type(emitter).model_fields))
            # The furnace is white by its very law.
            assert (len(set(colour)) == 3) == (name != "furnace")


@every_family
def test_the_film_is_neither_square_nor_a_power_of_two(name):
    film = member(name, 0).film
    assert film.width != film.height
    assert film.width & (film.width - 1)


# ------------------------------------------------------------------------------------- what each is there to show


def turned_over(emitter):
    """A rectangular emitter that shines to the other side."""
    half_u = tuple(-component for component in emitter.shape.half_u)
    return emitter.model_copy(update={"shape": emitter.shape.model_copy(update={"half_u": half_u})})


def visible_surface(scene, x, y):
    """Which object or emitter is seen at film positions; -1 for none."""
    origins, directions = camera_rays(scene, x, y)
    shapes = [o.shape for o in scene.objects] + [e.shape for e in scene.emitters if isinstance(e, model.AreaEmitter)]
    t = np.stack([hit_shape(shape, origins, directions)[0] for shape in shapes])
    return np.where(np.isfinite(t.min(axis=0)), t.argmin(axis=0), -1)


def test_a_light_that_shines_from_both_sides_shows_in_rectangle_horizon():
    for seed in SEEDS:
        scene = member("rectangle-horizon", seed)
        # What the back would add on the receiver.
        back = image_of(scene.model_copy(update={"emitters": tuple(map(turned_over, scene.emitters))}))
        receiver = on_receiver(scene)
        assert back[receiver].sum() > VISIBLE * small_image("rectangle-horizon", seed)[receiver].sum(), seed


def test_light_from_below_the_horizon_shows_in_rectangle_horizon():
    for seed in SEEDS:
        scene = member("rectangle-horizon", seed)
        # A receiver turned over sees what its front must not: the part of the light below the horizon.
        receiver = scene.objects[0]
        upside_down = receiver.model_copy(update={"shape": turned_over(receiver).shape})
        below = scene.model_copy(update={"objects": (upside_down,), "camera": from_below(scene.camera)})
        seen, lit = on_receiver(below), image_of(below)
        assert lit[seen].mean() > VISIBLE * small_image("rectangle-horizon", seed)[on_receiver(scene)].mean(), seed


def from_below(camera):
    """The camera mirrored at the plane z = 0."""
    mirrored = {
        field: (*getattr(camera, field)[:2], -getattr(camera, field)[2]) for field in ("origin", "target", "up")
    }
    return camera.model_copy(update=mirrored)


def on_receiver(scene, width=24, height=16):
    """Pixels in whose centre the first object is seen."""
    small = scene.model_copy(update={"film": model.Film(width=width, height=height)})
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return (visible_surface(small, x.ravel(), y.ravel()) == 0).reshape(height, width)


def test_the_light_of_rectangle_horizon_crosses_the_horizon_and_its_plane_the_receiver():
    for seed in SEEDS:
        scene = member("rectangle-horizon", seed)
        light = scene.emitters[0].shape
        corners = [np.add(light.center, a * np.array(light.half_u) + b * np.array(light.half_v))
                   for a in (-1, 1) for b in (-1, 1)]  # fmt: skip
        heights = [corner[2] for corner in corners]
        assert min(heights) < -0.1
        assert max(heights) > 0.1
        shape = scene.objects[0].shape
        normal = np.cross(light.half_u, light.half_v)
        sides = [
            np.dot(np.add(shape.center, a * np.array(shape.half_u) + b * np.array(shape.half_v)) - light.center, normal)
            for a in (-1, 1) for b in (-1, 1)
        ]  # fmt: skip
        assert min(sides) < 0 < max(sides)


def test_a_missing_shadow_shows_in_hard_shadow():
    for seed in SEEDS:
        scene = member("hard-shadow", seed)
        floor = on_receiver(scene)
        unblocked = image_of(scene.model_copy(update={"objects": scene.objects[:1]}))
        image = small_image("hard-shadow", seed)
        # Only where the floor is seen in both.
        assert np.abs(unblocked - image)[floor].sum() > VISIBLE * image.sum(), seed


def test_the_shadow_of_hard_shadow_is_dark_and_neither_nothing_nor_all():
    for seed in SEEDS:
        floor = on_receiver(member("hard-shadow", seed))
        dark = small_image("hard-shadow", seed)[floor].max(axis=-1) == 0
        assert 0.01 < dark.mean() < 0.5, seed


def test_distance_and_angle_both_vary_over_point_distance():
    for seed in SEEDS:
        image = small_image("point-distance", seed)[..., 0]
        assert image.max() > 2 * image.min(), seed


def test_the_cosine_of_point_angle_is_far_from_1():
    for seed in SEEDS:
        parameters = FAMILIES["point-angle"].draw(FAMILIES["point-angle"].generator(seed))
        assert 0.2 < np.cos(np.radians(parameters.incidence)) < 0.75


def test_parallel_light_gives_one_radiance_over_the_whole_receiver():
    for seed in SEEDS:
        image = small_image("directional", seed)
        floor = on_receiver(member("directional", seed))
        lit = image[floor & (image.min(axis=-1) > 0.99 * image.max(axis=(0, 1)).min())]
        assert len(lit) > 20
        np.testing.assert_allclose(lit, np.broadcast_to(lit[0], lit.shape), rtol=1e-12)


def test_the_two_lights_of_two_lights_differ_in_colour_and_both_matter():
    for seed in SEEDS:
        scene = member("two-lights", seed)
        image = small_image("two-lights", seed)
        floor = on_receiver(scene)
        for emitter in scene.emitters:
            alone = image_of(scene.model_copy(update={"emitters": (emitter,)}))
            assert alone[floor].sum() > VISIBLE * image[floor].sum(), seed
        assert scene.emitters[0].radiance != scene.emitters[1].radiance


def test_the_white_channel_of_the_furnace_vanishes():
    for seed in SEEDS:
        image = small_image("furnace", seed)
        white = int(np.argmax(member("furnace", seed).objects[0].material.reflectance))
        np.testing.assert_allclose(image[..., white], 1, rtol=1e-12)
        assert image.max() < 1 + 1e-12


def test_what_is_lit_by_area_lights_is_also_seen():
    # Both the light itself and its light on the receiver are in view, so that either going wrong shows.
    for name in ("rectangle-overhead", "rectangle-horizon", "disk", "sphere", "two-lights"):
        for seed in SEEDS:
            assert on_receiver(member(name, seed)).mean() > 0.1, (name, seed)


# ---------------------------------------------------------------------------------------------------- names


@every_family
@pytest.mark.parametrize("format_name", FORMATS)
def test_no_exported_file_tells_the_name_of_the_family(name, format_name, tmp_path):
    export(member(name, 5), format_name, tmp_path / "scene")
    words = {name, *name.split("-"), "furnace", "horizon", "shadow", "overhead"} - {
        "two",
        "point",
        "rectangle",
        "lights",
    }
    # The type of a shape or an emitter is part of the format.
    types = {"disk", "sphere", "directional", "rectangle", "point"}
    for path in (tmp_path / "scene").rglob("*"):
        text = path.name + path.read_bytes().decode("latin-1").lower()
        for word in types:
            text = re.sub(rf'"?type"?[=:] ?"{word}"', "", text)
        for word in words:
            assert not re.search(rf"\b{word}\b", text), (path.name, word)
