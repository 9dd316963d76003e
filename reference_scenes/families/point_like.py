"""Families lit by emitters without extent: distance, cosine, parallel light, hard shadow."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from reference_scenes import model
from reference_scenes.families import building
from reference_scenes.families.building import Degrees, Metres, View, uniform
from reference_scenes.families.family import Family, Parameters

# ------------------------------------------------------------------------------------------ point-distance


class PointDistanceParameters(Parameters):
    """A point emitter straight above a floor."""

    height: Metres
    intensity: model.Spectrum
    reflectance: model.Albedo
    spin: Degrees
    view: View


def _draw_point_distance(rng: np.random.Generator) -> PointDistanceParameters:
    height = uniform(rng, 0.5, 2.0)
    return PointDistanceParameters(
        height=height,
        intensity=(intensity := building.draw_colour(rng, 4 * height**2)),
        reflectance=building.draw_albedo(rng, intensity),
        spin=uniform(rng, 0, 90),
        view=building.draw_view(rng, (35, 60), (2.5, 4.5)),
    )


def _build_point_distance(p: PointDistanceParameters) -> model.Scene:
    return model.Scene(
        objects=(building.floor(p.reflectance, p.spin),),
        emitters=(model.PointEmitter(position=(0.0, 0.0, p.height), intensity=p.intensity),),
        # Off centre, so that near and far parts of the floor are seen.
        camera=building.camera(p.view, building.beside(p.view, 0.4 * p.height, 0.3 * p.height)),
        film=building.FILM,
    )


POINT_DISTANCE = Family(
    name="point-distance",
    law="The irradiance of a point emitter falls with the square of the distance.",
    concept="distance: inverse-square law",
    formula="L = rho/pi * I cos(theta) / r^2",
    source="Lambert 1760, Photometria; Pharr, Jakob and Humphreys 2023, section 4.1",
    spp=4,
    parameters=PointDistanceParameters,
    draw=_draw_point_distance,
    build=_build_point_distance,
)

# --------------------------------------------------------------------------------------------- point-angle


class PointAngleParameters(Parameters):
    """A point emitter seen at an oblique angle from a tilted receiver."""

    tilt: Annotated[float, Field(ge=0, lt=90)]
    tilt_azimuth: Degrees
    incidence: Annotated[float, Field(ge=0, lt=90)]
    incidence_azimuth: Degrees
    distance: Metres
    intensity: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_point_angle(rng: np.random.Generator) -> PointAngleParameters:
    distance = uniform(rng, 1.5, 3.0)
    return PointAngleParameters(
        tilt=uniform(rng, 10, 35),
        tilt_azimuth=uniform(rng, 0, 360),
        incidence=uniform(rng, 45, 75),
        incidence_azimuth=uniform(rng, 0, 360),
        distance=distance,
        intensity=(intensity := building.draw_colour(rng, 8 * distance**2)),
        reflectance=building.draw_albedo(rng, intensity),
        view=building.draw_view(rng, (45, 55), (3.5, 4.5)),
    )


def _build_point_angle(p: PointAngleParameters) -> model.Scene:
    normal = building.direction(p.tilt, p.tilt_azimuth)
    u, v = building.tangents(normal, p.incidence_azimuth)
    theta = np.radians(p.incidence)
    position = p.distance * (np.cos(theta) * normal + np.sin(theta) * u)
    half_width, half_height = 1.2, 0.9
    shape = model.Rectangle(
        center=(0.0, 0.0, 0.0), half_u=building.vector(half_width * u), half_v=building.vector(half_height * v)
    )
    return model.Scene(
        objects=(building.receiver(shape, p.reflectance),),
        emitters=(model.PointEmitter(position=building.vector(position), intensity=p.intensity),),
        camera=building.camera(p.view, np.zeros(3)),
        film=building.FILM,
    )


POINT_ANGLE = Family(
    name="point-angle",
    law="The irradiance falls with the cosine between the receiver's normal and the direction to the light.",
    concept="cosine rule",
    formula="L = rho/pi * I cos(theta) / r^2",
    source="Lambert 1760, Photometria; Pharr, Jakob and Humphreys 2023, section 4.1",
    spp=16,
    parameters=PointAngleParameters,
    draw=_draw_point_angle,
    build=_build_point_angle,
)

# --------------------------------------------------------------------------------------------- directional


class DirectionalParameters(Parameters):
    """Parallel light on a tilted receiver."""

    tilt: Annotated[float, Field(ge=0, lt=90)]
    tilt_azimuth: Degrees
    incidence: Annotated[float, Field(ge=0, lt=90)]
    incidence_azimuth: Degrees
    irradiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_directional(rng: np.random.Generator) -> DirectionalParameters:
    return DirectionalParameters(
        tilt=uniform(rng, 5, 35),
        tilt_azimuth=uniform(rng, 0, 360),
        incidence=uniform(rng, 25, 75),
        incidence_azimuth=uniform(rng, 0, 360),
        irradiance=(irradiance := building.draw_colour(rng, 4)),
        reflectance=building.draw_albedo(rng, irradiance),
        view=building.draw_view(rng, (45, 55), (3.5, 4.5)),
    )


def _build_directional(p: DirectionalParameters) -> model.Scene:
    normal = building.direction(p.tilt, p.tilt_azimuth)
    u, v = building.tangents(normal, p.incidence_azimuth)
    theta = np.radians(p.incidence)
    shape = model.Rectangle(center=(0.0, 0.0, 0.0), half_u=building.vector(1.1 * u), half_v=building.vector(0.8 * v))
    return model.Scene(
        objects=(building.receiver(shape, p.reflectance),),
        emitters=(
            model.DirectionalEmitter(
                direction=building.vector(-(np.cos(theta) * normal + np.sin(theta) * u)), irradiance=p.irradiance
            ),
        ),
        camera=building.camera(p.view, np.zeros(3)),
        film=building.FILM,
    )


DIRECTIONAL = Family(
    name="directional",
    law="Parallel light gives an irradiance that depends on the angle alone, not on the place.",
    concept="straight lines; cosine rule",
    formula="L = rho/pi * E cos(theta)",
    source="Lambert 1760, Photometria; Pharr, Jakob and Humphreys 2023, section 4.1",
    spp=16,
    parameters=DirectionalParameters,
    draw=_draw_directional,
    build=_build_directional,
)

# --------------------------------------------------------------------------------------------- hard-shadow


class HardShadowParameters(Parameters):
    """A black occluder between a point emitter and a floor."""

    height: Metres
    offset: Annotated[float, Field(ge=0, le=1)]
    offset_azimuth: Degrees
    occluder: Literal["rectangle", "disk", "sphere"]
    occluder_height: Annotated[float, Field(gt=0.1, lt=0.9)]
    occluder_size: Metres
    occluder_tilt: Annotated[float, Field(ge=0, le=60)]
    spin: Degrees
    intensity: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_hard_shadow(rng: np.random.Generator) -> HardShadowParameters:
    height = uniform(rng, 1.5, 2.5)
    return HardShadowParameters(
        height=height,
        offset=uniform(rng, 0.1, 0.6),
        offset_azimuth=uniform(rng, 0, 360),
        occluder=("rectangle", "disk", "sphere")[int(rng.integers(3))],
        occluder_height=uniform(rng, 0.2, 0.4),
        occluder_size=uniform(rng, 0.25, 0.4),
        occluder_tilt=uniform(rng, 0, 30),
        spin=uniform(rng, 0, 360),
        intensity=(intensity := building.draw_colour(rng, 4 * height**2)),
        reflectance=building.draw_albedo(rng, intensity),
        view=building.draw_view(rng, (35, 50), (3.0, 4.0)),
    )


def _build_hard_shadow(p: HardShadowParameters) -> model.Scene:
    light = np.array([*(p.offset * building.direction(90, p.offset_azimuth)[:2]), p.height])
    center = p.occluder_height * light
    normal = building.direction(p.occluder_tilt, p.spin)
    shape: model.Shape
    match p.occluder:
        case "rectangle":
            shape = building.rectangle(center, normal, p.occluder_size, 0.7 * p.occluder_size, p.spin)
        case "disk":
            shape = model.Disk(center=building.vector(center), normal=building.vector(normal), radius=p.occluder_size)
        case "sphere":
            shape = model.Sphere(center=building.vector(center), radius=p.occluder_size)
    return model.Scene(
        objects=(building.floor(p.reflectance, p.spin), building.receiver(shape, (0.0, 0.0, 0.0))),
        emitters=(model.PointEmitter(position=building.vector(light), intensity=p.intensity),),
        camera=building.camera(p.view, building.beside(p.view, 0.3, 0.1)),
        film=building.FILM,
    )


HARD_SHADOW = Family(
    name="hard-shadow",
    law="Light travels in straight lines: what hides a point emitter casts a sharp and completely dark shadow.",
    concept="straight lines; visibility",
    formula="L = rho/pi * V I cos(theta) / r^2 with V = 0 in the shadow and 1 outside",
    source="Pharr, Jakob and Humphreys 2023, sections 4.1 and 13.1",
    spp=16,
    parameters=HardShadowParameters,
    draw=_draw_hard_shadow,
    build=_build_hard_shadow,
)
