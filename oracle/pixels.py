"""Averages over pixel footprints: quadrature where the image is smooth, adaptive where an edge crosses a pixel.

The image is given as a function of film positions that returns radiance and a *label*. The label is any integer
that is constant where the radiance is smooth and differs across its edges (which surface is seen, which light is
visible). Edges are found and measured through the labels alone, so that their kind does not matter here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats, Integers

# Film positions x and y [pixels], each of shape (N,), to radiance (N, C) and labels (N,).
Image = Callable[[Floats, Floats], tuple[Floats, Integers]]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_GAUSS_X, _GAUSS_Y = (axis.ravel() / 2 + 0.5 for axis in np.meshgrid(_NODES, _NODES))
_GAUSS_WEIGHTS = np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4
_COARSE = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
_COARSE_X, _COARSE_Y = (axis.ravel() for axis in np.meshgrid(_COARSE, _COARSE))
# The corners of a cell, counter-clockwise, so that corner i and i + 1 share side i.
_CORNER_X, _CORNER_Y = np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0])
_POINTS_X = np.concatenate([_GAUSS_X, _COARSE_X, _CORNER_X])
_POINTS_Y = np.concatenate([_GAUSS_Y, _COARSE_Y, _CORNER_Y])

# Orders of quadrature tried on a smooth pixel before it is split; the difference from the order before is the bound.
_HIGHER_ORDERS = (3, 5, 8, 13)
_BISECTIONS = 20
_SPLITS_TO_FIND_EDGES = 2
_FIRST_SPLIT_TO_FOLLOW_EDGES = 2
_LAST_SPLIT = 8
_CELLS_AT_ONCE = 16384


@dataclass(frozen=True, eq=False)
class _Cells:
    """Squares of the film: their pixel (flat index), lower corner and side [pixels]."""

    pixel: Integers
    x: Floats
    y: Floats
    side: float

    def take(self, which: Booleans | Integers | slice) -> _Cells:
        return _Cells(self.pixel[which], self.x[which], self.y[which], self.side)

    def split(self) -> _Cells:
        """Four children each, those of one parent side by side."""
        half = self.side / 2
        x = self.x[:, None] + half * np.array([0, 1, 0, 1])
        y = self.y[:, None] + half * np.array([0, 0, 1, 1])
        return _Cells(np.repeat(self.pixel, 4), x.ravel(), y.ravel(), half)


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Mean radiance of cells (N, C), a bound on its error (N, C), and which cells hold an edge (N,)."""

    mean: Floats
    error: Floats
    mixed: Booleans


def average(image: Image, width: int, height: int, relative_tolerance: float = 1e-5) -> tuple[Floats, Floats]:
    """Average an image over each pixel's square.

    Parameters
    ----------
    image : callable
        Film positions x in [0, width], y in [0, height] [pixels], (N,) each, to radiance (N, C) and labels (N,).
    width, height : int
        Size of the film [pixels].
    relative_tolerance : float
        Error asked for, relative to the mean radiance of the whole image (with a tenth of it for each pixel's own
        radiance where that is smaller).

    Returns
    -------
    mean, error : ndarray
        Average radiance and a bound on its error, each (height, width, C).

    Notes
    -----
    Smooth cells: tensor Gauss-Legendre quadrature with 3 x 3 nodes, its difference from 2 x 2 nodes as the bound; where
    that is not enough, a smooth pixel gets up to 13 x 13 nodes before it is split.
    Cells with an edge: the edge is found on the cell's sides by bisection and taken as straight in between; cells
    are split until the estimate of a parent and the sum of its children agree, down to 1/8 pixel at least. Beside an
    edge pixels are searched for its continuation at 272 points. So a strip wider than 0.3 pixels is always seen, and
    one wider than 0.08 pixels is followed from wherever one of the 17 points of a pixel sees it.
    """
    column, row = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    pixels = _Cells(np.arange(width * height), column.ravel(), row.ravel(), 1.0)
    first = _estimate_all(image, pixels, follow_edges=False)
    mean, error, mixed = first.mean, first.error, first.mixed
    scale = np.abs(mean).mean(axis=0)
    allowed = relative_tolerance * (0.1 * scale + 0.9 * np.abs(mean))

    finished = np.zeros(len(mixed), dtype=np.bool_)
    beside_edges = _dilated(mixed, width)
    imprecise = (error > allowed).any(axis=1)
    for chunk in _chunks(pixels.take(imprecise & ~beside_edges)):
        raised = _raise_order(image, chunk, allowed[chunk.pixel])
        mean[chunk.pixel], error[chunk.pixel], mixed[chunk.pixel] = raised.mean, raised.error, raised.mixed
    pending = _dilated(mixed, width) | (error > allowed).any(axis=1)
    while pending.any():
        for chunk in _chunks(pixels.take(pending)):
            # Pixels around the chunk that hold an edge come along, for the edge to be followed from there.
            chosen = np.zeros(len(mixed), dtype=np.bool_)
            chosen[chunk.pixel] = True
            around = np.flatnonzero(_dilated(chosen, width) & mixed & ~chosen)
            together = np.concatenate([chunk.pixel, around])
            refined = _refine(image, pixels.take(together), allowed[together])
            own = slice(len(chunk.pixel))
            mean[chunk.pixel], error[chunk.pixel] = refined.mean[own], refined.error[own]
            mixed[chunk.pixel] |= refined.mixed[own]
        finished |= pending
        # An edge may continue into a pixel whose own 17 points had not seen it.
        pending = _dilated(mixed, width) & ~finished
    channels = mean.shape[1]
    return mean.reshape(height, width, channels), error.reshape(height, width, channels)


