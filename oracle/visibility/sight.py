"""What may hide an emitter: convex polygons in front of it, and the planes that receivers and their edges span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats
from oracle.shapes import Polygon
from oracle.visibility.pieces import EPSILON, SMALLEST, Pieces, cross, length

# Distances below so many roundings of the coordinates' differences count as touching.
TOUCH = 32 * EPSILON


@dataclass(frozen=True)
class Blocker:
    """A convex polygon in front of the emitter: corners `base` [m] plus, for those cut off at its plane, `shift`."""

    base: Floats
    shift: Floats
    normal: Floats


def in_front(light: Polygon, normal: Floats, occluder: Floats) -> Blocker | None:
    """The part of an occluder strictly in front of the emitter's plane; None if there is none."""
    relative = occluder - light.vertices[0]
    heights = relative @ normal
    # What touches the plane up to rounding, or up to how far the emitter itself leaves it, is in the plane.
    uneven = np.abs((light.vertices - light.vertices[0]) @ normal).max()
    noise = TOUCH * (np.abs(relative) @ np.abs(normal) + np.abs(relative).max()) + 2 * uneven
    heights = np.where(np.abs(heights) <= noise, 0.0, heights)
    if (heights <= 0).all():
        return None
    base, shift = [], []
    for i, here in enumerate(heights):
        j = (i + 1) % len(heights)
        if here >= 0:
            base.append(occluder[i])
            shift.append(np.zeros(3))
        if here * heights[j] < 0:
            base.append(occluder[i])
            shift.append(here / (here - heights[j]) * (occluder[j] - occluder[i]))
    return Blocker(np.array(base).T, np.array(shift).T, _normal(occluder))


def _normal(corners: Floats) -> Floats:
    relative = corners - corners[0]
    area = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0)
    result: Floats = area / np.linalg.norm(area)
    return result


@dataclass(frozen=True)
class Sight:
    """A convex occluder as the receivers see it."""

    planes: Floats
    """Inward normals of the planes through receiver and edge, as long as the parallelogram of both, shape (3, K, N)."""
    area: Floats
    """Lengths in whose roundings the normals are uncertain, shape (K, N)."""
    relative: Floats
    """Its corners relative to the emitter's first, shape (3, K)."""
    side: Floats
    """0 for receivers in its plane, who see its edge only; shape (N,)."""
    thickness: Floats
    """How thick [m] they may see it at the emitter nevertheless, if they are not exactly in its plane; shape (N,)."""

    @classmethod
    def of(cls, blocker: Blocker, points: Floats, corner: Floats, size: float) -> Sight:
        """What receivers (3, N) see in front of an emitter with this first `corner` (3,) and `size` [m]."""
        base, shift = blocker.base, blocker.shift
        towards = (base[:, :, None] - points[:, None]) + shift[:, :, None]
        edges = (np.roll(base, -1, axis=1) - base) + (np.roll(shift, -1, axis=1) - shift)
        heights = np.einsum("i,ikn->kn", blocker.normal, towards)
        noise = TOUCH * (np.einsum("i,ikn->kn", np.abs(blocker.normal), np.abs(towards)) + np.abs(towards).max(axis=0))
        # From the front, heights are negative and the corners go round counter-clockwise.
        touches = (np.abs(heights) <= noise).any(axis=0)
        highest = np.abs(heights).max(axis=0)
        nearest = np.maximum(length(towards).min(axis=0), SMALLEST)
        reach = length(corner[:, None] - points) + size
        thickness = np.where(touches & (highest > 0), (highest + noise.max(axis=0) / 16) / nearest * reach, 0.0)
        side = np.where(touches, 0.0, np.sign(heights[0]))
        # The nearer end of an edge determines the plane better.
        following = np.roll(towards, -1, axis=1)
        nearer = np.where(length(towards) <= length(following), towards, following)
        planes = side * cross(nearer, edges[:, :, None])
        moved = length(shift)
        area = length(nearer) * (length(edges) + moved + np.roll(moved, -1))[:, None]
        return cls(planes, area, (base - corner[:, None]) + shift, side, thickness)

    def distances(self, i: int, pieces: Pieces) -> tuple[Floats, Floats]:
        """Distances of corners from the plane of edge i, in units of the normal's length, and their rounding errors.

        Positive ones are on the occluder's side. Shape (V, P) both.
        """
        normal = self.planes[:, i, pieces.owner]
        corners = pieces.relative - self.relative[:, i, None, None]
        distances = np.einsum("ip,ivp->vp", normal, corners)
        reach = length(corners)
        rounding = 6 * self.area[i, pieces.owner] * reach + 2 * length(normal) * (reach + length(self.relative[:, i]))
        return distances, EPSILON * rounding

    def shifts(self, i: int, pieces: Pieces, noise: Floats) -> Floats:
        """Twice the furthest [m] that rounding errors `noise` may have moved the plane of edge i, shape (P,)."""
        long = length(self.planes[:, i])[pieces.owner]
        result: Floats = 2 * noise.max(axis=0) / np.maximum(long, SMALLEST)
        return result

    def meets(self, pieces: Pieces) -> Booleans:
        """Which pieces are not wholly beside the occluder, to rounding; shape (P,).

        Outside the plane of one of the occluder's edges, or with the occluder outside the plane of one of theirs.
        """
        result: Booleans = self.side[pieces.owner] != 0
        for i in range(self.planes.shape[1]):
            near = np.flatnonzero(result)
            distances, noise = self.distances(i, pieces.select(near))
            result[near] = (distances + noise).max(axis=0) >= 0
        near = np.flatnonzero(result)
        result[near] = ~self._is_outside(pieces.select(near))
        return result

    def _is_outside(self, pieces: Pieces) -> Booleans:
        """Whether the whole occluder is outside the plane of one of a piece's edges."""
        result = np.zeros(len(pieces.owner), dtype=np.bool_)
        offsets = pieces.offsets
        edges = np.roll(pieces.relative, -1, axis=1) - pieces.relative
        outward = cross(offsets, edges)
        # Rounding turns an edge between corners that nearly coincide anywhere.
        displaced = length(pieces.relative).max(axis=0) * (1 + pieces.cuts)
        area = length(offsets) * (length(edges) + displaced)
        lengths, far = length(outward), length(self.relative)
        for m in range(offsets.shape[1]):
            corners = self.relative[:, :, None] - pieces.relative[:, m, None]
            reach = length(corners)
            noise = EPSILON * (6 * area[m] * reach + 2 * lengths[m] * (reach + far[:, None]))
            result |= (np.einsum("ip,ikp->kp", outward[:, m], corners) > noise).all(axis=0)
        return result
