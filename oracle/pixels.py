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

_BISECTIONS = 20
_SPLITS_BESIDE_AN_EDGE = 3
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
    Smooth cells: tensor Gauss-Legendre quadrature with 3 x 3 nodes, its difference from 2 x 2 nodes as the bound.
    Cells with an edge: the edge is found on the cell's sides by bisection and taken as straight in between; cells
    are split until the estimate of a parent and the sum of its children agree, and beside an edge down to 1/8 pixel
    at least. An edge that touches none of the 17 points of a pixel nor of its neighbours goes unseen.
    """
    column, row = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    pixels = _Cells(np.arange(width * height), column.ravel(), row.ravel(), 1.0)
    parts = [_estimate(image, chunk, follow_edges=False) for chunk in _chunks(pixels)]
    mean = np.concatenate([part.mean for part in parts])
    error = np.concatenate([part.error for part in parts])
    mixed = np.concatenate([part.mixed for part in parts])

    near = _beside(pixels, mixed)
    scale = np.abs(mean).mean(axis=0)
    allowed = relative_tolerance * (0.1 * scale + 0.9 * np.abs(mean))
    refine = near | (error > allowed).any(axis=1)
    for chunk in _chunks(pixels.take(refine)):
        indices = chunk.pixel
        refined_mean, refined_error = _refine(image, chunk, allowed[indices])
        mean[indices] = refined_mean
        error[indices] = refined_error
    channels = mean.shape[1]
    return mean.reshape(height, width, channels), error.reshape(height, width, channels)


def _chunks(cells: _Cells) -> Iterator[_Cells]:
    for start in range(0, len(cells.pixel), _CELLS_AT_ONCE):
        yield cells.take(slice(start, start + _CELLS_AT_ONCE))


def _beside(cells: _Cells, mixed: Booleans) -> Booleans:
    """Which cells hold an edge or touch a cell that does: the tip of the edge may hide between their points."""
    column = np.rint(cells.x / cells.side).astype(np.int64) + 1
    row = np.rint(cells.y / cells.side).astype(np.int64) + 1
    stride = int(column.max()) + 2
    key = row * stride + column
    with_edge = key[mixed]
    beside = np.zeros(len(key), dtype=np.bool_)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            beside |= np.isin(key + dy * stride + dx, with_edge)
    return beside


def _refine(image: Image, pixels: _Cells, allowed: Floats) -> tuple[Floats, Floats]:
    """Split cells until parents and children agree; return mean and error of each given pixel."""
    total = np.zeros_like(allowed)
    error = np.zeros_like(allowed)
    owner = np.arange(len(pixels.pixel))
    cells, estimate = pixels, _estimate(image, pixels, follow_edges=False)
    for level in range(1, _LAST_SPLIT + 1):
        children = cells.split()
        follow_edges = level >= _SPLITS_BESIDE_AN_EDGE
        parts = [_estimate(image, chunk, follow_edges) for chunk in _chunks(children)]
        below = _Estimate(
            np.concatenate([part.mean for part in parts]),
            np.concatenate([part.error for part in parts]),
            np.concatenate([part.mixed for part in parts]),
        )
        area = children.side**2
        sums = below.mean.reshape(len(owner), 4, -1).sum(axis=1) * area
        disagreement = np.abs(sums - estimate.mean * cells.side**2)
        any_mixed = below.mixed.reshape(-1, 4).any(axis=1) | estimate.mixed
        own_error = below.error.reshape(len(owner), 4, -1).sum(axis=1) * area
        # Smooth children state their own bound; for an edge, what the last split changed is the bound.
        bound = np.where(any_mixed[:, None], np.maximum(disagreement, own_error), own_error)
        # A pixel's allowance is shared by the cells along an edge, of which there are about 1/side.
        done = (bound <= allowed[owner] * cells.side).all(axis=1)
        if level <= _SPLITS_BESIDE_AN_EDGE:
            done &= ~_beside(cells, any_mixed)
        if level == _LAST_SPLIT:
            done[:] = True
        np.add.at(total, owner[done], sums[done])
        np.add.at(error, owner[done], bound[done])
        if done.all():
            break
        keep = np.repeat(~done, 4)
        owner = np.repeat(owner, 4)[keep]
        cells = children.take(keep)
        estimate = _Estimate(below.mean[keep], below.error[keep], below.mixed[keep])
    return total, error


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
    """Mean over cells cut by one edge, taken as the straight line between its two points on the cell's sides."""
    count = len(cells.pixel)
    corner_labels = labels[:, 13:]
    first_side = sides_crossed.argmax(axis=1)
    second_side = 3 - sides_crossed[:, ::-1].argmax(axis=1)
    everyone = np.arange(count)

    def crossing(side: Integers) -> tuple[Floats, Floats]:
        """Where the label changes along a side, by bisection, in the cell's own coordinates."""
        after = (side + 1) % 4
        x0, y0, x1, y1 = _CORNER_X[side], _CORNER_Y[side], _CORNER_X[after], _CORNER_Y[after]
        label = corner_labels[everyone, side]
        low, high = np.zeros(count), np.ones(count)
        for _ in range(_BISECTIONS):
            t = (low + high) / 2
            _, here = image(cells.x + cells.side * (x0 + t * (x1 - x0)), cells.y + cells.side * (y0 + t * (y1 - y0)))
            same = here == label
            low, high = np.where(same, t, low), np.where(same, high, t)
        t = (low + high) / 2
        return x0 + t * (x1 - x0), y0 + t * (y1 - y0)

    ax, ay = crossing(first_side)
    bx, by = crossing(second_side)

    # The inner piece: first crossing, the corners between the two sides, second crossing. Shoelace formula.
    px, py = ax, ay
    inner_area = np.zeros(count)
    for corner in range(1, 4):
        inside = (corner > first_side) & (corner <= second_side)
        qx, qy = np.where(inside, _CORNER_X[corner], px), np.where(inside, _CORNER_Y[corner], py)
        inner_area += px * qy - qx * py
        px, py = qx, qy
    inner_area += px * by - bx * py + bx * ay - ax * by
    inner_area = np.clip(np.abs(inner_area) / 2, 0, 1)

    # Each piece has the mean of the points that carry its label; points of any third label are left out.
    inner_label = corner_labels[everyone, first_side + 1]
    outer_label = corner_labels[everyone, first_side]
    means = []
    for label in (inner_label, outer_label):
        own = (labels == label[:, None])[..., None]
        means.append((values * own).sum(axis=1) / own.sum(axis=1))
    mean = inner_area[:, None] * means[0] + (1 - inner_area)[:, None] * means[1]
    # The parent's disagreement with its children bounds the rest; a third label is not measured at all.
    third = (labels != inner_label[:, None]) & (labels != outer_label[:, None])
    spread = values.max(axis=1) - values.min(axis=1)
    error: Floats = np.where(third.any(axis=1)[:, None], spread, 0.0)
    return mean, error
