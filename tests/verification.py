"""Closed forms against independent references in high precision, over thousands of configurations of each form.

``make verify`` draws 20,000 configurations of every form and prints how far each is from the truth, and whether the
bounds that the forms return with their values hold. The test suite does the same with fewer. References live beside
their forms' strategies in ``tests/verified``; they share no code with `oracle`. Most integrate with Arb's ball
arithmetic (python-flint), which proves how many of its digits are right.
"""

import importlib
import math
import pickle
import pkgutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count as count_from
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

# Where float64 cannot reach this relative error, a form's bound has to say so.
WORST = 1e-10
TYPICAL = 1e-12
# Configurations in one example of hypothesis.
AT_ONCE = 20


@dataclass(frozen=True)
class Form:
    """A closed form and its reference.

    `computed` takes a configuration to a pair of floats: value and bound on its absolute error. `exact` takes it to
    the true value, right to 1e-14 at least relative to the value, or None if the reference does not cover it. `share`
    is the part of all configurations on which the form may confess, by its bound, a relative error above `WORST`.
    """

    name: str
    configurations: SearchStrategy[Any]
    computed: Callable[[Any], tuple[float, float]]
    exact: Callable[[Any], float | None]
    share: float = 0.0


@dataclass
class Findings:
    """What happened to one form."""

    errors: list[float] = field(default_factory=list)
    """Relative errors, where the truth is not 0."""
    bounds: list[float] = field(default_factory=list)
    """The bounds that the form returned, relative in the same way."""
    dark: int = 0
    """Configurations whose truth is 0; their bounds have to hold as well."""
    broken: list[Any] = field(default_factory=list)
    """Configurations whose error exceeds the bound."""
    worst_promised: float = 0.0
    """Largest error where the bound promised `WORST`."""
    worst: Any = None
    """The configuration with that error."""

    @property
    def confessed(self) -> float:
        """Part of the configurations whose bound exceeds `WORST`."""
        return float(np.mean(np.array(self.bounds) > WORST))

    def assert_good(self, form: Form) -> None:
        """Fail with the configuration that shows what is wrong."""
        assert self.errors, f"{form.name}: no configuration with light was covered"
        assert not self.broken, f"{form.name}: {len(self.broken)} bounds are broken, first by {self.broken[0]!r}"
        assert np.median(self.errors) <= TYPICAL, f"{form.name}: median error {np.median(self.errors):.3g}"
        assert self.worst_promised <= WORST, f"{form.name}: {self.worst_promised:.3g} at {self.worst!r}"
        # Of a few configurations, chance decides how many are hard.
        chance = 3 * math.sqrt(form.share * (1 - form.share) / len(self.bounds))
        assert self.confessed <= form.share + chance, f"{form.name}: bounds above {WORST} in {self.confessed:.2%}"


def examine(form: Form, count: int) -> Findings:
    """Compare a form with its reference in `count` configurations, always the same ones and no two of them equal."""
    findings = Findings()
    for configuration in islice(drawn(form.configurations), count):
        exact = form.exact(configuration)
        if exact is None:
            continue
        value, bound = form.computed(configuration)
        error = abs(value - exact)
        # A NaN must not pass for a small error.
        if not (error <= bound and math.isfinite(value)):
            findings.broken.append((configuration, value, bound, exact))
        if exact == 0:
            # Darkness is mostly known exactly and would flatter the statistics.
            findings.dark += 1
            continue
        findings.errors.append(error / abs(exact))
        findings.bounds.append(bound / abs(exact))
        if bound / abs(exact) <= WORST and error / abs(exact) >= findings.worst_promised:
            findings.worst_promised, findings.worst = error / abs(exact), configuration
    return findings


def drawn(configurations: SearchStrategy[Any]) -> Iterator[Any]:
    """Different configurations, without end.

    In long runs hypothesis copies parts of one example into others, which finds bugs that depend on equal parts but
    makes a third of the configurations equal or nearly so. After ten examples it has not begun with that, and many
    configurations in each example make up for the cost of so many runs.
    """
    seen = set()
    for number in count_from(0):
        for configuration in some(configurations, number):
            key = pickle.dumps(configuration)
            if key not in seen:
                seen.add(key)
                yield configuration


def some(configurations: SearchStrategy[Any], number: int) -> list[Any]:
    """What ten examples hold; which, the number decides."""
    found: list[Any] = []

    @seed(number)
    @settings(
        max_examples=10,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.tuples(*[configurations] * AT_ONCE))
    def collect(several):
        found.extend(several)

    collect()
    return found


def forms() -> list[Form]:
    """All forms of the modules in ``tests/verified``."""
    folder = Path(__file__).parent / "verified"
    names = sorted(module.name for module in pkgutil.iter_modules([str(folder)]))
    return [form for name in names for form in getattr(importlib.import_module(f"verified.{name}"), "FORMS", ())]


def main(count: int, pattern: str = "") -> None:
    """Print a table; the exit code is 1 if any form fails."""
    failures = []
    print("| form | configurations | dark | median | 99.9 % | worst promised | bound > 1e-10 | median bound |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for form in forms():
        if pattern not in form.name:
            continue
        findings = examine(form, count)
        errors = np.array(findings.errors)
        quantiles = f"{np.median(errors):.1g} | {np.quantile(errors, 0.999):.1g} | {findings.worst_promised:.1g}"
        print(
            f"| {form.name} | {len(errors) + findings.dark:,} | {findings.dark:,} | {quantiles} | "
            f"{findings.confessed:.2%} | {np.median(findings.bounds):.1g} |",
            flush=True,
        )
        try:
            findings.assert_good(form)
        except AssertionError as error:
            failures.append(str(error))
    for failure in failures:
        print(failure, file=sys.stderr)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])
