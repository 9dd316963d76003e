"""`oracle irradiance` and `oracle solid-angle`, as students type them."""

import json
import math
import os
import pty
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from graders.cli import _run
from graders.cli.ask import QUESTIONS

ORACLE = Path(sys.executable).with_name("oracle")
DISK = "irradiance disk --center 0,0,2 --normal 0,0,-1 --radius 0.5 --radiance 10"
RECTANGLE = "irradiance rectangle --center 0,0,2 --half-u 0,1,0 --half-v 1,0,0"
VALUE = math.pi * 10 * 0.25 / 4.25
BALL = "sphere center=0,0,1 radius=0.1"
SHADE = "rectangle center=0,0,1 half_u=.1,0,0 half_v=0,.1,0"


@pytest.fixture
def ask(capfd, tmp_path, monkeypatch):
    """Runs a command line; gives its exit code, output and complaint."""
    monkeypatch.chdir(tmp_path)

    def run(line, *more):
        code = _run([*line.split(), *more])
        output, complaint = capfd.readouterr()
        assert "Traceback" not in complaint
        assert complaint.count("\n") == (1 if code else 0), complaint
        return code, output, complaint

    return run


def rows(output):
    return [line.split("\t") for line in output.splitlines()]


# --------------------------------------------------------------------------------------------- answers


def test_the_door_opens_at_once_and_in_a_process_of_its_own():
    result = subprocess.run([ORACLE, *DISK.split()], capture_output=True, text=True, timeout=60, check=True)
    assert dict(line.split("\t") for line in result.stdout.splitlines())["unit"] == "W/m^2"
    times = []
    for _ in range(3):
        start = time.monotonic()
        result = subprocess.run([ORACLE, "--help"], capture_output=True, text=True, timeout=60, check=True)
        times.append(time.monotonic() - start)
    assert "irradiance" in result.stdout
    assert min(times) < 1.5, times  # 0.1 s on two idle cores


def test_a_pipe_gets_a_line_for_each_part_of_the_answer(ask):
    code, output, _ = ask(DISK)
    assert code == 0
    assert [row[0] for row in rows(output)] == ["value", "unit", "error", "formula", "source"]
    (_, value), (_, unit), (_, error), *_ = rows(output)
    assert float(value) == pytest.approx(VALUE, rel=1e-14)
    assert unit == "W/m^2"
    assert 0 < float(error) < 1e-13


def test_channels_are_columns(ask):
    _, output, _ = ask(DISK.replace("10", "10,5,0"))
    assert [float(value) for value in rows(output)[0][1:]] == pytest.approx([VALUE, VALUE / 2, 0], rel=1e-14)


def test_the_solid_angle_of_an_octant_and_of_a_cone(ask):
    triangle = ("--vertices", "1,0,0 0,1,0 0,0,1")
    for line, expected in (
        (("solid-angle polygon", *triangle), math.pi / 2),
        (("solid-angle cone --half-angle 90deg",), 2 * math.pi),
    ):
        (_, value), (_, unit), *_ = rows(ask(*line)[1])
        assert (float(value), unit) == (pytest.approx(expected, rel=1e-15), "sr")
    _, output, _ = ask("solid-angle sphere --center 0,0,0 --radius 1 --table point.x=1:100:3log")
    for distance, value, _ in (map(float, row) for row in rows(output)[1:]):
        assert value == pytest.approx(2 * math.pi * (1 - math.sqrt(1 - 1 / distance**2)), rel=1e-10)


def test_json_holds_the_case_that_truth_answers_alike(ask, tmp_path):
    _, output, _ = ask(DISK, "--json", "--point", "0.3, 0, 0", "--facing", "0,1,1")
    answer = json.loads(output)
    (tmp_path / "cases.json").write_text(json.dumps([answer["case"]]))
    _, again, _ = ask("truth cases.json")
    again = json.loads(again)
    assert {key: again[key] for key in ("value", "error", "unit")} == {
        key: answer[key] for key in ("value", "error", "unit")
    }


