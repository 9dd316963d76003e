"""How many receivers per second one core computes that see a quad past 0, 1, 4 and 16 occluders.

``python benchmarks/visibility.py``. The occluders are triangles between quad and receivers. How many of the receivers
they concern decides the rate, and is printed beside it.
"""

# The environment has to be set before numpy is imported.
# ruff: noqa: E402

import os

# One core.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import resource
import statistics
import time

import numpy as np

from oracle.emitters import Receivers
from oracle.irradiances import projected_solid_angle
from oracle.shapes import Polygon, Rectangle
from oracle.visibility import visible_projected_solid_angle

REPETITIONS = 5
COUNT = 1 << 16


def main() -> None:
    """Print a table."""
    rng = np.random.default_rng(0)
    light = Rectangle(np.array([0.0, 0, 1]), np.array([0, 0.5, 0]), np.array([0.5, 0, 0]))
    points = np.column_stack([rng.uniform(-2, 2, (COUNT, 2)), np.zeros(COUNT)])
    receivers = Receivers(points, np.array([0.0, 0, 1]))
    triangles = [
        Polygon(rng.uniform([-0.8, -0.8, 0.3], [0.8, 0.8, 0.7]) + 0.1 * rng.normal(size=(3, 3))) for _ in range(16)
    ]
    whole = projected_solid_angle(light, receivers).value
    print("| occluders | receivers in shadow | thousand receivers/s, median | best |")
    print("| --- | --- | --- | --- |")
    for count in (0, 1, 4, 16):
        rates = []
        for _ in range(REPETITIONS):
            start = time.perf_counter()
            seen = visible_projected_solid_angle(light, receivers, triangles[:count])
            rates.append(COUNT / (time.perf_counter() - start) / 1000)
        shadowed = np.mean(seen.value < whole * (1 - 1e-9))
        print(f"| {count} | {shadowed:.0%} | {statistics.median(rates):.0f} | {max(rates):.0f} |", flush=True)
    print(f"\nPeak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB.")


if __name__ == "__main__":
    main()
