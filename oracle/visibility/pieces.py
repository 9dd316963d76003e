"""What is left of an emitter as many receivers see it: convex polygons, each seen by one of them.

Arrays of vectors have the shape (3, ...). Positions come twice, from the receiver and relative to a corner of the
emitter: near receivers need the digits of the former, far ones those of the latter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats, Integers
from oracle.bounded import Bounded
from oracle.kernels.polygon import contour
from oracle.visibility.convex import join

EPSILON = float(np.finfo(np.float64).eps)
# Lengths below this one are 0, but may be divided by.
SMALLEST = 1e-200
# Below so many sizes of the emitter, the digits of what is seen from the receiver matter more.
_NEAR = 10.0


@dataclass(frozen=True)
class Pieces:
    """What is left of the emitter: convex polygons, their receivers, and how often each has been cut."""

    both: Floats
    """Corners relative to the emitter's first, then from the receiver, shape (6, V, P)."""
    owner: Integers
    """Which receiver sees the piece, shape (P,)."""
    cuts: Floats

    @property
    def relative(self) -> Floats:
        """Corners relative to the emitter's first, shape (3, V, P)."""
        return self.both[:3]

    @property
    def offsets(self) -> Floats:
        """Corners from the receiver, shape (3, V, P)."""
        return self.both[3:]

    @classmethod
    def of(cls, parts: Floats, points: Floats, corner: Floats) -> Pieces:
        """All parts (3, V, M) for all receivers (3, N)."""
        count = points.shape[1]
        vertices = np.repeat(parts, count, axis=2)
        owner = np.tile(np.arange(count), parts.shape[2])
        both = np.concatenate([vertices - corner[:, None, None], vertices - points[:, None, owner]])
        return cls(both, owner, np.zeros(len(owner)))

    def select(self, which: Booleans | Integers) -> Pieces:
        """Some of the pieces."""
        return Pieces(self.both[:, :, which], self.owner[which], self.cuts[which])

    def outline(self, normals: Floats) -> Floats:
        """`light_by_distance` along the pieces' outlines, shape (P,)."""
        following = np.roll(self.offsets, -1, axis=1)
        result: Floats = light_by_distance(self.offsets, following, normals[:, None, self.owner]).sum(axis=0)
        return result

    def irradiance(self, normals: Floats, size: float) -> Bounded:
        """Projected solid angle (N,) of all pieces of an emitter of this `size` [m], for receivers (3, N)."""
        count = normals.shape[1]
        distances = length(self.offsets)
        # Corners have been rounded twice; the kernel gets the edges between those whose digits matter more.
        near = distances.max(axis=0) < _NEAR * size
        relative = np.where(near, self.offsets, self.relative)
        seen = contour(self.offsets.transpose(2, 1, 0), normals[:, self.owner].T, relative.transpose(2, 1, 0))
        # Rounding displaces corners that were cut by ulps of the size, near ones by ulps of their distance.
        displaced = np.where(near, np.maximum(distances, np.roll(distances, -1, axis=0)), 0.0) + 2 * size * self.cuts
        following, up = np.roll(self.offsets, -1, axis=1), normals[:, None, self.owner]
        swept = (displaced * light_by_distance(self.offsets, following, up)).sum(axis=0)
        # Far ones are displaced as a whole: with their distance and angle changes what their area may send.
        perimeter = length(np.roll(self.relative, -1, axis=1) - self.relative).sum(axis=0)
        swept += np.where(near, 0.0, perimeter / np.maximum(distances.min(axis=0), SMALLEST)) ** 2 / np.pi
        # Rounding may leave a sliver with less than nothing.
        values = np.maximum(seen.value, 0)
        value = summed(self.owner, values, count)
        error = summed(self.owner, seen.error + EPSILON * swept, count)
        # The additions themselves, one for each piece.
        return Bounded(value, error + EPSILON * value * np.bincount(self.owner, minlength=count))


def joined(parts: list[Pieces]) -> Pieces:
    """All pieces in one."""
    return Pieces(
        join([part.both for part in parts]),
        np.concatenate([part.owner for part in parts]),
        np.concatenate([part.cuts for part in parts]),
    )


def light_by_distance(start: Floats, end: Floats, up: Floats) -> Floats:
    """Bound on the integral along edges (3, ...) of the receiver's cosine over the distance [1/m], by the angle.

    Times a small displacement [m] of the edge it is the projected solid angle that the edge sweeps.
    """
    edge = end - start
    sine, cosine = length(cross(start, end)), (start * end).sum(axis=0)
    from_start, from_end = length(start), length(end)
    nearest = np.minimum(from_start, from_end)
    foot = ((start * edge).sum(axis=0) < 0) & ((end * edge).sum(axis=0) > 0)
    nearest = np.maximum(np.where(foot, sine / np.maximum(length(edge), SMALLEST), nearest), SMALLEST)
    # The higher end is as high as the edge gets; as much as rounding may have lifted it counts, too.
    height = np.maximum((start * up).sum(axis=0), (end * up).sum(axis=0)) + 8 * EPSILON * (from_start + from_end)
    result: Floats = np.arctan2(sine, cosine) / nearest * np.clip(height / nearest, 0, 1)
    return result


def summed(owner: Integers, amounts: Floats, count: int) -> Floats:
    """The sum of what belongs to each of `count` receivers."""
    return np.bincount(owner, amounts, count).astype(np.float64)


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product over the first axis."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def length(a: Floats) -> Floats:
    """Length over the first axis."""
    result: Floats = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return result
