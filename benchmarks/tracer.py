"""How fast the reference tracer is, against Mitsuba 3 and against itself.

``python benchmarks/tracer.py [light] [truth] [scaling]``; all of them without arguments.

* light: paths per CPU-second on the Cornell box, 256 x 256, depth 8.
* truth: 1 / (variance x CPU-second) on the canonical scenes, against Mitsuba's path tracer with independent samples.
* scaling: two threads against one, time against the number of samples, and five million triangles.

CPU time of the whole process counts, as another process may take a core at any time; compilation does not.
"""

from __future__ import annotations

import math
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import mitsuba
import numpy as np

from oracle.emitters import Point
from oracle.shapes import Mesh
from oracle.tracer import Diffuse, Film, Goal, Job, Method, Object, Perspective, Rendering, Scene
from reference_scenes import model
from reference_scenes.export import export
from reference_scenes.families import FAMILIES
from reference_scenes.tracing import to_tracer
from reference_scenes.without_closed_form import SCENES

VARIANTS = {"llvm_ad_rgb": 2.2, "scalar_rgb": 4.0}
EFFICIENCY, LEAST_EFFICIENCY = 5.0, 2.0
SPP = 256
REPETITIONS = 5


def cpu_seconds(function: Callable[[], object], repetitions: int = REPETITIONS) -> float:
    """The least CPU time of several runs."""
    spent = []
    for _ in range(repetitions):
        start = time.process_time()
        function()
        spent.append(time.process_time() - start)
    return min(spent)


def render(job: Job, spp: int, seed: int = 0, threads: int = 1) -> Rendering:
    """All samples in one pass or few."""
    *_, last = job.passes(Goal(spp=spp), seed, threads=threads)
    return last


def in_mitsuba(folder: Path, name: str, depth: int) -> object:
    """An exported scene, its paths of that depth."""
    path = export(MODELS[name], "mitsuba3", folder / name)
    limits = f'<integer name="max_depth" value="{depth}"/><integer name="rr_depth" value="5"/>'
    path.write_text(path.read_text().replace('type="path" />', f'type="path">{limits}</integrator>'))
    return mitsuba.load_file(str(path))


MODELS = {name: family.member(0) for name, family in FAMILIES.items()} | {
    "cornell": SCENES["cornell-box"]().model_copy(update={"film": model.Film(width=256, height=256)}),
}


def light() -> bool:
    """Paths per CPU-second; whether a target was missed."""
    missed = False
    job = Job(*to_tracer(MODELS["cornell"]), Method(bounces=7))
    spp = 32
    ours = 256 * 256 * spp / cpu_seconds(lambda: render(job, spp))
    print(f"Cornell box, 256 x 256, depth 8: {ours / 1e6:.2f} million paths per CPU-second")
    for variant, target in VARIANTS.items():
        try:
            mitsuba.set_variant(variant)
        except (ImportError, AttributeError) as error:
            print(f"  {variant}: not here ({error})")
            continue
        with tempfile.TemporaryDirectory() as folder:
            there = in_mitsuba(Path(folder), "cornell", 8)

            def run(there: object = there) -> None:
                np.array(mitsuba.render(there, spp=spp))

            run()
            theirs = 256 * 256 * spp / cpu_seconds(run)
        print(f"  {variant}: {theirs / 1e6:.2f}; {ours / theirs:.2f} times (target {target})")
        missed |= ours / theirs < target
    return missed


def truth() -> bool:
    """Efficiency on the canonical scenes."""
    mitsuba.set_variant("llvm_ad_rgb")
    ratios = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in FAMILIES:
            scene, sensor, film = to_tracer(MODELS[name])
            job = Job(scene, sensor, film)
            there = in_mitsuba(Path(folder), name, -1)

            def theirs(seed: int, there: object = there) -> np.ndarray:
                return np.array(mitsuba.render(there, spp=SPP, seed=seed))

            def ours(seed: int, job: Job = job) -> np.ndarray:
                return render(job, SPP, seed).mean

            theirs(0)
            work = {}
            for who, function in (("ours", ours), ("theirs", theirs)):
                images = np.array([function(seed) for seed in range(1, 9)])
                mean = images.mean(axis=0)
                lit = mean > 1e-3 * mean.max()
                variance = float((images.var(axis=0, ddof=1)[lit] / mean[lit] ** 2).mean())
                work[who] = variance, cpu_seconds(lambda function=function: function(0))
            (v, t), (w, s) = work["ours"], work["theirs"]
            # Where there is no noise but rounding, only time is left to compare.
            floor = 1e-12
            ratios[name] = max(w, floor) * s / (max(v, floor) * t)
            figures = f"variance {w:.1e} / {v:.1e}, time {s:.3f} / {t:.3f} s"
            print(f"  {name:<24} {figures}: {ratios[name]:,.1f} times", flush=True)
    mean = math.exp(statistics.fmean(math.log(ratio) for ratio in ratios.values()))
    least = min(ratios.values())
    print(f"geometric mean {mean:,.1f} (target {EFFICIENCY:.0f}), least {least:.1f} (target {LEAST_EFFICIENCY:.0f})")
    return mean < EFFICIENCY or least < LEAST_EFFICIENCY


def bumpy(triangles: int) -> Mesh:
    """A square with so many triangles."""
    n = math.isqrt(triangles // 2)
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    height = 0.01 * np.sin(60 * u) * np.sin(50 * v)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    return Mesh(np.stack([u, v, height], axis=-1).reshape(-1, 3), np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]))


def scaling() -> bool:
    """Threads, samples, and a large mesh."""
    missed = False
    job = Job(*to_tracer(MODELS["cornell"]), Method(bounces=7))

    def wall(spp: int, threads: int) -> float:
        start = time.perf_counter()
        render(job, spp, threads=threads)
        return time.perf_counter() - start

    one, two = (min(wall(64, threads) for _ in range(REPETITIONS)) for threads in (1, 2))
    print(f"two threads are {one / two:.2f} times as fast as one (target 1.9)")
    missed |= one / two < 1.9
    per_sample = [cpu_seconds(lambda spp=spp: render(job, spp), 3) / spp for spp in (16, 64, 256)]
    print("time per sample with 16, 64 and 256 of them: " + ", ".join(f"{1e3 * t:.1f} ms" for t in per_sample))

    start = time.perf_counter()
    mesh = bumpy(5_000_000)
    lamp = Point(np.array([0.5, 0.5, 1.0]), np.ones(3))
    scene = Scene([Object(mesh, Diffuse(np.full(3, 0.5)))], [lamp])
    big = Job(scene, Perspective([0.5, -0.5, 1.0], [0.5, 0.5, 0], [0, 0, 1], 0.9), Film(256, 256))
    loaded = time.perf_counter() - start
    render(big, 16, threads=0)
    unit = 1 if sys.platform == "darwin" else 1024
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30
    print(f"{len(mesh.triangles):,} triangles: ready in {loaded:.1f} s, peak memory {memory:.2f} GiB (target 4)")
    return missed or memory >= 4


if __name__ == "__main__":
    # Each in turn; memory first, as its peak is that of the whole process.
    parts = {"scaling": scaling, "light": light, "truth": truth}
    chosen = sys.argv[1:] or list(parts)
    missed = [parts[name]() for name in chosen]
    sys.exit(any(missed))
