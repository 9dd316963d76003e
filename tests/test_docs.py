"""The documentation says what the code does."""

from __future__ import annotations

import doctest
import importlib.util
import json
import re
from pathlib import Path

import pytest

from graders.cli.commands import oracle
from graders.submission import CommandSubmission
from reference_scenes.loading import load_scene, validate
from reference_scenes.model import Scene

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])


def generated() -> dict[Path, str]:
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.generated()


@pytest.mark.parametrize("path", generated(), ids=lambda path: path.name)
def test_generated_files_are_up_to_date(path):
    assert path.read_text(encoding="utf-8") == generated()[path], "run `make generate`"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_example_scene_is_valid(tmp_path):
    example = re.search(
        r"```json\n(.*?)```", (ROOT / "docs" / "scene-format.md").read_text(encoding="utf-8"), re.DOTALL
    )
    (tmp_path / "scene.json").write_text(example[1], encoding="utf-8")
    assert isinstance(load_scene(tmp_path / "scene.json"), Scene)


def test_the_readme_s_submission_is_valid():
    import tomllib

    example = re.search(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    validate(tomllib.loads(example[1]), CommandSubmission, "README.md")


@pytest.mark.parametrize("page", ["light.md", "tracer.md"])
def test_what_is_typed_into_python_gives_what_the_page_says(page):
    finished = doctest.testfile(str(ROOT / "docs" / page), module_relative=False)
    assert finished.attempted >= 3
    assert not finished.failed


def test_every_command_is_documented():
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    for name in oracle.commands:
        assert f"`oracle {name}" in page


def test_schemas_describe_every_field():
    scene = json.loads((ROOT / "docs" / "schema" / "scene.schema.json").read_text(encoding="utf-8"))
    assert set(Scene.model_fields) == set(scene["properties"])
