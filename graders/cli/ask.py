"""`oracle irradiance` and `oracle solid-angle`: one case from flags, or with `--table` many of them."""

from __future__ import annotations

import copy
import json
import math
import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, get_args

import click
from pydantic import BaseModel

from graders.cli.console import output
from graders.cli.tables import Sweep, Table, print_table_of, require_drawable
from graders.cli.truth import answers
from graders.errors import UsageError
from oracle.arrays import InvalidArgument
from oracle.truth import Answer
from oracle.truth.fields import require_unit
from oracle.truth.solid_angle import SolidShape
from oracle.truth.things import Emitter
from reference_scenes.loading import suggest

_NUMBER = re.compile(r"(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)(?P<degrees>deg)?")
_AXES = {"x": 0, "y": 1, "z": 2}
_UNIT_HELP = {"m": "in metres", "rad": "in radians, or as 30deg", "unit vector": "direction, of any length"}


@dataclass(frozen=True)
class Parameter:
    """An option that fills one field of a case."""

    path: tuple[str, ...]
    default: str | None = None
    is_flag: bool = False
    is_direction: bool = False
    metavar: str = "X,Y,Z"
    help: str = ""


@dataclass(frozen=True)
class Question:
    """A quantity that flags can ask for: of some kind of thing, at some place."""

    quantity: str
    thing: str
    kinds: Mapping[str, type[BaseModel]]
    place: Mapping[str, Parameter]
    takes_occluders: bool = False

    def parameters(self, kind: str) -> dict[str, Parameter]:
        """The options for one kind of thing."""
        fields = self.kinds[kind].model_fields
        # The shape comes first, then how it shines.
        names = sorted((name for name in fields if name != "type"), key=lambda name: name in ("radiance", "two_sided"))
        return {name: self._parameter(kind, name) for name in names} | dict(self.place)

    def _parameter(self, kind: str, name: str) -> Parameter:
        field = self.kinds[kind].model_fields[name]
        is_light = (field.description or "").startswith("W/")
        lists = {"vertices": '"X,Y,Z X,Y,Z X,Y,Z"', "triangles": '"I,J,K I,J,K"'}
        return Parameter(
            (self.thing, name),
            default="1" if is_light else None,
            is_flag=field.annotation is bool,
            is_direction=any(getattr(one, "func", None) is require_unit for one in field.metadata),
            metavar=lists.get(name, "L or R,G,B" if is_light else "NUMBER" if field.annotation is float else "X,Y,Z"),
            help=_UNIT_HELP.get(field.description or "", field.description or ""),
        )


def _kinds(union: Any, *left_out: str) -> dict[str, type[BaseModel]]:
    """The members of a discriminated union by their `type`."""
    named = {kind.model_fields["type"].default: kind for kind in get_args(get_args(union)[0])}
    return {name: kind for name, kind in named.items() if name not in left_out}


_RECEIVER = {
    "point": Parameter(("receiver", "point"), "0,0,0", help="where the light arrives, in metres"),
    "facing": Parameter(
        ("receiver", "normal"), "0,0,1", is_direction=True, help="the receiver's normal, of any length"
    ),
}
_POINT = {"point": Parameter(("point",), "0,0,0", help="where it is seen from, in metres")}
QUESTIONS = {
    # A map has more texels than a command line has room for.
    "irradiance": Question("irradiance", "emitter", _kinds(Emitter, "map"), _RECEIVER, takes_occluders=True),
    "solid-angle": Question("solid_angle", "shape", _kinds(SolidShape), _POINT),
}


# --------------------------------------------------------------------------------------------- command


