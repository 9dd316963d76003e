"""Sweeps of one parameter: a table, and a curve in the terminal or in a file."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from graders.cli.console import output, print_table
from graders.errors import UsageError
from oracle.truth import Answer

_MOST = 10_000
_FORMATS = (".png", ".svg")
# Values that span more than this are drawn on a logarithmic axis.
_SPAN = 1e3
_WIDEST = 100
_COLOURS = ("red", "green", "blue")


@dataclass(frozen=True)
class Sweep:
    """Values that a parameter takes one after another."""

    name: str
    values: list[float]
    logarithmic: bool

    @classmethod
    def parse(cls, text: str) -> Sweep:
        """A sweep written as name=first:last:count, or with "log" after the count."""
        found = re.fullmatch(r"([^=]+)=([^:]+):([^:]+):(\d+)(log)?", text.strip())
        if not found:
            raise UsageError(
                f"--table: {text[:80]!r} is not written as name=first:last:count or name=first:last:countlog"
            )
        name, first, last = found[1], _number(found[2]), _number(found[3])
        count = int(found[4]) if len(found[4]) < 10 else _MOST + 1
        if not 2 <= count <= _MOST:
            raise UsageError(f"--table: a count of {found[4][:20]} is not between 2 and {_MOST}")
        if found[5] and not (first > 0 and last > 0):
            raise UsageError(
                f"--table: a logarithmic sweep from {first:g} to {last:g} is not possible, both must be positive"
            )
        spaced = np.geomspace(first, last, count) if found[5] else np.linspace(first, last, count)
        return cls(name.strip(), spaced.tolist(), bool(found[5]))


def _number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not abs(number) <= 1e18:
        raise UsageError(f"--table: {text[:80]!r} is no number between -1e18 and 1e18")
    return number


@dataclass(frozen=True)
class Table:
    """What a sweep found."""

    quantity: str
    sweep: Sweep
    answers: list[Answer]

    @property
    def unit(self) -> str:
        """Unit of values and errors."""
        return self.answers[0].unit

    @property
    def values(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Values, shape (N, C)."""
        return np.array([np.atleast_1d(answer.value) for answer in self.answers])

    @property
    def errors(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Error bounds, shape (N, C)."""
        return np.array([np.atleast_1d(answer.error) for answer in self.answers])

    @property
    def title(self) -> str:
        """What is drawn."""
        return f"{self.quantity} [{self.unit}]"

    def is_logarithmic(self) -> bool:
        """Whether the values ask for a logarithmic axis."""
        values = self.values
        return bool(values.min() > 0 and values.max() > _SPAN * values.min())


def require_drawable(plot: Path, sweep: Sweep | None) -> None:
    """Raise UsageError unless there is something to draw, in a format that is known."""
    if sweep is None:
        raise UsageError("--plot draws a table; give --table as well")
    if plot.suffix.lower() not in _FORMATS:
        raise UsageError(f"--plot {plot}: format {plot.suffix!r} is none of {', '.join(_FORMATS)}")


def print_table_of(table: Table, plot: Path | None, as_json: bool) -> None:
    """Print a table, and draw it into a file or, without one, on a terminal."""
    if plot:
        _draw_file(table, plot)
    if as_json:
        rows = [
            {table.sweep.name: value, "value": answer.value, "error": answer.error}
            for value, answer in zip(table.sweep.values, table.answers, strict=True)
        ]
        law = table.answers[0].law
        print(json.dumps({"unit": table.unit, "formula": law.formula, "source": law.source, "rows": rows}, indent=1))
        return
    console = output()
    if console.is_terminal:
        _print_for_people(table, console)
    else:
        _print_for_programs(table, console)
    if plot:
        console.print(str(plot), markup=False, soft_wrap=True)
    elif console.is_terminal:
        _draw_terminal(table, min(console.width, _WIDEST))


def _print_for_people(table: Table, console: Console) -> None:
    """Few digits, and of all channels' error bounds the largest."""
    channels = table.values.shape[1]
    names = [table.quantity] if channels == 1 else [f"channel {index}" for index in range(channels)]
    rows = [
        (f"{x:.9g}", *(f"{value:.9g}" for value in values), f"{max(errors):.1e}")
        for x, values, errors in zip(table.sweep.values, table.values.tolist(), table.errors.tolist(), strict=True)
    ]
    console.print(table.title, markup=False)
    print_table(console, (table.sweep.name, *names, "error below"), rows)


def _print_for_programs(table: Table, console: Console) -> None:
    """All digits."""
    channels = table.values.shape[1]
    names = [""] if channels == 1 else [f" {index}" for index in range(channels)]
    columns = (table.sweep.name, *(f"{table.title}{name}" for name in names), *(f"error{name}" for name in names))
    rows = [
        [repr(number) for number in (x, *values, *errors)]
        for x, values, errors in zip(table.sweep.values, table.values.tolist(), table.errors.tolist(), strict=True)
    ]
    print_table(console, columns, rows)


def _draw_terminal(table: Table, width: int) -> None:
    import plotext  # type: ignore[import-untyped]

    figure = plotext.figure
    figure.plot_size(width, 20)
    figure.theme("default" if output().color_system else "colorless")
    for channel, values in enumerate(table.values.T.tolist()):
        signal = figure.signal(table.sweep.values, values, marker="braille")
        signal.lines()
        if table.values.shape[1] > 1:
            signal.label(f"channel {channel}")
        figure.draw(signal)
    for axis, logarithmic in (("x", table.sweep.logarithmic), ("y", table.is_logarithmic())):
        if logarithmic:
            figure.ruler(axis).scale("log")
    figure.title(table.title)
    figure.label(table.sweep.name)
    text = str(figure.build())
    print(text if output().color_system else plotext.uncolorize(text))


def _draw_file(table: Table, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4), layout="constrained")
    axes = figure.subplots()
    channels = table.values.shape[1]
    for channel, values in enumerate(table.values.T.tolist()):
        colour = _COLOURS[channel] if channels == 3 else None
        axes.plot(table.sweep.values, values, color=colour, label=f"channel {channel}")
    if channels > 1:
        axes.legend()
    if table.sweep.logarithmic:
        axes.set_xscale("log")
    if table.is_logarithmic():
        axes.set_yscale("log")
    axes.set_xlabel(table.sweep.name)
    axes.set_ylabel(table.title)
    axes.set_title(table.answers[0].law.formula, fontsize="small", parse_math=False)
    axes.grid(alpha=0.3)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise UsageError(f"{path}: cannot write there: {error.strerror or error}") from None