def test_directions_may_have_any_length_and_angles_degrees(ask):
    spot = "irradiance spot --position 0,0,2 --intensity 4 --beam-width 10deg --cutoff-angle 0.5"
    values = [ask(spot, "--direction", way, "--facing", "0,0,1e-9")[1] for way in ("0,0,-1", "0,0,-300")]
    assert values[0] == values[1]
    assert float(rows(values[0])[0][1]) == 1
    document = json.loads(ask(spot, "--direction", "0,0,-9", "--json")[1])
    assert document["case"]["emitter"]["beam_width"] == math.radians(10)


def test_vertices_are_separated_by_blanks_or_semicolons(ask):
    one = "irradiance polygon --radiance 2 --vertices"
    answers = [ask(one, text)[1] for text in ("1,0,1 0,0,1 0,1,1", "1,0,1;0, 0, 1; 0,1,1")]
    assert answers[0] == answers[1]
    assert float(rows(answers[0])[0][1]) > 0
    behind = (one, "1,0,1 0,1,1 0,0,1")
    assert float(rows(ask(*behind)[1])[0][1]) == 0
    both = float(rows(ask(*behind, "--two-sided")[1])[0][1])
    assert both == pytest.approx(float(rows(answers[0])[0][1]), rel=1e-14)


def test_a_mesh_has_vertices_and_triangles(ask):
    mesh = ("--vertices", "1,0,1 0,1,1 0,0,1", "--triangles", "0,1,2 0,2,1")
    code, output, _ = ask("irradiance mesh", *mesh)
    assert (code, float(rows(output)[0][1]) > 0) == (0, True)


def test_occluders_hide(ask):
    point = "irradiance point --position 0,0,2 --intensity 4"
    assert float(rows(ask(point)[1])[0][1]) == 1
    ball, shade = ("--occluder", BALL), ("--occluder", SHADE)
    for hidden in (ball, shade, (*ball, *shade)):
        assert float(rows(ask(point, *hidden)[1])[0][1]) == 0


def test_every_emitter_can_be_asked_for(ask):
    """With the help of nothing but its own help."""
    values = {
        "X,Y,Z": "0,0,1",
        "NUMBER": "0.5",
        '"X,Y,Z X,Y,Z X,Y,Z"': "1,0,1 0,1,1 0,0,1",
        '"I,J,K I,J,K"': "0,1,2 0,2,1",
    }
    special = {"half_u": "1,0,0", "half_v": "0,1,0", "end": "1,0,1", "cutoff_angle": "1"}
    for name, question in QUESTIONS.items():
        for kind in question.kinds:
            line = [name.replace("_", "-"), kind]
            for option, parameter in question.parameters(kind).items():
                if not parameter.is_flag and parameter.default is None:
                    line += [f"--{option.replace('_', '-')}", special.get(option, values.get(parameter.metavar))]
            code = ask(" ".join(line[:2]), *line[2:])[0]
            assert code == 0, line


# ---------------------------------------------------------------------------------------------- tables


def test_a_table_sweeps_a_parameter(ask):
    code, output, _ = ask("irradiance disk --center 0,0,2 --normal 0,0,-1 --radiance 10 --table radius=0.5:2.5:5")
    head, *body = rows(output)
    assert (code, head) == (0, ["radius", "irradiance [W/m^2]", "error"])
    assert [float(row[0]) for row in body] == [0.5, 1, 1.5, 2, 2.5]
    for radius, value, _ in (map(float, row) for row in body):
        assert value == pytest.approx(math.pi * 10 * radius**2 / (radius**2 + 4), rel=1e-14)


def test_a_table_sweeps_a_component_and_logarithmically(ask):
    _, output, _ = ask("irradiance point --position 0,0,1", "--table", "position.z=1:100:3log")
    assert [float(value) for row in rows(output)[1:] for value in row[:2]] == pytest.approx([1, 1, 10, 1e-2, 100, 1e-4])


