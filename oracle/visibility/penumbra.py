"""What receivers see of a flat emitter past flat occluders.

All is decided in the receiver's sphere of directions, by planes through the receiver: an edge of an occluder and the
receiver span one, and an emitter's convex part P without a convex occluder Q is the union over Q's edges i of the
pieces of P outside the plane of edge i and inside those of the edges before it. Pieces do not overlap, and the next
occluder is subtracted from each of them, so that what two occluders hide counts once. An occluder that reaches behind
the receiver needs no care: in front, the planes of its edges bound the cone over the part in front. The idea to clip
polygons against each other as the light sees them is that of Weiler and Atherton (1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import Receivers
from oracle.kernels.polygon import polygon
from oracle.shapes import Polygon, Shape
from oracle.visibility.convex import convex_parts, join, polygons_of, split
from oracle.visibility.pieces import Pieces, joined, light_by_distance, summed
from oracle.visibility.sight import TOUCH, Blocker, Sight, in_front

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
class _Scene:
    """An emitter from one of its sides, with what may hide it there."""

    light: Polygon
    parts: Floats
    """Its convex parts, shape (3, V, M); counter-clockwise from this side."""
    normal: Floats
    """Towards this side."""
    blockers: list[Blocker]

    @classmethod
    def of(cls, light: Polygon, side: int, occluders: list[Floats]) -> _Scene:
        """The side 1 is the front, -1 the back."""
        parts = join([part[::side].T[:, :, None] for part in convex_parts(light)])
        normal = side * light.normal
        cut = [in_front(light, normal, occluder) for occluder in occluders]
        return cls(light, parts, normal, [blocker for blocker in cut if blocker is not None])

    def seen_from(self, points: Floats, normals: Floats) -> Bounded:
        """Projected solid angle (N,) from receivers (3, N)."""
        value, error = np.zeros(points.shape[1]), np.zeros(points.shape[1])
        away = points - self.light.vertices[0][:, None]
        height = self.normal @ away
        # The normal of a needle is rounded more than others.
        extent = np.abs(self.light.vertices - self.light.vertices[0]).max()
        blur = 1 + extent**2 / self.light.area
        noise = TOUCH * (np.abs(self.normal) @ np.abs(away) + blur * np.abs(away).max(axis=0))
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
        size = float(np.abs(self.light.vertices - corner).max())
        whole = pieces = Pieces.of(self.parts, points, corner)
        error = np.zeros(count)
        for blocker in self.blockers:
            sight = Sight.of(blocker, points, corner, size)
            # What is seen edge-on hides nothing, to rounding.
            edge_on = whole.select(sight.thickness[whole.owner] > 0)
            error += summed(edge_on.owner, edge_on.outline(normals) * sight.thickness[edge_on.owner], count)
            # Most occluders concern few receivers.
            concerned = np.zeros(count, dtype=np.bool_)
            concerned[whole.owner[sight.meets(whole)]] = True
            if concerned.any():
                concerns = concerned[pieces.owner]
                rest, lost = _without(pieces.select(concerns), sight, normals)
                pieces = joined([pieces.select(~concerns), rest])
                error += lost
        # Who sees all sees the emitter without occluders, whose form keeps more digits.
        everything = np.bincount(pieces.owner[pieces.cuts == 0], minlength=count) == parts
        value = np.zeros(count)
        if everything.any():
            unhidden = polygon(self.light, points[:, everything].T, normals[:, everything].T, two_sided=True)
            value[everything] = unhidden.value
            error[everything] += unhidden.error
        pieces = pieces.select(~everything[pieces.owner])
        if len(pieces.owner):
            partly = pieces.irradiance(normals, size)
            value += partly.value
            error += partly.error
        return Bounded(value, error)


def _without(pieces: Pieces, sight: Sight, normals: Floats) -> tuple[Pieces, Floats]:
    """Subtract a convex occluder from all pieces; also how much rounding may have moved its outline (N,) [sr]."""
    count = normals.shape[1]
    lost = np.zeros(count)
    meets = sight.meets(pieces)
    kept = [pieces.select(~meets)]
    rest = pieces.select(meets)
    for i in range(sight.planes.shape[1]):
        distances, noise = sight.distances(i, rest)
        # Where rounding may have moved the plane, the outline's length tells how much light that is.
        doubtful = (np.abs(distances) - noise).min(axis=0) <= 0
        if doubtful.any():
            around = rest.select(doubtful).outline(normals)
            lost += summed(rest.owner[doubtful], around * sight.shifts(i, rest, noise)[doubtful], count)
        outside = distances.max(axis=0) <= 0
        cut = ~outside & (distances.min(axis=0) < 0)
        kept.append(rest.select(outside))
        inside = [rest.select(~(outside | cut))]
        if cut.any():
            here = rest.select(cut)
            within, without, ends = split(here.both, distances[:, cut])
            shift = sight.shifts(i, here, noise[:, cut])
            along = light_by_distance(ends[0, 3:, 0], ends[1, 3:, 0], normals[:, here.owner])
            lost += summed(here.owner, along * shift, count)
            kept.append(Pieces(without, here.owner, here.cuts + 1))
            inside.append(Pieces(within, here.owner, here.cuts + 1))
        rest = joined(inside)
    return joined(kept), lost