def _chunks(cells: _Cells) -> Iterator[_Cells]:
    for start in range(0, len(cells.pixel), _CELLS_AT_ONCE):
        yield cells.take(slice(start, start + _CELLS_AT_ONCE))


def _dilated(pixels: Booleans, width: int) -> Booleans:
    """The given pixels (flat) and their eight neighbours."""
    grid = np.pad(pixels.reshape(-1, width), 1)
    rows = grid[:-2] | grid[1:-1] | grid[2:]
    result: Booleans = (rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]).ravel()
    return result


def _touching(cells: _Cells, chosen: Booleans) -> Booleans:
    """Which cells are chosen or share a side or a corner with a chosen one."""
    column = np.rint(cells.x / cells.side).astype(np.int64) + 1
    row = np.rint(cells.y / cells.side).astype(np.int64) + 1
    stride = int(column.max()) + 2
    key = row * stride + column
    keys_chosen = key[chosen]
    touching = np.zeros(len(key), dtype=np.bool_)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            touching |= np.isin(key + dy * stride + dx, keys_chosen)
    return touching


def _raise_order(image: Image, cells: _Cells, allowed: Floats) -> _Estimate:
    """Mean over smooth cells by quadrature of rising order until two orders agree; tells where an edge was found."""
    count = len(cells.pixel)
    result = _Estimate(np.zeros_like(allowed), np.full_like(allowed, np.inf), np.zeros(count, dtype=np.bool_))
    pending = np.arange(count)
    for order in _HIGHER_ORDERS:
        nodes, weights = np.polynomial.legendre.leggauss(order)
        x, y = (axis.ravel() / 2 + 0.5 for axis in np.meshgrid(nodes, nodes))
        part = cells.take(pending)
        values, labels = image((part.x[:, None] + part.side * x).ravel(), (part.y[:, None] + part.side * y).ravel())
        labels = labels.reshape(len(pending), -1)
        mean = np.einsum("npc,p->nc", values.reshape(*labels.shape, -1), np.outer(weights, weights).ravel() / 4)
        if order > _HIGHER_ORDERS[0]:
            result.error[pending] = np.abs(mean - result.mean[pending])
        result.mean[pending] = mean
        result.mixed[pending] = (labels != labels[:, :1]).any(axis=1)
        precise = (result.error[pending] <= allowed[pending]).all(axis=1)
        pending = pending[~precise & ~result.mixed[pending]]
        if not len(pending):
            break
    return result


