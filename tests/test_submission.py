"""submission.toml as people write it: right, with every slip of the pen, and with bad intentions."""

import os
import time
from pathlib import Path

import pytest

from graders.submission import CommandSubmission, ImagesSubmission, PythonSubmission, load_submission
from reference_scenes.loading import InvalidFile

COMMAND = """
name = "group 7"
kind = "command"

[render]
command = ["{build}/render", "{scene}", "{output}"]
output = "exr"
"""
BUILD = """
[build]
commands = [["make", "-C", "{source}", "OUT={build}"]]
"""
PYTHON = """
name = "group 7"
kind = "python"

[render]
callable = "renderer.main:render"
output = "exr"
"""
IMAGES = """
name = "group 7"
kind = "images"

[render]
images = "results/{case}-*.exr"
output = "exr"
"""


def load(folder, text):
    (folder / "submission.toml").write_text(text, encoding="utf-8")
    return load_submission(folder)[0]


def complaint(folder, text):
    """The one line that is said of a file, without its name."""
    with pytest.raises(InvalidFile) as caught:
        load(folder, text)
    message = str(caught.value)
    assert message.startswith(f"{folder / 'submission.toml'}: ")
    assert "\n" not in message
    return message.removeprefix(f"{folder / 'submission.toml'}: ")


def changed(text, old, new):
    assert text.count(old) == 1
    return text.replace(old, new)


# ---------------------------------------------------------------------------------------------- right files


def test_a_program_with_a_build_is_read(tmp_path):
    submission = load(tmp_path, COMMAND + BUILD)
    assert isinstance(submission, CommandSubmission)
    assert submission.render.command == ("{build}/render", "{scene}", "{output}")
    assert submission.build.commands == (("make", "-C", "{source}", "OUT={build}"),)
    assert (submission.scene_format, submission.render.encoding, submission.build.timeout) == ("json", "linear", 300)


def test_a_python_function_is_read(tmp_path):
    submission = load(tmp_path, PYTHON)
    assert isinstance(submission, PythonSubmission)
    assert submission.render.callable == "renderer.main:render"


def test_existing_images_are_read(tmp_path):
    submission = load(tmp_path, IMAGES)
    assert isinstance(submission, ImagesSubmission)
    assert submission.render.images == "results/{case}-*.exr"


def test_png_with_its_encoding_is_read(tmp_path):
    submission = load(tmp_path, changed(COMMAND, '"exr"', '"png"\nencoding = "srgb"'))
    assert (submission.render.output, submission.render.encoding) == ("png", "srgb")


def test_the_file_itself_may_be_named_instead_of_its_folder(tmp_path, monkeypatch):
    (tmp_path / "other.toml").write_text(COMMAND)
    monkeypatch.chdir(tmp_path)
    submission, source = load_submission(Path("other.toml"))
    assert submission.name == "group 7"
    assert source == tmp_path.resolve()


def test_a_name_may_have_any_letters(tmp_path):
    assert load(tmp_path, changed(COMMAND, "group 7", "Grüppchen 七  🫖")).name == "Grüppchen 七  🫖"


# ----------------------------------------------------------------------------------------- slips of the pen


