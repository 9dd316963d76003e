"""Environments as Mitsuba's map, which it interpolates bilinearly.

Column i of W lies at the azimuth 2 pi (i + 1/2)/W, row j of H at the polar angle pi j/(H - 1): rows reach the poles,
columns do not reach the seam. A value is the mean over the cell around it, so that the map keeps its flux.
"""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from reference_scenes import model

# At least so many rows and columns, which blur the edges of texels over 0.35 degrees at most.
_FINE = 1024
_SKY_ROWS = 2049


def image_map(texels: Floats) -> Floats:
    """The map of texels of uniform radiance, shape (H, W, 3); its columns go the other way round."""
    finer_rows, finer_columns = (max(2, -(-_FINE // size)) for size in texels.shape[:2])
    cells = np.repeat(np.repeat(texels, finer_rows, axis=0), finer_columns, axis=1)
    # Rows lie on the edges between these cells.
    rows: Floats = (np.concatenate([cells[:1], cells]) + np.concatenate([cells, cells[-1:]])) / 2
    return rows[:, ::-1]


def sky_map(sky: model.SkyEmitter) -> Floats:
    """The map of a sky, whose columns are all alike."""
    zenith = np.array(sky.zenith)
    horizon = zenith / 3 if sky.horizon is None else np.array(sky.horizon)
    height = np.pi / (_SKY_ROWS - 1)
    polar = height * np.arange(_SKY_ROWS)
    # Ends of each row's cell; below the horizon all is black.
    above, below = np.maximum(polar - height / 2, 0), np.minimum(polar + height / 2, np.pi)
    whole = below - above
    top, bottom = np.minimum(above, np.pi / 2), np.minimum(below, np.pi / 2)
    rows = np.outer(bottom - top, horizon) + np.outer(np.sin(bottom) - np.sin(top), zenith - horizon)
    return np.repeat((rows / whole[:, None])[:, None], 4, axis=1)
