"""Scenes as data: read back as written, frozen, checked, and refused in one line that says where and why."""

import json
import os
import string
from pathlib import Path

import numpy as np
import pytest
from any_scene import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from reference_scenes import model
from reference_scenes.export import export
from reference_scenes.families import FAMILIES
from reference_scenes.loading import InvalidFile, load_scene, load_toml, read_toml, validate
from reference_scenes.model import Scene

quick = settings(derandomize=True, deadline=None, max_examples=60)

NAN, INF = float("nan"), float("inf")
CAMERA = {"origin": [0, -3, 2], "target": [0, 0, 0], "fov_x": 40}
FILM = {"width": 4, "height": 3}
POINT = {"type": "point", "position": [0, 0, 1], "intensity": [1, 1, 1]}
GREY = {"reflectance": [0.5, 0.5, 0.5]}
SPHERE = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
CHECKER = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0]}
FLAT = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 5]]
KNOWN = "diffuse, mirror, dielectric, conductor, rough_conductor, rough_dielectric, phong, plastic, two_sided, mix"
SENSORS = "perspective, orthographic, irradiance_meter, radiance_meter"
TRIANGLE = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}


def a_scene(**changed):
    return {"camera": CAMERA, "film": FILM} | changed


def with_emitters(*emitters):
    return a_scene(emitters=list(emitters))


def with_object(shape, material=None):
    return a_scene(objects=[{"shape": shape, "material": material or GREY}])


