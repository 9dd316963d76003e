"""Rubrics as courses write them, and the slips they make."""

import pytest

from graders.rubric import load_rubric, ready_rubric
from oracle.statistics import MIN_IMAGES
from reference_scenes.families import FAMILIES
from reference_scenes.loading import InvalidFile

RUBRIC = """
name = "week 3"
tolerance = 0.01

[[cases]]
family = "disk"
points = 5

[[cases]]
family = "sphere"
spp = 8
tolerance = 0.02
"""


def complaint(folder, text):
    path = folder / "rubric.toml"
    path.write_text(text)
    with pytest.raises(InvalidFile) as caught:
        load_rubric(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


def test_the_rubrics_that_come_along_are_right():
    assert [case.family for case in ready_rubric("first-light").cases] == list(FAMILIES)
    quick = ready_rubric("quick")
    assert len(quick.cases) == 4
    assert quick.max_images >= MIN_IMAGES


def test_what_a_rubric_leaves_out_has_a_default(tmp_path):
    (tmp_path / "rubric.toml").write_text("detectable_bias = 0.05" + RUBRIC)
    rubric = load_rubric(tmp_path / "rubric.toml")
    assert (rubric.error_budget, rubric.max_images, rubric.timeout) == (1e-4, 16, 60)
    disk, sphere = rubric.cases
    assert (disk.points, disk.spp, disk.tolerance) == (5, None, None)
    assert (sphere.points, sphere.spp, sphere.tolerance) == (10, 8, 0.02)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"disk"', '"dsik"', "/cases/0/family: \"dsik\" is no family of scenes; did you mean 'disk'?"),
        ('"disk"', '"teapot"', f'/cases/0/family: "teapot" is no family of scenes; known: {", ".join(FAMILIES)}'),
        ('"sphere"', '"disk"', "/cases: names disk more than once"),
        ('family = "disk"\n', "", "/cases/0/family is missing"),
        ("points = 5", "point = 5", "/cases/0/point is not a known key; did you mean 'points'?"),
        ("points = 5", "points = -1", "/cases/0/points: -1: input should be greater than or equal to 0"),
        ("points = 5", "points = nan", "/cases/0/points: nan: input should be less than or equal to 1000000"),
        (
            "points = 5",
            'points = "five"',
            '/cases/0/points: "five": input should be a valid number, unable to parse string as a number',
        ),
        ("spp = 8", "spp = 0", "/cases/1/spp: 0: input should be greater than or equal to 1"),
        (
            "spp = 8",
            "spp = 2.5",
            "/cases/1/spp: 2.5: input should be a valid integer, got a number with a fractional part",
        ),
        ("tolerance = 0.01", "tollerance = 0.01", "/tollerance is not a known key; did you mean 'tolerance'?"),
        ("tolerance = 0.01", "tolerance = 0", "/tolerance: 0: input should be greater than 0"),
        ("tolerance = 0.01", "tolerance = nan", "/tolerance: nan: input should be less than or equal to 0.5"),
        ("tolerance = 0.01", "error_budget = 0.5", "/error_budget: 0.5: input should be less than or equal to 0.1"),
        (
            "tolerance = 0.01",
            "max_images = 3",
            f"/max_images: 3: input should be greater than or equal to {MIN_IMAGES}",
        ),
        ("tolerance = 0.01", "timeout = inf", "/timeout: inf: input should be less than or equal to 3600"),
        ('name = "week 3"', "", "/name is missing"),
    ],
)
def test_a_slip_is_named_with_its_place_its_value_and_a_cure(tmp_path, old, new, message):
    assert RUBRIC.count(old) == 1
    # Its two cases would contradict the default.
    text = "detectable_bias = 0.05" + RUBRIC.replace(old, new)
    assert complaint(tmp_path, text) == message


@pytest.mark.parametrize("bias", [0.02, 0.01])
def test_the_bias_to_be_found_must_exceed_every_tolerance(tmp_path, bias):
    message = complaint(tmp_path, f"detectable_bias = {bias}" + RUBRIC)
    assert message == f"/: detectable_bias {bias} must exceed every tolerance, here 0.02"


def test_a_rubric_needs_a_case(tmp_path):
    assert complaint(tmp_path, 'name = "empty"\ncases = []\n') == "/cases: [] is empty; at least one case is needed"
    assert complaint(tmp_path, 'name = "empty"\n') == "/cases is missing"


def test_no_toml_and_no_file_are_named(tmp_path):
    assert complaint(tmp_path, "name: week 3").startswith("not TOML: ")
    assert complaint(tmp_path, f"spp = {'9' * 5000}").startswith("not TOML: ")
    with pytest.raises(InvalidFile) as caught:
        load_rubric(tmp_path / "nowhere.toml")
    assert str(caught.value) == f"{tmp_path / 'nowhere.toml'}: No such file or directory"
