"""Submissions that render, and that fail in every way: graded with real processes, case by case."""

import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from graders.grading import case_of, grade_case
from graders.rendering import build, renderer
from graders.rubric import CaseOfRubric, Rubric
from graders.submission import load_submission
from oracle.statistics import Verdict
from reference_scenes.export import export
from reference_scenes.families import FAMILIES

FAMILY = "point-distance"


def grade(folder, timeout=20.0, max_images=16, family=FAMILY, **case):
    """The result of one case of a submission, from its folder."""
    wanted = CaseOfRubric(family=family, **case)
    rubric = Rubric(name="a test", detectable_bias=0.05, cases=(wanted,))
    work = folder / "work"
    work.mkdir()
    built = build(*load_submission(folder), work)
    result = grade_case(case_of(wanted, rubric, 0), built, max_images, timeout).result
    assert "\n" not in result.reason
    assert result.reason.isprintable()
    assert result.log.replace("\n", "").replace("\t", "").isprintable()
    assert len(result.reason) < 600
    return result


def assert_ungradable(result, reason):
    assert (result.verdict, result.reason) == (Verdict.UNGRADABLE, reason)
    assert (result.points, result.possible) == (0, 10)


def assert_gone(file):
    """The processes whose ids the file lists have ended, or are zombies that nobody has reaped yet."""
    deadline = time.monotonic() + 5
    for number in file.read_text().split():
        state = Path(f"/proc/{number}/stat")
        while state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z":
            assert time.monotonic() < deadline, "still alive"
            time.sleep(0.02)


# ------------------------------------------------------------------------------------------------- programs


def test_a_right_program_is_right(submit_student):
    result = grade(submit_student())
    assert (result.verdict, result.points, result.possible) == (Verdict.RIGHT, 10, 10)
    assert result.evidence.distinct_images == result.evidence.images


def test_a_wrong_program_is_wrong(submit_student):
    result = grade(submit_student("--bug", "inverse-distance"))
    assert (result.verdict, result.points, result.possible) == (Verdict.WRONG, 0, 10)


def test_a_program_without_seeds_is_undecided_or_right_but_never_wrong(submit_student):
    result = grade(submit_student("--bug", "fixed-seed"), spp=1)
    assert result.verdict in (Verdict.UNDECIDED, Verdict.RIGHT)
    assert result.evidence.distinct_images == 1


@pytest.mark.parametrize(
    ("word", "reason"),
    [
        ("exits-with-3", "the renderer ended with exit code 3: no such mesh: teapot.ply"),
        ("exits-silently", "the renderer ended with exit code 1"),
        ("kills-itself", "the renderer was ended by SIGSEGV"),
        ("kills-its-group", "the renderer was ended by SIGKILL"),
        ("closes-everything", "the renderer ended with exit code 4"),
        ("prints-a-lot", "the renderer ended with exit code 1: sample 2999"),
        ("writes-nothing", "the renderer succeeded but wrote no image at {output}"),
        ("writes-elsewhere", "the renderer succeeded but wrote no image at {output}; it left picture.pfm instead"),
        ("writes-strange-names", "the renderer succeeded but wrote no image at {output}; it left a b instead"),
        ("writes-a-directory", "image.pfm: not a regular file"),
        ("writes-a-pipe", "image.pfm: not a regular file"),
        ("writes-a-link", "image.pfm: is a symbolic link, not a regular file"),
        ("writes-a-dangling-link", "image.pfm: is a symbolic link, not a regular file"),
        ("writes-an-empty-file", "image.pfm: is empty"),
        ("removes-its-folder", "the renderer succeeded but wrote no image, and its folder is gone or closed"),
    ],
)
def test_a_failing_program_is_ungradable_and_says_why(submit_command, word, reason):
    assert_ungradable(grade(submit_command(word)), reason)


def test_what_a_failing_program_printed_is_kept(submit_command):
    assert grade(submit_command("exits-with-3")).log == "reading the scene\nno such mesh: teapot.ply\n"