def test_a_swept_direction_keeps_its_length(ask):
    _, output, _ = ask("irradiance constant --facing 0,0,1", "--table", "facing.x=-2:2:3")
    assert [float(row[1]) for row in rows(output)[1:]] == pytest.approx([math.pi] * 3)
    _, output, _ = ask("irradiance directional --direction 0,0,-1", "--table", "facing.x=-1:1:3")
    assert [float(row[1]) for row in rows(output)[1:]] == pytest.approx([math.sqrt(0.5), 1, math.sqrt(0.5)])


def test_a_table_is_json_on_request(ask):
    _, output, _ = ask(DISK, "--json", "--table", "point.x=0:1:3")
    document = json.loads(output)
    assert document["unit"] == "W/m^2"
    assert [row["point.x"] for row in document["rows"]] == [0, 0.5, 1]


@pytest.mark.parametrize("name", ["curve.png", "curve.SVG"])
def test_a_table_is_drawn_into_a_file(ask, tmp_path, name):
    code, output, _ = ask(DISK.replace("10", "10,5,0"), "--table", "point.x=-1:1:9", "--plot", name)
    assert (code, output.splitlines()[-1]) == (0, name)
    content = (tmp_path / name).read_bytes()
    assert content.startswith(b"\x89PNG" if name.endswith("png") else b"<?xml")
    assert len(content) > 2000


# -------------------------------------------------------------------------------------------- terminals


def on_a_terminal(*arguments, **more):
    terminal, inside = pty.openpty()
    kept = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    with subprocess.Popen(
        [ORACLE, *arguments], stdin=inside, stdout=inside, stderr=inside,
        env={**kept, "LANG": "C.UTF-8", "COLUMNS": "80", "TERM": "xterm-256color", **more},
    ) as process:  # fmt: skip
        os.close(inside)
        content = b""
        while True:
            try:
                chunk = os.read(terminal, 65536)
            except OSError:
                break
            if not chunk:
                break
            content += chunk
    os.close(terminal)
    assert process.returncode == 0, content
    return content.decode()


def test_a_terminal_gets_a_block_and_a_curve_within_80_columns():
    block = on_a_terminal(*DISK.split())
    assert re.search(r"irradiance +1\.84799\d+ W/m\^2", block)
    assert "formula" in block
    curve = on_a_terminal(*DISK.split(), "--table", "point.x=-9:9:19", NO_COLOR="1")
    assert "\x1b" not in curve
    assert max(map(len, curve.splitlines())) <= 80
    assert re.search("[\u2801-\u28ff]", curve)
    assert "\x1b[" in on_a_terminal(*DISK.split(), "--table", "radius=1:1000:4log")


