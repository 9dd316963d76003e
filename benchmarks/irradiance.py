"""How many irradiances of polygons per second one core computes, and how much memory a map of 4096 x 4096 takes.

``python benchmarks/irradiance.py``; ``--quick`` takes a smaller map. Times are those of the processor, so that a busy
machine disturbs little. The map runs in a process of its own, whose peak memory includes the map itself (value and
bound) and its 16.8 million points.
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
from oracle.shapes import Polygon, Rectangle, Shape

TARGET_RATE = 2e6
TARGET_MEMORY = 1.0
REPETITIONS = 7
COUNT = 1 << 18
CENTER = np.array([0.0, 0, 1])


def lights() -> dict[str, Area]:
    """Shapes of size 1 at the height 1, shining down."""
    quad = Rectangle(CENTER, np.array([0, 0.5, 0]), np.array([0.5, 0, 0]))
    angles = -np.pi / 7 * np.arange(14)
    radii = np.where(np.arange(14) % 2, 0.25, 0.6)
    star = Polygon(CENTER + np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(14)]))
    shapes: dict[str, Shape] = {
        "quad": quad,
        "triangle": Polygon(quad.polygon.vertices[:3]),
        "star with 14 vertices": star,
    }
    return {name: Area(shape, np.ones(1)) for name, shape in shapes.items()}


def receivers(count: int, kind: str) -> Receivers:
    """Points below the light: facing up, tilted at random, or with horizons that cut every light."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-2, 2, (count, 2)), np.zeros(count)])
    if kind == "facing up":
        return Receivers(points, np.array([0.0, 0, 1]))
    normals = rng.normal(size=(count, 3))
    if kind == "horizon cuts all":
        # The horizon passes through a point inside the light.
        towards = CENTER + np.array([0.1, 0.05, 0]) - points
        normals -= towards * ((normals * towards).sum(axis=1) / (towards**2).sum(axis=1))[:, None]
    return Receivers(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def rates(light: Area, where: Receivers) -> list[float]:
    """Irradiances per second of processor time, in several repetitions."""
    irradiance(light, where)
    result = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        irradiance(light, where)
        result.append(COUNT / (time.process_time() - start))
    return result


def whole_map(size: int) -> None:
    """Compute a map in this process and print its peak memory in GiB."""
    axis = np.linspace(-2, 2, size)
    points = np.zeros((size, size, 3))
    points[..., 0], points[..., 1] = axis, axis[:, None]
    where = Receivers(points, np.array([0.0, 0, 1]))
    del points
    irradiance(lights()["quad"], where)
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
    for name, light in lights().items():
        for kind in ("facing up", "tilted at random", "horizon cuts all"):
            measured = rates(light, receivers(COUNT, kind))
            best, median = max(measured), statistics.median(measured)
            line = f"{name}, {kind}: best {best / 1e6:.2f}, median {median / 1e6:.2f} M/s"
            if name == "quad":
                missed |= best < TARGET_RATE
                line += f" (target {TARGET_RATE / 1e6:.0f})"
            print(line, flush=True)
    size = 512 if arguments.quick else 4096
    command = [sys.executable, __file__, "--map", str(size)]
    peak = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    missed |= peak >= TARGET_MEMORY
    print(f"map of {size} x {size}: peak memory {peak:.2f} GiB (target below {TARGET_MEMORY:.0f})")
    sys.exit(missed)


if __name__ == "__main__":
    main()
