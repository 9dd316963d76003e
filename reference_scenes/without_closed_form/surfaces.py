"""Surfaces that are not diffuse: metal, glass, plastic."""

from __future__ import annotations

import numpy as np

from reference_scenes import model
from reference_scenes.without_closed_form.building import (
    BLUE,
    COPPER,
    FILM,
    GOLD,
    GREEN,
    GREY,
    RED,
    WHITE,
    ball,
    camera,
    ceiling_lamp,
    floor,
    rectangle,
    rows,
)

DIM_SKY = model.ConstantEmitter(radiance=(0.3, 0.35, 0.4))
CHEQUERED = model.Diffuse(reflectance=model.Checker(even=(0.7, 0.7, 0.7), odd=(0.2, 0.3, 0.4), columns=8.0, rows=8.0))
LAMP = ceiling_lamp((0.5, -0.5, 2.5), 0.6, 0.6, (6.0, 6.0, 6.0))
VIEW = camera((0.0, -3.2, 1.6), (0.0, 0.0, 0.5), 38.0)


def _on_a_floor(*objects: model.Object, ground: model.Material = CHEQUERED) -> model.Scene:
    return model.Scene(objects=(floor(2.0, ground), *objects), emitters=(LAMP, DIM_SKY), camera=VIEW, film=FILM)


def glossy_plates() -> model.Scene:
    """Four plates, ever rougher, reflect four spheres of light, ever larger [Veach and Guibas 1995]."""
    plates, eye = [], np.array([0.0, -4.0, 1.8])
    for index, alpha in enumerate((0.05, 0.08, 0.15, 0.25)):
        center = np.array([0.0, 0.9 - 0.75 * index, 0.45 - 0.2 * index])
        # So that the eye sees the spheres, which hang at (x, 1.6, 1.6), in the middle of each plate.
        to_eye, to_light = (point - center for point in (eye, np.array([0.0, 1.6, 1.6])))
        normal = to_eye / np.linalg.norm(to_eye) + to_light / np.linalg.norm(to_light)
        normal /= np.linalg.norm(normal)
        first, second = rows(np.array([center, 0.3 * np.cross(normal, [1.0, 0.0, 0.0])]))
        plates.append(
            model.Object(
                shape=rectangle(first, (1.6, 0.0, 0.0), second),
                material=model.RoughConductor(**COPPER, alpha=alpha, separable=True),
            )
        )
    lights = tuple(
        model.AreaEmitter(
            shape=model.Sphere(center=(x, 1.6, 1.6), radius=radius),
            radiance=(0.05 / radius**2, 0.04 / radius**2, 0.03 / radius**2),
        )
        for x, radius in ((-1.2, 0.1), (-0.5, 0.15), (0.3, 0.22), (1.2, 0.35))
    )
    return model.Scene(
        objects=(floor(4.0, GREY, -0.5), *plates),
        emitters=lights,
        camera=camera((0.0, -4.0, 1.8), (0.0, 0.3, 0.4), 44.0),
        film=FILM,
    )


def rough_conductor() -> model.Scene:
    """Two balls of rough metal on a chequered floor."""
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.RoughConductor(**GOLD, alpha=0.1, separable=True)),
        ball((0.55, 0.0, 0.5), 0.5, model.RoughConductor(**COPPER, alpha=0.4, separable=True)),
    )


def smooth_conductors() -> model.Scene:
    """Balls of gold and copper that mirror each other and the floor."""
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.Conductor(**GOLD)),
        ball((0.55, 0.0, 0.5), 0.5, model.Conductor(**COPPER)),
        ball((0.0, -0.6, 0.2), 0.2, RED),
    )


def glass() -> model.Scene:
    """A ball of glass, one with a bubble of air in it, and what is seen through them."""
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.Dielectric(eta=1.5)),
        ball((0.55, 0.0, 0.5), 0.5, model.Dielectric(eta=1.5)),
        ball((0.55, 0.0, 0.5), 0.35, model.Dielectric(eta=1 / 1.5)),
        ball((0.0, 0.9, 0.3), 0.3, GREEN),
    )


def glass_caustic() -> model.Scene:
    """A ball of glass gathers the light of a large lamp on the floor."""
    return model.Scene(
        objects=(floor(2.0, WHITE), ball((0.0, 0.0, 0.6), 0.5, model.Dielectric(eta=1.5))),
        emitters=(ceiling_lamp((0.4, 0.2, 2.2), 1.0, 1.0, (3.0, 2.5, 2.0)),),
        camera=camera((0.0, -3.2, 1.8), (0.0, 0.0, 0.3), 38.0),
        film=FILM,
    )


def rough_glass() -> model.Scene:
    """Two balls of frosted glass on a chequered floor."""
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.RoughDielectric(eta=1.5, alpha=0.1, separable=True)),
        ball((0.55, 0.0, 0.5), 0.5, model.RoughDielectric(eta=1.3, alpha=0.4, separable=True)),
    )


def plastic() -> model.Scene:
    """Coated balls on a coated floor."""
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.Plastic(reflectance=(0.6, 0.1, 0.1), eta=1.5)),
        ball((0.55, 0.0, 0.5), 0.5, model.Plastic(reflectance=(0.1, 0.2, 0.6), eta=1.9)),
        ground=model.Plastic(reflectance=(0.4, 0.4, 0.4), eta=1.3),
    )


def mix() -> model.Scene:
    """Balls half of metal and half of paint, and half of one paint and half of another."""
    metal = model.RoughConductor(**GOLD, alpha=0.2, separable=True)
    return _on_a_floor(
        ball((-0.55, 0.0, 0.5), 0.5, model.Mix(first=BLUE, second=metal, weight=0.6)),
        ball((0.55, 0.0, 0.5), 0.5, model.Mix(first=RED, second=GREEN, weight=0.3)),
    )
