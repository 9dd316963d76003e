"""Families lit by emitters with extent: rectangle, disk, sphere, two of them, and the furnace."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from oracle.arrays import Floats
from reference_scenes import model
from reference_scenes.families import building
from reference_scenes.families.building import Degrees, Metres, View, uniform
from reference_scenes.families.family import Family, Parameters

# -------------------------------------------------------------------------------------- rectangle-overhead


class RectangleOverheadParameters(Parameters):
    """A rectangle above a floor, facing down or nearly so."""

    height: Metres
    half_width: Metres
    half_height: Metres
    tilt: Annotated[float, Field(ge=0, le=60)]
    tilt_azimuth: Degrees
    spin: Degrees
    radiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_rectangle_overhead(rng: np.random.Generator) -> RectangleOverheadParameters:
    height = uniform(rng, 1.0, 1.6)
    return RectangleOverheadParameters(
        height=height,
        half_width=uniform(rng, 0.3, 0.6),
        half_height=uniform(rng, 0.2, 0.4),
        tilt=uniform(rng, 5, 25),
        tilt_azimuth=uniform(rng, 0, 360),
        spin=uniform(rng, 0, 90),
        radiance=(radiance := building.draw_colour(rng, 6)),
        reflectance=building.draw_albedo(rng, radiance),
        view=building.draw_view(rng, (25, 35), (3.5, 4.5)),
    )


def _facing_down(tilt: float, azimuth: float) -> Floats:
    return -building.direction(tilt, azimuth)


def _build_rectangle_overhead(p: RectangleOverheadParameters) -> model.Scene:
    shape = building.rectangle(
        np.array([0.0, 0.0, p.height]), _facing_down(p.tilt, p.tilt_azimuth), p.half_width, p.half_height, p.spin
    )
    return model.Scene(
        objects=(building.floor(p.reflectance, p.spin),),
        emitters=(model.AreaEmitter(shape=shape, radiance=p.radiance),),
        camera=building.camera(p.view, building.beside(p.view, 0.3 * p.height, 0)),
        film=building.FILM,
    )


RECTANGLE_OVERHEAD = Family(
    name="rectangle-overhead",
    law="The irradiance of a rectangle is its radiance integrated over its projected solid angle.",
    concept="size of lights; solid angle; change of variables between area and solid angle",
    formula="L = rho/pi * Le/2 * sum_i Theta_i (n . Gamma_i) over the edges",
    source="Lambert 1760, Photometria; Arvo 1994, eq. 12",
    spp=16,
    parameters=RectangleOverheadParameters,
    draw=_draw_rectangle_overhead,
    build=_build_rectangle_overhead,
)

# --------------------------------------------------------------------------------------- rectangle-horizon


class RectangleHorizonParameters(Parameters):
    """An upright rectangle half below the plane of a finite receiver, part of which lies behind the rectangle."""

    distance: Metres
    half_width: Metres
    half_height: Metres
    rise: Annotated[float, Field(ge=-1, le=1)]
    turn: Annotated[float, Field(ge=-85, le=85)]
    lean: Annotated[float, Field(ge=-45, le=45)]
    azimuth: Degrees
    radiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_rectangle_horizon(rng: np.random.Generator) -> RectangleHorizonParameters:
    turn = uniform(rng, 60, 72) * (1 if rng.random() < 0.5 else -1)
    return RectangleHorizonParameters(
        distance=uniform(rng, 1.2, 1.4),
        half_width=uniform(rng, 0.3, 0.5),
        half_height=uniform(rng, 0.5, 0.8),
        rise=uniform(rng, -0.2, 0.2),
        turn=turn,
        lean=uniform(rng, 5, 15),
        azimuth=uniform(rng, 0, 360),
        radiance=(radiance := building.draw_colour(rng, 10)),
        reflectance=building.draw_albedo(rng, radiance),
        view=building.draw_view(rng, (50, 65), (4.0, 5.0)),
    )


def _build_rectangle_horizon(p: RectangleHorizonParameters) -> model.Scene:
    outwards = building.direction(90, p.azimuth)
    # Turned sideways so that the light's own plane, too, crosses the receiver.
    normal = building.direction(90 + p.lean, p.azimuth + 180 + p.turn)
    along = np.cross([0.0, 0.0, 1.0], normal)
    along /= np.linalg.norm(along)
    upwards = np.cross(normal, along)
    light = model.Rectangle(
        center=building.vector(p.distance * outwards + np.array([0.0, 0.0, p.rise])),
        half_u=building.vector(p.half_width * along),
        half_v=building.vector(p.half_height * upwards),
    )
    # The receiver ends before it could touch the light.
    across = np.cross([0.0, 0.0, 1.0], outwards)
    shape = model.Rectangle(
        center=(0.0, 0.0, 0.0), half_u=building.vector(0.8 * outwards), half_v=building.vector(1.5 * across)
    )
    return model.Scene(
        objects=(building.receiver(shape, p.reflectance),),
        emitters=(model.AreaEmitter(shape=light, radiance=p.radiance),),
        camera=building.camera(p.view, np.zeros(3)),
        film=building.FILM,
    )


RECTANGLE_HORIZON = Family(
    name="rectangle-horizon",
    law="Only the part of a light above the receiver's horizon shines on it, and only the light's front shines.",
    concept="cosine rule on both sides; hemisphere above a surface",
    formula="L = rho/pi * Le/2 * sum_i Theta_i (n . Gamma_i) over the contour clipped at the horizon",
    source="Nishita and Nakamae 1985; Arvo 1994, eq. 12",
    spp=128,
    parameters=RectangleHorizonParameters,
    draw=_draw_rectangle_horizon,
    build=_build_rectangle_horizon,
)

# ---------------------------------------------------------------------------------------------------- disk


class DiskParameters(Parameters):
    """A disk above a floor."""

    height: Metres
    radius: Metres
    tilt: Annotated[float, Field(ge=0, le=60)]
    tilt_azimuth: Degrees
    spin: Degrees
    radiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_disk(rng: np.random.Generator) -> DiskParameters:
    return DiskParameters(
        height=uniform(rng, 1.0, 1.6),
        radius=uniform(rng, 0.25, 0.5),
        tilt=uniform(rng, 10, 45),
        tilt_azimuth=uniform(rng, 0, 360),
        spin=uniform(rng, 0, 90),
        radiance=(radiance := building.draw_colour(rng, 8)),
        reflectance=building.draw_albedo(rng, radiance),
        view=building.draw_view(rng, (25, 35), (3.5, 4.5)),
    )


def _build_disk(p: DiskParameters) -> model.Scene:
    shape = model.Disk(
        center=(0.0, 0.0, p.height),
        normal=building.vector(_facing_down(p.tilt, p.tilt_azimuth)),
        radius=p.radius,
    )
    return model.Scene(
        objects=(building.floor(p.reflectance, p.spin),),
        emitters=(model.AreaEmitter(shape=shape, radiance=p.radiance),),
        camera=building.camera(p.view, np.zeros(3)),
        film=building.FILM,
    )


DISK = Family(
    name="disk",
    law="The irradiance of a disk is its radiance integrated over its projected solid angle.",
    concept="size of lights; solid angle",
    formula="L = rho/pi * Le/2 * |closed integral of n . (p x dp) / |p|^2| over the rim",
    source="Sparrow 1963; Howell's catalogue of view factors, B-13",
    spp=16,
    parameters=DiskParameters,
    draw=_draw_disk,
    build=_build_disk,
)

# -------------------------------------------------------------------------------------------------- sphere


class SphereParameters(Parameters):
    """A shining sphere above a floor."""

    height: Metres
    radius: Metres
    spin: Degrees
    radiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_sphere(rng: np.random.Generator) -> SphereParameters:
    return SphereParameters(
        height=uniform(rng, 0.9, 1.4),
        radius=uniform(rng, 0.2, 0.45),
        spin=uniform(rng, 0, 90),
        radiance=(radiance := building.draw_colour(rng, 6)),
        reflectance=building.draw_albedo(rng, radiance),
        view=building.draw_view(rng, (25, 35), (3.0, 4.0)),
    )


def _build_sphere(p: SphereParameters) -> model.Scene:
    shape = model.Sphere(center=(0.0, 0.0, p.height), radius=p.radius)
    return model.Scene(
        objects=(building.floor(p.reflectance, p.spin),),
        emitters=(model.AreaEmitter(shape=shape, radiance=p.radiance),),
        camera=building.camera(p.view, building.beside(p.view, 0.3 * p.height, 0)),
        film=building.FILM,
    )


SPHERE = Family(
    name="sphere",
    law="A uniform sphere gives the irradiance of a point at its center with the same flux.",
    concept="solid angle; radiance constant along straight lines",
    formula="L = rho * Le (R/d)^2 cos(theta)",
    source="Lambert 1760; Snyder 1996",
    spp=64,
    parameters=SphereParameters,
    draw=_draw_sphere,
    build=_build_sphere,
)

# ---------------------------------------------------------------------------------------------- two-lights


class TwoLightsParameters(Parameters):
    """A rectangle and a disk of different colours, side by side under one ceiling."""

    height: Metres
    separation: Metres
    azimuth: Degrees
    half_width: Metres
    half_height: Metres
    radius: Metres
    rectangle_radiance: model.Spectrum
    disk_radiance: model.Spectrum
    reflectance: model.Albedo
    view: View


def _draw_two_lights(rng: np.random.Generator) -> TwoLightsParameters:
    return TwoLightsParameters(
        height=uniform(rng, 0.8, 1.2),
        separation=uniform(rng, 1.2, 1.6),
        azimuth=uniform(rng, 0, 360),
        half_width=uniform(rng, 0.2, 0.4),
        half_height=uniform(rng, 0.15, 0.3),
        radius=uniform(rng, 0.15, 0.35),
        rectangle_radiance=(rectangle_radiance := building.draw_colour(rng, 9)),
        disk_radiance=building.draw_colour(rng, 9),
        reflectance=building.draw_albedo(rng, rectangle_radiance),
        view=building.draw_view(rng, (25, 35), (3.5, 4.5)),
    )


def _build_two_lights(p: TwoLightsParameters) -> model.Scene:
    down = np.array([0.0, 0.0, -1.0])
    aside = p.separation / 2 * building.direction(90, p.azimuth)
    ceiling = np.array([0.0, 0.0, p.height])
    first = building.rectangle(ceiling + aside, down, p.half_width, p.half_height, p.azimuth)
    second = model.Disk(center=building.vector(ceiling - aside), normal=building.vector(down), radius=p.radius)
    return model.Scene(
        objects=(building.floor(p.reflectance, p.azimuth),),
        emitters=(
            model.AreaEmitter(shape=first, radiance=p.rectangle_radiance),
            model.AreaEmitter(shape=second, radiance=p.disk_radiance),
        ),
        camera=building.camera(p.view, np.zeros(3)),
        film=building.FILM,
    )


TWO_LIGHTS = Family(
    name="two-lights",
    law="Light adds up: the irradiance of two lights is the sum of each alone, in every channel.",
    concept="linearity: superposition",
    formula="L = rho/pi * (E_1 + E_2)",
    source="Pharr, Jakob and Humphreys 2023, section 4.1; the forms of rectangle and disk",
    spp=16,
    parameters=TwoLightsParameters,
    draw=_draw_two_lights,
    build=_build_two_lights,
)

# ------------------------------------------------------------------------------------------------- furnace


class FurnaceParameters(Parameters):
    """A diffuse sphere in a constant environment of radiance 1."""

    reflectance: model.Albedo
    radius: Metres
    view: View


def _draw_furnace(rng: np.random.Generator) -> FurnaceParameters:
    # White in one channel, grey in the others: the white furnace and two grey ones in one image.
    red, green, blue = (float(v) for v in rng.permutation([1.0, uniform(rng, 0.4, 0.7), uniform(rng, 0.1, 0.3)]))
    return FurnaceParameters(
        reflectance=(red, green, blue),
        radius=uniform(rng, 0.7, 1.0),
        view=building.draw_view(rng, (5, 70), (3.6, 4.4)),
    )


def _build_furnace(p: FurnaceParameters) -> model.Scene:
    shape = model.Sphere(center=(0.0, 0.0, 0.0), radius=p.radius)
    return model.Scene(
        objects=(building.receiver(shape, p.reflectance),),
        emitters=(model.ConstantEmitter(radiance=(1.0, 1.0, 1.0)),),
        camera=building.camera(p.view, building.beside(p.view, 0.3 * p.radius, 0.25 * p.radius)),
        film=building.FILM,
    )


FURNACE = Family(
    name="furnace",
    law=(
        "In light of radiance 1 from everywhere a diffuse surface shows its reflectance: "
        "white vanishes, none exceeds 1."
    ),
    concept="reflection integral; white furnace test: a white diffuse BRDF is 1/pi",
    formula="L = integral of rho/pi * 1 * cos(theta) d-omega = rho",
    source="Heitz 2014, section 5.1 (white furnace test); Pharr, Jakob and Humphreys 2023, section 9.2",
    spp=16,
    parameters=FurnaceParameters,
    draw=_draw_furnace,
    build=_build_furnace,
)
