"""The command `oracle` as people and CI jobs run it: in a process of its own, with everything that can go wrong."""

import json
import os
import pty
import re
import select
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from reference_scenes.families import FAMILIES

ORACLE = Path(sys.executable).with_name("oracle")
COMMANDS = [
    (), ("demo",), ("grade",), ("judge",), ("scenes",), ("scenes", "list"), ("scenes", "show"), ("scenes", "export"),
    ("scenes", "validate"), ("doctor",),
]  # fmt: skip
RUBRIC = """
name = "small"
detectable_bias = 0.05
timeout = {timeout}

[[cases]]
family = "point-distance"

[[cases]]
family = "sphere"
spp = 4
"""


def environment(**more):
    kept = {name: os.environ[name] for name in ("PATH", "HOME", "TMPDIR", "LD_LIBRARY_PATH") if name in os.environ}
    return {**kept, "LANG": "C.UTF-8", "COLUMNS": "80", **more}


def oracle(*arguments, cwd=None, **more):
    """Run a command to its end; nothing that it prints may be an escape or a traceback."""
    result = subprocess.run(
        [ORACLE, *arguments], cwd=cwd, env=environment(**more), capture_output=True, timeout=100, check=False
    )
    result.stdout, result.stderr = result.stdout.decode("utf-8"), result.stderr.decode("utf-8")
    assert "Traceback" not in result.stderr + result.stdout, result.stderr
    assert "\x1b" not in result.stdout + result.stderr
    return result


def assert_refused(result, code, message):
    """Nothing but one line on standard error."""
    assert result.stdout == ""
    assert result.stderr.startswith("oracle: ")
    assert result.stderr.count("\n") == 1
    assert result.stderr.endswith("\n")
    assert message in result.stderr
    assert result.returncode == code


@pytest.fixture
def rubric(tmp_path):
    def make(timeout=20, text=RUBRIC):
        path = tmp_path / "rubric.toml"
        path.write_text(text.replace("{timeout}", str(timeout)))
        return path

    return make


@pytest.fixture(scope="module")
def images(student, tmp_path_factory):
    """Four right images of a scene that the command line exported."""
    folder = tmp_path_factory.mktemp("images")
    result = oracle("scenes", "export", "sphere", "--format", "json", "-o", "scenes", "--seed", "5", cwd=folder)
    assert (result.returncode, result.stdout, result.stderr) == (0, "scenes/sphere/scene.json\n", "")
    paths = [folder / f"sphere-{seed}.pfm" for seed in range(4)]
    for seed, path in enumerate(paths):
        command = [student, "scenes/sphere/scene.json", path, "--spp", "64", "--seed", str(seed)]
        subprocess.run(command, cwd=folder, check=True)
    return paths


# -------------------------------------------------------------------------------------------------- help


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(("oracle", *command)))
def test_help_fits_into_80_columns_and_ends_every_sentence(command):
    for flag in ("--help", "-h"):
        result = oracle(*command, flag)
        assert (result.returncode, result.stderr) == (0, "")
        assert result.stdout.startswith(f"Usage: {' '.join(('oracle', *command))} ")
        assert max(map(len, result.stdout.splitlines())) <= 80
        assert "..." not in re.sub(r"\[?[A-Z]+\]?\.\.\.", "", result.stdout)  # NAMES... in the usage line only


def test_help_answers_at_once_and_names_the_exit_codes():
    times = []
    for _ in range(3):
        start = time.monotonic()
        result = oracle("--help")
        times.append(time.monotonic() - start)
    assert min(times) < 1.5, times  # 0.1 s on two idle cores
    words = " ".join(result.stdout.split())
    assert (
        "Exit codes: 0 all is right; 1 graded, and something is not right; 2 the command line or one of its files is "
        "wrong; 3 the machine failed, not the submission; 130 interrupted." in words
    )


def test_without_a_command_help_is_shown_as_an_error():
    result = oracle()
    assert result.returncode == 2
    assert "Usage: oracle" in result.stdout + result.stderr


