"""Images of the reference tracer: how they are made, and how sure they are."""

from __future__ import annotations

import hashlib
import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from oracle.arrays import Floats, Integers, InvalidArgument
from oracle.tracer import _core, stage
from oracle.tracer.scene import Film, IrradianceMeter, Scene, Sensor

# Changes whenever the same scene, seed and samples give other images than before.
VERSION = 2

Strategy: TypeAlias = Literal["light", "bsdf", "hemisphere", "mis"]
Sampler: TypeAlias = Literal["sobol", "independent"]

# Samples of the Sobol' kind are not independent of each other; the variance comes from so many independent parts.
REPLICATES = 8
# Samples are followed eight at a time; whole groups of them make it irrelevant how they come together.
GROUP = 8
_UNBOUNDED = 1 << 30
_SUM_UNIT, _SQUARE_UNIT = 2.0**-64, 2.0**-60
# A pass is no longer than this, so that an interrupted rendering loses little.
_PASS_SECONDS = 2.0


@dataclass(frozen=True)
class Range:
    """Samples ``first, ..., first + count - 1`` of one seed."""

    seed: int
    first: int
    count: int


@dataclass(frozen=True, eq=False)
class Rendering:
    """An image, and the exact sums that it comes from.

    `sums` has the shape (H, W, R, 3, 2) and `squares` (H, W, 3, 2); the last axis holds the low and the high half
    of an integer of 128 bits, which makes sums independent of their order. `identity` tells what was rendered and how,
    but for seed and samples; renderings with the same one can be merged.
    """

    sums: NDArray[np.uint64]
    squares: NDArray[np.uint64]
    ranges: tuple[Range, ...]
    exponent: int
    identity: str

    @property
    def spp(self) -> int:
        """Samples per pixel."""
        return sum(one.count for one in self.ranges)

    @cached_property
    def mean(self) -> Floats:
        """Radiance [W/(m^2 sr)], or irradiance [W/m^2] of an irradiance meter; shape (H, W, 3)."""
        total: Floats = self._parts.sum(axis=2)
        return total / self.spp

    @cached_property
    def variance(self) -> Floats:
        """Estimated variance of `mean`, shape (H, W, 3); infinite where one sample tells nothing of it."""
        replicates = self.sums.shape[2]
        if replicates > 1:
            means = self._parts * (replicates / self.spp)
            spread: Floats = means.var(axis=2, ddof=1) / replicates
            return spread
        if self.spp == 1:
            return np.full(self.mean.shape, np.inf)
        squares = _real(self.squares) * (_SQUARE_UNIT * 4.0**self.exponent) / self.spp
        return np.maximum(squares - self.mean**2, 0) / (self.spp - 1)

    @property
    def standard_error(self) -> Floats:
        """Square root of `variance`."""
        return np.sqrt(self.variance)

    @cached_property
    def _parts(self) -> Floats:
        return _real(self.sums) * (_SUM_UNIT * 2.0**self.exponent)


def merge(a: Rendering, b: Rendering) -> Rendering:
    """The rendering of the samples of both, bit for bit as if they had been rendered together.

    Raises
    ------
    InvalidArgument
        If they do not show the same scene in the same way, or have samples in common.
    """
    if a.identity != b.identity:
        raise InvalidArgument("b: shows another scene, or was rendered otherwise; only seed and samples may differ")
    ranges = list(a.ranges)
    for one in b.ranges:
        for other in a.ranges:
            if one.seed == other.seed and one.first < other.first + other.count and other.first < one.first + one.count:
                raise InvalidArgument(f"b: has samples of seed {one.seed} that a has as well")
        ranges.append(one)
    return replace(a, sums=_added(a.sums, b.sums), squares=_added(a.squares, b.squares), ranges=tuple(_joined(ranges)))