def test_a_program_that_prints_escapes_is_quoted_harmlessly(submit_command):
    result = grade(submit_command("prints-escapes"))
    assert_ungradable(
        result, "the renderer ended with exit code 1: last \N{REPLACEMENT CHARACTER}\N{REPLACEMENT CHARACTER}line"
    )
    assert "progress 100 %" in result.log
    for forbidden in "\x1b\x07\0\x85\x9b\u202e\u061c\r":
        assert forbidden not in result.log


def test_a_program_that_hangs_is_stopped_at_the_limit_with_all_its_children(submit_command):
    folder = submit_command("hangs-with-children")
    start = time.monotonic()
    result = grade(folder, timeout=1.0)
    assert time.monotonic() - start < 5
    assert_ungradable(result, "the renderer did not finish within 1 s and was stopped")
    assert_gone(folder / "pids")


def test_a_program_that_prints_endlessly_fills_no_memory(submit_command):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    result = grade(submit_command("prints-endlessly"), timeout=0.5)
    assert result.reason.startswith("the renderer did not finish within 0.5 s and was stopped: 00000")
    assert len(result.log) <= 8192
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < (50 << 10 if sys.platform == "linux" else 50 << 20)


def test_the_folders_of_a_grading_are_called_by_their_placeholders(submit_command):
    result = grade(submit_command("prints-its-folders"))
    assert result.log == "{scratch}/image-0 and {scratch} and {source}\n"
    assert result.reason.endswith(": {scratch}/image-0 and {scratch} and {source}")


@pytest.mark.parametrize("folder", ["{scene}", "{output}", "a {seed} b", "ä ö"])
def test_a_folder_that_is_named_like_a_placeholder_is_only_a_folder(submit_command, folder):
    assert_ungradable(grade(submit_command("writes-nothing", folder=folder)),
                      "the renderer succeeded but wrote no image at {output}")  # fmt: skip


@pytest.mark.parametrize(
    ("content", "mode", "reason"),
    [
        (None, 0, "cannot run {source}/render: No such file or directory"),
        ("#!/bin/sh\n", 0o644, "cannot run {source}/render: Permission denied"),
        ("#!/nowhere/python\n", 0o755, "cannot run {source}/render: the interpreter in its first line does not exist"),
        ("echo", 0o755, "cannot run {source}/render: Exec format error"),
    ],
)
def test_a_program_that_cannot_start_is_ungradable_and_says_why(submit, content, mode, reason):
    folder = submit(
        'name = "a test"\nkind = "command"\n'
        '[render]\ncommand = ["{source}/render", "{scene}", "{output}"]\noutput = "exr"\n'
    )
    if content is not None:
        (folder / "render").write_text(content)
        (folder / "render").chmod(mode)
    assert_ungradable(grade(folder), reason)


@pytest.mark.parametrize("word", ["removes-its-home", "locks-its-folder"])
def test_no_points_are_saved_by_spoiling_the_folder_one_is_given(submit_command, right_image, word):
    folder = submit_command(word)
    (folder / "right.pfm").write_bytes(right_image(scale=2.0))
    result = grade(folder)
    assert result.verdict in (Verdict.UNGRADABLE, Verdict.WRONG)
    assert (result.points, result.possible) == (0, 10)


def test_what_a_program_leaves_behind_spoils_nothing(submit_command, right_image):
    folder = submit_command("digs-deep")
    (folder / "right.pfm").write_bytes(right_image(scale=2.0))
    assert grade(folder).verdict == Verdict.WRONG


