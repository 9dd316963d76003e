"""Convex polygons: a polygon's convex parts, and what a half-space leaves of many polygons at once."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Booleans, Floats, InvalidArgument
from oracle.shapes import Mesh, Polygon, Rectangle, Shape


def polygons_of(name: str, shape: Shape) -> tuple[Polygon, ...]:
    """The polygons of a flat shape.

    Raises
    ------
    InvalidArgument
        If the shape is round; `name` is the argument's.
    """
    match shape:
        case Polygon():
            return (shape,)
        case Rectangle():
            return (shape.polygon,)
        case Mesh():
            return shape.polygons
        case _:
            raise InvalidArgument(f"{name} is a {type(shape).__name__}; a Polygon, Rectangle or Mesh is supported")


def convex_parts(polygon: Polygon) -> list[Floats]:
    """A polygon as it is if convex, else as triangles between its vertices.

    Notes
    -----
    Ears are cut off one by one [Meisters 1975]. A vertex in the same place as one of the ear's corners does not keep it
    from being cut off, so that a hole may be joined to the outline by an edge that is passed twice.
    """
    vertices = polygon.vertices
    # Seen along the axis nearest to the normal, which takes coordinates as they are.
    axis = int(np.abs(polygon.normal).argmax())
    flat = np.roll(vertices, -axis - 1, axis=1)[:, :2] - np.roll(vertices[0], -axis - 1)[:2]
    if polygon.normal[axis] < 0:
        flat = flat * [-1, 1]
    if (_turns(flat) >= 0).all():
        return [vertices]
    left = list(range(len(vertices)))
    parts = []
    while len(left) > 2:
        turns = _turns(flat[left])
        ear = _best_ear(flat[left], turns)
        # A vertex on the straight line between its neighbours leaves without taking any area along.
        if turns[ear] > 0:
            parts.append(vertices[[left[ear - 1], left[ear], left[(ear + 1) % len(left)]]])
        del left[ear]
    return parts


def _cross(a: Floats, b: Floats) -> Floats:
    result: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def _turns(flat: Floats) -> Floats:
    """Twice the signed area of each vertex with its two neighbours; rounding errors are 0."""
    to_here, onwards = flat - np.roll(flat, 1, axis=0), np.roll(flat, -1, axis=0) - flat
    turns = _cross(to_here, onwards)
    noise = 4 * np.finfo(np.float64).eps * np.abs(flat).max() * (np.abs(to_here) + np.abs(onwards)).sum(axis=1)
    return np.where(np.abs(turns) <= noise, 0.0, turns)


def _best_ear(flat: Floats, turns: Floats) -> int:
    """The first vertex whose triangle with its neighbours holds no other vertex, or touches the fewest."""
    before, after = np.roll(flat, 1, axis=0), np.roll(flat, -1, axis=0)
    if (turns == 0).any():
        return int((turns == 0).argmax())

    def side(start: Floats, end: Floats) -> Floats:
        """side[i, j]: on which side of the line from start[i] to end[i] vertex j lies; rounding errors are 0."""
        sides = _cross((end - start)[:, None], flat[None] - start[:, None])
        noise = 8 * np.finfo(np.float64).eps * np.abs(flat).max() * np.abs(end - start).sum(axis=1)
        return np.where(np.abs(sides) <= noise[:, None], 0.0, sides)

    sides = np.stack([side(before, flat), side(flat, after), side(after, before)])
    corner = np.zeros(sides.shape[1:], dtype=np.bool_)
    for own in (before, flat, after):
        corner |= (own[:, None] == flat[None]).all(axis=-1)
    holds = ((sides > 0).all(axis=0) & ~corner).sum(axis=1)
    touches = ((sides >= 0).all(axis=0) & ~corner).sum(axis=1)
    # Non-convex corners come last, then those that hold vertices, then those that touch some.
    return int(np.lexsort((touches, holds, turns <= 0))[0])


def split(polygons: Floats, distances: Floats) -> tuple[Floats, Floats, Floats]:
    """Cut convex polygons in two.

    Parameters
    ----------
    polygons : ndarray
        Vertices, shape (D, V, P) with D numbers for each, all of them linear in space; repeated vertices do no harm.
    distances : ndarray
        The vertices' signed distances from each polygon's own plane, shape (V, P), of both signs for each polygon.

    Returns
    -------
    tuple of ndarray
        What lies on the positive and on the negative side, shape (D, V', P) each, the last vertex repeated as needed;
        and the two ends of the cut, shape (2, D, 1, P).
    """
    onwards = np.roll(distances, -1, axis=0)
    crosses = ((distances > 0) & (onwards < 0)) | ((distances < 0) & (onwards > 0))
    t = distances / np.where(crosses, distances - onwards, 1.0)
    # Both sides share these vertices to the last bit.
    cuts = polygons + t * (np.roll(polygons, -1, axis=1) - polygons)
    # Repeated vertices count once.
    first = np.ones(distances.shape, dtype=np.bool_)
    first[1:] = (polygons[:, 1:] != polygons[:, :-1]).any(axis=0)
    candidates = np.stack([polygons, cuts], axis=2).reshape(len(polygons), -1, polygons.shape[2])
    inside, outside, between = (
        _gather(candidates, np.stack([kept, crosses], axis=1).reshape(-1, kept.shape[1]))
        for kept in ((distances >= 0) & first, (distances <= 0) & first, (distances == 0) & first)
    )
    return inside, outside, np.stack([between[:, :1], between[:, -1:]])


def _gather(candidates: Floats, used: Booleans) -> Floats:
    """Move the candidates that are used to the front."""
    count = used.sum(axis=0)
    order = np.argsort(~used, axis=0, kind="stable")[: count.max(initial=1)]
    rows = np.minimum(np.arange(len(order))[:, None], count - 1)
    columns = np.arange(used.shape[1])
    result: Floats = candidates[:, order[rows, columns], columns]
    return result


def join(batches: list[Floats]) -> Floats:
    """Batches of polygons (D, V, P) with different V as one; the last vertex is repeated as needed."""
    widest = max(batch.shape[1] for batch in batches)
    return np.concatenate(
        [batch[:, np.minimum(np.arange(widest), batch.shape[1] - 1)] for batch in batches],
        axis=2,
    )