def _refine(image: Image, pixels: _Cells, allowed: Floats) -> _Estimate:
    """Split cells until parents and children agree; return the estimate of each given pixel."""
    total = np.zeros_like(allowed)
    error = np.zeros_like(allowed)
    mixed = np.zeros(len(allowed), dtype=np.bool_)
    owner = np.arange(len(allowed))
    cells, estimate = pixels, _estimate_all(image, pixels, follow_edges=False)
    for level in range(1, _LAST_SPLIT + 1):
        children = cells.split()
        below = _estimate_all(image, children, follow_edges=level >= _FIRST_SPLIT_TO_FOLLOW_EDGES)
        area = children.side**2
        sums = below.mean.reshape(len(owner), 4, -1).sum(axis=1) * area
        disagreement = np.abs(sums - estimate.mean * cells.side**2)
        with_edge = below.mixed.reshape(-1, 4).any(axis=1) | estimate.mixed
        own_error = below.error.reshape(len(owner), 4, -1).sum(axis=1) * area
        # Smooth children state their own bound; for an edge, what the last split changed is the bound.
        bound = np.where(with_edge[:, None], np.maximum(disagreement, own_error), own_error)
        # A pixel's allowance is shared by the cells along an edge, of which there are about 1/side.
        done = (bound <= allowed[owner] * cells.side).all(axis=1)
        # The tip of an edge that is not settled yet may hide between the points of a cell beside it.
        done &= ~_touching(cells, with_edge & ~done) & (level >= _SPLITS_TO_FIND_EDGES)
        if level == _LAST_SPLIT:
            done[:] = True
        np.add.at(total, owner[done], sums[done])
        np.add.at(error, owner[done], bound[done])
        np.logical_or.at(mixed, owner, with_edge)
        if done.all():
            break
        keep = np.repeat(~done, 4)
        owner = np.repeat(owner, 4)[keep]
        cells = children.take(keep)
        estimate = _Estimate(below.mean[keep], below.error[keep], below.mixed[keep])
    return _Estimate(total, error, mixed)


def _estimate_all(image: Image, cells: _Cells, follow_edges: bool) -> _Estimate:
    """Like `_estimate`, for any number of cells."""
    parts = [_estimate(image, chunk, follow_edges) for chunk in _chunks(cells)]
    return _Estimate(
        np.concatenate([part.mean for part in parts]),
        np.concatenate([part.error for part in parts]),
        np.concatenate([part.mixed for part in parts]),
    )


def _estimate(image: Image, cells: _Cells, follow_edges: bool) -> _Estimate:
    """Mean radiance of each cell from its own points, and from where edges cross its sides if asked."""
    count = len(cells.pixel)
    x = cells.x[:, None] + cells.side * _POINTS_X
    y = cells.y[:, None] + cells.side * _POINTS_Y
    values, labels = image(x.ravel(), y.ravel())
    values = values.reshape(count, len(_POINTS_X), -1)
    labels = labels.reshape(count, len(_POINTS_X))
    mean = np.einsum("npc,p->nc", values[:, :9], _GAUSS_WEIGHTS)
    coarse = values[:, 9:13].mean(axis=1)
    error = np.abs(mean - coarse)
    mixed = (labels != labels[:, :1]).any(axis=1)

    # Without a straight edge to follow, an edge cell may be off by as much as its values differ.
    spread = values.max(axis=1) - values.min(axis=1)
    error[mixed] = spread[mixed]
    corner_labels = labels[:, 13:]
    sides_crossed = corner_labels != np.roll(corner_labels, -1, axis=1)
    straight = mixed & (sides_crossed.sum(axis=1) == 2)
    if follow_edges and straight.any():
        mean[straight], error[straight] = _two_pieces(
            image, cells.take(straight), labels[straight], values[straight], sides_crossed[straight]
        )
    return _Estimate(mean, error, mixed)


