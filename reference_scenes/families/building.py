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
    """The camera of a view of `target`."""
    towards_camera, _, up = _axes(view)
    return model.Camera(
        origin=vector(target + view.distance * towards_camera),
        target=vector(target),
        up=vector(up),
        fov_x=view.fov_x,
    )


def beside(view: View, right: float, up: float) -> Floats:
    """A point off the origin by some metres to the right and upwards in the image.

    A camera that looks there sees no scene around the origin symmetrically, so that a flipped image shows.
    """
    _, image_right, image_up = _axes(view)
    return right * image_right + up * image_up


def _axes(view: View) -> tuple[Floats, Floats, Floats]:
    """Unit vectors towards the camera, to the right and upwards in the image; up is z before the camera is rolled."""
    towards_camera = direction(90 - view.elevation, view.azimuth)
    right = np.cross([0.0, 0.0, 1.0], towards_camera)
    right /= np.linalg.norm(right)
    up = np.cross(towards_camera, right)
    roll = np.radians(view.roll)
    return towards_camera, np.cos(roll) * right - np.sin(roll) * up, np.cos(roll) * up + np.sin(roll) * right


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


def draw_albedo(rng: np.random.Generator, emission: model.Vector) -> model.Vector:
    """Reflectances in the order of the emission, so that one cannot undo the difference between its channels."""
    levels = sorted(uniform(rng, 0.2, 0.9) for _ in range(3))
    red, green, blue = (levels[rank] for rank in np.argsort(np.argsort(emission)))
    return (red, green, blue)


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