@pytest.mark.parametrize(
    ("pixel", "reason"),
    [
        (np.nan, "image.pfm: 1 NaN of 6144 pixels, first at x = 0, y = 63"),
        (np.inf, "image.pfm: 1 infinite of 6144 pixels, first at x = 0, y = 63"),
        (-1.0, "image.pfm: 1 of 6144 pixels are negative, first at x = 0, y = 63 (-1); radiance is at least 0"),
    ],
)
def test_bad_pixels_are_ungradable_and_located(submit_command, right_image, pixel, reason):
    folder = submit_command("copies")
    image = bytearray(right_image())
    start = image.index(b"-1.0\n") + 5
    image[start : start + 4] = np.float32(pixel).tobytes()
    (folder / "image").write_bytes(image)
    assert_ungradable(grade(folder), reason)


def test_an_image_of_another_size_is_ungradable(submit_command, right_image):
    folder = submit_command("copies")
    (folder / "image").write_bytes(right_image().replace(b"96 64", b"64 96"))
    assert_ungradable(grade(folder), "image.pfm: is 64 x 96 pixels, the scene's film has 96 x 64")


# --------------------------------------------------------------------------------------------------- builds


def submit_build(submit, commands, timeout=20, **more):
    return submit(
        f'name = "a test"\nkind = "command"\n[build]\ncommands = {commands}\ntimeout = {timeout}\n'
        '[render]\ncommand = ["{build}/render", "{scene}", "{output}"]\noutput = "pfm"\n',
        "misbehaving.sh",
        **more,
    )


def test_a_build_that_fails_is_ungradable_and_quotes_the_first_error(submit):
    script = "echo compiling; echo 'a.cpp:3: error: expected ;'; echo 'a.cpp:9: error: more'; echo stop; exit 2"
    result = grade(submit_build(submit, [["sh", "-c", script]]))
    assert_ungradable(result, "build failed: sh ended with exit code 2: a.cpp:3: error: expected ;")


def test_a_build_stops_at_its_first_failure(submit):
    folder = submit_build(submit, [["echo", "one"], ["false"], ["touch", "{source}/touched"]])
    assert_ungradable(grade(folder), "build failed: false ended with exit code 1")
    assert not (folder / "touched").exists()


def test_a_build_without_its_tool_is_ungradable(submit):
    result = grade(submit_build(submit, [["no-such-make", "{build}"]]))
    assert_ungradable(result, "build failed: cannot run no-such-make: No such file or directory")


def test_a_build_that_hangs_is_stopped_with_its_children_at_the_limit_for_all_commands(submit):
    commands = [["sleep", "0.2"], ["{source}/misbehaving.sh", "hangs-with-children", "x", "x"]]
    folder = submit_build(submit, commands, timeout=1)
    start = time.monotonic()
    result = grade(folder)
    assert time.monotonic() - start < 5
    assert_ungradable(result, "build failed: {source}/misbehaving.sh did not finish within 1 s and was stopped")
    assert_gone(folder / "pids")


def test_a_build_log_is_the_same_in_every_folder_and_at_every_speed(submit, tmp_path):
    script = "echo $0 in $PWD for $1; echo '-- Configuring done (1.5s)'; echo '-- Generating done (0.0s)'"
    logs = []
    for name in ("a", "b"):
        folder = submit_build(submit, [["sh", "-c", script, "{source}/run", "{build}/program"]], folder=name)
        (tmp_path / f"work-{name}").mkdir()
        logs.append(build(*load_submission(folder), tmp_path / f"work-{name}").log)
    assert logs[0] == logs[1]
    assert logs[0].splitlines() == [
        "{source}/run in {source} for {build}/program",
        "-- Configuring done",
        "-- Generating done",
    ]


def test_a_build_that_forgets_the_program_is_ungradable(submit):
    result = grade(submit_build(submit, [["true"]]))
    assert_ungradable(result, "cannot run {build}/render: No such file or directory")


# ------------------------------------------------------------------------------------------- Python functions


def submit_python(submit, function, module="misbehaving", **more):
    return submit(
        f'name = "a test"\nkind = "python"\n[render]\ncallable = "{module}:{function}"\noutput = "pfm"\n',
        "misbehaving.py",
        **more,
    )


