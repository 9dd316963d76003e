"""Gauss quadrature for integrands with features of a known, small scale near a known place.

Offsets from the place are ``scale * sinh(x)``: poles and branch points at a distance of `scale` or more from it, to the
sides or behind, are moved to where Im x is pi/2 or so, whatever the scale. Panels of x of length 2 or less with 16
nodes then leave about 1e-16, and with 12 about 1e-13, which tells how well an integral is known.
"""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats

FINE, COARSE = 16, 12


def one_sided(length: Floats, scale: Floats, order: int, panel: float) -> tuple[Floats, Floats]:
    """Offsets from 0 to `length` and their weights; the last axis, of the nodes, is added to the broadcast shape."""
    extent = np.asarray(np.arcsinh(length / scale))
    count = max(1, int(np.ceil(extent.max(initial=0.0) / panel)))
    nodes, weights = np.polynomial.legendre.leggauss(order)
    positions = ((nodes + 1) / 2 + np.arange(count)[:, None]).ravel() / count
    x = extent[..., None] * positions
    factors = np.tile(weights / (2 * count), count) * extent[..., None]
    scale = np.asarray(scale)[..., None]
    return scale * np.sinh(x), scale * np.cosh(x) * factors


def between(places: Floats, scales: Floats, order: int, panel: float) -> tuple[Floats, Floats, Floats]:
    """Nodes from the first to the last of `places` (..., K), increasing, each with features of its own scale (..., K).

    Returns origins, offsets and weights, each of shape (..., N): a node is its origin, one of the places, plus its
    offset, apart so that distances to the place keep their digits.
    """
    parts = []
    half = np.diff(places) / 2
    for k in range(half.shape[-1]):
        for place, sign in ((k, 1.0), (k + 1, -1.0)):
            offsets, weights = one_sided(half[..., k], scales[..., place], order, panel)
            parts.append((np.broadcast_to(places[..., place, None], offsets.shape), sign * offsets, weights))
    origins, signed, all_weights = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    return origins, signed, all_weights