def command(name: str, kind: str) -> click.Command:
    """The command that asks one question about one kind of thing; raises UsageError with a suggestion."""
    question = QUESTIONS[name]
    if kind not in question.kinds:
        raise UsageError(f"there is no {question.thing} {kind!r}; {suggest(kind, list(question.kinds))}")
    parameters = question.parameters(kind)
    options: list[click.Parameter] = [
        click.Option(
            [f"--{field.replace('_', '-')}", field],
            default=False if parameter.is_flag else parameter.default,
            is_flag=parameter.is_flag,
            show_default=parameter.default is not None,
            metavar=None if parameter.is_flag else parameter.metavar,
            help=parameter.help if parameter.is_flag or parameter.default else f"{parameter.help}  [required]",
        )
        for field, parameter in parameters.items()
    ]
    if question.takes_occluders:
        what = 'What hides light, as "rectangle center=0,0,1 half_u=.1,0,0 half_v=0,.1,0"; repeatable.'
        options.append(click.Option(["--occluder", "occluders"], multiple=True, metavar="TEXT", help=what))
    options += [
        click.Option(["--table"], metavar="NAME=A:B:N[log]", help="Sweep a parameter, such as radius=0.1:10:20log."),
        click.Option(["--plot"], metavar="FILE", type=click.Path(path_type=Path), help="Draw the table: .png or .svg."),
        click.Option(["--json", "as_json"], is_flag=True, help="Print JSON."),
    ]

    def run(table: str | None, plot: Path | None, as_json: bool, occluders: tuple[str, ...] = (), **given: Any) -> None:
        _run(question, kind, parameters, given, occluders, table, plot, as_json)

    summary = " ".join((question.kinds[kind].__doc__ or "").replace("`", "").split())
    return click.Command(kind, callback=run, params=options, help=summary, short_help=summary)