def _two_pieces(
    image: Image, cells: _Cells, labels: Integers, values: Floats, sides_crossed: Booleans
) -> tuple[Floats, Floats]:
    """Mean over cells cut by one edge, through five of its points: two on the cell's sides and three between."""
    count = len(cells.pixel)
    corner_labels = labels[:, 13:]
    first_side = sides_crossed.argmax(axis=1)
    second_side = 3 - sides_crossed[:, ::-1].argmax(axis=1)
    everyone = np.arange(count)
    outer_label, inner_label = corner_labels[everyone, first_side], corner_labels[everyone, first_side + 1]

    def at(x: Floats, y: Floats) -> tuple[Floats, Integers]:
        """The image at positions (..., cells) in the cells' own coordinates."""
        there, label_there = image(
            (cells.x + cells.side * np.clip(x, 0, 1)).ravel(), (cells.y + cells.side * np.clip(y, 0, 1)).ravel()
        )
        return there.reshape(*x.shape, -1), label_there.reshape(x.shape)

    def boundary(label: Integers, x: Floats, y: Floats, dx: Floats, dy: Floats) -> Floats:
        """How far one can go from (x, y), which has the label, along (dx, dy) until it ends: bisection in [0, 1]."""
        low, high = np.zeros(x.shape), np.ones(x.shape)
        for _ in range(_BISECTIONS):
            t = (low + high) / 2
            same = at(x + t * dx, y + t * dy)[1] == label
            low, high = np.where(same, t, low), np.where(same, high, t)
        middle: Floats = (low + high) / 2
        return middle

    # Where the label changes along the two sides.
    sides = np.stack([first_side, second_side])
    x, y = _CORNER_X[sides], _CORNER_Y[sides]
    dx, dy = _CORNER_X[(sides + 1) % 4] - x, _CORNER_Y[(sides + 1) % 4] - y
    t = boundary(corner_labels[everyone, sides], x, y, dx, dy)
    (ax, bx), (ay, by) = x + t * dx, y + t * dy

    # The inner piece: first crossing, the corners between the two sides, second crossing. Its doubled area and moments
    # by the shoelace formula, with the first crossing as origin.
    doubled_area, moment_x, moment_y = np.zeros(count), np.zeros(count), np.zeros(count)
    px, py = np.zeros(count), np.zeros(count)
    for corner in range(1, 5):
        if corner == 4:
            qx, qy = bx - ax, by - ay
        else:
            inside = (corner > first_side) & (corner <= second_side)
            qx, qy = np.where(inside, _CORNER_X[corner] - ax, px), np.where(inside, _CORNER_Y[corner] - ay, py)
        cross = px * qy - qx * py
        doubled_area += cross
        moment_x += (px + qx) * cross
        moment_y += (py + qy) * cross
        px, py = qx, qy
    inner_area = np.clip(doubled_area / 2, 0, 1)
    outer_area = 1 - inner_area

    # A linear function has its mean at the centroid; the two centroids balance at the middle of the cell.
    positive = np.where(doubled_area > 0, doubled_area, 1.0)
    inner_x, inner_y = ax + moment_x / (3 * positive), ay + moment_y / (3 * positive)
    rest = np.where(outer_area > 0, outer_area, 1.0)
    outer_x, outer_y = (0.5 - inner_area * inner_x) / rest, (0.5 - inner_area * inner_y) / rest

    # How far the edge bulges out of the inner piece at a quarter, half and three quarters of the chord, sought up to a
    # quarter of its length to either side. Simpson's rule with half the points tells how good the one with all is.
    chord_x, chord_y = bx - ax, by - ay
    out_x, out_y = -chord_y / 4, chord_x / 4
    parts = np.array([[0.25], [0.5], [0.75]])
    x, y = ax + parts * chord_x, ay + parts * chord_y
    measured = (at(x - out_x, y - out_y)[1] == inner_label).all(axis=0)
    measured &= (at(x + out_x, y + out_y)[1] != inner_label).all(axis=0)
    t = boundary(inner_label, x - out_x, y - out_y, 2 * out_x, 2 * out_y)
    bulges = (2 * t - 1) / 4 * (chord_x**2 + chord_y**2)
    coarse = 2 / 3 * bulges[1]
    fine = (bulges[0] + bulges[1] / 2 + bulges[2]) / 3
    inner_area = np.clip(inner_area + np.where(measured, fine, 0.0), 0, 1)
    area_error = np.where(measured, np.abs(fine - coarse), 1.0)

    pieces = np.stack([inner_label, outer_label])
    areas = np.stack([inner_area, 1 - inner_area])
    there, label_there = at(np.stack([inner_x, outer_x]), np.stack([inner_y, outer_y]))
    # Where the edge bends around a centroid, the points that carry the label do instead.
    own = (labels == pieces[..., None])[..., None]
    missed = label_there != pieces
    of_points = (values * own).sum(axis=2) / own.sum(axis=2)
    mean = (areas[..., None] * np.where(missed[..., None], of_points, there)).sum(axis=0)
    area_error += np.where(missed, areas, 0.0).sum(axis=0)
    # A third label is not measured at all.
    third = ((labels != inner_label[:, None]) & (labels != outer_label[:, None])).any(axis=1)
    spread = values.max(axis=1) - values.min(axis=1)
    error: Floats = np.where(third, 1.0, np.minimum(area_error, 1.0))[:, None] * spread
    return mean, error