@pytest.fixture
def complaint(tmp_path):
    """What loading a file says about its content, without the file's name."""

    def of(content):
        path = tmp_path / "scene.json"
        path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
        with pytest.raises(InvalidFile) as caught:
            load_scene(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: ")
        assert message.isprintable()
        assert len(message) < len(str(path)) + 400
        return message.removeprefix(f"{path}: ")

    return of


@quick
@given(scenes)
def test_a_scene_is_read_back_from_json_as_it_was(scene):
    assert Scene.model_validate_json(scene.model_dump_json()) == scene
    assert validate(json.loads(scene.model_dump_json()), Scene, "scene.json") == scene


@quick
@given(scenes)
def test_the_same_scene_has_the_same_text_whatever_way_it_came(scene):
    assert Scene.model_validate_json(scene.model_dump_json()).model_dump_json() == scene.model_dump_json()


def test_an_exported_scene_is_loaded_as_it_was(tmp_path):
    scene = FAMILIES["two-lights"].member(3)
    assert load_scene(export(scene, "json", tmp_path)) == scene


def test_whole_numbers_are_numbers():
    assert Scene.model_validate(a_scene()).camera.origin == (0.0, -3.0, 2.0)


def every_model():
    found = [model.Model]
    for kind in found:
        found += [k for k in kind.__subclasses__() if k.__module__.startswith("reference_scenes.model.")]
    return found[1:]


@pytest.mark.parametrize("kind", every_model(), ids=lambda kind: kind.__name__)
def test_every_part_of_a_scene_is_frozen_and_refuses_unknown_keys(kind):
    assert kind.model_config["frozen"]
    assert kind.model_config["extra"] == "forbid"


def test_a_scene_cannot_be_changed():
    scene = FAMILIES["disk"].member(0)
    with pytest.raises(ValidationError, match="frozen"):
        scene.film = model.Film(width=1, height=1)
    with pytest.raises(ValidationError, match="frozen"):
        scene.camera.fov_x = 30.0
    assert isinstance(scene.objects, tuple)
    assert isinstance(scene.camera.origin, tuple)
    hash(scene)


def test_texels_cannot_be_changed_and_are_equal_if_their_values_are():
    texels, same, other = (model.Texels(np.full((1, 2, 3), value)) for value in (0.5, 0.5, 0.25))
    assert texels == same
    assert hash(texels) == hash(same)
    assert texels != other
    with pytest.raises(ValueError, match="read-only"):
        texels.array[0, 0, 0] = 1.0


def test_several_constant_environments_stay_valid():
    constant = {"type": "constant", "radiance": [1, 1, 1]}
    assert len(Scene.model_validate(with_emitters(constant, constant)).emitters) == 2


def test_a_scene_of_the_first_version_is_written_as_it_ever_was():
    scene = FAMILIES["rectangle-overhead"].member(0)
    written = json.loads(scene.model_dump_json())
    assert set(written) == {"format", "version", "objects", "emitters", "camera", "film"}
    assert set(written["emitters"][0]) == {"type", "shape", "radiance"}


# --------------------------------------------------------------------------------------------------- errors


def changed_camera(**values):
    return a_scene(camera=CAMERA | values)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        # Light.
        (
            with_emitters(POINT, POINT, {"type": "area", "shape": SPHERE, "radiance": [1.0, -0.5, 1.0]}),
            "/emitters/2/radiance: [1.0, -0.5, 1.0] has a negative component; light is at least 0 in every channel",
        ),
        (
            with_object(SPHERE, {"reflectance": [0.5, 1.25, 0.5]}),
            "/objects/0/material/reflectance: [0.5, 1.25, 0.5] has a component outside [0, 1];"
            " a surface reflects between none and all of the light",
        ),
        (
            with_emitters(POINT | {"intensity": [1, "2", 3]}),
            '/emitters/0/intensity/1: "2": input should be a valid number',
        ),
        (
            with_emitters(POINT | {"intensity": [1, True, 3]}),
            "/emitters/0/intensity/1: true: input should be a valid number",
        ),
        (with_emitters(POINT | {"intensity": [1, 2]}), "/emitters/0/intensity/2 is missing"),
        # Keys.
        (a_scene(emiters=[]), "/emiters is not a known key; did you mean 'emitters'?"),
        (
            a_scene(xyz=1),
            "/xyz is not a known key; known: camera, emitters, film, format, medium, objects, version",
        ),
        (
            with_emitters({"type": "point", "position": [0, 0, 1], "intensitiy": [1, 1, 1]}),
            "/emitters/0/intensitiy is not a known key; did you mean 'intensity'? (and 1 more)",
        ),
        (
            with_emitters({"type": "area", "shape": SPHERE | {"radios": 2}, "radiance": [1, 1, 1]}),
            "/emitters/0/shape/radios is not a known key; did you mean 'radius'?",
        ),
        (
            a_scene(film=FILM | {"filter": {"type": "gaussian", "stdev": 1}}),
            "/film/filter/stdev is not a known key; did you mean 'stddev'?",
        ),
        (
            a_scene(**{"a/b~c": 1}),
            "/a~1b~0c is not a known key; known: camera, emitters, film, format, medium, objects, version",
        ),
        (
            a_scene(**{"a\n\u202eb": 1}),
            "/a\\n\\u202eb is not a known key; known: camera, emitters, film, format, medium, objects, version",
        ),
        # What is missing, or of another kind.
        ({"film": FILM}, "/camera is missing"),
        (with_emitters({"type": "area", "radiance": [1, 2, 3]}), "/emitters/0/shape is missing"),
        (a_scene(camera=5), "/camera: 5 is not an object"),
        (with_emitters(5), "/emitters/0: 5 is not an object"),
        (a_scene(objects={}), "/objects: {}: input should be a valid tuple"),
        ([], "/: [] is not an object"),
        # Types.
        (
            with_emitters({"type": "pont"}),
            "/emitters/0/type: \"pont\" is not a known type; did you mean 'point'?",
        ),
        (
            with_emitters({"type": ["area"]}),
            '/emitters/0/type: ["area"] is not a known type;'
            " known: area, point, spot, directional, constant, sky, image",
        ),
        (
            with_emitters({"position": [0, 0, 0]}),
            "/emitters/0/type is missing; known: area, point, spot, directional, constant, sky, image",
        ),
        (
            with_emitters({"type": "area", "shape": {"type": "torus"}, "radiance": [1, 1, 1]}),
            '/emitters/0/shape/type: "torus" is not a known type; known: rectangle, disk, sphere, mesh',
        ),
        (a_scene(version=2), "/version: 2: input should be 1"),
        (a_scene(format="obj"), "/format: \"obj\": input should be 'render-oracle-scene'"),
        # Ranges.
        (changed_camera(fov_x=180), "/camera/fov_x: 180: input should be less than 180"),
        (
            changed_camera(origin=[0, 0, 1e19]),
            "/camera/origin/2: 1e+19: input should be less than or equal to 1000000000000000000",
        ),
        (a_scene(film={"width": 0, "height": 3}), "/film/width: 0: input should be greater than or equal to 1"),
        (a_scene(film={"width": 4.0, "height": 3}), "/film/width: 4.0: input should be a valid integer"),
        (with_object(SPHERE | {"radius": 0}), "/objects/0/shape/radius: 0: input should be greater than 0"),
        # Conditions between fields.
        (
            changed_camera(target=[0, -3, 2]),
            '/camera: {"origin": [0, -3, 2], "target": [0, -3, 2], "fov_x": 40}'
            " origin and target are the same point; the camera looks nowhere",
        ),
        (
            changed_camera(target=[0, -3, 7]),
            '/camera: {"origin": [0, -3, 2], "target": [0, -3, 7], "fov_x": 40}'
            " up is parallel to the viewing direction; choose another up",
        ),
        (
            changed_camera(up=[0, 0, 0]),
            "/camera/up: [0, 0, 0] has no length; a direction needs at least one component that is not 0",
        ),
        (
            with_object({"type": "rectangle", "center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [1, 1, 0]}),
            "/objects/0/shape: half_u and half_v are not orthogonal; for other than right angles use a mesh",
        ),
        (
            with_object(TRIANGLE | {"triangles": [[0, 1, 2], [0, 1, 3]]}),
            "/objects/0/shape: triangles[1] = (0, 1, 3) names a vertex outside 0..2",
        ),
        (
            with_object(TRIANGLE | {"triangles": [[0, 1, -1]]}),
            "/objects/0/shape: triangles[0] = (0, 1, -1) names a vertex outside 0..2",
        ),
        (
            with_object(TRIANGLE | {"triangles": [[0, 1, 1]]}),
            "/objects/0/shape: triangles[0] = (0, 1, 1) has no area",
        ),
        (
            with_object(TRIANGLE | {"normals": [[0, 0, 1]]}),
            "/objects/0/shape: normals has 1 entries for 3 vertices; give one for each",
        ),
        (
            with_object(TRIANGLE | {"uv": [[0, 0], [1, 0], [0, 1, 2]]}),
            "/objects/0/shape/uv/2: [0, 1, 2]: tuple should have at most 2 items after validation, not 3",
        ),
        (
            with_object({"type": "instances", "mesh": TRIANGLE, "transforms": [FLAT]}),
            "/objects/0/shape/transforms/0: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 5]] has no inverse;"
            " it flattens what it maps (and 1 more)",
        ),
        (with_object({"type": "instances", "transforms": [FLAT]}), "/objects/0/shape/mesh is missing (and 2 more)"),
        (
            with_emitters({"type": "area", "radiance": [1, 1, 1], "shape": {"type": "instances"}}),
            '/emitters/0/shape/type: "instances" is not a known type; known: rectangle, disk, sphere, mesh',
        ),
        # Materials and textures.
        (
            with_object(SPHERE, {"type": "mirrror"}),
            "/objects/0/material/type: \"mirrror\" is not a known type; did you mean 'mirror'?",
        ),
        (
            with_object(SPHERE, {"type": "plastic", "reflectance": [0, 0, 0], "etta": 1.5}),
            "/objects/0/material/etta is not a known key; did you mean 'eta'? (and 1 more)",
        ),
        (with_object(SPHERE, {"type": 5}), "/objects/0/material/type: 5 is not a known type; known: " + KNOWN),
        (with_object(SPHERE, 5), "/objects/0/material: 5 is not an object"),
        (with_object(SPHERE, {"reflectance": 5}), "/objects/0/material/reflectance: 5: input should be a valid tuple"),
        (
            with_object(SPHERE, {"type": "rough_conductor", "eta": [1, 1, 1], "k": [1, 1, 1], "alpha": 0}),
            "/objects/0/material/alpha: 0: input should be greater than or equal to 0.0001",
        ),
        (
            with_object(SPHERE, {"type": "rough_dielectric", "eta": 1, "alpha": 0.1}),
            "/objects/0/material/eta: 1 bends no light; leave the surface out",
        ),
        (
            with_object(SPHERE, {"type": "two_sided", "front": {"type": "dielectric", "eta": 1.5}}),
            '/objects/0/material/front/type: "dielectric" is not a known type;'
            " known: diffuse, mirror, conductor, rough_conductor, phong, plastic, mix",
        ),
        (
            with_object(SPHERE, {"type": "two_sided", "front": GREY, "back": {
                "type": "mix", "first": GREY, "second": {"type": "dielectric", "eta": 1.5}, "weight": 0.5}}),
            "/objects/0/material: back/second lets light through; a surface with two sides must be opaque",
        ),
        (
            with_object(SPHERE, {"reflectance": CHECKER}),
            "/objects/0: material/reflectance is a texture, and a sphere has no place for it;"
            " use a rectangle or a mesh with uv",
        ),
        (
            with_object(TRIANGLE, {"type": "mix", "first": GREY, "second": {"reflectance": CHECKER}, "weight": 1}),
            "/objects/0: material/second/reflectance is a texture, and the mesh has no uv to place it;"
            " give uv, one pair for each vertex",
        ),
        (
            with_emitters({"type": "area", "radiance": CHECKER, "shape": SPHERE}),
            "/emitters/0: radiance is a texture, and a sphere has no place for it; use a rectangle or a mesh with uv",
        ),
        (
            with_object(SPHERE, {"reflectance": CHECKER | {"type": "chequer"}}),
            "/objects/0/material/reflectance/type: \"chequer\" is not a known type; did you mean 'checker'?",
        ),
        (
            with_object(SPHERE, {"reflectance": CHECKER | {"odd": [0, 0, 2]}}),
            '/objects/0/material/reflectance: {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 2]}'
            " odd has a component above 1; a surface reflects at most all light",
        ),
        (
            with_object(SPHERE, {"reflectance": {"type": "bitmap", "texels": [[[0, 0, 2]]]}}),
            '/objects/0/material/reflectance: {"type": "bitmap", "texels": [[[0, 0, 2]]]}'
            " texels go up to 2; a surface reflects at most all light, 1",
        ),
        (
            with_object(SPHERE, {"reflectance": {"type": "bitmap", "texels": [[[0, 0, 0]], [[0, -1, 0]]]}}),
            "/objects/0/material/reflectance/texels/1/0: [0, -1, 0] has a negative component;"
            " light is at least 0 in every channel (and 1 more)",
        ),
        (
            with_object(SPHERE, {"reflectance": {"type": "bitmap", "texels": [[[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]]}}),
            "/objects/0/material/reflectance/texels: [[[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]] row 1 has 2 texels"
            " and row 0 has 1; all must be as long",
        ),
        # Light from far away.
        (
            with_emitters({"type": "constant", "radiance": [1, 1, 1]}, POINT, {"type": "sky", "zenith": [1, 1, 1]}),
            "/emitters: has environments at 0 and 2; there can be one, or several constant ones",
        ),
        (
            with_emitters({"type": "image", "radiance": [[[1, 1, 1]]], "front": [1, 0, 1]}),
            '/emitters/0: {"type": "image", "radiance": [[[1, 1, 1]]], "front": [1, 0, 1]}'
            " up and front are not orthogonal; front is where the horizon meets column 0",
        ),
        (
            with_emitters(POINT, {"type": "constant", "radiance": [1, 1, 1]}) | {
                "medium": {"absorption": [0, 0, 0], "scattering": [1, 1, 1]}},
            '/medium: {"absorption": [0, 0, 0], "scattering": [1, 1, 1]}'
            " fills all space, so that no light of /emitters/1 arrives; leave one of them out",
        ),
        # Sensors.
        (a_scene(camera={"type": "fisheye"}), '/camera/type: "fisheye" is not a known type; known: ' + SENSORS),
        (
            a_scene(camera={"type": "irradiance_meter"}),
            "/camera/surface is missing",
        ),
        (
            a_scene(camera={"type": "orthographic", "origin": [0, 0, 0], "target": [0, 0, 1], "width": 1}),
            '/camera: {"type": "orthographic", "origin": [0, 0, 0], "target": [0, 0, 1], "width": 1}'
            " up is parallel to the viewing direction; choose another up",
        ),
        (
            with_object(TRIANGLE | {"triangles": [[0, 1, 2.0]]}),
            "/objects/0/shape/triangles/0/2: 2.0: input should be a valid integer (and 1 more)",
        ),
        (
            with_emitters({"type": "spot", "position": [0, 0, 0], "direction": [0, 0, 1], "intensity": [1, 1, 1],
                           "cutoff_angle": 20, "beam_width": 30}),
            "/emitters/0: beam_width 30.0 is not below cutoff_angle 20.0",
        ),
        # Files that are no scene at all.
        (b"", "line 1, column 1: not JSON: Expecting value"),
        (b'{"camera": ', "line 1, column 12: not JSON: Expecting value"),
        (b'{"camera": {}\n "film"}', "line 2, column 2: not JSON: Expecting ',' delimiter"),
        (b'{"film": 1, "film": 2}', 'an object names the key "film" twice'),
        (b'{"film": ' + b"9" * 5000 + b"}", "not JSON: a number has too many digits"),
        (b'{"name": "\xe9"}', "byte 10 is not UTF-8"),
        (b"\xff\xfe{", "byte 0 is not UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"camera":' * 100_000 + b"1" + b"}" * 100_000, "nested too deeply"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line_with_place_value_and_what_is_allowed(complaint, content, message):
    assert complaint(content) == message


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_not_finite_are_refused(complaint, number):
    text = json.dumps(with_emitters(POINT)).replace('"position": [0', f'"position": [{number}')
    assert complaint(text.encode()).startswith("/emitters/0/position/0: ")


@pytest.mark.parametrize("length", [10, 50, 100, 200])
def test_a_file_cut_short_is_not_json(complaint, length):
    text = json.dumps(with_emitters(POINT, POINT)).encode()
    assert "not JSON" in complaint(text[:length])


@pytest.mark.parametrize("depth", [10, 300, 900, 960, 980, 990, 1000, 3000])
def test_depth_of_nesting_is_no_crash(complaint, depth):
    # Each parser and printer on the way has its own limit.
    for opening, closing in ((b"[", b"]"), (b'{"a":', b"}")):
        complaint(b'{"film": {}, "camera": ' + opening * depth + b"1" + closing * depth + b"}")


def test_files_that_cannot_be_read_are_named(tmp_path):
    for path, reason in ((tmp_path / "none.json", "No such file or directory"), (tmp_path, "Is a directory")):
        with pytest.raises(InvalidFile) as caught:
            load_scene(path)
        assert str(caught.value) == f"{path}: {reason}"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_is_named(tmp_path):
    path = tmp_path / "scene.json"
    path.touch(mode=0o000)
    with pytest.raises(InvalidFile, match="Permission denied"):
        load_scene(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a = ", "not TOML: Invalid value (at end of document)"),
        (b"a = 1\na = 2\n", "not TOML: Cannot overwrite a value (at line 2, column 6)"),
        (b'a = "\xff"', "byte 5 is not UTF-8"),
        (b"a = " + b"9" * 5000, "not TOML: a number has too many digits"),
        (b"a = " + b"[" * 5000, "nested too deeply"),
    ],
)
def test_toml_is_refused_in_the_same_way(tmp_path, content, message):
    path = tmp_path / "rubric.toml"
    path.write_bytes(content)
    with pytest.raises(InvalidFile) as caught:
        read_toml(path)
    assert str(caught.value) == f"{path}: {message}"


def test_a_model_is_read_from_toml(tmp_path):
    (tmp_path / "film.toml").write_text("width = 4\nheight = 3\n", encoding="utf-8")
    assert load_toml(tmp_path / "film.toml", model.Film) == model.Film(width=4, height=3)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@st.composite
def spoiled_scenes(draw):
    """A valid scene with one value replaced, or one key added, anywhere."""
    scene = json.loads(
        FAMILIES[draw(st.sampled_from(["two-lights", "hard-shadow", "furnace"]))].member(0).model_dump_json()
    )
    place = scene
    while True:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        key = draw(st.sampled_from(keys))
        if not isinstance(place[key], dict | list) or not place[key] or draw(st.booleans()):
            break
        place = place[key]
    if isinstance(place, dict) and draw(st.booleans()):
        key = draw(st.text(string.printable, max_size=8))
    place[key] = draw(json_values)
    return scene


@quick
@given(spoiled_scenes())
def test_whatever_is_wrong_there_is_a_line_and_no_traceback(scene):
    try:
        validate(scene, Scene, "scene.json")
    except InvalidFile as error:
        message = str(error)
        assert message.startswith("scene.json: /")
        assert "\n" not in message
        assert len(message) < 500


# ------------------------------------------------------------------------------------------------- schema

SCHEMA_FILE = Path(__file__).parent.parent / "docs" / "schema" / "scene.schema.json"
SCHEMA = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
ANNOTATIONS = {"$defs", "$schema", "default", "description", "discriminator", "title"}
TYPES = {
    "null": lambda v: v is None,
    "boolean": lambda v: isinstance(v, bool),
    "object": lambda v: isinstance(v, dict),
    "array": lambda v: isinstance(v, list),
    "string": lambda v: isinstance(v, str),
    "number": lambda v: isinstance(v, int | float) and not isinstance(v, bool),
    "integer": lambda v: (isinstance(v, int) and not isinstance(v, bool)) or (isinstance(v, float) and v.is_integer()),
}


def conforms(value, schema):
    """Whether a value is valid by the words of JSON Schema that occur in ours; any other word is an error."""
    for word, meaning in schema.items():
        match word:
            case "$ref":
                valid = conforms(value, SCHEMA["$defs"][meaning.removeprefix("#/$defs/")])
            case "type":
                valid = TYPES[meaning](value)
            case "const":
                valid = value == meaning and not isinstance(value, bool)
            case "oneOf":
                valid = sum(conforms(value, option) for option in meaning) == 1
            case "anyOf":
                valid = any(conforms(value, option) for option in meaning)
            case "required":
                valid = not isinstance(value, dict) or set(meaning) <= set(value)
            case "properties":
                valid = not isinstance(value, dict) or all(
                    conforms(value[k], s) for k, s in meaning.items() if k in value
                )
            case "additionalProperties":
                assert meaning is False
                valid = not isinstance(value, dict) or set(value) <= set(schema["properties"])
            case "items":
                valid = not isinstance(value, list) or all(conforms(item, meaning) for item in value)
            case "prefixItems":
                valid = not isinstance(value, list) or all(map(conforms, value, meaning[: len(value)]))
            case "minItems":
                valid = not isinstance(value, list) or len(value) >= meaning
            case "maxItems":
                valid = not isinstance(value, list) or len(value) <= meaning
            case "minimum":
                valid = not TYPES["number"](value) or value >= meaning
            case "maximum":
                valid = not TYPES["number"](value) or value <= meaning
            case "exclusiveMinimum":
                valid = not TYPES["number"](value) or value > meaning
            case "exclusiveMaximum":
                valid = not TYPES["number"](value) or value < meaning
            case _:
                assert word in ANNOTATIONS, word
                valid = True
        if not valid:
            return False
    return True


def test_the_published_schema_is_that_of_the_model():
    published = {key: value for key, value in SCHEMA.items() if key != "$schema"}
    assert published == TypeAdapter(Scene).json_schema(), "run `make generate`"


@quick
@given(scenes)
def test_every_scene_conforms_to_the_schema(scene):
    assert conforms(json.loads(scene.model_dump_json()), SCHEMA)


@pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda family: family.name)
def test_every_exported_family_conforms_to_the_schema(family, tmp_path):
    path = export(family.member(1), "json", tmp_path)
    assert conforms(json.loads(path.read_text(encoding="utf-8")), SCHEMA)


@quick
@given(spoiled_scenes())
def test_what_the_schema_refuses_the_model_refuses(scene):
    # The model is stricter: it knows conditions between fields, and which numbers are written as integers.
    if not conforms(scene, SCHEMA):
        with pytest.raises(InvalidFile):
            validate(scene, Scene, "scene.json")


def accepted(scene):
    try:
        validate(scene, Scene, "scene.json")
    except InvalidFile:
        return False
    return True


@pytest.mark.parametrize(
    "scene",
    [
        a_scene(x=1),
        {"film": FILM},
        a_scene(version=2),
        changed_camera(fov_x=180),
        changed_camera(fov_x="40"),
        changed_camera(origin=[0, 0]),
        changed_camera(origin=[0, 0, 0, 0]),
        changed_camera(origin=[0, 0, True]),
        with_emitters({"type": "sun"}),
        with_emitters(POINT | {"intensity": [0, -1, 0]}),
        with_object(SPHERE, {"reflectance": [0.5, 1.25, 0.5]}),
        with_object(SPHERE | {"radius": 0}),
        with_object(TRIANGLE | {"triangles": []}),
        with_object(TRIANGLE | {"triangles": [[0, 1]]}),
        a_scene(film={"width": 0, "height": 3}),
        a_scene(film={"width": 16385, "height": 3}),
        with_object(SPHERE, {"type": "mirror", "reflectance": [2, 0, 0]}),
        with_object(SPHERE, {"type": "conductor", "eta": [1, 1, -1], "k": [1, 1, 1]}),
        with_object(SPHERE, {"type": "mix", "first": GREY, "second": {"type": "mix"}, "weight": 0.5}),
        with_object(SPHERE, {"type": "phong", "reflectance": [0, 0, 0], "exponent": -1}),
        with_object(SPHERE, {"eta": 1.5}),
        with_object(SPHERE, {"reflectance": {"type": "bitmap", "texels": []}}),
        with_object(SPHERE, {"reflectance": {"type": "bitmap", "texels": [[[0, 0, -1]]]}}),
        with_object(SPHERE, {"reflectance": CHECKER | {"columns": 0}}),
        with_emitters({"type": "area", "shape": SPHERE, "radiance": [1, 1, 1], "two_sided": 1}),
        a_scene(medium={"absorption": [0, 0, 0], "scattering": [0, 0, 0], "asymmetry": 1}),
        a_scene(camera={"type": "radiance_meter", "origin": [0, 0, 0]}),
    ],
)
def test_schema_and_model_agree_on_what_one_field_may_hold(scene):
    assert not accepted(scene)
    assert not conforms(scene, SCHEMA)
