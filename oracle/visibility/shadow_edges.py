"""Shadows of convex polygons on a flat, convex receiver: penumbra and umbra are convex polygons themselves.

A point of the receiver lies in the penumbra of a convex occluder and a convex emitter if some point of the emitter is
behind the occluder: unless one of the planes through an edge of the one and a corner of the other that separate the two
separates it from the occluder, too. It lies in the umbra if all of the emitter's corners are behind the occluder, hence
within the cones over the occluder from each of them [Nishita and Nakamae 1983].
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Floats, InvalidArgument
from oracle.emitters import Directional, Point, Spot
from oracle.shapes import Polygon, Rectangle
from oracle.visibility.convex import convex_parts, split

# Planes through corners that are so near to them, relative to the size of all, pass through them.
_TOUCH = 1e-12


@dataclass(frozen=True, eq=False)
class Shadow:
    """Parts of a receiver, as convex polygons [m] that go round as the receiver does; shape (0, 3) if there is none.

    ``penumbra`` is where the occluder hides some of the emitter, including ``umbra``, where it hides all. Edges that
    are not on the receiver's outline are the shadow's. To rounding: some ulps of the coordinates, more where the edges
    come from planes that graze the receiver.
    """

    penumbra: Floats
    umbra: Floats


def polygon_shadow(
    emitter: Polygon | Rectangle | Point | Spot | Directional,
    occluder: Polygon | Rectangle,
    receiver: Polygon | Rectangle,
) -> Shadow:
    """Penumbra and umbra of one convex occluder.

    Parameters
    ----------
    emitter : Polygon, Rectangle, Point, Spot or Directional
        Convex; it shines from its front. A spot shines everywhere: its cone has its own edges.
    occluder : Polygon or Rectangle
        Convex; what is behind the emitter or the receiver hides nothing.
    receiver : Polygon or Rectangle
        Convex; only what its front sees counts.

    Returns
    -------
    Shadow
        On the part of the receiver that is in front of the emitter. Without size, an emitter has an umbra only, and the
        penumbra is the same.

    Raises
    ------
    InvalidArgument
        If one of the three is not convex or of another kind.
    """
    ground = convex_polygon("receiver", receiver)
    blocker = convex_polygon("occluder", occluder)
    up, origin = ground.normal, ground.vertices[0]
    where, hiding = ground.vertices, _above(blocker.vertices, origin, up)

    # The emitter's corners with weight 1, or a direction towards it with weight 0.
    match emitter:
        case Polygon() | Rectangle():
            light = convex_polygon("emitter", emitter)
            corners, weight = _above(light.vertices, origin, up), 1.0
            where, hiding = (_above(part, light.vertices[0], light.normal) for part in (where, hiding))
        case Point() | Spot():
            corners, weight = _above(emitter.position[None], origin, up), 1.0
        case Directional():
            corners, weight = -emitter.direction[None], 0.0
            if emitter.direction @ up >= 0:
                corners = corners[:0]
        case _:
            raise InvalidArgument(f"emitter is a {type(emitter).__name__}; a flat or a point-like one is supported")
    if not len(where) or not len(hiding) or not len(corners):
        return Shadow(np.empty((0, 3)), np.empty((0, 3)))

    scale = max(float(np.abs(part - origin).max()) for part in (where, hiding, corners if weight else hiding))
    penumbra = where
    for at, normal in _separating(hiding, corners, weight, scale):
        penumbra = _clip(penumbra, (penumbra - at) @ normal)
    return Shadow(penumbra, _umbra(where, hiding, corners, weight, scale))


def convex_polygon(name: str, shape: object) -> Polygon:
    """A convex polygon or rectangle as a polygon; InvalidArgument by `name` if it is anything else."""
    if not isinstance(shape, Polygon | Rectangle):
        raise InvalidArgument(f"{name} is a {type(shape).__name__}; a convex Polygon or a Rectangle is supported")
    polygon = shape.polygon if isinstance(shape, Rectangle) else shape
    if len(convex_parts(polygon)) > 1:
        raise InvalidArgument(f"{name} is not convex; pass its convex parts one by one")
    return polygon


def _above(corners: Floats, origin: Floats, up: Floats) -> Floats:
    """The part of a convex polygon, or of a single point, above a plane; empty if it only touches it."""
    heights = (corners - origin) @ up
    heights = np.where(np.abs(heights) <= _TOUCH * np.abs(corners - origin).max(), 0.0, heights)
    return _clip(corners, heights)


def _clip(polygon: Floats, distances: Floats) -> Floats:
    """The part (K, 3) of a convex polygon where the distances of its corners are positive."""
    if not (distances > 0).any():
        return polygon[:0]
    if (distances >= 0).all():
        return polygon
    kept: Floats = split(polygon.T[:, :, None], distances[:, None])[0][:, :, 0].T
    return kept


def _edges(polygon: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Edges as start and vector; none of a single point."""
    if len(polygon) > 1:
        yield from zip(polygon, np.roll(polygon, -1, axis=0) - polygon, strict=True)


def _separating(hiding: Floats, corners: Floats, weight: float, scale: float) -> Iterator[tuple[Floats, Floats]]:
    """Planes, by a point and a normal towards the occluder, that have occluder and emitter on different sides."""
    spanned = [(start, edge, corner - weight * start) for start, edge in _edges(hiding) for corner in corners]
    spanned += [(start, edge, corner - start) for start, edge in _edges(corners) for corner in hiding]
    for at, first, second in spanned:
        normal = np.cross(first, second)
        noise = _TOUCH * scale * np.linalg.norm(first) * np.linalg.norm(second)
        if np.linalg.norm(normal) * scale <= noise:
            continue
        occluder, light = (hiding - at) @ normal, (corners - weight * at) @ normal
        for side in (1, -1):
            apart = (side * occluder >= -noise).all() and (side * light <= noise).all()
            # A plane that holds both says nothing.
            if apart and max(np.abs(occluder).max(), np.abs(light).max()) > noise:
                yield at, side * normal


def _umbra(where: Floats, hiding: Floats, corners: Floats, weight: float, scale: float) -> Floats:
    """The part of the receiver that is behind the occluder as seen from each of the emitter's corners."""
    start, edge = hiding[0], hiding[1] - hiding[0]
    face = np.cross(edge, hiding[2] - hiding[0])
    middle = hiding.mean(axis=0)
    noise = _TOUCH * scale * np.linalg.norm(face)
    for corner in corners:
        height = (corner - weight * start) @ face
        if abs(height) <= noise:
            # In the occluder's plane: hidden only where the occluder touches it.
            sides = [np.cross(along, corner - at) @ face for at, along in _edges(hiding)]
            if weight == 0 or min(sides) < -noise * np.linalg.norm(edge):
                return where[:0]
            continue
        for at, along in _edges(hiding):
            normal = np.cross(along, corner - weight * at)
            inwards = np.sign((middle - at) @ normal)
            where = _clip(where, inwards * ((where - at) @ normal))
    return where
