"""What the families draw and build alike: views, colours, receivers and frames."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from oracle.arrays import Floats
from reference_scenes import model

Degrees = Annotated[float, Field(ge=-360, le=360)]
Metres = Annotated[float, Field(gt=0, le=1e6)]

# Not square and not a power of two, so that exchanged axes and wrong strides show.
FILM = model.Film(width=96, height=64)


class View(model.Model):
    """Where the camera stands around the point it looks at."""

    azimuth: Degrees
    elevation: Annotated[float, Field(gt=0, lt=90)]
    distance: Metres
    fov_x: Annotated[float, Field(gt=0, lt=180)]
    roll: Degrees = 0.0


def draw_view(rng: np.random.Generator, elevation: tuple[float, float], distance: tuple[float, float]) -> View:
    """A view from any side, slightly rolled so that no edge follows the pixel grid."""
    return View(
        azimuth=uniform(rng, 0, 360),
        elevation=uniform(rng, *elevation),
        distance=uniform(rng, *distance),
        fov_x=uniform(rng, 32, 44),
        roll=uniform(rng, -12, 12),
    )


def camera(view: View, target: Floats) -> model.Camera:
    """The camera of a view of `target`, z up before it is rolled."""
    towards_camera = direction(90 - view.elevation, view.azimuth)
    forward = -towards_camera
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    roll = np.radians(view.roll)
    return model.Camera(
        origin=vector(target + view.distance * towards_camera),
        target=vector(target),
        up=vector(np.cos(roll) * up + np.sin(roll) * right),
        fov_x=view.fov_x,
    )


def direction(polar: float, azimuth: float) -> Floats:
    """Unit vector at a polar angle from +z and an azimuth from +x, in degrees."""
    theta, phi = np.radians(polar), np.radians(azimuth)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def tangents(normal: Floats, spin: float) -> tuple[Floats, Floats]:
    """Unit vectors u, v with ``u x v = normal``, turned by `spin` degrees around it."""
    helper = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(helper, normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    angle = np.radians(spin)
    return np.cos(angle) * u + np.sin(angle) * v, np.cos(angle) * v - np.sin(angle) * u


def rectangle(center: Floats, normal: Floats, half_width: float, half_height: float, spin: float) -> model.Rectangle:
    """A rectangle that faces along the unit vector `normal`."""
    u, v = tangents(normal, spin)
    return model.Rectangle(center=vector(center), half_u=vector(half_width * u), half_v=vector(half_height * v))


def receiver(shape: model.Shape, reflectance: model.Vector) -> model.Object:
    """A diffuse object."""
    return model.Object(shape=shape, material=model.Diffuse(reflectance=reflectance))


def floor(reflectance: model.Vector, spin: float, half_size: float = 40.0) -> model.Object:
    """A large horizontal receiver through the origin, front upwards."""
    return receiver(rectangle(np.zeros(3), np.array([0.0, 0.0, 1.0]), half_size, half_size, spin), reflectance)


def draw_albedo(rng: np.random.Generator) -> model.Vector:
    """Reflectances that differ between the channels."""
    return (uniform(rng, 0.2, 0.9), uniform(rng, 0.2, 0.9), uniform(rng, 0.2, 0.9))


def draw_colour(rng: np.random.Generator, scale: float) -> model.Vector:
    """Emission around `scale` that clearly differs between the channels, in any order."""
    levels = [uniform(rng, 0.25, 0.4), uniform(rng, 0.5, 0.7), uniform(rng, 0.85, 1.2)]
    red, green, blue = (round(float(level * scale), 4) for level in rng.permutation(levels))
    return (red, green, blue)


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A uniform number, rounded so that scene files stay readable."""
    return round(float(rng.uniform(low, high)), 4)


def vector(array: Floats) -> model.Vector:
    """A numpy vector as the model's plain tuple."""
    x, y, z = (float(component) for component in array)
    return (x, y, z)
