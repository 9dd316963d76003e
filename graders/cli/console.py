"""How commands speak: tables for people, plain lines for pipes and logs, JSON for programs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

STYLES = {
    "right": "green",
    "wrong": "bold red",
    "undecided": "yellow",
    "ungradable": "bold red",
    "infrastructure-error": "magenta",
    "ok": "green",
    "missing": "yellow",
    "broken": "bold red",
}

_PLAIN_WIDTH = 400


def output() -> Console:
    """The console for results; without a terminal its lines are not folded, and NO_COLOR means no escapes at all."""
    console = Console(highlight=False, color_system=None if os.environ.get("NO_COLOR") else "auto")
    return console if console.is_terminal else Console(highlight=False, width=_PLAIN_WIDTH)


def print_table(console: Console, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table on terminals, tab-separated lines elsewhere; words of verdicts are coloured."""
    if not console.is_terminal:
        for row in (columns, *rows):
            print("\t".join(row))
        return
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for index, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=index == 0)
    for row in rows:
        table.add_row(*(Text(cell, style=STYLES.get(cell, "")) for cell in row))
    console.print(table)


@contextmanager
def progress(description: str, total: int) -> Iterator[Progress]:
    """A progress bar on standard error, with the time left; nothing when that is no terminal."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        bar.add_task(description, total=total)
        yield bar
