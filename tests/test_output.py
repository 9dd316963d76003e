"""What a grading leaves on disk: complete or absent, and the same bytes every time."""

import json
import os
import re
import stat
import subprocess
import sys
from importlib import resources
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from graders.cli.grade import grade_and_write
from graders.errors import UsageError
from graders.grading import Job, expectation_of
from graders.output import replace, require_writable
from graders.rubric import CaseOfRubric, Rubric, ready_rubric
from graders.submission import load_submission
from oracle.statistics import Verdict

SMALL = Rubric(name="small", detectable_bias=0.05, cases=(CaseOfRubric(family="point-distance"),))
FILES = {"result.json", "report.html", "junit.xml", "images"}


def grade(folder, rubric, seed, jobs, out):
    require_writable(out)
    return grade_and_write([Job(*load_submission(folder))], rubric, seed, jobs, [out], "grading")[0]


def without_times(data):
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key != "times"}
    return [without_times(value) for value in data] if isinstance(data, list) else data


def fingerprint(out):
    """Everything in a result folder that must not depend on the clock."""
    junit = re.sub(r' (time|timestamp)="[^"]*"', "", (out / "junit.xml").read_text())
    images = {path.name: path.read_bytes() for path in (out / "images").iterdir()}
    return json.dumps(without_times(json.loads((out / "result.json").read_text()))), junit, images


def read_exr(path):
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels("float"))


# ---------------------------------------------------------------------------------------------- end to end


def test_the_example_student_is_right_and_the_same_with_one_job_and_with_four(tmp_path):
    example = Path(str(resources.files("graders"))) / "examples" / "student"
    quick = ready_rubric("quick")
    for jobs in (1, 4):
        result = grade(example, quick, 0, jobs, tmp_path / str(jobs))
        assert result.verdicts == {Verdict.RIGHT: 4}
        assert (result.points, result.possible) == (40, 40)
        assert {path.name for path in (tmp_path / str(jobs)).iterdir()} == FILES
    assert "Built target student" in result.submission.build_log
    once, again = (fingerprint(tmp_path / jobs) for jobs in ("1", "4"))
    assert once[0] == again[0]
    assert once[1] == again[1]
    assert set(once[2]) == set(again[2])
    assert len(once[2]) == 12
    assert [name for name in once[2] if once[2][name] != again[2][name]] == []


def test_another_seed_is_another_grading(submit_student, tmp_path):
    folder = submit_student()
    prints = []
    for seed in (0, 1, 0):
        result = grade(folder, SMALL, seed, 1, tmp_path / f"{len(prints)}")
        assert result.verdicts == {Verdict.RIGHT: 1}
        prints.append(fingerprint(tmp_path / f"{len(prints)}"))
    assert prints[0] == prints[2]
    for first, other in zip(prints[0][2].values(), prints[1][2].values(), strict=True):
        assert first != other
    assert prints[0][:2] != prints[1][:2]


def test_the_images_are_what_was_expected_and_seen(submit_student, tmp_path):
    grade(submit_student("--bug", "no-inverse-pi"), SMALL, 0, 1, tmp_path / "out")
    expected = expectation_of("point-distance", 0).radiance
    images = tmp_path / "out" / "images"
    np.testing.assert_array_equal(read_exr(images / "point-distance-expected.exr"), expected.astype(np.float32))
    observed = read_exr(images / "point-distance-observed.exr")
    assert observed.mean() / expected.mean() == pytest.approx(np.pi, rel=0.01)
    difference = read_exr(images / "point-distance-difference.exr")
    assert np.median(difference) == pytest.approx(np.pi - 1, rel=0.01)


