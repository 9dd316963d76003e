"""Small scenes whose light no closed form gives: global illumination, gloss, glass, textures, fog.

Their expectation comes from the reference tracer. Each is made by a function without arguments whose docstring says in
one sentence what there is to see; `SCENES` holds all of them by name. They are small, and any path tracer that samples
lights and materials renders them with moderate noise: no light is found by chance alone, unless it is large.
"""

from __future__ import annotations

from collections.abc import Callable

from reference_scenes import model
from reference_scenes.without_closed_form import light, rooms, shapes, surfaces, views

SCENES: dict[str, Callable[[], model.Scene]] = {
    make.__name__.replace("_", "-"): make
    for make in (
        rooms.cornell_box,
        rooms.colour_bleeding,
        rooms.through_a_gap,
        rooms.textured_room,
        rooms.mirror_maze,
        rooms.fog,
        rooms.coloured_fog,
        surfaces.glossy_plates,
        surfaces.rough_conductor,
        surfaces.smooth_conductors,
        surfaces.glass,
        surfaces.glass_caustic,
        surfaces.rough_glass,
        surfaces.plastic,
        surfaces.mix,
        light.environment,
        light.overcast,
        light.screen,
        light.many_lights,
        light.two_sided_lamp,
        shapes.copies,
        shapes.smooth_normals,
        shapes.blades,
        views.orthographic,
        views.irradiance_in_a_box,
        views.radiance_of_a_corner,
    )
}
