"""What receivers see of a flat emitter past flat occluders.

All is decided in the receiver's sphere of directions, by planes through the receiver: an edge of an occluder and the
receiver span one, and an emitter's convex part P without a convex occluder Q is the union over Q's edges i of the
pieces of P outside the plane of edge i and inside those of the edges before it. Pieces do not overlap, and the next
occluder is subtracted from each of them, so that what two occluders hide counts once. An occluder that reaches behind
the receiver needs no care: in front, the planes of its edges bound the cone over the part in front. The idea to clip
polygons against each other as the light sees them is that of Weiler and Atherton (1977).

Arrays of vectors have the shape (3, ...) here. Positions come twice, from the receiver and relative to a corner of the
emitter: near receivers need the digits of the former, far ones those of the latter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats, Integers
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import Receivers
from oracle.irradiance.polygon import contour, polygon
from oracle.shapes import Polygon, Shape
from oracle.visibility.convex import convex_parts, join, polygons_of, split

_EPSILON = float(np.finfo(np.float64).eps)
# Distances below so many roundings of the coordinates' differences count as touching.
TOUCH = 32 * _EPSILON
# Lengths below this one are 0, but may be divided by.
_SMALLEST = 1e-300
_AT_ONCE = 4096


def visible_projected_solid_angle(
    shape: Shape, receivers: Receivers, occluders: Sequence[Shape], two_sided: bool = False
) -> Bounded:
    """Projected solid angle of the part of a flat emitter that receivers see past flat occluders.

    Parameters
    ----------
    shape : Polygon, Rectangle or Mesh
        Only its front counts, or both of its sides if `two_sided`. A mesh hides its own parts only if it is also among
        the occluders.
    receivers : Receivers
        Points [m] and unit normals, shape (...).
    occluders : sequence of Polygon, Rectangle or Mesh
        Opaque from both sides; they may overlap, touch the emitter or pass through it and need not be convex.

    Returns
    -------
    Bounded
        Projected solid angle [sr], shape (...), clipped at the receivers' horizons: the irradiance of unit radiance.

    Raises
    ------
    InvalidArgument
        If the emitter or an occluder is round.

    Notes
    -----
    Only what is strictly between receiver and emitter hides: an occluder in the emitter's plane, or one in whose plane
    the receiver is, hides nothing. Nearer than 32 roundings of the coordinates' differences counts as in the plane.
    In the emitter's own plane the result is 0.
    """
    lights = polygons_of("shape", shape)
    blockers = [
        part
        for index, occluder in enumerate(occluders)
        for one in polygons_of(f"occluders[{index}]", occluder)
        for part in convex_parts(one)
    ]
    scenes = [_Scene.of(light, side, blockers) for light in lights for side in ((1, -1) if two_sided else (1,))]
    result = Bounded(np.zeros(receivers.shape), np.zeros(receivers.shape))
    for part in chunks(receivers.shape, _AT_ONCE):
        points = receivers.points[part].reshape(-1, 3).T
        normals = receivers.normals[part].reshape(-1, 3).T
        total = Bounded(np.zeros(points.shape[1]), np.zeros(points.shape[1]))
        for scene in scenes:
            total = total + scene.seen_from(points, normals)
        result.value[part] = total.value.reshape(result.value[part].shape)
        result.error[part] = total.error.reshape(result.error[part].shape)
    return result


@dataclass(frozen=True)
class _Blocker:
    """A convex polygon in front of the emitter: corners `base` [m] plus, for those cut off at its plane, `shift`."""

    base: Floats
    shift: Floats
    normal: Floats


@dataclass(frozen=True)
class _Scene:
    """An emitter from one of its sides, with what may hide it there."""

    light: Polygon
    parts: Floats
    """Its convex parts, shape (3, V, M); counter-clockwise from this side."""
    normal: Floats
    """Towards this side."""
    blockers: list[_Blocker]

    @classmethod
    def of(cls, light: Polygon, side: int, occluders: list[Floats]) -> _Scene:
        """The side 1 is the front, -1 the back."""
        parts = join([part[::side].T[:, :, None] for part in convex_parts(light)])
        normal = side * light.normal
        cut = [_in_front(light, normal, occluder) for occluder in occluders]
        return cls(light, parts, normal, [blocker for blocker in cut if blocker is not None])

    def seen_from(self, points: Floats, normals: Floats) -> Bounded:
        """Projected solid angle (N,) from receivers (3, N)."""
        value, error = np.zeros(points.shape[1]), np.zeros(points.shape[1])
        away = points - self.light.vertices[0][:, None]
        height = self.normal @ away
        noise = TOUCH * (np.abs(self.normal) @ np.abs(away) + np.abs(away).max(axis=0))
        front = height > 0
        if front.any():
            seen = self._seen_in_front(points[:, front], normals[:, front])
            value[front], error[front] = seen.value, seen.error
        # Where rounding hides on which side the receiver is, all may be wrong.
        near = np.abs(height) <= noise
        if near.any():
            unhidden = polygon(self.light, points[:, near].T, normals[:, near].T, two_sided=True)
            error[near] += unhidden.value + unhidden.error
        # Whatever happens, the hemisphere has no more.
        return Bounded(value, np.minimum(error, np.pi))

    def _seen_in_front(self, points: Floats, normals: Floats) -> Bounded:
        count, parts = points.shape[1], self.parts.shape[2]
        corner = self.light.vertices[0]
        pieces = _Pieces.of(self.parts, points, corner)
        error = np.zeros(count)
        for blocker in self.blockers:
            pieces, lost = _without(pieces, blocker, points, normals, corner)
            error += lost
        # Who sees all sees the emitter without occluders, whose form keeps more digits.
        everything = np.bincount(pieces.owner[pieces.cuts == 0], minlength=count) == parts
        value = np.zeros(count)
        if everything.any():
            whole = polygon(self.light, points[:, everything].T, normals[:, everything].T, two_sided=True)
            value[everything] = whole.value
            error[everything] += whole.error
        pieces = pieces.select(~everything[pieces.owner])
        if len(pieces.owner):
            partly = pieces.irradiance(normals, float(np.abs(self.light.vertices - corner).max()))
            value += partly.value
            error += partly.error
        return Bounded(value, error)


@dataclass(frozen=True)
class _Pieces:
    """What is left of the emitter: convex polygons, their receivers, and how often each has been cut."""

    both: Floats
    """Corners relative to the emitter's first, then from the receiver, shape (6, V, P)."""
    owner: Integers
    """Which receiver sees the piece, shape (P,)."""
    cuts: Floats

    @property
    def relative(self) -> Floats:
        return self.both[:3]

    @property
    def offsets(self) -> Floats:
        return self.both[3:]

    @classmethod
    def of(cls, parts: Floats, points: Floats, corner: Floats) -> _Pieces:
        """All parts (3, V, M) for all receivers (3, N)."""
        count = points.shape[1]
        vertices = np.repeat(parts, count, axis=2)
        owner = np.tile(np.arange(count), parts.shape[2])
        both = np.concatenate([vertices - corner[:, None, None], vertices - points[:, None, owner]])
        return cls(both, owner, np.zeros(len(owner)))

    def select(self, which: Booleans) -> _Pieces:
        return _Pieces(self.both[:, :, which], self.owner[which], self.cuts[which])

    def irradiance(self, normals: Floats, size: float) -> Bounded:
        """Projected solid angle (N,) of all pieces of an emitter of this `size` [m], for receivers (3, N)."""
        count = normals.shape[1]
        seen = contour(self.offsets.transpose(2, 1, 0), normals[:, self.owner].T, self.relative.transpose(2, 1, 0))
        # Rounding displaces corners: those seen from the receiver by ulps of their distance, those cut by ulps of size.
        distances = _length(self.offsets)
        displaced = _EPSILON * (np.maximum(distances, np.roll(distances, -1, axis=0)) + 2 * size * self.cuts)
        following, up = np.roll(self.offsets, -1, axis=1), normals[:, None, self.owner]
        swept = (displaced * _light_by_distance(self.offsets, following, up)).sum(axis=0)
        # Rounding may leave a sliver with less than nothing.
        values = np.maximum(seen.value, 0)
        value = _summed(self.owner, values, count)
        error = _summed(self.owner, seen.error + swept, count)
        # The additions themselves, one for each piece.
        return Bounded(value, error + _EPSILON * value * np.bincount(self.owner, minlength=count))


