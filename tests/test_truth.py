"""`oracle truth`: any number of cases, good and bad, through real processes and within bounded memory."""

import json
import math
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter

from graders.cli import _run
from graders.cli.reading import Unreadable, read_values
from graders.errors import UsageError
from oracle import emitters, shapes
from oracle.bounded import Bounded
from oracle.irradiances import irradiance
from oracle.truth import KINDS, Answer, AnyCase, Case, evaluate

ORACLE = Path(sys.executable).with_name("oracle")
DOCS = Path(__file__).parent.parent / "docs"
DISK = {"type": "disk", "center": [0, 0, 2], "normal": [0, 0, -1], "radius": 0.5, "radiance": 10}
RECTANGLE = {"type": "rectangle", "center": [0, 0, 2], "half_u": [0, 1, 0], "half_v": [1, 0, 0], "radiance": 1}
BALL = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1}
TRIANGLE = {"type": "polygon", "vertices": [[0, 0, 1], [1, 0, 1], [0, 1, 1]]}
GOOD = {"quantity": "irradiance", "emitter": DISK, "receiver": {"point": [0, 0, 0], "normal": [0, 0, 1]}}
# E = pi L R^2 / (R^2 + d^2) on the axis.
VALUE = math.pi * 10 * 0.25 / 4.25


def environment():
    kept = {name: os.environ[name] for name in ("PATH", "HOME", "TMPDIR", "LD_LIBRARY_PATH") if name in os.environ}
    return {**kept, "LANG": "C.UTF-8", "COLUMNS": "80"}


def truth(*arguments, cwd=None, given=None):
    """Run the command in a process of its own."""
    result = subprocess.run(
        [ORACLE, "truth", *arguments], cwd=cwd, env=environment(), input=given, capture_output=True, timeout=100,
        check=False,
    )  # fmt: skip
    result.stdout, result.stderr = result.stdout.decode(), result.stderr.decode()
    assert "Traceback" not in result.stderr + result.stdout, result.stderr
    assert "Warning" not in result.stderr
    return result


@pytest.fixture
def asked(capfd, tmp_path, monkeypatch):
    """Asks what is in a file, or for "-" on standard input; gives exit code, answers and the complaint."""
    monkeypatch.chdir(tmp_path)

    def ask(content, suffix=".json"):
        if not isinstance(content, bytes):
            content = (content if isinstance(content, str) else json.dumps(content)).encode()
        if suffix == "-":
            result = truth("-", given=content)
            code, output, complaint = result.returncode, result.stdout, result.stderr
        else:
            (tmp_path / f"cases{suffix}").write_bytes(content)
            code = _run(["truth", f"cases{suffix}"])
            output, complaint = capfd.readouterr()
        assert "Traceback" not in complaint
        assert complaint.count("\n") == (1 if code else 0), complaint
        assert len(complaint) < 700
        return code, [json.loads(line) for line in output.splitlines()], complaint

    return ask


def changed(path, value, case=GOOD):
    """The good case with one field changed, or removed if the value is `...`."""
    case = json.loads(json.dumps(case))
    *parents, last = path.split("/")
    place = case
    for name in parents:
        place = place[name]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return case


# ----------------------------------------------------------------------------------------------- answers


def documented():
    text = (DOCS / "truth-format.md").read_text(encoding="utf-8")
    return json.loads(re.search(r"```json\n(.*?)```", text, re.DOTALL)[1])


def test_every_documented_case_is_answered(asked):
    code, answers, complaint = asked(documented())
    assert (code, complaint) == (0, "")
    assert [answer["index"] for answer in answers] == list(range(len(documented())))
    for answer in answers:
        assert list(answer) == ["index", "value", "unit", "error", "formula", "source"]
        assert answer["formula"]
        assert answer["source"]
        value, error = np.array(answer["value"]), np.array(answer["error"])
        assert value.shape == error.shape
        assert np.all(error <= 1e-10 * np.abs(value)), answer