def test_the_version_is_told():
    result = oracle("--version")
    assert (result.returncode, result.stderr) == (0, "")
    assert re.fullmatch(r"oracle, version \d+\.\d+\.\d+\n", result.stdout)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["grad"], "No such command 'grad'"),
        (["grade"], "Missing argument 'PATH'"),
        (["grade", ".", "--jobs", "0"], "0 is not in the range x>=1"),
        (["grade", ".", "--seed", "-1"], "-1 is not in the range x>=0"),
        (["grade", ".", "--sede", "1"], "No such option"),
        (["judge", "a.exr"], "Missing option '--scene'"),
        (["judge", "a.exr", "--scene", "disk", "--tolerance", "0"], "0.0 is not in the range"),
        (["judge", "a.exr", "--scene", "disk", "--tolerance", "nan"], "--tolerance nan is no number"),
        (["judge", "a.exr", "--scene", "disk", "--encoding", "gamma"], "'gamma' is not one of 'linear', 'srgb'"),
        (["judge", "a.exr", "--scene", "disc"], "there is no scene 'disc'; did you mean 'disk'?"),
        (["scenes", "show", "sphre"], "there is no scene 'sphre'; did you mean 'sphere'?"),
        (["scenes", "show", "teapot"], "there is no scene 'teapot'; known: point-distance, "),
        (["scenes", "export", "disk", "-o", "x", "--format", "jsn"], "there is no format 'jsn'; did you mean 'json'?"),
        (["scenes", "export", "dsk", "-o", "x", "--format", "json"], "there is no scene 'dsk'; did you mean 'disk'?"),
        (["scenes", "export", "-o", "x", "--format", "json"], "give names of scenes, or --all for every one"),
        (["scenes", "export", "disk", "--all", "-o", "x", "--format", "json"], "give names of scenes, or --all"),
        (["scenes", "export", "disk", "--format", "json"], "Missing option '-o' / '--out'"),
        (["scenes", "export", "disk", "-o", "/dev/null/x", "--format", "json"], "/dev/null/x: cannot write there: "),
        (["scenes", "validate"], "Missing argument 'FILES...'"),
    ],
    ids=" ".join,
)
def test_a_slip_on_the_command_line_is_one_line_and_code_2(tmp_path, arguments, message):
    assert_refused(oracle(*arguments, cwd=tmp_path), 2, message)
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------------------ scenes


def test_scenes_are_listed_for_people_and_for_programs():
    table = oracle("scenes", "list")
    assert (table.returncode, table.stderr) == (0, "")
    assert [line.split("\t")[0] for line in table.stdout.splitlines()] == ["name", *FAMILIES]
    listed = json.loads(oracle("scenes", "list", "--json").stdout)
    assert [one["name"] for one in listed] == list(FAMILIES)
    assert all(one["formula"] and one["source"] and one["law"] for one in listed)


def test_a_scene_is_shown_with_the_parameters_that_the_seed_draws():
    shown = oracle("scenes", "show", "sphere", "--seed", "3")
    assert (shown.returncode, shown.stderr) == (0, "")
    assert "formula:" in shown.stdout
    document = json.loads(oracle("scenes", "show", "sphere", "--seed", "3", "--json").stdout)
    assert (document["name"], document["seed"]) == ("sphere", 3)
    assert document["scene"] == FAMILIES["sphere"].member(3).model_dump(mode="json")
    for key, value in document["parameters"].items():
        assert f"{key}\t{json.dumps(value)}" in shown.stdout


@pytest.mark.parametrize(("name", "file"), [("json", "scene.json"), ("mitsuba3", "scene.xml")])
def test_all_scenes_are_exported_into_folders_of_their_own(tmp_path, name, file):
    result = oracle("scenes", "export", "--all", "--format", name, "-o", "a b", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.splitlines() == [f"a b/{family}/{file}" for family in FAMILIES]
    assert all((tmp_path / line).stat().st_size for line in result.stdout.splitlines())


def test_exported_scenes_are_valid(images):
    file = images[0].parent / "scenes/sphere/scene.json"
    result = oracle("scenes", "validate", file)
    assert (result.returncode, result.stdout, result.stderr) == (0, f"{file}: valid\n", "")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"radius": ', '"radius": -', "/emitters/0/shape/radius: -"),
        ('"objects"', '"objcts"', "/objcts is not a known key; did you mean 'objects'?"),
        ('"version": 1', '"version": 2', "/version: 2: input should be 1"),
        ("{\n", "", "line 1, column "),
        ('"version": 1', f'"version": {"9" * 5000}', ""),
        ('"version": 1', f'"version": {"[" * 50000}', "nested too deeply"),
    ],
    ids=["negative", "misspelt", "version", "no JSON", "many digits", "deep"],
)
def test_a_bad_scene_is_one_line_and_code_1(tmp_path, old, new, message):
    text = json.dumps(FAMILIES["sphere"].member(5).model_dump(mode="json"), indent=1)
    assert old in text
    (tmp_path / "bad.json").write_text(text.replace(old, new, 1))
    result = oracle("scenes", "validate", "bad.json", cwd=tmp_path)
    assert_refused(result, 1, f"bad.json: {message}")
    assert len(result.stderr) < 300
    (document,) = json.loads(oracle("scenes", "validate", "bad.json", "--json", cwd=tmp_path).stdout)
    assert (document["file"], document["valid"]) == ("bad.json", False)
    assert document["error"].startswith("bad.json: ")


