"""Where light comes from: skies, pictures that shine, many lamps."""

from __future__ import annotations

import numpy as np

from reference_scenes import model
from reference_scenes.without_closed_form.building import (
    FILM,
    GREY,
    RED,
    WHITE,
    ball,
    block,
    camera,
    floor,
    joined,
    rectangle,
    rows,
)


def environment() -> model.Scene:
    """A ball and a block under a map of sky and ground with a small sun."""
    polar, azimuth = np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(32) + 0.5) / 32, indexing="ij")
    sky = np.stack([0.3 + 0.2 * np.cos(2 * np.pi * azimuth), 0.4 + 0.3 * polar, 0.9 - 0.5 * polar], axis=-1)
    sky[polar > 0.5] = (0.1, 0.08, 0.05)
    sky[4, 26] = (120.0, 100.0, 80.0)
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            ball((-0.5, 0.0, 0.45), 0.45, WHITE),
            model.Object(shape=block((0.5, 0.2, 0.3), (0.25, 0.25, 0.3), 30.0), material=RED),
        ),
        emitters=(model.ImageEmitter(radiance=sky.round(4)),),
        camera=camera((0.5, -3.2, 1.5), (0.0, 0.0, 0.4), 38.0),
        film=FILM,
    )


def overcast() -> model.Scene:
    """A courtyard of blocks under the CIE overcast sky, which leans a little."""
    blocks = joined(
        block((-0.8, 0.3, 0.6), (0.2, 0.8, 0.6)),
        block((0.8, 0.3, 0.4), (0.2, 0.8, 0.4)),
        block((0.0, 1.2, 0.8), (1.0, 0.1, 0.8)),
    )
    return model.Scene(
        objects=(floor(2.0, GREY), model.Object(shape=blocks, material=WHITE)),
        emitters=(model.SkyEmitter(up=(0.2, 0.1, 1.0), zenith=(1.0, 1.1, 1.3)),),
        camera=camera((0.0, -3.0, 2.2), (0.0, 0.2, 0.4), 45.0),
        film=FILM,
    )


def screen() -> model.Scene:
    """A screen that shows a picture lights a floor and a ball; a chequered lamp hangs behind."""
    picture = np.random.default_rng(3).uniform(0.0, 4.0, (5, 8, 3)).round(3)
    return model.Scene(
        objects=(floor(1.5, WHITE), ball((0.0, -0.2, 0.3), 0.3, GREY)),
        emitters=(
            model.AreaEmitter(
                shape=rectangle((0.0, 1.0, 0.8), (1.0, 0.0, 0.0), (0.0, 0.0, 0.6)),
                radiance=model.Bitmap(texels=picture),
            ),
            model.AreaEmitter(
                shape=rectangle((-1.4, 0.0, 0.7), (0.0, 0.8, 0.0), (0.0, 0.0, 0.5)),
                radiance=model.Checker(even=(3.0, 0.5, 0.1), odd=(0.1, 0.2, 2.0), columns=4.0, rows=3.0),
            ),
        ),
        camera=camera((0.8, -3.2, 1.5), (0.0, 0.2, 0.5), 42.0),
        film=FILM,
    )


def many_lights() -> model.Scene:
    """Three dozen small lamps of all colours, balls, disks and rectangles, hang over a floor with a wall on it."""
    rng = np.random.default_rng(5)
    lamps: list[model.AreaEmitter] = []
    for index in range(36):
        x, y = 0.4 * (index % 6) - 1.0, 0.4 * (index // 6) - 1.0
        center = (float(x), float(y), 0.9 + 0.01 * index)
        radiance = rows(rng.uniform(2.0, 6.0, (1, 3)).round(3))[0]
        shape: model.Shape
        match index % 3:
            case 0:
                shape = model.Sphere(center=center, radius=0.12)
            case 1:
                shape = model.Disk(center=center, normal=(0.0, 0.2, -1.0), radius=0.12)
            case _:
                shape = rectangle(center, (0.1, 0.0, 0.0), (0.0, -0.1, 0.0))
        lamps.append(model.AreaEmitter(shape=shape, radiance=radiance))
    wall = model.Object(shape=block((0.0, 0.2, 0.3), (0.9, 0.05, 0.3), 20.0), material=WHITE)
    return model.Scene(
        objects=(floor(2.0, GREY), wall),
        emitters=tuple(lamps),
        camera=camera((0.0, -3.4, 2.0), (0.0, 0.1, 0.3), 45.0),
        film=FILM,
    )


def two_sided_lamp() -> model.Scene:
    """A lamp that shines to both sides stands between two walls; a disk that does so hangs above."""
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            model.Object(shape=block((-1.0, 0.2, 0.6), (0.05, 0.8, 0.6)), material=RED),
            model.Object(shape=block((1.0, 0.2, 0.6), (0.05, 0.8, 0.6)), material=WHITE),
        ),
        emitters=(
            model.AreaEmitter(
                shape=rectangle((0.0, 0.2, 0.5), (0.0, 0.4, 0.0), (0.0, 0.0, 0.4)),
                radiance=(3.0, 3.0, 2.0),
                two_sided=True,
            ),
            model.AreaEmitter(
                shape=model.Disk(center=(0.0, -0.2, 1.5), normal=(0.3, 0.0, 1.0), radius=0.3),
                radiance=(2.0, 3.0, 4.0),
                two_sided=True,
            ),
        ),
        camera=camera((0.9, -3.2, 1.7), (0.0, 0.1, 0.5), 42.0),
        film=FILM,
    )
