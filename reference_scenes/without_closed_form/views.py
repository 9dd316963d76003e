"""Other sensors than a pinhole camera."""

from __future__ import annotations

from reference_scenes import model
from reference_scenes.without_closed_form.building import (
    FILM,
    GREEN,
    GREY,
    RED,
    WHITE,
    ball,
    block,
    ceiling_lamp,
    floor,
    rectangle,
    walls,
)

LAMP = ceiling_lamp((0.2, -0.1, 1.9), 0.7, 0.7, (4.0, 4.0, 3.5))
ROOM = (
    model.Object(shape=walls(1.0, 2.0, "floor", "ceiling", "back", "front"), material=WHITE),
    model.Object(shape=walls(1.0, 2.0, "left"), material=RED),
    model.Object(shape=walls(1.0, 2.0, "right"), material=GREEN),
    model.Object(shape=block((0.3, 0.3, 0.4), (0.25, 0.25, 0.4), 25.0), material=GREY),
)


def orthographic() -> model.Scene:
    """A ball and a block seen by parallel rays."""
    return model.Scene(
        objects=(
            floor(1.5, GREY),
            ball((-0.4, 0.0, 0.4), 0.4, WHITE),
            model.Object(shape=block((0.5, 0.2, 0.3), (0.25, 0.25, 0.3), 30.0), material=RED),
        ),
        emitters=(LAMP,),
        camera=model.OrthographicCamera(origin=(1.0, -2.0, 1.6), target=(0.0, 0.0, 0.3), width=2.4),
        film=model.Film(width=64, height=48),
    )


def irradiance_in_a_box() -> model.Scene:
    """What a meter on the floor of a closed room measures, in the shadow of a block and beside it."""
    surface = rectangle((0.0, 0.0, 0.01), (0.9, 0.0, 0.0), (0.0, 0.9, 0.0))
    return model.Scene(objects=ROOM, emitters=(LAMP,), camera=model.IrradianceMeter(surface=surface), film=FILM)


def radiance_of_a_corner() -> model.Scene:
    """What a single ray into the corner of a closed room measures."""
    return model.Scene(
        objects=ROOM,
        emitters=(LAMP,),
        camera=model.RadianceMeter(origin=(-0.5, -0.5, 1.0), direction=(-0.8, 1.4, -0.9)),
        film=model.Film(width=1, height=1),
    )