def _joined(parts: list[_Pieces]) -> _Pieces:
    return _Pieces(
        join([part.both for part in parts]),
        np.concatenate([part.owner for part in parts]),
        np.concatenate([part.cuts for part in parts]),
    )


def _normal(corners: Floats) -> Floats:
    relative = corners - corners[0]
    area = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0)
    result: Floats = area / np.linalg.norm(area)
    return result


def _in_front(light: Polygon, normal: Floats, occluder: Floats) -> _Blocker | None:
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
    return _Blocker(np.array(base).T, np.array(shift).T, _normal(occluder))


def _without(
    pieces: _Pieces, blocker: _Blocker, points: Floats, normals: Floats, corner: Floats
) -> tuple[_Pieces, Floats]:
    """Subtract a convex occluder from all pieces; also how much rounding may have moved its outline (N,) [sr]."""
    count = points.shape[1]
    lost = np.zeros(count)
    sight = _Sight.of(blocker, points, corner)
    hides = sight.side[pieces.owner] != 0
    kept = [pieces.select(~hides)]
    rest = pieces.select(hides)

    # Most pieces are wholly beside the occluder: outside the plane of one of its edges, or it outside one of theirs.
    for i in range(sight.planes.shape[1]):
        distances, noise = sight.distances(i, rest)
        beside = (distances + noise).max(axis=0) < 0
        kept.append(rest.select(beside))
        rest = rest.select(~beside)
    beside = sight.beside(rest)
    kept.append(rest.select(beside))
    rest = rest.select(~beside)

    for i in range(sight.planes.shape[1]):
        distances, noise = sight.distances(i, rest)
        # Where rounding may have moved the plane, the outline's length tells how much light that is.
        doubtful = (np.abs(distances) <= noise).any(axis=0)
        if doubtful.any():
            offsets = rest.offsets[:, :, doubtful]
            up = normals[:, None, rest.owner[doubtful]]
            around = _light_by_distance(offsets, np.roll(offsets, -1, axis=1), up).sum(axis=0)
            lost += _summed(rest.owner[doubtful], around * sight.shifts(i, rest, noise)[doubtful], count)
        outside = distances.max(axis=0) <= 0
        cut = ~outside & (distances.min(axis=0) < 0)
        kept.append(rest.select(outside))
        inside = [rest.select(~(outside | cut))]
        if cut.any():
            here = rest.select(cut)
            within, without, ends = split(here.both, distances[:, cut])
            shift = sight.shifts(i, here, noise[:, cut])
            lost += _summed(here.owner, _light_by_distance(*ends[:, 3:, 0], normals[:, here.owner]) * shift, count)
            kept.append(_Pieces(without, here.owner, here.cuts + 1))
            inside.append(_Pieces(within, here.owner, here.cuts + 1))
        rest = _joined(inside)
    return _joined(kept), lost


