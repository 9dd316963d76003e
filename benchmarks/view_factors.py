"""How much faster view factors are than with pyviewfactor, and how much closer to the truth.

``python benchmarks/view_factors.py`` in an environment that holds this package and pyviewfactor (with numba):
``pip install pyviewfactor``. Both compute the same matrices on one core in the same run; compilation is not counted.
"""

# The environment has to be set before numpy is imported.
# ruff: noqa: E402

import os

# One core.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[variable] = "1"

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from oracle.shapes import Rectangle
from oracle.view_factors import view_factors

try:
    import pyviewfactor
    import pyvista
except ImportError as error:
    print(f"Skipped: {error}. pip install pyviewfactor, then run this again.")
    sys.exit(0)

TARGET = 50
REPETITIONS = 7
COUNT = 100


def scenes() -> dict[str, tuple[list[Rectangle], list[Rectangle]]]:
    """Sources and targets in parallel and perpendicular planes, all in front of each other."""
    rng = np.random.default_rng(0)

    def rectangles(fixed: int, at: float, sign: int, low: float, high: float) -> list[Rectangle]:
        u, v = (np.eye(3)[i] for i in ((1, 2), (2, 0), (0, 1))[fixed])
        result = []
        for _ in range(COUNT):
            center = rng.uniform(low, high, 3)
            center[fixed] = at
            a, b = rng.uniform(0.2, 0.5, 2)
            result.append(Rectangle(center, a * u, b * v) if sign > 0 else Rectangle(center, b * v, a * u))
        return result

    floor = rectangles(2, 0.0, 1, 0.5, 2.5)
    return {
        "parallel rectangles": (floor, rectangles(2, 1.5, -1, 0.5, 2.5)),
        "perpendicular rectangles": (floor, rectangles(0, 0.0, 1, 0.5, 2.5)),
    }


def seconds(function: Callable[[], object]) -> list[float]:
    """Durations of several runs, after one that warms up."""
    function()
    result = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        function()
        result.append(time.perf_counter() - start)
    return result


def mesh(shapes: list[Rectangle]) -> "pyvista.PolyData":
    """The rectangles as the cells of one mesh."""
    points = np.concatenate([shape.polygon.vertices for shape in shapes])
    faces = np.column_stack([np.full(len(shapes), 4), np.arange(4 * len(shapes)).reshape(-1, 4)])
    return pyvista.PolyData(points, faces=faces.ravel())


def main() -> None:
    """Print a table; the exit code is 1 if the target is missed against pyviewfactor's function for one pair."""
    missed = False
    for name, (sources, targets) in scenes().items():
        ours = view_factors(sources, targets).value
        cells = [[mesh([shape]) for shape in shapes] for shapes in (sources, targets)]
        everything = mesh([*sources, *targets])

        def one_by_one(cells: list[list["pyvista.PolyData"]] = cells) -> np.ndarray:
            # Its arguments are receiver, emitter.
            return np.array([[pyviewfactor.compute_viewfactor(b, a) for b in cells[1]] for a in cells[0][:10]])

        def as_matrix(everything: "pyvista.PolyData" = everything) -> np.ndarray:
            return pyviewfactor.compute_viewfactor_matrix(everything, skip_obstruction=True)

        here = seconds(lambda sources=sources, targets=targets: view_factors(sources, targets))
        pairs = COUNT**2
        rivals = {"compute_viewfactor": (one_by_one, 10 * COUNT), "compute_viewfactor_matrix": (as_matrix, pairs)}
        print(f"{name}: {min(here) / pairs * 1e6:.2f} us for each of {pairs} pairs")
        for rival, (function, count) in rivals.items():
            there = seconds(function)
            best = min(there) / count / (min(here) / pairs)
            middle = statistics.median(there) / count / (statistics.median(here) / pairs)
            print(f"  {rival}: {min(there) / count * 1e6:.1f} us; {best:.0f} times (minima), {middle:.0f} (medians)")
            if rival == "compute_viewfactor":
                missed |= best < TARGET
        error = np.abs(one_by_one() / ours[:10] - 1).max()
        print(f"  largest relative difference {error:.1e}")
    sys.exit(missed)


if __name__ == "__main__":
    main()
