"""The mistakes that people make, in the order in which a lecture derives the laws they break."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from oracle.emitters import Area, Constant, CosineSky, Directional, Equirectangular, Line, Point, Spot
from oracle.mistakes.effects import (
    Effect,
    at_center,
    front_missing,
    horizon,
    instead,
    integrand,
    scaled,
    spot_falloff,
)
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere

_EVERY = (Point, Spot, Directional, Line, Area, Constant, CosineSky, Equirectangular)
_NEAR = (Point, Spot, Line, Area)
_FLAT = (Polygon, Rectangle, Disk)
_SHAPES = (*_FLAT, Sphere, Mesh)


@dataclass(frozen=True)
class Mistake:
    """A mistake: its name, the law it breaks, what to look for, and the emitters that can show it.

    `shapes` are those of an `Area`; `needs_reflectance` tells that its effect depends on the receiver's reflectance.
    """

    name: str
    concept: str
    advice: str
    emitters: tuple[type, ...]
    effect: Effect = field(repr=False, compare=False)
    shapes: tuple[type, ...] = _SHAPES
    needs_reflectance: bool = False


_CATALOGUE = (
    Mistake(
        "no receiver cosine",
        "cosine rule",
        "Multiply by the cosine between the receiver's normal and the direction to the light; without it solid angle "
        "stands in for projected solid angle.",
        (*_NEAR, Directional, Constant),
        integrand(0, 1, 2),
    ),
    Mistake(
        "receiver cosine squared",
        "cosine rule",
        "The receiver's cosine belongs to the integral once; look whether BRDF and integrator both multiply by it.",
        (*_NEAR, Directional, Constant),
        integrand(2, 1, 2),
    ),
    Mistake(
        "horizon folded",
        "cosine rule",
        "Take max(0, cos), not |cos|: what is below the horizon must not shine on the front.",
        _EVERY,
        horizon(1.0),
    ),
    Mistake(
        "horizon subtracted",
        "cosine rule",
        "Clamp the cosine at 0: what is below the horizon must not take light away.",
        _EVERY,
        horizon(-1.0),
    ),
    Mistake(
        "direction reversed",
        "cosine rule",
        "Check the sign of the direction: from the light to the surface, or the other way round.",
        (Spot, Directional),
        instead(lambda emitter: dataclasses.replace(emitter, direction=-emitter.direction)),
    ),
    Mistake(
        "distance to the power 1",
        "distance",
        "Divide by the squared distance. A direction to the light that is not normalised in the receiver's cosine "
        "shows the same.",
        _NEAR,
        integrand(1, 1, 1),
    ),
    Mistake(
        "distance to the power 3",
        "distance",
        "Divide by the squared distance. A cosine that is divided by the distance once more shows the same.",
        _NEAR,
        integrand(1, 1, 3),
    ),
    Mistake(
        "no distance",
        "distance",
        "Divide by the squared distance. A direction that is not normalised in both cosines shows the same.",
        _NEAR,
        integrand(1, 1, 0),
    ),
    Mistake(
        "no light cosine",
        "change of variables",
        "From area to solid angle takes cos(theta_light)/r^2; the light's cosine is missing.",
        (Area, Line),
        integrand(1, 0, 2),
    ),
    Mistake(
        "light cosine squared",
        "change of variables",
        "The light's cosine comes with the change of variables, once; a diffuse light's radiance has none.",
        (Area, Line),
        integrand(1, 2, 2),
    ),
    Mistake(
        "two-sided light",
        "change of variables",
        "Take max(0, cos) at the light, not |cos|: it shines from its front only.",
        (Area,),
        instead(lambda emitter: dataclasses.replace(emitter, two_sided=True)),
    ),
    Mistake(
        "light reversed",
        "change of variables",
        "The light shines from its back: check its winding, or the sign of the direction in its cosine.",
        (Area,),
        front_missing,
    ),
    Mistake(
        "light area doubled",
        "change of variables",
        "Check the light's area; that of a triangle is half the length of the cross product.",
        (Area,),
        scaled(lambda emitter, reflectance: 2.0),
    ),
    Mistake(
        "light area halved",
        "change of variables",
        "Check the light's area; that of a parallelogram is the whole length of the cross product.",
        (Area,),
        scaled(lambda emitter, reflectance: 0.5),
    ),
    Mistake(
        "half extents as extents",
        "change of variables",
        "The light's area is a quarter of the right one: half axes were taken for edges, or a radius for a diameter.",
        (Area,),
        scaled(lambda emitter, reflectance: 0.25),
        (Rectangle, Disk, Sphere),
    ),
    Mistake(
        "extents as half extents",
        "change of variables",
        "The light's area is four times the right one: edges were taken for half axes, or a diameter for a radius.",
        (Area,),
        scaled(lambda emitter, reflectance: 4.0),
        (Rectangle, Disk, Sphere),
    ),
    Mistake(
        "radius not squared",
        "change of variables",
        "The area of a disk or a sphere grows with the square of its radius.",
        (Area,),
        scaled(lambda emitter, reflectance: 1 / emitter.shape.radius),
        (Disk, Sphere),
    ),
    Mistake(
        "light sampled in its center only",
        "change of variables",
        "Sample the whole of the light, not its center alone; far away both are the same.",
        (Area,),
        at_center(light_cosine=True, area=True),
        _FLAT,
    ),
    Mistake(
        "light as an isotropic point",
        "radiance",
        "Radiance times area is the intensity straight ahead; elsewhere it falls with the light's cosine.",
        (Area,),
        at_center(light_cosine=False, area=True),
        _FLAT,
    ),
    Mistake(
        "radiance as intensity",
        "radiance",
        "The number given is radiance, not the intensity of a point: multiply by projected area, integrate over it.",
        (Area,),
        at_center(light_cosine=False, area=False),
        (*_FLAT, Sphere),
    ),
    Mistake(
        "radiance as flux",
        "radiance",
        "The number given is radiance; it must not be divided by pi and the light's area.",
        (Area,),
        scaled(lambda emitter, reflectance: 1 / (np.pi * emitter.shape.area * (2 if emitter.two_sided else 1))),
    ),
    Mistake(
        "radiance as exitance",
        "radiance",
        "The number given is radiance; it must not be divided by pi.",
        (Area, Constant, CosineSky, Equirectangular),
        scaled(lambda emitter, reflectance: 1 / np.pi),
    ),
    Mistake(
        "intensity as flux",
        "radiance",
        "The number given is intensity; it must not be divided by the 4 pi of all directions.",
        (Point, Spot),
        scaled(lambda emitter, reflectance: 1 / (4 * np.pi)),
    ),
    Mistake(
        "spot without falloff",
        "radiance",
        "Between beam and cutoff the spot's intensity falls to 0; here it stays full up to the cutoff.",
        (Spot,),
        spot_falloff(lambda spot: (spot.beam_width, spot.cutoff_angle), "none"),
    ),
    Mistake(
        "spot without cone",
        "radiance",
        "The spot shines in all directions; restrict it to its cone.",
        (Spot,),
        instead(lambda spot: Point(spot.position, spot.intensity)),
    ),
    Mistake(
        "spot falloff linear in the cosine",
        "radiance",
        "The falloff is linear in the angle, not in its cosine.",
        (Spot,),
        spot_falloff(lambda spot: (spot.beam_width, spot.cutoff_angle), "cosine"),
    ),
    Mistake(
        "spot falloff smooth in the cosine",
        "radiance",
        "The falloff is linear in the angle, not a smoothstep of the cosine.",
        (Spot,),
        spot_falloff(lambda spot: (spot.beam_width, spot.cutoff_angle), "smoothstep"),
    ),
    Mistake(
        "spot's half angles as full angles",
        "radiance",
        "Beam and cutoff are given from the axis to the edge, not from edge to edge.",
        (Spot,),
        spot_falloff(lambda spot: (spot.beam_width / 2, spot.cutoff_angle / 2)),
    ),
    Mistake(
        "degrees as radians",
        "radiance",
        "Angles given in degrees are used as radians; convert them.",
        (Spot,),
        spot_falloff(lambda spot: (float(np.degrees(spot.beam_width)), float(np.degrees(spot.cutoff_angle)))),
    ),
    Mistake(
        "radians as degrees",
        "radiance",
        "Angles in radians are converted as if they were degrees; convert them once.",
        (Spot,),
        spot_falloff(lambda spot: (float(np.radians(spot.beam_width)), float(np.radians(spot.cutoff_angle)))),
    ),
    Mistake(
        "no visibility",
        "visibility",
        "Test whether something stands between light and receiver.",
        _EVERY,
        instead(lambda emitter: emitter),
    ),
    Mistake(
        "no 1/pi",
        "reflection",
        "A diffuse BRDF is the reflectance divided by pi.",
        _EVERY,
        scaled(lambda emitter, reflectance: np.pi),
    ),
    Mistake(
        "1/pi twice",
        "reflection",
        "A diffuse BRDF is divided by pi once; look whether light and BRDF, or BRDF and density, both divide.",
        _EVERY,
        scaled(lambda emitter, reflectance: 1 / np.pi),
    ),
    Mistake(
        "1/(2 pi) for 1/pi",
        "reflection",
        "The cosine's integral over the hemisphere is pi, not the solid angle 2 pi.",
        _EVERY,
        scaled(lambda emitter, reflectance: 0.5),
    ),
    Mistake(
        "reflectance twice",
        "reflection",
        "The reflectance is multiplied in twice; look whether BRDF and integrator both do.",
        _EVERY,
        scaled(lambda emitter, reflectance: reflectance),
        needs_reflectance=True,
    ),
)

MISTAKES = {mistake.name: mistake for mistake in _CATALOGUE}
