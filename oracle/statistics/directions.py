"""Directions: how images of wrong renderers may differ from the expectation, as relative deviations of each pixel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import ndimage

from oracle.arrays import Booleans, Floats, Integers
from oracle.statistics.null import to_blocks

# Name, plane and relative deviation of each pixel, (height, width).
Deviation: TypeAlias = tuple[str, int, Floats]

# A direction that would make a pixel black, or much brighter, is bet on only so far.
_DARKEST, _BRIGHTEST = -0.95, 20.0
# Blocks in which deviations differ by more than this part of the largest that there are, are bet on pixel by pixel.
_UNEVEN = 0.05
_AMPLITUDES = (0.01, 0.04)
_SHIFTS = (0.25, 0.5, 1.0)
_COMPASS = {"right": (0, 1), "left": (0, -1), "down": (1, 0), "up": (-1, 0)}
_DIAGONAL = {"down and right": (1, 1), "down and left": (1, -1), "up and right": (-1, 1), "up and left": (-1, -1)}


@dataclass(frozen=True, eq=False)
class Direction:
    """A deviation of one plane: wrong over right radiance, less 1, for each block and, where uneven, for each pixel.

    Attributes
    ----------
    name : str
        What is wrong, in words.
    plane : int
        Which plane is bet on.
    even : ndarray
        Deviations of blocks, (blocks,); 0 for uneven ones.
    uneven : ndarray
        Which blocks are uneven, (U,).
    pixels : ndarray
        The deviations of their pixels, (16, U).
    """

    name: str
    plane: int
    even: Floats
    uneven: Integers
    pixels: Floats


def direction(name: str, plane: int, deviations: Floats, lit: Booleans) -> Direction:
    """A direction from the deviations of pixels, (height, width), where these are lit."""
    kept = to_blocks(np.where(lit, np.clip(np.nan_to_num(deviations), _DARKEST, _BRIGHTEST), 0.0))
    here = to_blocks(lit)
    count = here.sum(axis=0)
    mean = kept.sum(axis=0) / np.maximum(count, 1)
    apart = np.abs(np.where(here, kept - mean, 0.0)).max(axis=0)
    rough = apart > _UNEVEN * np.maximum(np.abs(mean), 0.2 * np.abs(kept).max())
    uneven = np.flatnonzero(rough)
    return Direction(name, plane, np.where(rough, 0.0, mean), uneven, np.ascontiguousarray(kept[:, uneven]))


def suspicions(mean: Floats, lit: Booleans) -> Iterator[Deviation]:
    """What is bet on besides uniform deviations: patterns, and transformations of the image, for all channels alike.

    Parameters
    ----------
    mean, lit : ndarray
        The expected image of all channels together, and where it is lit, (height, width).
    """
    for name, deviations in (*_patterns(lit), *_transformations(mean, lit)):
        yield name, 0, deviations


def patterns(lit: Booleans) -> Iterator[tuple[str, Floats]]:
    """Products of Legendre polynomials up to the third degree, but for the constant, with a mean square of 1."""
    rows, columns = np.flatnonzero(lit.any(axis=1)), np.flatnonzero(lit.any(axis=0))
    if not len(rows):
        return
    y = _from_minus_one_to_one(len(lit), rows)
    x = _from_minus_one_to_one(lit.shape[1], columns)
    for degree in range(1, 4):
        for down in range(degree + 1):
            vertical = np.polynomial.legendre.Legendre.basis(down)(y)
            horizontal = np.polynomial.legendre.Legendre.basis(degree - down)(x)
            pattern = np.where(lit, vertical[:, None] * horizontal, 0.0)
            size = np.sqrt((pattern**2).sum() / lit.sum())
            if size > 1e-6:
                yield f"a pattern of degree {degree - down} across and {down} down", pattern / size


def shifts(mean: Floats, lit: Booleans, distance: float) -> Iterator[tuple[str, Floats]]:
    """The image moved by a part of a pixel, in eight directions."""
    for name, (down, right) in (_COMPASS | _DIAGONAL).items():
        moved = ndimage.shift(mean, (distance * down, distance * right), order=1, mode="nearest")
        yield f"moved {name} by {distance:g} pixels", _ratio(moved, mean, lit)


def _patterns(lit: Booleans) -> Iterator[tuple[str, Floats]]:
    for name, pattern in patterns(lit):
        for amplitude in _AMPLITUDES:
            for sign in (1, -1):
                yield name, sign * amplitude * pattern


def _transformations(mean: Floats, lit: Booleans) -> Iterator[tuple[str, Floats]]:
    for distance in _SHIFTS:
        yield from shifts(mean, lit, distance)
    middle = (np.array(mean.shape) - 1) / 2
    for name, turn, zoom in (
        ("larger", 0.0, 1.01),
        ("smaller", 0.0, 1 / 1.01),
        ("turned", 0.01, 1.0),
        ("turned back", -0.01, 1.0),
    ):
        matrix = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) / zoom
        turned = ndimage.affine_transform(mean, matrix, middle - matrix @ middle, order=1, mode="nearest")
        yield name, _ratio(turned, mean, lit)
    if lit.any():
        level = mean[lit].mean()
        for amplitude in (0.01, -0.01, 0.05, -0.05):
            yield "an offset", _ratio(mean + amplitude * level, mean, lit)
        for exponent in (1.02, 1 / 1.02, 2.2, 1 / 2.2):
            yield "a power", _ratio(level * (np.maximum(mean, 0) / level) ** exponent, mean, lit)


def _ratio(wrong: Floats, mean: Floats, lit: Booleans) -> Floats:
    return np.where(lit, wrong / np.where(lit, mean, 1.0) - 1, 0.0)


def _from_minus_one_to_one(count: int, used: Integers) -> Floats:
    """Pixel centers, with the used ones from -1 to 1."""
    first, last = used[0], used[-1]
    result: Floats = np.clip((2 * np.arange(count) - first - last) / max(last - first, 1), -1.0, 1.0)
    return result
