"""Scenes without a closed form: described, small, the same every time, and known to every renderer here."""

import json

import pytest

from reference_scenes import model
from reference_scenes.closed_form import NoClosedForm, require_closed_form
from reference_scenes.export import FORMATS, export
from reference_scenes.loading import load_scene
from reference_scenes.without_closed_form import SCENES


@pytest.mark.parametrize("name", SCENES)
def test_a_sentence_says_what_there_is_to_see(name):
    sentence = SCENES[name].__doc__
    assert sentence.endswith(".")
    assert "\n" not in sentence


@pytest.mark.parametrize("name", SCENES)
def test_none_has_a_closed_form(name):
    with pytest.raises(NoClosedForm):
        require_closed_form(SCENES[name]())


@pytest.mark.parametrize("name", SCENES)
def test_each_is_small_and_the_same_every_time(name):
    scene = SCENES[name]()
    assert scene == SCENES[name]()
    assert scene.film.width * scene.film.height <= 64 * 64


@pytest.mark.parametrize("format_name", FORMATS)
@pytest.mark.parametrize("name", SCENES)
def test_each_goes_into_every_format(tmp_path, name, format_name):
    path = export(SCENES[name](), format_name, tmp_path)
    assert path.stat().st_size > 0
    if format_name == "json":
        assert load_scene(path) == SCENES[name]()


def test_the_cornell_box_has_36_triangles():
    scene = SCENES["cornell-box"]()
    meshes = [one.shape for one in (*scene.objects, *scene.emitters)]
    assert sum(len(mesh.triangles) for mesh in meshes) == 36


def test_together_they_hold_every_kind_of_thing_that_all_renderers_know():
    def types(part):
        if isinstance(part, dict):
            yield from [part["type"]] if "type" in part else []
            yield from (kind for value in part.values() for kind in types(value))
        elif isinstance(part, list):
            yield from (kind for value in part for kind in types(value))

    found = {kind for make in SCENES.values() for kind in types(json.loads(make().model_dump_json()))}
    known = {kind.model_fields["type"].default for kind in every_kind(model.Model) if "type" in kind.model_fields}
    # Phong is not known to Mitsuba; points and spots have closed forms enough, and so has the Gaussian filter.
    assert known - found == {"phong", "point", "spot", "gaussian"}


def every_kind(kind):
    """All kinds of parts that the scene model has."""
    for one in kind.__subclasses__():
        if one.__module__.startswith("reference_scenes.model."):
            yield one
            yield from every_kind(one)
