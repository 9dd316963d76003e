"""How often the judge is wrong about right renderers, and how small a bias it finds.

``make calibrate`` prints the long version; `test_judge` runs a short one.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np
from noise import NOISES, Noise
from rich.console import Console
from rich.progress import track

from oracle.arrays import Floats
from oracle.expectation import Expectation, Provenance
from oracle.statistics import Bank, Judge, Verdict, judge

TOLERANCE, DETECTABLE = 0.005, 0.02
BUDGET = 1e-4


@dataclass(frozen=True)
class FalseAlarms:
    """E-values of right renderers: how many, their mean, and how many reached 10, 100 and the budget's threshold."""

    gradings: int
    mean: float
    above_10: int
    above_100: int
    wrong: int
    verdicts: dict[str, int]


def picture(size: int = 32) -> Expectation:
    """A lit floor that falls off towards a corner, with a black strip, in three colours."""
    y, x = np.mgrid[:size, :size] / size
    level = 1 / (0.4 + (x - 0.3) ** 2 + (y - 0.2) ** 2) ** 1.5
    level[:, -size // 8 :] = 0
    radiance: Floats = level[..., None] * np.array([0.2, 0.5, 0.9])
    zero = np.zeros_like(radiance)
    return Expectation(radiance, zero, zero.copy(), np.ones((size, size), dtype=np.bool_), Provenance("synthetic", ()))


def false_alarms(noise: Noise, images: int, gradings: int, seed: int, progress: bool = False) -> FalseAlarms:
    """Judge right renderers with one kind of noise."""
    expectation = picture()
    bank = Bank.of(expectation, TOLERANCE, DETECTABLE)
    rng = np.random.default_rng(seed)
    log10_e = np.empty(gradings)
    verdicts: Counter[str] = Counter()
    console = Console(stderr=True)
    shown = progress and console.is_terminal
    for index in track(range(gradings), disable=not shown, transient=True, console=console):
        seen = noise(rng, expectation.radiance, images)
        court = Judge(bank, BUDGET)
        evidence = [court.look(image) for image in seen][-1]
        log10_e[index] = evidence.log10_e_value
        verdicts[str(evidence.verdict)] += 1
    return FalseAlarms(
        gradings=gradings,
        mean=float((10**log10_e).mean()),
        above_10=int((log10_e >= 1).sum()),
        above_100=int((log10_e >= 2).sum()),
        wrong=verdicts[Verdict.WRONG],
        verdicts=dict(verdicts),
    )


def found(noise: Noise, bias: float, images: int, gradings: int, seed: int) -> int:
    """How many of some renderers with a global bias are called wrong."""
    expectation = picture()
    rng = np.random.default_rng(seed)
    return sum(
        judge(expectation, (1 + bias) * noise(rng, expectation.radiance, images), TOLERANCE, BUDGET, DETECTABLE).verdict
        == Verdict.WRONG
        for _ in range(gradings)
    )


def right_although_off(noise: Noise, images: int, gradings: int, seed: int) -> int:
    """How many renderers with just the bias that "right" rules out are called right."""
    expectation = picture()
    rng = np.random.default_rng(seed)
    count = 0
    for index in range(gradings):
        seen = (1 + (DETECTABLE if index % 2 else -DETECTABLE)) * noise(rng, expectation.radiance, images)
        evidence = judge(expectation, seen, TOLERANCE, BUDGET, DETECTABLE)
        count += evidence.verdict == Verdict.RIGHT
    return count


def main() -> None:
    """Print both tables; the only argument is the number of gradings for each kind of noise and of images."""
    gradings = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    print(f"Right renderers, 32 x 32 pixels, budget {BUDGET:g}, tolerance {TOLERANCE:g}:")
    print(
        f"{'noise':<10} {'images':>6} {'gradings':>8} {'mean E':>8} {'E>=10':>6} {'E>=100':>6} {'wrong':>6}  verdicts"
    )
    for name, noise in NOISES.items():
        for images in (1, 4, 8):
            r = false_alarms(noise, images, gradings, seed=images, progress=True)
            print(
                f"{name:<10} {images:>6} {r.gradings:>8} {r.mean:>8.3f} {r.above_10:>6} {r.above_100:>6} {r.wrong:>6}"
                f"  {r.verdicts}",
                flush=True,
            )
    print(f"\nRenderers that are {DETECTABLE:.0%} too bright or too dark:")
    print(f"{'noise':<10} {'images':>6} {'called right':>13}")
    for name, noise in NOISES.items():
        off = right_although_off(noise, 8, gradings, seed=9)
        print(f"{name:<10} {8:>6} {off / gradings:>13.4f}", flush=True)


if __name__ == "__main__":
    main()