@pytest.mark.parametrize(
    ("base", "old", "new", "message"),
    [
        (COMMAND, "output =", "ouput =", "/render/ouput is not a known key; did you mean 'output'? (and 1 more)"),
        (COMMAND, "name =", "nmae =", "/nmae is not a known key; did you mean 'name'? (and 1 more)"),
        (COMMAND, "[render]", "[rendr]", "/rendr is not a known key; did you mean 'render'? (and 1 more)"),
        (
            COMMAND + BUILD,
            "commands =",
            "comands =",
            "/build/comands is not a known key; did you mean 'commands'? (and 1 more)",
        ),
        (
            PYTHON,
            "callable =",
            "calable =",
            "/render/calable is not a known key; did you mean 'callable'? (and 1 more)",
        ),
        (IMAGES, "images =", "image =", "/render/image is not a known key; did you mean 'images'? (and 1 more)"),
        (COMMAND, '"command"\n', '"comand"\n', "/kind: 'comand' is no kind of submission; did you mean 'command'?"),
        (COMMAND, '"command"\n', '"zzz"\n', "/kind: 'zzz' is no kind of submission; known: command, python, images"),
        (COMMAND, '"command"\n', "7\n", "/kind: 7 is no kind of submission; known: command, python, images"),
        (
            COMMAND,
            '"command"\n',
            '["command"]\n',
            "/kind: ['command'] is no kind of submission; did you mean 'command'?",
        ),
        (COMMAND, 'kind = "command"\n', "", "/kind is missing; known: command, python, images"),
        (COMMAND, 'name = "group 7"\n', "", "/name is missing"),
        (COMMAND, '"group 7"', '""', '/name: "": string should have at least 1 character'),
        (
            COMMAND,
            "\n[render]",
            'scene_format = "jsno"\n[render]',
            "/scene_format: \"jsno\" is no scene format; did you mean 'json'?",
        ),
        (COMMAND, '"exr"', '"jpg"', "/render/output: \"jpg\": input should be 'exr', 'pfm', 'hdr' or 'png'"),
        (
            COMMAND,
            '"exr"',
            '"exr"\nencoding = "gamma"',
            "/render/encoding: \"gamma\": input should be 'linear' or 'srgb'",
        ),
        (
            COMMAND,
            '"{scene}"',
            '"{scne}"',
            '/render/command: ["{build}/render", "{scne}", "{output}"] has no placeholder'
            " to fill in for {scne}; did you mean 'scene'?",
        ),
        (
            COMMAND,
            '"{scene}"',
            '"{}"',
            '/render/command: ["{build}/render", "{}", "{output}"] has no placeholder to fill'
            " in for {}; known: source, build, scene, output, spp, seed, width, height",
        ),
        (COMMAND, '"{scene}", ', "", '/render/command: ["{build}/render", "{output}"] never mentions {scene}'),
        (COMMAND, ', "{output}"', "", '/render/command: ["{build}/render", "{scene}"] never mentions {output}'),
        (
            COMMAND,
            '["{build}/render", "{scene}", "{output}"]',
            "[]",
            "/render/command: [] is empty; at least one is needed",
        ),
        (
            COMMAND,
            '["{build}/render", "{scene}", "{output}"]',
            '"render {scene} {output}"',
            '/render/command: "render {scene} {output}": input should be a valid tuple',
        ),
        (COMMAND, '"{scene}"', "7", "/render/command/1: 7: input should be a valid string"),
        (
            COMMAND,
            '"{scene}"',
            '"a\\u0000b"',
            '/render/command: ["{build}/render", "a\\u0000b", "{output}"] has a NUL'
            " character, which no program can be given",
        ),
        (
            COMMAND + BUILD,
            "{source}",
            "{sorce}",
            '/build/commands/0: ["make", "-C", "{sorce}", "OUT={build}"] has no'
            " placeholder to fill in for {sorce}; did you mean 'source'?",
        ),
        (
            COMMAND + BUILD,
            "{source}",
            "{scene}",
            '/build/commands/0: ["make", "-C", "{scene}", "OUT={build}"] has no'
            " placeholder to fill in for {scene}; known: source, build",
        ),
        (
            COMMAND + BUILD,
            '[["make", "-C", "{source}", "OUT={build}"]]',
            "[]",
            "/build/commands: [] is empty; at least one is needed",
        ),
        (COMMAND + BUILD, "[build]", "[build]\ntimeout = 0", "/build/timeout: 0: input should be greater than 0"),
        (
            COMMAND + BUILD,
            "[build]",
            "[build]\ntimeout = 1e9",
            "/build/timeout: 1000000000.0: input should be less than or equal to 3600",
        ),
        (PYTHON, "renderer.main:render", "renderer.py", '/render/callable: "renderer.py" is not MODULE:FUNCTION'),
        (PYTHON, "renderer.main:render", "os; x:y", '/render/callable: "os; x:y" is not MODULE:FUNCTION'),
        (
            IMAGES,
            "results/{case}",
            "/scratch/{case}",
            '/render/images: "/scratch/{case}-*.exr" leaves the submission\'s folder',
        ),
        (
            IMAGES,
            "results/",
            "results/../../",
            '/render/images: "results/../../{case}-*.exr" leaves the submission\'s folder',
        ),
        (IMAGES, "{case}", "disk", '/render/images: "results/disk-*.exr" never mentions {case}'),
        (
            IMAGES,
            "{case}",
            "{scene}",
            '/render/images: "results/{scene}-*.exr" has no placeholder to fill in for {scene}; known: case',
        ),
        (
            IMAGES,
            "{case}-*",
            "{case}-**",
            '/render/images: "results/{case}-**.exr" has ** beside something else; it stands for whole folders',
        ),
    ],
)
def test_a_slip_is_named_with_its_place_its_value_and_a_cure(tmp_path, base, old, new, message):
    assert complaint(tmp_path, changed(base, old, new)) == message