def test_good_and_bad_scenes_are_told_apart(tmp_path, images):
    good = str(images[0].parent / "scenes/sphere/scene.json")
    result = oracle("scenes", "validate", good, "missing.json", good, cwd=tmp_path)
    assert result.returncode == 1
    assert result.stdout == f"{good}: valid\n" * 2
    assert result.stderr == "oracle: missing.json: No such file or directory\n"


# ------------------------------------------------------------------------------------------------- judge


def test_right_images_are_right(images):
    result = oracle("judge", *images, "--scene", "sphere", "--seed", "5")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("right: being off by 2 % is ruled out with 99 % confidence in each of ")


def test_images_of_another_seed_are_wrong(images):
    result = oracle("judge", *images, "--scene", "sphere", "--seed", "6")
    assert (result.returncode, result.stderr) == (1, "")
    assert result.stdout.startswith("wrong: ")


def test_one_image_is_judged_and_its_assumptions_are_told(images):
    result = oracle("judge", images[0], "--scene", "sphere", "--seed", "5")
    assert result.returncode in (0, 1)
    assert result.stderr == ""
    assert not result.stdout.startswith("wrong")
    assert "\nassumed: " in result.stdout


def test_a_verdict_is_json_on_request(images):
    document = json.loads(oracle("judge", *images, "--scene", "sphere", "--seed", "5", "--json").stdout)
    assert document["verdict"] == "right"
    assert document["evidence"]["images"] == 4
    assert document["evidence"]["ratios"]["all"]["estimate"] == pytest.approx(1, abs=0.01)


def test_missing_images_and_unknown_formats_are_code_2(tmp_path, images):
    judge = ("judge", "--scene", "sphere", "--seed", "5")
    assert_refused(oracle(*judge, images[0], "missing.exr", cwd=tmp_path), 2, "missing.exr: no such file")
    (tmp_path / "image.jpg").touch()
    assert_refused(
        oracle(*judge, "image.jpg", cwd=tmp_path), 2, "image.jpg: format 'jpg' is none of exr, pfm, hdr, png"
    )
    (tmp_path / "image").touch()
    assert_refused(oracle(*judge, "image", cwd=tmp_path), 2, "image: format '' is none of exr, pfm, hdr, png")


def test_png_without_its_encoding_is_code_2(tmp_path, images):
    (tmp_path / "image.png").touch()
    judge = ("judge", "--scene", "sphere", "image.png", images[0])
    assert_refused(oracle(*judge, cwd=tmp_path), 2, "image.png: --encoding srgb is for PNG, which needs it")
    assert_refused(oracle(*judge, "--encoding", "srgb", cwd=tmp_path), 2, "0.pfm: --encoding srgb is for PNG")


def test_a_broken_image_is_one_line_and_code_1(tmp_path, images):
    content = images[0].read_bytes()
    for damaged, message in [
        (content[:-1000], "broken or truncated colour PFM file"),
        (content.replace(b"96 64", b"64 96"), "is 64 x 96 pixels, the scene's film has 96 x 64"),
        (content[:-4] + np.float32(np.nan).tobytes(), "1 NaN of 6144 pixels, first at x = 95, y = 0"),
    ]:
        (tmp_path / "bad.pfm").write_bytes(damaged)
        judge = ("judge", images[1], "bad.pfm", "--scene", "sphere", "--seed", "5")
        assert_refused(oracle(*judge, cwd=tmp_path), 1, f"ungradable: bad.pfm: {message}")
    document = json.loads(oracle(*judge, "--json", cwd=tmp_path).stdout)
    assert document["verdict"] == "ungradable"
    assert document["reason"].startswith(f"bad.pfm: {message}")


# ------------------------------------------------------------------------------------------------- grade


def test_a_right_submission_is_code_0_and_can_be_graded_twice(tmp_path, submit_student, rubric):
    for _ in range(2):
        result = oracle("grade", submit_student(), "--rubric", rubric(), "--out", "out", cwd=tmp_path)
        assert (result.returncode, result.stderr) == (0, "")
        table = [line.split("\t") for line in result.stdout.splitlines()[:3]]
        assert [row[:2] for row in table] == [["case", "verdict"], ["point-distance", "right"], ["sphere", "right"]]
        assert "a test: 20 of 20 points" in result.stdout
        assert result.stdout.endswith(f"{tmp_path / 'out' / 'report.html'}\n")
        assert json.loads((tmp_path / "out/result.json").read_text())["points"] == 20


