"""The demo, as a newcomer runs it: right renderers are right, and every bug is caught."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from graders.cli.demo import BUGS
from reference_scenes.families import FAMILIES

ORACLE = Path(sys.executable).with_name("oracle")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo")
    done = subprocess.run(
        [ORACLE, "demo", "--seed", "1", "--out", out], capture_output=True, text=True, timeout=600, check=False
    )
    return out, done


def result(out: Path, name: str) -> dict:
    return json.loads((out / name / "result.json").read_text(encoding="utf-8"))


def test_the_demo_succeeds_and_prints_its_report_last(demo):
    out, done = demo
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == str(out / "report.html")
    assert "\x1b" not in done.stdout


@pytest.mark.parametrize("name", ["mitsuba3", "student"])
def test_a_right_renderer_is_right_in_every_case(demo, name):
    found = result(demo[0], name)
    assert found["verdicts"] == {"right": len(FAMILIES)}
    assert found["points"] == found["possible"] == 100


@pytest.mark.parametrize("bug", BUGS)
def test_a_bug_is_wrong_somewhere_and_nothing_else_than_right_or_wrong(demo, bug):
    verdicts = result(demo[0], f"bugs/{bug}")["verdicts"]
    assert verdicts.get("wrong", 0) >= 1
    assert set(verdicts) <= {"right", "wrong"}


@pytest.mark.parametrize(
    ("bug", "families"),
    [
        ("no-visibility", {"hard-shadow"}),
        ("hemisphere-pdf", {"furnace"}),
        ("no-light-area", {"rectangle-overhead", "rectangle-horizon", "disk", "sphere", "two-lights"}),
    ],
)
def test_a_bug_is_wrong_just_where_it_shows(demo, bug, families):
    cases = result(demo[0], f"bugs/{bug}")["cases"]
    assert {case["family"] for case in cases if case["verdict"] == "wrong"} == families


def test_the_overview_links_to_every_report(demo):
    out, _ = demo
    links = re.findall(r'href="([^"]+)"', (out / "report.html").read_text(encoding="utf-8"))
    assert len(links) == 2 + len(BUGS)
    for link in links:
        assert (out / link).is_file()