def test_every_quantity_is_documented():
    assert {case["quantity"] for case in documented()} == set(KINDS)
    page = (DOCS / "truth-format.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in KINDS)


def test_the_schema_knows_every_quantity():
    schema = json.loads((DOCS / "schema" / "truth.schema.json").read_text(encoding="utf-8"))
    assert set(schema["items"]["discriminator"]["mapping"]) == set(KINDS)


def test_an_answer_is_that_of_the_library_to_the_last_digit(asked):
    _, (answer,), _ = asked([GOOD])
    light = emitters.Area(shapes.Disk([0, 0, 2], [0, 0, -1], 0.5), [10])
    found = irradiance(light, emitters.Receivers([[0, 0, 0]], [[0, 0, 1]]))
    assert (answer["value"], answer["error"]) == (found.value[0, 0], found.error[0, 0])
    assert answer["value"] == pytest.approx(VALUE, rel=1e-14)


def test_light_comes_back_in_the_form_in_which_it_was_given(asked):
    cases = [changed("emitter/radiance", radiance) for radiance in (10, [10], [10, 5, 0])]
    _, answers, _ = asked(cases)
    assert [np.shape(answer["value"]) for answer in answers] == [(), (1,), (3,)]
    one, (same,), (first, half, none) = (answer["value"] for answer in answers)
    assert one == same == first == pytest.approx(2 * half, rel=1e-15)
    assert none == 0


def test_a_normal_that_is_rounded_to_seven_digits_is_scaled_to_length_1(asked):
    _, answers, _ = asked([changed("receiver/normal", [0, 0, 1.0000005])])
    assert answers[0]["value"] == pytest.approx(VALUE, rel=1e-14)


def test_several_emitters_add_up(asked):
    both = {**changed("emitter", ...), "emitters": [DISK, {"type": "point", "position": [0, 0, 2], "intensity": 4}]}
    _, (answer,), _ = asked([both])
    assert answer["value"] == pytest.approx(VALUE + 1, rel=1e-14)


def test_an_occluder_hides_a_point_and_parallel_light(asked):
    ball = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1}
    for light in (
        {"type": "point", "position": [0, 0, 2], "intensity": 4},
        {"type": "directional", "direction": [0, 0, -1], "irradiance": 1},
    ):
        _, answers, _ = asked([{**changed("emitter", light), "occluders": there} for there in ([], [ball])])
        assert [answer["value"] for answer in answers] == [1, 0]


def test_answers_do_not_depend_on_what_else_is_asked(asked):
    draw = random.Random(4)
    cases = []
    for _ in range(200):
        case = changed("receiver/point", [draw.uniform(-1, 1) for _ in range(3)])
        cases.append(changed("emitter/radius", draw.choice([0.1, 0.2, 3]), case))
    _, answers, _ = asked(cases)
    draw.shuffle(order := list(range(200)))
    _, shuffled, _ = asked([cases[index] for index in order])
    for answer, index in zip(shuffled, order, strict=True):
        assert (answer["value"], answer["error"]) == (answers[index]["value"], answers[index]["error"])


@pytest.mark.parametrize(
    "found",
    [
        lambda: Bounded(np.full(1, 1e200) * 1e200, np.zeros(1)),
        lambda: Bounded(np.full(1, np.inf), np.zeros(1)),
        lambda: Bounded(np.zeros(1), np.full(1, np.nan)),
    ],
    ids=["overflow on the way", "infinite value", "unknown error"],
)
def test_what_leaves_the_range_of_float64_has_no_answer(found):
    class Immense(Case):
        @classmethod
        def computed(cls, together):
            return found()

    (answer,) = evaluate([Immense()])
    assert str(answer).endswith("leaves the range of float64")


def test_cases_are_computed_together_though_one_of_them_is_bad():
    model = TypeAdapter(AnyCase)
    point = {"type": "point", "position": [0, 0, 0], "intensity": 1}
    there = [changed("emitter", point, changed("receiver/point", [0, 0, -float(z)])) for z in range(100)]
    answers = evaluate([model.validate_python(case) for case in there])
    # The first receiver is at the light itself.
    assert [isinstance(answer, Answer) for answer in answers] == [False] + 99 * [True]
    assert answers[2].value == pytest.approx(0.25)