@dataclass(frozen=True)
class _Sight:
    """A convex occluder as the receivers see it."""

    planes: Floats
    """Inward normals of the planes through receiver and edge, as long as the parallelogram of both, shape (3, K, N)."""
    area: Floats
    """At most so long are the normals, shape (K, N)."""
    relative: Floats
    """Its corners relative to the emitter's first, shape (3, K)."""
    side: Floats
    """0 for receivers in its plane, who see its edge only; shape (N,)."""

    @classmethod
    def of(cls, blocker: _Blocker, points: Floats, corner: Floats) -> _Sight:
        base, shift = blocker.base, blocker.shift
        towards = (base[:, :, None] - points[:, None]) + shift[:, :, None]
        edges = (np.roll(base, -1, axis=1) - base) + (np.roll(shift, -1, axis=1) - shift)
        heights = np.einsum("i,ikn->kn", blocker.normal, towards)
        noise = TOUCH * (np.einsum("i,ikn->kn", np.abs(blocker.normal), np.abs(towards)) + np.abs(towards).max(axis=0))
        # From the front, heights are negative and the corners go round counter-clockwise.
        touches = (np.abs(heights) <= noise).any(axis=0)
        side = np.where(touches, 0.0, np.sign(heights[0]))
        # The nearer end of an edge determines the plane better.
        following = np.roll(towards, -1, axis=1)
        nearer = np.where(_length(towards) <= _length(following), towards, following)
        planes = side * _cross(nearer, edges[:, :, None])
        area = _length(nearer) * _length(edges)[:, None]
        return cls(planes, area, (base - corner[:, None]) + shift, side)

    def distances(self, i: int, pieces: _Pieces) -> tuple[Floats, Floats]:
        """Distances of corners from the plane of edge i, in units of the normal's length, and their rounding errors.

        Positive ones are on the occluder's side. Shape (V, P) both.
        """
        normal = self.planes[:, i, pieces.owner]
        corners = pieces.relative - self.relative[:, i, None, None]
        distances = np.einsum("ip,ivp->vp", normal, corners)
        reach = _length(corners)
        rounding = 6 * self.area[i, pieces.owner] * reach + 2 * _length(normal) * (reach + _length(self.relative[:, i]))
        return distances, _EPSILON * rounding

    def shifts(self, i: int, pieces: _Pieces, noise: Floats) -> Floats:
        """Twice the furthest [m] that rounding errors `noise` may have moved the plane of edge i, shape (P,)."""
        length = _length(self.planes[:, i])[pieces.owner]
        result: Floats = 2 * noise.max(axis=0) / np.maximum(length, _SMALLEST)
        return result

    def beside(self, pieces: _Pieces) -> Booleans:
        """Whether the whole occluder is outside the plane of one of a piece's edges, beyond rounding errors."""
        result = np.zeros(len(pieces.owner), dtype=np.bool_)
        offsets = pieces.offsets
        edges = np.roll(pieces.relative, -1, axis=1) - pieces.relative
        outward = _cross(offsets, edges)
        area, lengths, far = _length(offsets) * _length(edges), _length(outward), _length(self.relative)
        for m in range(offsets.shape[1]):
            corners = self.relative[:, :, None] - pieces.relative[:, m, None]
            reach = _length(corners)
            noise = _EPSILON * (6 * area[m] * reach + 2 * lengths[m] * (reach + far[:, None]))
            result |= (np.einsum("ip,ikp->kp", outward[:, m], corners) > noise).all(axis=0)
        return result


