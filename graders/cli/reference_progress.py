"""How far a rendering is: a bar with the time left on terminals, now and then a line elsewhere."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

# Without a terminal there is a line no more often than this [s].
LINE_SECONDS = 10.0


@dataclass
class Status:
    """How far a rendering is; the rendering writes it, and whoever shows it reads it.

    `samples` per pixel are there of `expected` ones, maybe infinitely many; `before` of them were there at the start,
    `seconds` ago. `limit` is how many seconds it may take, and `error` the relative standard error reached.
    """

    name: str
    before: int = 0
    samples: float = 0.0
    expected: float = math.inf
    seconds: float = 0.0
    limit: float = math.inf
    error: float | None = None

    @property
    def seconds_left(self) -> float:
        """How long it will take at this speed, maybe infinitely long."""
        done = self.samples - self.before
        wanted = self.seconds * (self.expected - self.samples) / done if done > 0 else math.inf
        return max(0.0, min(wanted, self.limit - self.seconds))

    @property
    def part(self) -> float:
        """The part of the time that is over."""
        left = self.seconds_left
        return 0.0 if math.isinf(left) else self.seconds / (self.seconds + left) if self.seconds else 1.0

    def __str__(self) -> str:
        words = [f"{self.samples:.0f} samples per pixel"]
        if self.error is not None:
            words.append(f"standard error {percent(self.error)}")
        words.append(clock(self.seconds))
        if not math.isinf(self.seconds_left):
            words.append(f"{clock(self.seconds_left)} left")
        return ", ".join(words)


@dataclass
class Display:
    """What shows a status."""

    status: Status
    is_plain: bool
    _last: float = field(default_factory=time.monotonic)

    def line(self) -> None:
        """Print a line, unless there is a bar or was a line a moment ago."""
        if self.is_plain and time.monotonic() - self._last >= LINE_SECONDS:
            self._last = time.monotonic()
            print(f"{self.status.name}: {self.status}", file=sys.stderr)

    def __rich__(self) -> Table:
        row = Table.grid(padding=(0, 1))
        row.add_row(self.status.name, ProgressBar(1.0, self.status.part, width=20), str(self.status))
        return row


@contextmanager
def shown(status: Status) -> Iterator[Display]:
    """Show a status on standard error as long as it changes."""
    console = Console(stderr=True)
    display = Display(status, not console.is_terminal)
    if display.is_plain:
        yield display
        return
    with Live(display, console=console, refresh_per_second=4, transient=True):
        yield display


def percent(value: float) -> str:
    """A part in percent with three significant digits."""
    return f"{100 * value:.3g} %"


def clock(seconds: float) -> str:
    """A time as people say it."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 120 else f"{minutes / 60:.1f} h"