@dataclass(frozen=True)
class Goal:
    """When a rendering is good enough: at the first of these that is reached.

    `spp` samples per pixel; a standard error of `error` times the mean, averaged over the channels, in the part `share`
    of the pixels that are not black; `seconds` of time.
    """

    spp: int | None = None
    error: float | None = None
    seconds: float | None = None
    share: float = 0.95

    def __post_init__(self) -> None:
        if self.spp is None and self.error is None and self.seconds is None:
            raise InvalidArgument("a goal needs spp, error or seconds")
        for name in ("spp", "error", "seconds"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InvalidArgument(f"{name} is {value}, it must be above 0")
        if not 0 < self.share <= 1:
            raise InvalidArgument(f"share is {self.share}, it must be above 0 and at most 1")

    def samples(self, rendering: Rendering) -> float:
        """How many samples per pixel `spp` and `error` ask for, as far as `rendering` tells."""
        wanted = math.inf if self.spp is None else float(self.spp)
        if self.error is None or not rendering.spp:
            return wanted
        return min(wanted, rendering.spp * (relative_error(rendering, self.share) / self.error) ** 2)


def relative_error(rendering: Rendering, share: float) -> float:
    """The standard error relative to the mean that the part `share` of all pixels with light do not exceed."""
    mean, error = rendering.mean.mean(axis=-1), np.sqrt(rendering.variance.sum(axis=-1)) / rendering.mean.shape[-1]
    lit = mean > 0
    return float(np.quantile(error[lit] / mean[lit], share)) if lit.any() else 0.0


@dataclass(frozen=True)
class Method:
    """How a scene is rendered.

    Parameters
    ----------
    strategy : {"mis", "light", "bsdf", "hemisphere"}
        How the light at a surface is looked for: on the emitters and where the surface reflects, both weighed [Veach
        1997]; only on the emitters; only where the surface reflects, or uniformly, which both miss emitters without
        extent. The means are the same.
    sampler : {"sobol", "independent"}
        Owen-scrambled Sobol' points in each pixel, or Philox random numbers.
    bounces : int, optional
        The most reflections that light may take; without it there is no limit. 0 is emission alone, 1 direct light.
    first_bounce : int
        Light that was reflected fewer times is left out: 2 leaves indirect light, ``first_bounce = bounces = n`` the
        n-th bounce alone.
    """

    strategy: Strategy = "mis"
    sampler: Sampler = "sobol"
    bounces: int | None = None
    first_bounce: int = 0

    def __post_init__(self) -> None:
        for name, allowed in (("strategy", get_args(Strategy)), ("sampler", get_args(Sampler))):
            if getattr(self, name) not in allowed:
                raise InvalidArgument(f"{name} is {getattr(self, name)!r}, it must be one of {', '.join(allowed)}")
        for name in ("bounces", "first_bounce"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= _UNBOUNDED:
                raise InvalidArgument(f"{name} is {value}, it must be between 0 and {_UNBOUNDED}")

    @property
    def replicates(self) -> int:
        """Into how many independent parts the samples of a pixel fall."""
        return REPLICATES if self.sampler == "sobol" else 1


class Job:
    """A scene in the extension, ready to be rendered pass by pass.

    Raises
    ------
    InvalidArgument
        If something of the scene does not fit single precision; the message names the object.
    """

    def __init__(self, scene: Scene, sensor: Sensor, film: Film, method: Method | None = None) -> None:
        self.method = method or Method()
        self.film = film
        self.exponent = math.frexp(stage.brightest(scene))[1]
        self.identity = _identity(VERSION, scene, sensor, film, self.method)
        self._stage = stage.build(scene)
        self._sensor, self._film = stage.sensor(sensor, film), _core.Film(film.width, film.height, film.gaussian)

    def nothing(self) -> Rendering:
        """The rendering without samples, to which passes are added."""
        shape = (self.film.height, self.film.width)
        sums = np.zeros((*shape, self.method.replicates, 3, 2), np.uint64)
        return Rendering(sums, np.zeros((*shape, 3, 2), np.uint64), (), self.exponent, self.identity)

    def extended(
        self, rendering: Rendering, more: Range, threads: int = 0, watch: Callable[[float], None] | None = None
    ) -> Rendering:
        """`rendering` with more samples; `watch` is told now and then which part of them is done."""
        done = replace(rendering, sums=rendering.sums.copy(), squares=rendering.squares.copy())
        method = self.method
        one_pass = _core.Pass(
            method.strategy,
            method.first_bounce,
            _UNBOUNDED if method.bounces is None else method.bounces,
            method.sampler,
            more.seed,
            more.first,
            more.count,
            method.replicates,
            self.exponent,
        )
        self._stage.render_pass(
            self._sensor, self._film, one_pass, threads, done.sums, done.squares, watch or (lambda part: None)
        )
        return replace(done, ranges=tuple(_joined([*rendering.ranges, more])))

    def passes(
        self,
        goal: Goal,
        seed: int = 0,
        first_sample: int = 0,
        threads: int = 0,
        start: Rendering | None = None,
        watch: Callable[[Progress], None] | None = None,
    ) -> Iterator[Rendering]:
        """Ever better renderings, until the goal is reached; the last one is the result.

        Passes double the number of samples as long as they take no more than some seconds, so that little is lost if
        the caller is interrupted and keeps the rendering before. `start` is a rendering to go on from.

        Raises
        ------
        InvalidArgument
            If `start` shows something else, or a number is out of its range.
        """
        if not 0 <= seed < 1 << 64:
            raise InvalidArgument(f"seed is {seed}, it must be between 0 and 2**64 - 1")
        for name, value in (("spp", goal.spp or 0), ("first_sample", first_sample)):
            if value % GROUP or not 0 <= value < 1 << 32:
                raise InvalidArgument(f"{name} is {value}, it must be a multiple of {GROUP} and below 2**32")
        rendering = self.nothing() if start is None else start
        if rendering.identity != self.identity:
            raise InvalidArgument("start: shows another scene, or was rendered otherwise")
        at = max([first_sample, *(one.first + one.count for one in rendering.ranges if one.seed == seed)])
        began = time.monotonic()
        count = 4 * GROUP
        while True:
            missing = goal.samples(rendering) - rendering.spp
            elapsed = time.monotonic() - began
            if missing <= 0 or (goal.seconds is not None and elapsed >= goal.seconds):
                return
            count = min(count, GROUP * math.ceil(min(missing, 1 << 40) / GROUP), (1 << 32) - at)
            if count <= 0:
                raise InvalidArgument("spp: a seed has no more than 2**32 samples; go on with another one")
            expected = goal.samples(rendering) if goal.seconds is None else math.inf
            before = rendering

            def report(part: float, before: Rendering = before, count: int = count, expected: float = expected) -> None:
                if watch:
                    watch(Progress(before.spp + part * count, expected, time.monotonic() - began))

            rendering = self.extended(rendering, Range(seed, at, count), threads, report)
            yield rendering
            at += count
            took = time.monotonic() - began - elapsed
            count = rendering.spp if 2 * took * rendering.spp / count < _PASS_SECONDS else _shorter(count, took)


def _shorter(count: int, took: float) -> int:
    """The number of samples that takes about as long as a pass should, a power of two times a group."""
    fitting = count * _PASS_SECONDS / max(took, 1e-9) / GROUP
    return GROUP << max(0, math.floor(math.log2(max(fitting, 1.0))))


@dataclass(frozen=True)
class Progress:
    """How far a rendering is: samples per pixel, how many are expected (maybe infinitely many), and seconds so far."""

    samples: float
    expected: float
    seconds: float


def render(
    scene: Scene,
    sensor: Sensor,
    film: Film,
    *,
    spp: int,
    seed: int = 0,
    threads: int = 0,
    sampler: Sampler = "sobol",
    strategy: Strategy = "mis",
    bounces: int | None = None,
    first_bounce: int = 0,
    first_sample: int = 0,
) -> Rendering:
    """Render a scene with a number of samples.

    Parameters
    ----------
    scene, sensor, film
        What is seen, by whom, in how many pixels.
    spp : int
        Samples per pixel, a multiple of 8; Sobol' points are best in 8 times a power of two.
    seed : int
        Renderings with different seeds are independent of each other. From 0 to 2**64 - 1.
    threads : int
        0 for one on each processor. The result does not depend on it.
    sampler, strategy, bounces, first_bounce
        As for `Method`.
    first_sample : int
        Where the range of samples begins. Renderings of adjacent ranges merge to that of their union.

    Returns
    -------
    Rendering

    Raises
    ------
    InvalidArgument
        If a number is out of its range, or something of the scene does not fit single precision.

    Examples
    --------
    >>> from oracle import Disk
    >>> from oracle.tracer import Film, Object, RadianceMeter, Scene, render
    >>> lamp = Object(Disk(center=[0, 0, 2], normal=[0, 0, -1], radius=0.5), radiance=[10, 10, 10])
    >>> render(Scene([lamp]), RadianceMeter([0, 0, 0], [0, 0, 1]), Film(1, 1), spp=8).mean
    array([[[10., 10., 10.]]])
    """
    job = Job(scene, sensor, film, Method(strategy, sampler, bounces, first_bounce))
    # The last pass is the result.
    (result,) = deque(job.passes(Goal(spp=spp), seed, first_sample, threads), maxlen=1)
    return result


@dataclass(frozen=True, eq=False)
class FirstHits:
    """What the rays through the centres of the pixels meet; everything has the leading axes (H, W).

    `distance` [m] along the ray, infinite for nothing; `position` [m] and shading `normal` of the front, (H, W, 3);
    `albedo`, the colour of the material, (H, W, 3); `object`, its index in the scene, -1 for nothing.
    """

    distance: NDArray[np.float32]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    albedo: NDArray[np.float32]
    object: Integers


def first_hits(scene: Scene, sensor: Sensor, film: Film) -> FirstHits:
    """Look up what the pixels of a camera show, without any light.

    Raises
    ------
    InvalidArgument
        If the sensor has no rays of its own, or something does not fit single precision.
    """
    if isinstance(sensor, IrradianceMeter):
        raise InvalidArgument("sensor: an irradiance meter looks everywhere at once")
    found = stage.build(scene).first_hits(
        stage.sensor(sensor, film), _core.Film(film.width, film.height, film.gaussian)
    )
    return FirstHits(*found)


def _real(halves: NDArray[np.uint64]) -> Floats:
    """Integers of 128 bits as float64, rounded twice."""
    high = halves[..., 1].astype(np.int64).astype(np.float64)
    real: Floats = high * 2.0**64 + halves[..., 0].astype(np.float64)
    return real


def _added(a: NDArray[np.uint64], b: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Sum of integers of 128 bits."""
    low = a[..., 0] + b[..., 0]
    carry = (low < a[..., 0]).astype(np.uint64)
    return np.stack([low, a[..., 1] + b[..., 1] + carry], axis=-1)


def _joined(ranges: list[Range]) -> list[Range]:
    """Ranges in order, adjacent ones as one."""
    result: list[Range] = []
    for one in sorted(ranges, key=lambda r: (r.seed, r.first)):
        last = result[-1] if result else None
        if last and last.seed == one.seed and last.first + last.count == one.first:
            result[-1] = Range(last.seed, last.first, last.count + one.count)
        else:
            result.append(one)
    return result


def _identity(*parts: object) -> str:
    """A digest of frozen data, equal if and only if all numbers in it are."""
    digest = hashlib.sha256()

    def take(value: object) -> None:
        if is_dataclass(value) and not isinstance(value, type):
            digest.update(f"{type(value).__name__}(".encode())
            for one in fields(value):
                take(getattr(value, one.name))
        elif isinstance(value, np.ndarray):
            digest.update(f"{value.dtype.str}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        elif isinstance(value, tuple | list):
            digest.update(f"[{len(value)}".encode())
            for item in value:
                take(item)
        else:
            digest.update(f"{type(value).__name__}:{value!r};".encode())

    for part in parts:
        take(part)
    return digest.hexdigest()