# ------------------------------------------------------------------------------------------------ slips


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (("irradiance", "dsk"), "there is no emitter 'dsk'; did you mean 'disk'?"),
        (("solid-angle", "mesh"), "there is no shape 'mesh'; known: polygon, "),
        (("solid-angle", "cone", "--half-angle", "4"), "shape: half_angle is 4.0"),
        (("solid-angle", "cone"), "Missing option '--half-angle'."),
        (("irradiance", "xyz"), "there is no emitter 'xyz'; known: polygon, "),
        ((*DISK.split(), "--raduis", "1"), "No such option '--raduis'"),
        (("irradiance", "disk", "--center", "0,0,2", "--normal", "0,0,1"), "Missing option '--radius'."),
        ((*DISK.split(), "--radius", "-1"), "--radius: -1.0: input should be greater than 0"),
        ((*DISK.split(), "--radius", "x"), "--radius: 'x' is no number"),
        ((*DISK.split(), "--radius", "nan"), "--radius: 'nan' is no number"),
        ((*DISK.split(), "--radius", ""), "--radius is empty"),
        ((*DISK.split(), "--radius", "1,2"), "--radius: [1, 2]: input should be a valid number"),
        ((*DISK.split(), "--center", "1,2"), "--center: '1,2' is not written as X,Y,Z"),
        ((*DISK.split(), "--center", "1"), "--center: '1' is not written as X,Y,Z"),
        ((*DISK.split(), "--center", "0,0,2m"), "--center: '2m' is no number"),
        ((*DISK.split(), "--center", "1,2,3 4,5,6 7,8,9"), "--center: '1,2,3 4,5,6 7,8,9' is not written as X,Y,Z"),
        ((*DISK.split(), "--normal", "0,0,0"), "--normal: '0,0,0' has no direction"),
        ((*DISK.split(), "--radiance", "-1"), "--radiance: -1.0 is negative"),
        ((*DISK.split(), "--radius", "1e999"), "--radius: inf: "),
        ((*DISK.split(), "--occluder", ""), "--occluder '': type: \"\" is not a known type"),
        ((*DISK.split(), "--occluder", "sphere radius"), "--occluder: 'radius' is not written as name=value"),
        ((*DISK.split(), "--occluder", "sphere radius=1"), "--occluder 'sphere radius=1': center is missing"),
        ((*DISK.split(), "--occluder", SHADE), "occluders: no closed form for a Disk past occluders; a point, spot, "),
        ((*RECTANGLE.split(), "--occluder", SHADE, "--occluder", BALL), f"--occluder '{BALL}': is a Sphere; "),
        ((*DISK.split(), "--table", "radius"), "--table: 'radius' is not written as name=first:last:count"),
        ((*DISK.split(), "--table", "raduis=1:2:3"), "there is no parameter 'raduis'; did you mean 'radius'?"),
        ((*DISK.split(), "--table", "radius=1:2:1"), "--table: a count of 1 is not between 2 and 10000"),
        ((*DISK.split(), "--table", "radius=1:2:99999999999999"), "is not between 2 and 10000"),
        ((*DISK.split(), "--table", "radius=0:2:3log"), "both must be positive"),
        ((*DISK.split(), "--table", "radius=-1:2:3"), "--table radius=-1.0: --radius: -1.0: input should be greater"),
        ((*DISK.split(), "--table", "radius=nan:2:3"), "--table: 'nan' is no number between"),
        ((*DISK.split(), "--table", "center=1:2:3"), "--table: center has components: center.x, center.y, center.z"),
        ((*DISK.split(), "--table", "center.w=1:2:3"), "--table: center has no component 'w'; known: x, y, z"),
        ((*DISK.split(), "--table", "radius.x=1:2:3"), "--table: radius is no vector X,Y,Z"),
        ((*DISK.split(), "--table", "two_sided=0:1:2"), "--table: there is no parameter 'two_sided'"),
        ((*DISK.split(), "--plot", "a.png"), "--plot draws a table; give --table as well"),
        ((*DISK.split(), "--table", "radius=1:2:3", "--plot", "a.jpg"), "--plot a.jpg: format '.jpg' is none of"),
        ((*DISK.split(), "--table", "radius=1:2:3", "--plot", "no/a.png"), "no/a.png: cannot write there: "),
    ],
    ids=lambda value: " ".join(value[-2:]) if isinstance(value, tuple) else "",
)  # fmt: skip
def test_a_slip_is_one_line_and_code_2(ask, tmp_path, line, message):
    code, output, complaint = ask("", *line)
    assert (code, output) == (2, "")
    assert complaint.startswith("oracle: ")
    assert message in complaint
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [("truth",), ("irradiance",), ("irradiance", "spot"), ("solid-angle",)])
def test_help_fits_into_80_columns(command):
    result = subprocess.run(
        [ORACLE, *command, "--help"], env={**os.environ, "COLUMNS": "80"}, capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith(f"Usage: oracle {' '.join(command)} ")
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert "..." not in re.sub(r"\[?[A-Z]+\]?\.\.\.", "", result.stdout)


def test_help_names_the_kinds_by_what_they_are_and_tells_what_has_to_be_given(ask):
    assert re.search(r"\n\nEmitters:\n  polygon .*\n  overcast_sky ", ask("irradiance --help")[1], re.DOTALL)
    assert "\nShapes:\n  polygon " in ask("solid-angle --help")[1]
    help_text = ask("irradiance spot --help")[1]
    assert re.search(r"--position X,Y,Z +in metres +\[required\]", help_text)
    assert re.search(r"--cutoff-angle NUMBER +in radians, or as 30deg +\[required\]", help_text)
    assert re.search(r"--intensity L or R,G,B +W/sr +\[default: 1\]", help_text)
