"""How many quad irradiances per second one core computes, and how much memory a map of 4096 x 4096 takes.

``python benchmarks/irradiance.py``; ``--quick`` takes a smaller map. The map runs in a process of its own, whose peak
memory includes the map itself (value and bound) and its 16.8 million points.
"""

# The environment has to be set before numpy is imported.
# ruff: noqa: E402

import os

# One core.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse
import resource
import statistics
import subprocess
import sys
import time

import numpy as np

from oracle.emitters import Area, Receivers
from oracle.irradiances import irradiance
from oracle.shapes import Rectangle

TARGET_RATE = 2e6
TARGET_MEMORY = 1.0
REPETITIONS = 7


def quad() -> Area:
    """A quad of size 1 at the height 1, shining down."""
    return Area(Rectangle(np.array([0.0, 0, 1]), np.array([0, 0.5, 0]), np.array([0.5, 0, 0])), np.ones(1))


def receivers(count: int, tilted: bool) -> Receivers:
    """Points below the quad; tilted ones see it cut by their horizon, here and there."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-2, 2, (count, 2)), np.zeros(count)])
    normals = rng.normal(size=(count, 3)) if tilted else np.tile([0.0, 0, 1], (count, 1))
    return Receivers(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def rates(tilted: bool, count: int = 1 << 20) -> list[float]:
    """Irradiances per second, in several repetitions."""
    light, where, result = quad(), receivers(count, tilted), []
    irradiance(light, where)
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        irradiance(light, where)
        result.append(count / (time.perf_counter() - start))
    return result


def whole_map(size: int) -> None:
    """Compute a map in this process and print its peak memory in GiB."""
    axis = np.linspace(-2, 2, size)
    points = np.zeros((size, size, 3))
    points[..., 0], points[..., 1] = axis, axis[:, None]
    where = Receivers(points, np.array([0.0, 0, 1]))
    del points
    irradiance(quad(), where)
    # Linux counts in KiB, macOS in bytes.
    unit = 1 if sys.platform == "darwin" else 1024
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30)


def main() -> None:
    """Print a table; the exit code is 1 if a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a map of 512 x 512")
    parser.add_argument("--map", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.map:
        whole_map(arguments.map)
        return
    missed = False
    for tilted in (False, True):
        measured = rates(tilted)
        best, median = max(measured) / 1e6, statistics.median(measured) / 1e6
        missed |= max(measured) < TARGET_RATE
        kind = "tilted at random" if tilted else "facing up"
        print(f"quad irradiances, {kind}: best {best:.2f}, median {median:.2f} M/s (target {TARGET_RATE / 1e6:.0f})")
    size = 512 if arguments.quick else 4096
    command = [sys.executable, __file__, "--map", str(size)]
    peak = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    missed |= peak >= TARGET_MEMORY
    print(f"map of {size} x {size}: peak memory {peak:.2f} GiB (target below {TARGET_MEMORY:.0f})")
    sys.exit(missed)


if __name__ == "__main__":
    main()