# ------------------------------------------------------------------------------------------- bad cases

BAD = [
    (changed("emitter/radius", -1), "/1/emitter/radius: -1: input should be greater than 0"),
    (changed("emitter/radius", "1"), '/1/emitter/radius: "1": input should be a valid number'),
    (changed("emitter/radius", True), "/1/emitter/radius: true: input should be a valid number"),
    (changed("emitter/radius", 1e-200), "/1/emitter/radius: 1e-200 is below 1e-18"),
    (changed("emitter/radius", 1e300), "/1/emitter/radius: 1e+300: input should be less than or equal to"),
    (changed("emitter/radius", ...), "/1/emitter/radius is missing"),
    (changed("emitter/raduis", 1), "/1/emitter/raduis is not a known key; did you mean 'radius'?"),
    (changed("emitter/center", [0, 0]), "/1/emitter/center/2 is missing"),
    (changed("emitter/normal", [0, 0, -2]), "/1/emitter/normal: [0, 0, -2] has length 2; it must be a unit vector"),
    (changed("receiver/normal", [0, 0, 1.00001]), "/1/receiver/normal: [0, 0, 1.00001] has length 1.00001; it must be"),
    (changed("emitter/radiance", [1, -2]), "/1/emitter/radiance: [1, -2] is negative; light is at least 0"),
    (changed("emitter/radiance", []), "/1/emitter/radiance: [] is empty"),
    (changed("emitter/radiance", "1"), '/1/emitter/radiance: "1" is neither a number nor a list of numbers'),
    (changed("emitter/radiance", True), "/1/emitter/radiance: true is neither a number nor a list of numbers"),
    (changed("emitter/type", "dsk"), "/1/emitter/type: \"dsk\" is not a known type; did you mean 'disk'?"),
    (changed("emitter", 5), "/1/emitter"),
    (changed("emitter", ...), "needs either emitter or emitters"),
    (changed("emitters", [DISK]), "needs either emitter or emitters"),
    (changed("quantity", "iradiance"), "\"iradiance\" is not a known quantity; did you mean 'irradiance'?"),
    (changed("quantity", ["irradiance"]), "/1/quantity is no text; known: irradiance"),
    (changed("quantity", ...), "/1/quantity is missing; known: irradiance"),
    (changed("occluders", [BALL]), "/1: occluders: no closed form for a Disk past occluders"),
    (
        {**changed("emitter", RECTANGLE), "occluders": [TRIANGLE, BALL]},
        "/1/occluders/1: is a Sphere; a Polygon, Rectangle or Mesh is supported",
    ),
    (
        {**changed("emitter", ...), "emitters": [DISK, {**DISK, "radiance": [1, 2]}]},
        "/1/emitters/1: has 2 channels, emitter[0] has 1",
    ),
    (
        changed("emitter", {"type": "polygon", "vertices": [[0, 0, 1]] * 3, "radiance": 1}),
        "/1/emitter: vertices enclose no area",
    ),
    (
        changed("emitter", {**DISK, "type": "rectangle", "half_u": [1, 0, 0], "half_v": [1, 1, 0]}),
        "/1/emitter/normal is not a known key; known: center, half_u, half_v, radiance, two_sided, type (and 1 more)",
    ),
    ([], "/1: is not an object"),
    (None, "/1: is not an object"),
    ({"quantity": "slab_reflectance", "cosine": 2, "eta": 1.5}, "/1/cosine: 2: input should be less than or equal"),
    ({"quantity": "closed_box", "emission": 1, "reflectance": 1}, "/1: "),
    ({"quantity": "closed_box", "emission": 1, "reflectance": 1.5}, "/1/reflectance: 1.5 is above 1"),
    ({"quantity": "closed_box", "emission": 1, "reflectance": [0, 1.1]}, "/1/reflectance: [0, 1.1] is above 1"),
    ({"quantity": "closed_box", "emission": 1, "reflectance": 0.5, "bounces": 1.5}, "/1/bounces"),
    ({"quantity": "phong_albedo", "cosine": 1, "exponent": 2.5}, "/1/exponent: 2.5: input should be a valid integer"),
]  # fmt: skip