def _run(
    question: Question,
    kind: str,
    parameters: dict[str, Parameter],
    given: dict[str, Any],
    occluders: tuple[str, ...],
    table: str | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    sweep = Sweep.parse(table) if table else None
    if plot:
        require_drawable(plot, sweep)
    case: dict[str, Any] = {"quantity": question.quantity, question.thing: {"type": kind}}
    swept = _swept(sweep, parameters) if sweep else ("", None)
    for name, parameter in parameters.items():
        value = given[name]
        if value is not None:
            _put(case, parameter.path, value if parameter.is_flag else _checked(parameter, value, _option(name)))
        elif swept != (name, None):
            raise UsageError(f"Missing option '{_option(name)}'.")
    if occluders:
        case["occluders"] = [_thing(text, "--occluder") for text in occluders]
    directions = [parameter.path for parameter in parameters.values() if parameter.is_direction]
    if not sweep:
        _scale(case, directions)
        answer = answers([case])[0]
        if not isinstance(answer, Answer):
            raise UsageError(_in_options(answer, parameters, occluders))
        _print(question, case, answer, as_json)
        return

    cases = []
    for value in sweep.values:
        one = copy.deepcopy(case)
        _put_swept(one, parameters, swept, value)
        _scale(one, directions)
        cases.append(one)
    found = []
    for value, answer in zip(sweep.values, answers(cases), strict=True):
        if not isinstance(answer, Answer):
            complaint = _in_options(answer, parameters, occluders)
            raise UsageError(f"--table {sweep.name}={value!r}: {complaint}")
        found.append(answer)
    print_table_of(Table(question.quantity.replace("_", " "), sweep, found), plot, as_json)


# ---------------------------------------------------------------------------------------- from words


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _checked(parameter: Parameter, text: str, option: str) -> Any:
    """A value as it is parsed; a vector has three components, and a direction a length."""
    value = _parsed(text, option)
    if parameter.metavar == "X,Y,Z":
        if not isinstance(value, list) or len(value) != 3 or any(isinstance(one, list) for one in value):
            raise UsageError(f"{option}: {text[:80]!r} is not written as X,Y,Z")
        if parameter.is_direction and not any(value):
            raise UsageError(f"{option}: {text[:80]!r} has no direction")
    return value


def _parsed(text: str, option: str) -> Any:
    """A number, a vector or channels written as 1,2,3, or several of them with blanks or semicolons between."""
    words = re.sub(r"\s*,\s*", ",", text.strip())
    rows = [[_number(word, option) for word in row.split(",")] for row in re.split(r"[;\s]+", words) if row]
    if not rows:
        raise UsageError(f"{option} is empty")
    if len(rows) > 1:
        return rows
    return rows[0][0] if len(rows[0]) == 1 else rows[0]


def _number(word: str, option: str) -> float:
    found = _NUMBER.fullmatch(word)
    if not found:
        raise UsageError(f"{option}: {word[:80]!r} is no number")
    number = float(found["number"])
    if found["degrees"]:
        return math.radians(number)
    return int(number) if word.isdigit() and number < 2**53 else number


def _thing(text: str, option: str) -> dict[str, Any]:
    """A thing written as its type and fields, each name=value."""
    kind, *fields = text.split() or [""]
    thing: dict[str, Any] = {"type": kind}
    for item in fields:
        name, equals, value = item.partition("=")
        if not equals:
            raise UsageError(f"{option}: {item[:80]!r} is not written as name=value")
        thing[name] = _parsed(value, f"{option} {name}")
    return thing


def _put(case: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    for name in path[:-1]:
        case = case.setdefault(name, {})
    case[path[-1]] = value


def _scale(case: dict[str, Any], directions: list[tuple[str, ...]]) -> None:
    """Give directions the length 1; what is no direction is left to the checks of cases."""
    for part, name in directions:
        value = case[part][name]
        if isinstance(value, list) and len(value) == 3 and all(isinstance(one, int | float) for one in value):
            length = math.hypot(*value)
            if 0 < length < math.inf:
                case[part][name] = [one / length for one in value]


# --------------------------------------------------------------------------------------------- sweeps


def _swept(sweep: Sweep, parameters: dict[str, Parameter]) -> tuple[str, int | None]:
    """The parameter of a sweep, and which of its components."""
    name, dot, component = sweep.name.replace("-", "_").partition(".")
    known = [known for known, parameter in parameters.items() if not parameter.is_flag]
    if name not in known:
        raise UsageError(f"--table: there is no parameter {name[:80]!r}; {suggest(name, known)}")
    if not dot:
        if parameters[name].metavar == "X,Y,Z":
            raise UsageError(f"--table: {name} has components: {name}.x, {name}.y, {name}.z")
        return name, None
    if component not in _AXES:
        raise UsageError(f"--table: {name} has no component {component[:80]!r}; known: x, y, z")
    return name, _AXES[component]


def _put_swept(case: Any, parameters: dict[str, Parameter], swept: tuple[str, int | None], value: float) -> None:
    name, component = swept
    path = parameters[name].path
    if component is None:
        _put(case, path, value)
        return
    vector = reduce(getitem, path, case)
    if not isinstance(vector, list) or len(vector) != 3:
        raise UsageError(f"--table: {name} is no vector X,Y,Z")
    vector[component] = value


# --------------------------------------------------------------------------------------------- answers


def _in_options(error: InvalidArgument, parameters: dict[str, Parameter], occluders: tuple[str, ...]) -> str:
    """A complaint about a case in the words of the command line."""
    text = str(error)
    found = re.match(r"/?occluders[/[](\d+)[]/:]*", text)
    if found:
        return f"--occluder {occluders[int(found[1])][:80]!r}: {text[found.end() :].strip()}"
    for name, parameter in parameters.items():
        pointer = "/" + "/".join(parameter.path)
        if text.startswith(pointer) and text[len(pointer) : len(pointer) + 1] in (":", "/", " "):
            return _option(name) + text[len(pointer) :]
    return text.removeprefix("/")


def _print(question: Question, case: dict[str, Any], answer: Answer, as_json: bool) -> None:
    if as_json:
        document = {
            "value": answer.value,
            "unit": answer.unit,
            "error": answer.error,
            "formula": answer.law.formula,
            "source": answer.law.source,
            "case": case,
        }
        print(json.dumps(document, indent=1))
        return
    console = output()
    if not console.is_terminal:
        for label, cells in (
            ("value", _channels(answer.value)),
            ("unit", [answer.unit]),
            ("error", _channels(answer.error)),
            ("formula", [answer.law.formula]),
            ("source", [answer.law.source]),
        ):
            print("\t".join((label, *cells)))
        return
    bound = ", ".join(f"{error:.1e}" for error in _numbers(answer.error))
    for label, text in (
        (question.quantity.replace("_", " "), f"{', '.join(_channels(answer.value))} {answer.unit}"),
        ("error below", f"{bound} {answer.unit}"),
        ("formula", answer.law.formula),
        ("source", answer.law.source),
    ):
        lines = textwrap.wrap(text, max(console.width - 14, 20))
        console.print(f"{label:<13} {lines[0]}", markup=False, soft_wrap=True)
        for line in lines[1:]:
            console.print(f"{'':<13} {line}", markup=False, soft_wrap=True)


def _numbers(value: float | list[float]) -> list[float]:
    return value if isinstance(value, list) else [value]


def _channels(value: float | list[float]) -> list[str]:
    return [repr(one) for one in _numbers(value)]
