"""Rooms: light that arrives by way of walls, or through fog."""

from __future__ import annotations

import numpy as np

from reference_scenes import model
from reference_scenes.without_closed_form.building import (
    BLUE,
    FILM,
    GREEN,
    GREY,
    RED,
    WHITE,
    ball,
    block,
    camera,
    ceiling_lamp,
    floor,
    joined,
    rectangle,
    walls,
)


def cornell_box() -> model.Scene:
    """A white room with a red and a green wall, two blocks and a lamp: 36 triangles [Goral et al. 1984]."""
    short = block((0.35, -0.4, 0.3), (0.3, 0.3, 0.3), -17.0)
    tall = block((-0.35, 0.3, 0.6), (0.3, 0.3, 0.6), 20.0)
    return model.Scene(
        objects=(
            model.Object(shape=joined(walls(1.0, 2.0, "floor", "ceiling", "back"), short, tall), material=WHITE),
            model.Object(shape=walls(1.0, 2.0, "left"), material=RED),
            model.Object(shape=walls(1.0, 2.0, "right"), material=GREEN),
        ),
        emitters=(
            model.AreaEmitter(
                shape=model.Mesh(
                    vertices=((-0.25, -0.25, 1.99), (-0.25, 0.25, 1.99), (0.25, 0.25, 1.99), (0.25, -0.25, 1.99)),
                    triangles=((0, 1, 2), (0, 2, 3)),
                ),
                radiance=(17.0, 12.0, 6.0),
            ),
        ),
        camera=camera((0.0, -3.9, 1.0), (0.0, 0.0, 1.0), 39.0),
        film=FILM,
    )


def colour_bleeding() -> model.Scene:
    """The sun on a white floor between a red and a blue wall, which colour it."""
    return model.Scene(
        objects=(
            floor(1.0, WHITE),
            model.Object(shape=walls(1.0, 1.0, "left"), material=RED),
            model.Object(shape=walls(1.0, 1.0, "right"), material=BLUE),
            ball((0.0, 0.2, 0.35), 0.35, WHITE),
        ),
        emitters=(model.DirectionalEmitter(direction=(0.3, 0.4, -1.0), irradiance=(3.0, 3.0, 3.0)),),
        camera=camera((0.0, -3.0, 1.6), (0.0, 0.0, 0.4), 42.0),
        film=FILM,
    )


def through_a_gap() -> model.Scene:
    """A room whose only light comes through the gap above a partition, from a lamp that is not seen."""
    partition = model.Object(shape=block((0.3, 0.0, 0.65), (0.02, 1.0, 0.65)), material=GREY)
    return model.Scene(
        objects=(
            model.Object(shape=walls(1.0, 2.0, "floor", "ceiling", "back", "front", "left", "right"), material=GREY),
            partition,
            ball((-0.4, 0.2, 0.3), 0.3, GREEN),
        ),
        emitters=(
            model.AreaEmitter(
                shape=rectangle((0.98, 0.0, 1.2), (0.0, -0.7, 0.0), (0.0, 0.0, 0.6)), radiance=(5.0, 4.5, 4.0)
            ),
        ),
        camera=camera((-0.2, -0.95, 1.0), (-0.5, 0.4, 0.5), 75.0),
        film=FILM,
    )


def textured_room() -> model.Scene:
    """A room with a chequered floor, a blurred and a sharp picture on its walls."""
    colours = np.random.default_rng(7).uniform(0.1, 0.9, (4, 6, 3)).round(3)
    board = model.Checker(even=(0.8, 0.8, 0.8), odd=(0.1, 0.2, 0.3), columns=7.0, rows=5.0)
    return model.Scene(
        objects=(
            floor(1.0, model.Diffuse(reflectance=board)),
            model.Object(
                shape=rectangle((0.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
                material=model.Diffuse(reflectance=model.Bitmap(texels=colours)),
            ),
            model.Object(
                shape=rectangle((-1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
                material=model.Diffuse(reflectance=model.Bitmap(texels=colours, smooth=False)),
            ),
            ball((0.3, 0.1, 0.4), 0.4, GREY),
        ),
        emitters=(ceiling_lamp((0.2, -0.2, 2.0), 0.5, 0.5, (6.0, 6.0, 6.0)),),
        camera=camera((1.8, -3.2, 1.6), (-0.2, 0.2, 0.8), 42.0),
        film=FILM,
    )


def mirror_maze() -> model.Scene:
    """Mirrors on three sides of a ball and a lamp, which are seen many times over."""
    silver = model.Mirror(reflectance=(0.9, 0.85, 0.8))
    return model.Scene(
        objects=(
            floor(1.0, GREY),
            model.Object(shape=rectangle((-1.0, 0.0, 0.75), (0.0, 1.0, 0.0), (0.0, 0.0, 0.75)), material=silver),
            model.Object(shape=rectangle((1.0, 0.1, 0.75), (0.1, -1.0, 0.0), (0.0, 0.0, 0.75)), material=silver),
            model.Object(shape=rectangle((0.0, 1.0, 0.75), (1.0, 0.1, 0.0), (0.0, 0.0, 0.75)), material=silver),
            ball((0.2, 0.1, 0.3), 0.3, RED),
        ),
        emitters=(ceiling_lamp((0.0, 0.0, 1.6), 1.0, 1.0, (3.0, 3.0, 3.0)),),
        camera=camera((0.5, -2.6, 1.4), (0.0, 0.2, 0.5), 42.0),
        film=FILM,
    )


def fog() -> model.Scene:
    """A lamp, a shining ball and a white one in grey fog that scatters forwards."""
    return _in_fog(model.Medium(absorption=(0.02, 0.02, 0.02), scattering=(0.06, 0.06, 0.06), asymmetry=0.4))


def coloured_fog() -> model.Scene:
    """The same in smoke that dims blue light more than red, and scatters it backwards."""
    return _in_fog(model.Medium(absorption=(0.01, 0.03, 0.06), scattering=(0.06, 0.05, 0.04), asymmetry=-0.3))


def _in_fog(medium: model.Medium) -> model.Scene:
    return model.Scene(
        objects=(floor(2.0, GREY), ball((-0.4, 0.1, 0.4), 0.4, WHITE)),
        emitters=(
            ceiling_lamp((0.0, 0.0, 2.0), 0.5, 0.5, (6.0, 6.0, 6.0)),
            model.AreaEmitter(shape=model.Sphere(center=(0.6, 0.3, 0.9), radius=0.15), radiance=(6.0, 6.0, 6.0)),
        ),
        medium=medium,
        camera=camera((0.0, -3.5, 1.4), (0.0, 0.0, 0.6), 42.0),
        film=FILM,
    )