@pytest.fixture(scope="module")
def complaints(tmp_path_factory):
    """All bad cases in one run, each after a good one."""
    path = tmp_path_factory.mktemp("bad") / "cases.jsonl"
    path.write_text("".join(f"{json.dumps(GOOD)}\n{json.dumps(case)}\n" for case, _ in BAD))
    result = truth("cases.jsonl", cwd=path.parent)
    assert result.returncode == 2
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert len(lines) == 2 * len(BAD)
    assert all("value" in line for line in lines[::2])
    assert result.stderr.startswith(f"oracle: {lines[1]['invalid']}; {len(BAD) - 1} more without an answer")
    return lines[1::2]


@pytest.mark.parametrize("number", range(len(BAD)))
def test_a_bad_case_is_told_with_its_place_and_costs_no_other(complaints, number):
    line = complaints[number]
    assert set(line) == {"index", "invalid"}
    expected = BAD[number][1].replace("/1", f"/{2 * number + 1}", 1)
    assert line["invalid"].startswith(f"cases.jsonl: /{2 * number + 1}")
    assert expected in line["invalid"]


@pytest.mark.parametrize("suffix", [".json", ".jsonl"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"quantity": NaN}', "NaN is no JSON number"),
        ('{"quantity": -Infinity}', "-Infinity is no JSON number"),
        ('{"quantity": "irradiance", "quantity": 1}', 'an object names the key "quantity" twice'),
        (f'{{"quantity": {"9" * 5000}}}', "a number has too many digits"),
        (json.dumps(GOOD).replace("0.5", "1e999"), "inf"),
        (json.dumps(GOOD).replace("0.5", "9" * 400), "radius"),
        ('"' + "x" * 5000 + '"', "is not an object"),
        (f'{{"quantity": "{"x" * 5000}"}}', "is not a known quantity"),
        (json.dumps({**GOOD, "\u2028\x1b" * 20: 1}), "is not a known key"),
    ],
    ids=["NaN", "Infinity", "twice", "digits", "overflow", "huge", "text", "long", "escapes"],
)
def test_what_is_no_case_costs_no_other_in_lists_and_lines(asked, suffix, text, message):
    good = json.dumps(GOOD)
    content = f"[{good}, {text}, {good}]" if suffix == ".json" else f"{good}\n{text}\n\n{good}\n"
    code, answers, complaint = asked(content, suffix)
    assert code == 2
    assert [answer["index"] for answer in answers] == [0, 1, 2]
    assert message in answers[1]["invalid"]
    assert "\x1b" not in complaint
    assert complaint.startswith(f"oracle: cases{suffix}: /1")
    assert answers[0]["value"] == answers[2]["value"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"{", "line 2, column 2: not JSON: "),
        (b'{"a": "\xe4"}', "line 2, byte 7 is not UTF-8"),
        (b"[" * 100_000, "line 2: nested too deeply"),
        (b'{"a": ' * 100_000, "line 2: nested too deeply"),
        (json.dumps(GOOD).encode() * 2, "not JSON: Extra data"),
        (b"\x00", "not JSON"),
    ],
    ids=["truncated", "latin-1", "deep list", "deep object", "two", "zero byte"],
)
def test_a_line_that_is_no_json_costs_only_itself(asked, line, message):
    good = json.dumps(GOOD).encode()
    code, answers, _ = asked(good + b"\n" + line + b"\n" + good, ".jsonl")
    assert (code, len(answers)) == (2, 3)
    assert answers[1]["invalid"].startswith("cases.jsonl: /1: ")
    assert message in answers[1]["invalid"]
    assert answers[2]["value"] == answers[0]["value"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[%s, %s", "the list does not end"),
        (b"[%s, %s, ", "line 1, column "),
        (b"[%s,\n %s,]", "line 2, column "),
        (b"[%s, %s }", "expecting , or ]"),
        (b"[%s, %s] 1", "something follows the list"),
        (b"[%s, %s, {\"a\": \"\xe4", "is not UTF-8"),
        (b"[%s, %s, " + b"[" * 100_000, "nested too deeply"),
        (b"[%s, %s, tru", "not JSON"),
        (b"[%s, %s, \"open", "not JSON: Unterminated string"),
    ],
    ids=["end", "comma", "no value", "brace", "more", "latin-1", "deep", "word", "string"],
)  # fmt: skip
def test_a_broken_list_is_answered_up_to_its_fault(asked, content, message):
    good = json.dumps(GOOD).encode()
    code, answers, complaint = asked(content.replace(b"%s", good), ".json")
    assert (code, [answer["index"] for answer in answers]) == (2, [0, 1])
    assert complaint.startswith("oracle: cases.json: ")
    assert message in complaint


