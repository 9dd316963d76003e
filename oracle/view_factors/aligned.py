"""Which pairs of rectangles have edges parallel to one another, and their exchange areas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats, Integers
from oracle.bounded import Bounded
from oracle.compensated import two_sum
from oracle.shapes import Rectangle
from oracle.view_factors.rectangles import Axis, Strip, parallel, perpendicular

_EPSILON = float(np.finfo(np.float64).eps)

# Edges of rotated rectangles are parallel or orthogonal up to this, their rounding; its effect is in the bound.
_PARALLEL = 64 * _EPSILON


@dataclass(frozen=True, eq=False)
class Rectangles:
    """Many rectangles: centres (N, 3), half lengths along u and v (N, 2), and the unit vectors u, v, n (N, 3, 3)."""

    centers: Floats
    halves: Floats
    axes: Floats

    @classmethod
    def of(cls, shapes: Sequence[Rectangle]) -> Rectangles:
        """From single ones, at least one."""
        halves = np.array([(shape.half_u, shape.half_v) for shape in shapes])
        largest = np.abs(halves).max(axis=(1, 2), keepdims=True)
        lengths = np.linalg.norm(halves / largest, axis=2) * largest[..., 0]
        u, v = np.moveaxis(halves / lengths[..., None], 1, 0)
        return cls(np.array([shape.center for shape in shapes]), lengths, np.stack([u, v, np.cross(u, v)], axis=1))

    def __getitem__(self, where: slice | Integers) -> Rectangles:
        return Rectangles(self.centers[where], self.halves[where], self.axes[where])

    def __len__(self) -> int:
        return len(self.centers)


def exchange_areas(sources: Rectangles, targets: Rectangles) -> tuple[Bounded, Booleans]:
    """Exchange areas [m^2] of all pairs, shape (S, T), and of which pairs they are known: those with parallel edges."""
    count = len(sources), len(targets)
    # turn[:, :, s, t]: the target's axes in the source's frame.
    product = sources.axes.transpose(1, 0, 2).reshape(-1, 3) @ targets.axes.transpose(1, 0, 2).reshape(-1, 3).T
    turn: Floats = product.reshape(3, count[0], 3, count[1]).transpose(0, 2, 1, 3).reshape(9, -1)
    rounded = np.rint(turn)
    deviation = np.abs(turn - rounded).max(axis=0)
    # Rectangles need not be orthogonal to the last digit; neither need their normals then have length 1.
    skew = [np.abs(np.einsum("ni,ni->n", one.axes[:, 0], one.axes[:, 1])) for one in (sources, targets)]
    deviation = deviation + np.add.outer(skew[0], skew[1]).ravel()
    known = deviation <= _PARALLEL

    offset = targets.centers - sources.centers[:, None]
    along = [np.einsum("stk,sk->st", offset, sources.axes[:, i]).ravel() for i in range(3)]
    terms = [np.einsum("stk,sk->st", np.abs(offset), np.abs(sources.axes[:, i])).ravel() for i in range(3)]
    half_source = [np.repeat(sources.halves[:, i], count[1]) for i in range(2)]
    half_target = [np.tile(targets.halves[:, i], count[0]) for i in range(2)]
    rounded = np.abs(rounded) * np.where(known, 1.0, 0.0)
    extent = [rounded[3 * i] * half_target[0] + rounded[3 * i + 1] * half_target[1] for i in range(3)]
    facing = known & (turn[8] < -0.5)
    upright = [known & (rounded[2] > 0.5), known & (rounded[5] > 0.5)]

    sizes = half_source[0] + half_source[1] + half_target[0] + half_target[1]
    half_source.append(np.zeros_like(sizes))

    # How far, along each axis, rounding may have moved one rectangle: by what the difference of the centres lost, where
    # all axes are those of the coordinates, else by the rounding of the axes too.
    exact = [np.isin(np.abs(one.axes), (0.0, 1.0)).all(axis=(1, 2)) for one in (sources, targets)]
    plain = np.logical_and.outer(*exact).ravel()
    _, lost = two_sum(targets.centers, -sources.centers[:, None])
    moved = [
        np.where(
            plain,
            np.einsum("stk,sk->st", np.abs(lost), np.abs(sources.axes[:, i])).ravel(),
            4 * _EPSILON * (terms[i] + half_source[i] + extent[i]) + deviation * sizes,
        )
        for i in range(3)
    ]
    value, error = np.zeros(len(known)), np.zeros(len(known))

    here = np.flatnonzero(facing & (along[2] > 0))
    if len(here):
        x, y = (Axis.of(half_source[i][here], extent[i][here], along[i][here]) for i in range(2))
        gap, shift = along[2][here], moved[2][here]
        apart = np.hypot(np.hypot(x.nearest, y.nearest), gap)
        result = parallel(x, y, gap)
        contour = 5.1 * np.minimum(half_source[0] + half_source[1], half_target[0] + half_target[1])[here]
        error[here] = result.error + shift * np.minimum(
            result.value * (2 / gap + 4 / apart), contour * np.arcsinh(2 * sizes[here] / gap)
        )
        for i, axis, other in ((0, x, y), (1, y, x)):
            error[here] += _slid(moved[i][here] + _EPSILON * axis.reach, result.value, apart, 2 * other.shorter)
        value[here] = result.value
    for across in range(2):
        up = Strip.of(-np.sign(turn[3 * across + 2]) * along[across], half_source[across])
        aside = Strip.of(along[2], extent[2])
        here = np.flatnonzero(upright[across] & (up.far > 0) & (aside.far > 0))
        if len(here):
            common = 1 - across
            x = Axis.of(half_source[common][here], extent[common][here], along[common][here])
            up, aside = up[here], aside[here]
            apart = np.hypot(np.hypot(up.near, aside.near), x.nearest)
            result = perpendicular(x, up, aside)
            shift, narrow = moved[common][here] + _EPSILON * x.reach, np.minimum(up.width, aside.width)
            error[here] = result.error + _slid(shift, result.value, apart, narrow)
            for i, one, beyond, length in ((across, up, aside, half_source), (2, aside, up, extent)):
                # How far from the common line most of what is exchanged is.
                typical = one.near + np.minimum(one.width, np.hypot(beyond.near, x.nearest))
                error[here] += _slid(2 * moved[i][here], result.value, typical, length[common][here])
            value[here] = result.value
    return Bounded(value.reshape(count), error.reshape(count)), known.reshape(count)


def _slid(shift: Floats, value: Floats, distance: Floats, edge: Floats) -> Floats:
    """What sliding a rectangle within its plane changes: 4 shifts by the distance, at most the strips at its edges."""
    strips = shift * edge
    return np.where(
        4 * shift * value < strips * distance, 4 * shift * value / np.where(distance > 0, distance, 1), strips
    )