@pytest.mark.parametrize(
    "function", ["copies", "prints_and_copies", "closes_stdout_and_copies", "reads_standard_input_and_copies"]
)
def test_a_python_function_may_print_and_read_what_it_likes(submit, right_image, function):
    folder = submit_python(submit, function)
    (folder / "image").write_bytes(right_image(scale=2.0))
    result = grade(folder)
    assert result.verdict == Verdict.WRONG, result.reason
    assert "the whole image has 200 % of the expected light" in result.reason


def test_what_a_python_function_printed_is_kept(submit, right_image):
    folder = submit_python(submit, "prints_and_copies")
    (folder / "image").write_bytes(right_image())
    log = grade(folder).log
    for said in (
        "hello from render\n",
        "a child says hello\n",
        "warning: 3 fireflies\n",
        '{"error": "a forged answer"}',
    ):
        assert log.count(said) == 4  # images


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        ("raises", "the renderer failed: ValueError: the sky is not blue \N{REPLACEMENT CHARACTER}"),
        ("raises_half_a_character", "the renderer failed: ValueError: half a character: ?"),
        ("raises_the_unspeakable", "the renderer's process ended with exit code 1"),
        ("raises_at_length", "the renderer failed: gave no valid answer"),
        ("exits", "the renderer failed: SystemExit: 3"),
        ("exits_at_once", "the renderer's process ended without an answer"),
        ("is_killed", "the renderer's process was ended by SIGKILL"),
        ("interrupts_itself", "the renderer failed: KeyboardInterrupt:"),
        ("writes_nothing", "the renderer succeeded but wrote no image at {output}"),
        ("recurses", "the renderer failed: RecursionError: maximum recursion depth exceeded"),
        ("takes_nothing", "the renderer failed: TypeError: len() takes no keyword arguments"),
        ("renders", "the renderer failed: AttributeError: module 'misbehaving' has no attribute 'renders'"),
    ],
)
def test_a_failing_python_function_is_ungradable_and_says_why(submit, function, reason):
    result = grade(submit_python(submit, function))
    assert_ungradable(result, reason)


def test_a_failing_python_function_shows_its_traceback_in_the_log(submit):
    log = grade(submit_python(submit, "raises")).log
    assert 'File "{source}/misbehaving.py"' in log
    assert "in raises" in log


@pytest.mark.parametrize(
    ("module", "content", "reason"),
    [
        ("nowhere", "", "ModuleNotFoundError: No module named 'nowhere'"),
        ("doctor", "", "ModuleNotFoundError: No module named 'doctor'"),  # a module of the grader
        ("broken", "def render(:\n", "SyntaxError: invalid syntax (broken.py, line 1)"),
        ("lacking", "import no_such_library\n", "ModuleNotFoundError: No module named 'no_such_library'"),
        ("exiting", "raise SystemExit\n", "SystemExit:"),
    ],
)
def test_a_module_that_cannot_be_imported_is_ungradable(submit, module, content, reason):
    folder = submit_python(submit, "render", module)
    if content:
        (folder / f"{module}.py").write_text(content)
    assert_ungradable(grade(folder), f"the renderer failed: {reason}")


def test_a_python_function_that_hangs_is_stopped_with_its_children(submit):
    folder = submit_python(submit, "hangs")
    start = time.monotonic()
    result = grade(folder, timeout=1.0)
    assert time.monotonic() - start < 5
    assert_ungradable(result, "the renderer did not finish within 1 s and was stopped")
    assert_gone(folder / "pids")


def test_a_python_function_that_closes_all_pipes_and_hangs_is_stopped(submit):
    start = time.monotonic()
    result = grade(submit_python(submit, "closes_all_pipes_and_hangs"), timeout=20)
    assert time.monotonic() - start < 10
    assert_ungradable(result, "the renderer closed the pipe on which its process answers")