def test_standard_input_may_hold_a_list_or_lines(asked):
    good = json.dumps(GOOD)
    for content in (f"[{good}, 5]", f"{good}\n5"):
        code, answers, complaint = asked(content, "-")
        assert (code, len(answers)) == (2, 2)
        assert complaint == "oracle: standard input: /1: is not an object\n"


def test_an_empty_list_and_no_lines_have_no_answers(asked):
    for content, suffix in (("[]", ".json"), (" [ \n ] \n", ".json"), ("", ".jsonl"), ("\n \n", "-")):
        assert asked(content, suffix) == (0, [], "")


@pytest.mark.parametrize("content", ["", "{}", "5", '"text"', json.dumps(GOOD)], ids=len)
def test_a_json_file_that_is_no_list_is_code_2(asked, content):
    code, answers, complaint = asked(content, ".json")
    assert (code, answers) == (2, [])
    assert complaint.startswith("oracle: cases.json: not a JSON list of cases: ")


def test_a_byte_order_mark_is_no_error(asked):
    good = json.dumps(GOOD)
    for content, suffix in ((f"[{good}]", ".json"), (good, ".jsonl"), (f"[{good}]", "-")):
        code, answers, _ = asked(b"\xef\xbb\xbf" + content.encode(), suffix)
        assert (code, len(answers)) == (0, 1)


def test_files_that_cannot_be_read_are_code_2(tmp_path):
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "secret.json").touch(mode=0)
    for name, message in (
        (tmp_path / "folder.json", f"{tmp_path}/folder.json: Is a directory"),
        ("missing.json", "missing.json: No such file or directory"),
        ("/proc/self/mem", "/proc/self/mem: Input/output error"),
        *([(tmp_path / "secret.json", f"{tmp_path}/secret.json: Permission denied")] if os.getuid() else []),
    ):
        result = truth(name)
        assert (result.returncode, result.stdout, result.stderr) == (2, "", f"oracle: {message}\n")


# ----------------------------------------------------------------------------------------- streams


def test_numbers_are_written_in_the_shortest_form_that_gives_them_again():
    result = truth("-", given=json.dumps(GOOD).encode())
    written = re.search(r'"value": (\S+),', result.stdout)[1]
    assert written == repr(float(written))