def _light_by_distance(start: Floats, end: Floats, up: Floats) -> Floats:
    """Bound on the integral along edges (3, ...) of the receiver's cosine over the distance [1/m], by the angle.

    Times a small displacement [m] of the edge it is the projected solid angle that the edge sweeps.
    """
    edge = end - start
    sine, cosine = _length(_cross(start, end)), (start * end).sum(axis=0)
    from_start, from_end = _length(start), _length(end)
    nearest = np.minimum(from_start, from_end)
    foot = ((start * edge).sum(axis=0) < 0) & ((end * edge).sum(axis=0) > 0)
    nearest = np.maximum(np.where(foot, sine / np.maximum(_length(edge), _SMALLEST), nearest), _SMALLEST)
    # The higher end is as high as the edge gets; as much as rounding may have lifted it counts, too.
    height = np.maximum((start * up).sum(axis=0), (end * up).sum(axis=0)) + 8 * _EPSILON * (from_start + from_end)
    result: Floats = np.arctan2(sine, cosine) / nearest * np.clip(height / nearest, 0, 1)
    return result


def _summed(owner: Integers, amounts: Floats, count: int) -> Floats:
    """The sum of what belongs to each of `count` receivers."""
    return np.bincount(owner, amounts, count).astype(np.float64)


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross product over the first axis."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _length(a: Floats) -> Floats:
    """Length over the first axis."""
    result: Floats = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return result