def test_a_module_that_hangs_when_imported_is_stopped(submit):
    folder = submit_python(submit, "render", "sleepy")
    (folder / "sleepy.py").write_text("import time\ntime.sleep(100)\n")
    assert_ungradable(grade(folder, timeout=0.5), "the renderer did not finish within 0.5 s and was stopped")


def test_modules_of_a_submission_may_have_any_name(submit, right_image):
    folder = submit_python(submit, "copies", "rendering.main")
    (folder / "rendering").mkdir()
    (folder / "rendering/main.py").write_text("import errors, output, misbehaving\ncopies = misbehaving.copies\n")
    for name in ("json", "traceback", "importlib", "errors", "output"):
        (folder / f"{name}.py").write_text("")
    (folder / "image").write_bytes(right_image(scale=2.0))
    result = grade(folder)
    assert result.verdict == Verdict.WRONG, result.reason


def test_running_a_python_submission_leaves_nothing_in_its_folder(submit, right_image):
    folder = submit_python(submit, "copies")
    (folder / "image").write_bytes(right_image())
    before = {path.name for path in folder.iterdir()} | {"work"}
    grade(folder)
    assert {path.name for path in folder.iterdir()} == before


# -------------------------------------------------------------------------------------------- existing images


def submit_images(submit, output="pfm", pattern=None):
    pattern = pattern or f"{{case}}-*.{output}"
    encoding = 'encoding = "srgb"\n' if output == "png" else ""
    return submit(f'name = "a test"\nkind = "images"\n[render]\nimages = "{pattern}"\noutput = "{output}"\n{encoding}')


@pytest.mark.parametrize("output", ["pfm", "exr", "hdr", "png"])
@pytest.mark.parametrize("rounding", ["to nearest", "cut off"])
def test_right_images_that_exist_are_right_in_every_format(submit, student, tmp_path, output, rounding):
    folder = submit_images(submit, output)
    scene = export(FAMILIES[FAMILY].member(0), "json", tmp_path / "scene")
    for seed in range(4):
        rendered = tmp_path / "rendered.pfm"
        subprocess.run([student, scene, rendered, "--spp", "16", "--seed", str(seed)], check=True)
        pixels = np.frombuffer(rendered.read_bytes()[-96 * 64 * 12 :], "<f4").reshape(64, 96, 3)[::-1]
        integer = np.rint if rounding == "to nearest" else np.floor
        if output == "png":
            srgb = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 0) ** (1 / 2.4) - 0.055)
            pixels = integer(255 * srgb.clip(0, 1)) / 255
        if output == "hdr":
            # [Ward 1991]: three mantissas of 8 bits share an exponent.
            step = np.exp2(np.frexp(pixels.max(axis=2, keepdims=True))[1] - 8.0)
            pixels = np.minimum(integer(pixels / step), 255) * step
        path = folder / f"{FAMILY}-{seed}.{output}"
        writer = oiio.ImageOutput.create(str(path))
        config = oiio.ImageSpec(96, 64, 3, "uint8" if output == "png" else "float")
        config["pnm:pfmflip"] = 1
        assert writer.open(str(path), config)
        assert writer.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
        assert writer.close()
    result = grade(folder)
    assert (result.verdict, result.evidence.distinct_images) == (Verdict.RIGHT, 4), result.reason


def test_images_that_do_not_exist_are_ungradable(submit):
    assert_ungradable(grade(submit_images(submit)), "no image matches point-distance-*.pfm")


def test_one_image_is_judged_alone(submit, right_image):
    folder = submit_images(submit)
    (folder / f"{FAMILY}-0.pfm").write_bytes(right_image(noise=np.random.default_rng(1), scale=3.0))
    result = grade(folder)
    assert (result.verdict, result.evidence.images) == (Verdict.WRONG, 1)


def test_the_same_image_again_is_no_second_observation(submit, right_image):
    folder = submit_images(submit)
    for index in range(6):
        (folder / f"{FAMILY}-{index}.pfm").write_bytes(right_image(noise=np.random.default_rng(1)))
    evidence = grade(folder).evidence
    assert (evidence.images, evidence.distinct_images) == (6, 1)


def test_the_first_broken_image_by_name_is_named(submit, right_image):
    folder = submit_images(submit)
    (folder / f"{FAMILY}-0.pfm").write_bytes(right_image())
    (folder / f"{FAMILY}-2.pfm").write_bytes(b"")
    (folder / f"{FAMILY}-1.pfm").write_bytes(right_image()[:-1])
    reason = grade(folder).reason
    assert reason.startswith("point-distance-1.pfm: broken or truncated colour PFM file")


def test_images_elsewhere_are_not_reached_through_links(submit, right_image, tmp_path):
    others = tmp_path / "others"
    others.mkdir()
    (others / f"{FAMILY}-0.pfm").write_bytes(right_image())
    folder = submit_images(submit, pattern="images/{case}-*.pfm")
    (folder / "images").symlink_to(others)
    assert_ungradable(grade(folder), "images/point-distance-0.pfm: lies outside the submission's folder")


def test_folders_nested_without_end_are_no_way_to_stop_a_grading(submit):
    folder = submit_images(submit, pattern="**/{case}.pfm")
    subprocess.run(["mkdir", "-p", folder / ("d/" * 1400)], check=True)
    try:
        assert grade(folder).verdict == Verdict.UNGRADABLE
    finally:
        # No one else could remove it.
        subprocess.run(["rm", "-rf", folder / "d"], check=True)


def test_thousands_of_images_are_not_read(submit):
    folder = submit_images(submit)
    for index in range(1025):
        (folder / f"{FAMILY}-{index}.pfm").touch()
    assert_ungradable(grade(folder), "1025 images match point-distance-*.pfm; at most 1024 are judged")


# -------------------------------------------------------------------------------- when the machine is at fault

FAILING_MACHINE = """
import resource, sys
from pathlib import Path
from graders.grading import case_of, expectation_of, grade_case
from graders.rendering import Built
from graders.rubric import CaseOfRubric, Rubric
from graders.submission import load_submission
wanted = CaseOfRubric(family="point-distance")
case = case_of(wanted, Rubric(name="a test", cases=(wanted,)), 0)
expectation_of(case.family, case.seed)
built = Built(*load_submission(Path(sys.argv[1])), Path(sys.argv[1]))
{fault}
result = grade_case(case, built, 4, 20).result
print(result.verdict, result.points, result.possible, result.reason, sep="|")
"""


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))", "OSError: [Errno 27] File too large"),
        (
            "resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))",
            "FileNotFoundError: [Errno 2] No usable temporary directory",
        ),
        ("import tempfile; tempfile.tempdir = '/nowhere'", "FileNotFoundError: [Errno 2] No such file or directory"),
    ],
    ids=["full disk", "no descriptors", "no temporary folder"],
)
def test_what_the_machine_does_wrong_costs_no_points(submit_student, fault, reason):
    result = subprocess.run(
        [sys.executable, "-c", FAILING_MACHINE.format(fault=fault), submit_student()],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert result.stderr == ""
    verdict, points, possible, why = result.stdout.split("|", 3)
    assert (verdict, points, possible) == ("infrastructure-error", "0.0", "0.0")
    assert why.startswith(reason)


def test_a_python_interpreter_that_has_gone_is_the_fault_of_the_machine(submit, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    folder = submit_python(submit, "copies")
    result = grade(folder)
    assert (result.verdict, result.possible) == (Verdict.INFRASTRUCTURE_ERROR, 0)


def test_closing_a_renderer_twice_or_before_it_ran_is_harmless(submit, tmp_path):
    folder = submit_python(submit, "copies")
    made = tmp_path / "made"
    made.mkdir()
    idle = renderer(build(*load_submission(folder), made), 1.0, tmp_path)
    assert (idle.close(), idle.close()) == ("", "")