def test_whoever_waits_for_an_answer_before_asking_on_gets_it():
    with subprocess.Popen([ORACLE, "truth", "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        for index in range(3):
            process.stdin.write(json.dumps(GOOD).encode() + b"\n")
            process.stdin.flush()
            assert json.loads(process.stdout.readline())["index"] == index
        process.stdin.close()
        assert process.wait(20) == 0


def test_a_reader_that_has_had_enough_ends_the_work_early():
    line = json.dumps(GOOD)
    # Endless cases: only the reader that leaves can end this.
    script = f"yes '{line}' | $O truth - | head -2 | cut -c1-12"
    start = time.monotonic()
    result = subprocess.run(
        ["bash", "-c", script], env={**environment(), "O": str(ORACLE)}, capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert (result.stdout, result.stderr) == ('{"index": 0,\n{"index": 1,\n', "")
    assert time.monotonic() - start < 30


@pytest.mark.parametrize("suffix", [".json", ".jsonl"])
def test_memory_does_not_grow_with_the_number_of_cases(suffix, tmp_path):
    """What is read is ten times as long as the pieces in which that happens."""
    good = json.dumps(GOOD)
    count = 60_000
    path = tmp_path / f"cases{suffix}"
    path.write_text("[" + ",\n".join([good] * count) + "]" if suffix == ".json" else f"{good}\n" * count)
    assert path.stat().st_size > 10e6
    code = f"""
import resource, sys, graders.cli.truth as truth
truth.answers = lambda values: [None] * len(values)
truth._placed = lambda *_: "x"
from pathlib import Path
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try: truth.run_truth(Path({str(path)!r}))
except truth.UsageError as error: assert "{count - 1} more without an answer" in str(error)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, file=sys.stderr)
"""
    result = subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=True)
    # Some MiB of parsed cases for one of text; all of them would be 130.
    assert int(result.stderr) / 1024 < 60


class Trickle:
    """A stream that gives a few bytes at a time, within characters and numbers."""

    def __init__(self, content, size):
        self.content, self.size = content, size

    def read1(self, _):
        here, self.content = self.content[: self.size], self.content[self.size :]
        return here


@pytest.mark.parametrize("size", [*range(3, 20), 64])
def test_however_a_stream_is_cut_the_values_are_the_same(size):
    values = [{"a": "ä🫖", "b": [1.5e-7, 123456, True]}, 1234567, 'Ünicode " [', [], {}, None, -1.5]
    text = json.dumps(values, ensure_ascii=False, indent=1).encode()
    batches = read_values(Trickle(text, size), "x", True)
    assert [value for batch in batches for value in batch] == values
    lines = "\n".join(json.dumps(value, ensure_ascii=False) for value in values[:1] + values).encode()
    batches = read_values(Trickle(lines, size), "x", False)
    assert [value for batch in batches for value in batch] == values[:1] + values


@pytest.mark.parametrize("size", [3, 10, 10_000])
def test_however_a_broken_stream_is_cut_the_fault_is_found(size):
    for text, count, fault in (
        (b'[1,\n 2,\n {"a": NaN},\n "x', 3, "line 4, column 2: not JSON: Unterminated string"),
        (b'[1, "\xe4"]', 1, "byte 5 is not UTF-8"),
        (b"[1, 2\n 3]", 2, "line 2, column 2: not JSON: expecting , or ]"),
    ):
        found = []
        with pytest.raises(UsageError, match=re.escape(f"x: {fault}")):
            found.extend(value for batch in read_values(Trickle(text, size), "x", True) for value in batch)
        assert len(found) == count
        assert [type(value) for value in found if not isinstance(value, int)] == [Unreadable] * (
            count - 2 if count > 2 else 0
        )


def test_a_long_value_is_not_read_again_and_again():
    text = b'["' + b"x" * 3_000_000 + b'", 1]'
    start = time.monotonic()
    (long, one) = (value for batch in read_values(Trickle(text, 4096), "x", True) for value in batch)
    assert (len(long), one) == (3_000_000, 1)
    assert time.monotonic() - start < 5  # 0.05 s; quadratic reading takes a minute


def test_a_line_or_value_without_end_is_refused():
    class Endless:
        first = b"["

        def read1(self, size):
            here, self.first = self.first + b'"' + b"x" * size, b""
            return here.replace(b'"', b"") if here[:1] == b'"' else here

    with pytest.raises(UsageError, match="x: line 1, column 2: not JSON: a value is longer than 64 MiB"):
        list(read_values(Endless(), "x", True))
    endless = Endless()
    endless.first = b"1"
    with pytest.raises(UsageError, match="x: a line is longer than 64 MiB"):
        list(read_values(endless, "x", False))