def test_a_submission_that_renders_nothing_has_a_result_with_its_reason(submit_command, tmp_path):
    result = grade(submit_command("exits-with-3"), SMALL, 0, 1, tmp_path / "out")
    assert result.verdicts == {Verdict.UNGRADABLE: 1}
    assert (result.points, result.possible) == (0, 10)
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    written = json.loads((tmp_path / "out/result.json").read_text())
    assert written["cases"][0]["reason"] == "the renderer ended with exit code 3: no such mesh: teapot.ply"
    assert written["cases"][0]["images"]["observed"] is None
    assert [path.name for path in (tmp_path / "out/images").iterdir()] == ["point-distance-expected.exr"]


def test_results_go_into_folders_of_any_name(submit_command, tmp_path):
    out = tmp_path / "sp ace" / "ä 七 🫖"
    grade(submit_command("exits-silently"), SMALL, 0, 1, out)
    assert {path.name for path in out.iterdir()} == FILES


def test_a_second_grading_replaces_the_first(submit_student, submit_command, tmp_path):
    grade(submit_student(folder="right"), SMALL, 0, 1, tmp_path / "out")
    grade(submit_command("exits-silently"), SMALL, 0, 1, tmp_path / "out")
    assert json.loads((tmp_path / "out/result.json").read_text())["verdicts"] == {"ungradable": 1}
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES


# --------------------------------------------------------------------------------------- complete or absent


def test_a_file_is_replaced_whole_and_open_to_whom_the_umask_admits(tmp_path):
    path = tmp_path / "result.json"
    path.write_text("old")
    previous = os.umask(0o027)
    try:
        replace(path, b"new")
    finally:
        os.umask(previous)
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert [one.name for one in tmp_path.iterdir()] == ["result.json"]


def test_a_file_that_cannot_be_replaced_leaves_nothing_behind(tmp_path):
    (tmp_path / "result.json").mkdir()
    with pytest.raises(OSError, match="Is a directory"):
        replace(tmp_path / "result.json", b"new")
    assert [one.name for one in tmp_path.iterdir()] == ["result.json"]


FULL_DISK = """
import resource, sys
from pathlib import Path
from graders.cli import grade as cli
from graders.cli.grade import grade_and_write
from graders.errors import InfrastructureError
from graders.grading import Job
from graders.rubric import CaseOfRubric, Rubric
from graders.submission import load_submission
write = cli.write_grading
def write_on_a_full_disk(*arguments):
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2)
    return write(*arguments)
cli.write_grading = write_on_a_full_disk
rubric = Rubric(name="small", cases=(CaseOfRubric(family="point-distance"),))
out = Path(sys.argv[2])
out.mkdir()
try:
    grade_and_write([Job(*load_submission(Path(sys.argv[1])))], rubric, 0, 1, [out], "grading")
except InfrastructureError as error:
    print(error)
"""


@pytest.mark.parametrize("room", [0, 3000, 20_000])
def test_a_full_disk_is_the_fault_of_the_machine_and_leaves_no_half_file(submit_student, tmp_path, room):
    out = tmp_path / "out"
    result = subprocess.run(
        [sys.executable, "-c", FULL_DISK, submit_student(), out, str(room)], capture_output=True, text=True, check=False
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert re.fullmatch(r"[^\n]*: (writing failed|cannot be written): [^\n]*\n", result.stdout), result.stdout
    assert [path.name for path in out.iterdir()] == ["images"]
    for path in (out / "images").iterdir():
        assert oiio.ImageBuf(str(path)).get_pixels("float") is not None


@pytest.mark.parametrize("place", ["file/out", "/proc/out", "/dev/null", "x" * 300])
def test_a_folder_that_cannot_be_written_is_refused_before_any_work(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match=r"cannot write there: .*; choose another folder with --out$"):
        require_writable(Path(place))


def test_a_folder_whose_name_is_no_text_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"its name is not UTF-8; choose another folder with --out$"):
        require_writable(tmp_path / os.fsdecode(b"\xff"))


def test_looking_whether_a_folder_can_be_written_leaves_nothing_in_it(tmp_path):
    require_writable(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []
