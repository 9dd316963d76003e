"""Large arrays in pieces, so that intermediate results stay within the processor's cache and memory is bounded."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

_AT_ONCE = 16384


def chunks(shape: tuple[int, ...], at_once: int = _AT_ONCE) -> Iterator[tuple[int | slice, ...]]:
    """Indices that together select all of an array with leading axes `shape`, each at most `at_once` entries."""
    # As many of the last axes as fit stay whole; the axis before them is sliced, those before it are counted.
    whole = len(shape)
    inner = 1
    while whole and inner * shape[whole - 1] <= at_once:
        whole -= 1
        inner *= shape[whole]
    if whole == 0:
        yield ()
        return
    step = max(1, at_once // max(inner, 1))
    for outer in product(*(range(n) for n in shape[: whole - 1])):
        for start in range(0, shape[whole - 1], step):
            yield (*outer, slice(start, start + step))