def test_a_wrong_submission_is_code_1_in_json_as_well(tmp_path, submit_student, rubric):
    folder = submit_student("--bug", "extra-pi")
    result = oracle("grade", folder, "--rubric", rubric(), "--out", "out", "--json", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (1, "")
    document = json.loads(result.stdout)
    assert document == json.loads((tmp_path / "out/result.json").read_text())
    assert document["verdicts"] == {"wrong": 2}


def test_a_renderer_that_hangs_is_code_1_and_its_limit_is_told(tmp_path, submit_command, rubric):
    start = time.monotonic()
    result = oracle("grade", submit_command("hangs"), "--rubric", rubric(timeout=0.5), "--out", "out", cwd=tmp_path)
    assert time.monotonic() - start < 15
    assert (result.returncode, result.stderr) == (1, "")
    assert "did not finish within 0.5 s and was stopped" in result.stdout


def test_paths_with_spaces_and_any_letters_work_in_the_c_locale(tmp_path, submit_student, rubric):
    folder, out = submit_student(folder="meine Übung 七"), "aus gabe ä 🫖"
    result = oracle("grade", folder, "--rubric", rubric(), "--out", out, cwd=tmp_path, LC_ALL="C")
    assert (result.returncode, result.stderr) == (0, "")
    assert (tmp_path / out / "result.json").exists()
    # Not even a locale that knows no letters gets a traceback.
    result = oracle("scenes", "show", "furnace", LC_ALL="C", PYTHONCOERCECLOCALE="0", PYTHONUTF8="0")
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize("out", ["file/out", "/proc/out", os.fsdecode(b"\xff")], ids=["file", "proc", "no text"])
def test_results_that_cannot_be_written_are_code_2_before_any_work(tmp_path, submit_command, rubric, out):
    (tmp_path / "file").touch()
    folder = submit_command("leaves-a-child")
    result = oracle("grade", folder, "--rubric", rubric(), "--out", out, cwd=tmp_path)
    assert_refused(result, 2, "choose another folder with --out")
    assert not (folder / "pids").exists()


def test_bad_files_are_code_2(tmp_path, submit, rubric):
    grade = ("grade", "submission", "--rubric", "rubric.toml", "--out", "out")
    assert_refused(oracle(*grade, cwd=tmp_path), 2, "submission: No such file or directory")
    folder = submit('name = "a"\nkind = "command"\n"\\u001b[31mred" = 1\n')
    assert_refused(oracle(*grade, cwd=tmp_path), 2, "is not a known key; known: ")
    (folder / "submission.toml").write_text('name = "a"\nkind = ["command"]\n')
    assert_refused(oracle(*grade, cwd=tmp_path), 2, "submission.toml: /kind: ['command'] is no kind of submission")
    submit('name = "a"\nkind = "python"\n[render]\ncallable = "a:b"\noutput = "exr"\n')
    assert_refused(oracle(*grade, cwd=tmp_path), 2, "rubric.toml: No such file or directory")
    rubric(text=RUBRIC.replace('family = "sphere"', 'family = "sfere"'))
    assert_refused(oracle(*grade, cwd=tmp_path), 2, 'rubric.toml: /cases/1/family: "sfere" is no family of scenes; did')
    assert not (tmp_path / "out").exists()


def test_a_machine_without_room_is_code_3(tmp_path, submit_student, rubric):
    command = shlex.join([str(ORACLE), "grade", str(submit_student()), "--rubric", str(rubric()), "--out", "out"])
    for fault, message in [
        ("ulimit -f 8", ": cannot be written: "),
        ("export TMPDIR=/nowhere; ulimit -f 0", "this machine fails: "),
    ]:
        result = subprocess.run(
            ["bash", "-c", f"{fault}; exec {command}"], cwd=tmp_path, env=environment(), capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert_refused(result, 3, message)
        assert not (tmp_path / "out/result.json").exists()


# ----------------------------------------------------------------------------------- streams and signals


def run_shell(script, cwd=None):
    """Run a line of bash in which $O is oracle; its exit code is that of the first failing command."""
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {script}"], cwd=cwd, env=environment(O=str(ORACLE)), capture_output=True,
        text=True, timeout=60, check=False,
    )  # fmt: skip


def test_a_reader_that_has_had_enough_is_no_error(tmp_path, submit_student, rubric):
    result = run_shell("$O scenes show furnace --json | head -1")
    assert (result.returncode, result.stdout, result.stderr) == (0, "{\n", "")
    result = run_shell("$O scenes list | true")
    assert (result.returncode, result.stderr) == (0, "")
    result = run_shell("$O --help | true")
    assert (result.returncode, result.stderr) == (0, "")


def test_the_exit_code_tells_the_verdict_even_if_nobody_reads(tmp_path, submit_student, rubric):
    command = shlex.join(["grade", str(submit_student("--bug", "extra-pi")), "--rubric", str(rubric()), "--out", "out"])
    result = run_shell(f"$O {command} | true", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (1, "")
    assert (tmp_path / "out/result.json").exists()


def test_closed_streams_are_no_error():
    result = run_shell("$O scenes list <&- >&- 2>&-")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    result = run_shell("$O scenes show nothing 2>&-")
    assert (result.returncode, result.stdout, result.stderr) == (2, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_output_that_cannot_be_written_is_one_line_and_code_3():
    result = run_shell("$O scenes list >/dev/full")
    assert_refused(result, 3, "No space left on device")


def on_a_terminal(*arguments, **more):
    """What a command writes to a terminal."""
    terminal, inside = pty.openpty()
    with subprocess.Popen(
        [ORACLE, *arguments], stdin=inside, stdout=inside, stderr=inside, env=environment(TERM="xterm-256color", **more)
    ) as process:
        os.close(inside)
        content = b""
        while select.select([terminal], [], [], 60)[0]:
            try:
                chunk = os.read(terminal, 65536)
            except OSError:
                break
            if not chunk:
                break
            content += chunk
    os.close(terminal)
    assert process.returncode == 0
    return content.decode()


def test_a_terminal_gets_colours_unless_it_wants_none():
    assert "\x1b[" in on_a_terminal("scenes", "list")
    plain = on_a_terminal("scenes", "list", NO_COLOR="1")
    assert "\x1b" not in plain
    assert "point-distance" in plain


def is_alive(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.parametrize(
    ("wish", "stage"),
    [(signal.SIGINT, "render"), (signal.SIGINT, "build"), (signal.SIGTERM, "render"), (signal.SIGHUP, "build")],
)
def test_an_interrupted_grading_leaves_nothing_behind(tmp_path, submit, submit_command, rubric, wish, stage):
    folder = submit_command("hangs-with-children")
    if stage == "build":
        submit(
            'name = "a"\nkind = "command"\n'
            '[build]\ncommands = [["{source}/misbehaving.sh", "hangs-with-children", "x"]]\n'
            '[render]\ncommand = ["x", "{scene}", "{output}"]\noutput = "exr"\n'
        )
    (tmp_path / "tmp").mkdir()
    # Jobs in the background hand down that they ignore interruptions.
    heed = {"preexec_fn": lambda: signal.signal(wish, signal.SIG_DFL)}
    with subprocess.Popen(
        [ORACLE, "grade", folder, "--rubric", rubric(timeout=60), "--out", "out", "--jobs", "1"],
        cwd=tmp_path, env=environment(TMPDIR=str(tmp_path / "tmp")), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, **heed,
    ) as process:  # fmt: skip
        pids = folder / "pids"
        deadline = time.monotonic() + 30
        while not pids.exists() or len(pids.read_text().split()) < 5:
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(wish)
        start = time.monotonic()
        output, errors = process.communicate(timeout=30)
    assert time.monotonic() - start < 10
    assert (process.returncode, output, errors.strip()) == (130, "", "oracle: interrupted")
    deadline = time.monotonic() + 5
    while any(map(is_alive, pids.read_text().split())):
        assert time.monotonic() < deadline, "still alive"
        time.sleep(0.02)
    assert list((tmp_path / "out").iterdir()) == []
    assert list((tmp_path / "tmp").iterdir()) == []


# ------------------------------------------------------------------------------------------------ doctor


def test_the_doctor_speaks_to_people_and_to_programs():
    people, programs = oracle("doctor"), oracle("doctor", "--json")
    assert (people.returncode, people.stderr, programs.returncode, programs.stderr) == (0, "", 0, "")
    checks = json.loads(programs.stdout)
    assert {check["name"] for check in checks} > {"Python", "C++ compiler", "OpenImageIO"}
    for check in checks:
        assert check["name"] in people.stdout


def test_the_programs_of_these_tests_can_run():
    assert shutil.which("bash")
    assert ORACLE.exists()
