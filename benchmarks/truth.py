"""How many cases `oracle truth` answers per second, and how much memory that takes.

Runs the command on JSON lines with one emitter for all receivers, on the same as a JSON list, and on lines with an
emitter of its own for each case: ``python benchmarks/truth.py [COUNT]``, 1,000,000 without it (a tenth for the last).
"""

from __future__ import annotations

import json
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ORACLE = Path(sys.executable).with_name("oracle")
RECTANGLE = {
    "type": "rectangle",
    "center": [0, 0, 2],
    "half_u": [0, 0.5, 0],
    "half_v": [0.5, 0, 0],
    "radiance": [3, 2, 1],
}


def shared_emitter(draw: random.Random) -> dict[str, object]:
    """One rectangle and many receivers."""
    point = [draw.uniform(-1, 1), draw.uniform(-1, 1), 0.0]
    return {"quantity": "irradiance", "emitter": RECTANGLE, "receiver": {"point": point, "normal": [0, 0, 1]}}


def own_emitter(draw: random.Random) -> dict[str, object]:
    """A disk for each receiver."""
    disk = {"type": "disk", "center": [0, 0, draw.uniform(1, 9)], "normal": [0, 0, -1], "radius": draw.random() + 0.1}
    return {**shared_emitter(draw), "emitter": {**disk, "radiance": 1}}


def measure(title: str, suffix: str, count: int, case: Callable[[random.Random], dict[str, object]]) -> None:
    """Write `count` cases into a file, let the command answer them, and print what that took."""
    draw = random.Random(1)
    with tempfile.NamedTemporaryFile("w", suffix=suffix) as file:
        for index in range(count):
            before = "[" if index == 0 and suffix == ".json" else ""
            after = "" if suffix == ".jsonl" else "]" if index == count - 1 else ","
            file.write(f"{before}{json.dumps(case(draw))}{after}\n")
        file.flush()
        size = Path(file.name).stat().st_size
        start = time.monotonic()
        subprocess.run([ORACLE, "truth", file.name], stdout=subprocess.DEVNULL, check=True)
        seconds = time.monotonic() - start
    # The largest of all children so far; it grows from case to case only if the last one took more.
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{title:<40} {count / seconds:>9,.0f} cases/s {size / 1e6:>6.0f} MB file {memory:>6.0f} MiB memory")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    measure("one emitter, JSON lines", ".jsonl", count, shared_emitter)
    measure("one emitter, JSON list", ".json", count, shared_emitter)
    measure("an emitter for each case, JSON lines", ".jsonl", max(1, count // 10), own_emitter)