def test_png_needs_its_encoding_declared(tmp_path):
    message = complaint(tmp_path, changed(COMMAND, '"exr"', '"png"'))
    assert message.startswith("/render: {")
    assert message.endswith('png holds sRGB values: declare encoding = "srgb", or write exr, pfm or hdr')


def test_only_png_may_hold_srgb(tmp_path):
    message = complaint(tmp_path, changed(COMMAND, '"exr"', '"exr"\nencoding = "srgb"'))
    assert message == '/render: exr holds linear radiance: leave encoding = "srgb" to png'


def test_no_toml_is_named_with_line_and_column(tmp_path):
    assert complaint(tmp_path, 'name = "a"\nkind: command\n').startswith("not TOML: Expected '=' after a key")
    assert complaint(tmp_path, 'name = "a"\nkind: command\n').endswith("(at line 2, column 5)")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidFile) as caught:
        load_submission(tmp_path)
    assert str(caught.value) == f"{tmp_path / 'submission.toml'}: No such file or directory"
    with pytest.raises(InvalidFile) as caught:
        load_submission(tmp_path / "nowhere")
    assert str(caught.value) == f"{tmp_path / 'nowhere'}: No such file or directory"


# ------------------------------------------------------------------------------------------- bad intentions


def test_a_name_cannot_colour_a_terminal_or_forge_a_line(tmp_path):
    for name in ("a\\u001b[31mb", "a\\nb", "a\\tb", "a\\u202eb", "a\\u0085b"):
        assert complaint(tmp_path, changed(COMMAND, "group 7", name)).endswith(" is not one line of plain text")


def test_bytes_that_are_no_text_are_named(tmp_path):
    (tmp_path / "submission.toml").write_bytes(b'name = "\xff"')
    with pytest.raises(InvalidFile, match="byte 8 is not UTF-8"):
        load_submission(tmp_path)


@pytest.mark.parametrize("text", [f"kind = {'9' * 5000}", f"kind = {'[' * 5000}", f"kind = {'{a=' * 5000}"])
def test_what_python_cannot_read_is_one_line_too(tmp_path, text):
    assert len(complaint(tmp_path, text)) < 250


def test_a_pipe_is_refused_without_waiting_for_a_writer(tmp_path):
    os.mkfifo(tmp_path / "submission.toml")
    start = time.monotonic()
    with pytest.raises(InvalidFile, match=r"not a regular file$"):
        load_submission(tmp_path)
    assert time.monotonic() - start < 5


def test_a_device_without_an_end_is_refused(tmp_path):
    (tmp_path / "submission.toml").symlink_to("/dev/zero")
    with pytest.raises(InvalidFile, match=r"not a regular file$"):
        load_submission(tmp_path)


def test_a_huge_file_is_refused_unread(tmp_path):
    with (tmp_path / "submission.toml").open("wb") as file:
        file.truncate(1 << 40)  # sparse
    with pytest.raises(InvalidFile, match=f"{1 << 40} bytes are too many$"):
        load_submission(tmp_path)
