"""What a mistake does to irradiance: another integrand, a factor, another emitter, another horizon, another falloff."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from oracle.arrays import Floats, InvalidArgument, dot
from oracle.bounded import Bounded
from oracle.emitters import Area, Constant, Directional, Emitter, Line, Point, Receivers, Spot
from oracle.irradiances import irradiance
from oracle.mistakes.quadrature import Kernel, over_line, over_shape, refuse_on_light
from oracle.radiometry.emission import angle_between

_EPSILON = float(np.finfo(np.float64).eps)

# Irradiance (N, C) of an emitter at N receivers on a surface of some reflectance.
Effect: TypeAlias = Callable[[Any, Receivers, Floats], Bounded]


def integrand(receiver: int, light: int, distance: int) -> Effect:
    """``L cos^receiver(theta) cos^light(theta_light) / r^distance`` in place of the powers 1, 1, 2."""
    kernel = Kernel(receiver, light, distance)

    def effect(emitter: Emitter, receivers: Receivers, reflectance: Floats) -> Bounded:
        points, normals = receivers.points, receivers.normals
        match emitter:
            case Area():
                return _times(over_shape(kernel, emitter.shape, emitter.two_sided, points, normals), emitter.radiance)
            case Line():
                there = over_line(kernel, emitter.start, emitter.end, points, normals)
                return _times(there, emitter.intensity_per_length)
            case Point():
                return _times(_from_point(kernel, emitter.position, receivers), emitter.intensity)
            case Spot():
                return _spot(emitter, receivers, kernel, _falloff(emitter.beam_width, emitter.cutoff_angle))
            case Directional():
                cosine = -(normals @ emitter.direction)
                return _times(_cosine_power(cosine, receiver), emitter.irradiance)
            case Constant():
                # The hemisphere's integral of cos^a.
                factor = np.full(len(normals), 2 * np.pi / (receiver + 1))
                return _times(Bounded(factor, 4 * _EPSILON * factor), emitter.radiance)
            case _:
                raise NotImplementedError

    return effect


def scaled(factor: Callable[[Any, Floats], float | Floats]) -> Effect:
    """Irradiance times a factor that depends on emitter and reflectance, and is right to a few ulp."""

    def effect(emitter: Emitter, receivers: Receivers, reflectance: Floats) -> Bounded:
        right = irradiance(emitter, receivers)
        channels = right.value.shape[-1]
        if reflectance.ndim and len(reflectance) != channels:
            raise InvalidArgument(f"reflectance has shape {reflectance.shape}, the emitter has {channels} channels")
        wrong = right * factor(emitter, reflectance)
        return Bounded(wrong.value, wrong.error + 8 * _EPSILON * np.abs(wrong.value))

    return effect


def instead(other: Callable[[Any], Emitter]) -> Effect:
    """Irradiance of another emitter."""
    return lambda emitter, receivers, reflectance: irradiance(other(emitter), receivers)


def front_missing(emitter: Area, receivers: Receivers, reflectance: Floats) -> Bounded:
    """Irradiance of a shape's back alone."""
    one_sided = dataclasses.replace(emitter, two_sided=False)
    both = dataclasses.replace(emitter, two_sided=True)
    all_of_it, front = irradiance(both, receivers), irradiance(one_sided, receivers)
    # Only one side of a triangle is seen, so that nothing cancels but what is 0.
    return all_of_it + front * -1.0


def horizon(sign: float) -> Effect:
    """What arrives from above the horizon, plus or minus what arrives from below."""

    def effect(emitter: Emitter, receivers: Receivers, reflectance: Floats) -> Bounded:
        below = irradiance(emitter, Receivers(receivers.points, -receivers.normals))
        return irradiance(emitter, receivers) + below * sign

    return effect


def at_center(light_cosine: bool, area: bool) -> Effect:
    """The whole light as one point in its center: with or without its cosine, and its area."""

    def effect(emitter: Area, receivers: Receivers, reflectance: Floats) -> Bounded:
        shape: Any = emitter.shape
        # Of a polygon the mean of its corners, as people take it.
        center = shape.vertices.mean(axis=0) if hasattr(shape, "vertices") else shape.center
        there = _from_point(Kernel(1, 0, 2), center, receivers)
        size = shape.area if area else 1.0
        if light_cosine:
            away = receivers.points - center
            cosine = (away @ shape.normal) / np.linalg.norm(away, axis=-1)
            facing = np.abs(cosine) if emitter.two_sided else np.maximum(cosine, 0)
            there = Bounded(there.value * facing, there.error + 16 * _EPSILON * there.value)
        return _times(Bounded(there.value * size, (there.error + 16 * _EPSILON * there.value) * size), emitter.radiance)

    return effect


def spot_falloff(angles: Callable[[Spot], tuple[float, float]], shape: str = "angle") -> Effect:
    """A spot with other half angles of beam and cutoff, or another falloff between the two."""

    def effect(emitter: Spot, receivers: Receivers, reflectance: Floats) -> Bounded:
        return _spot(emitter, receivers, Kernel(1, 0, 2), _falloff(*angles(emitter), shape))

    return effect


def _falloff(beam: float, cutoff: float, shape: str = "angle") -> Callable[[Floats], tuple[Floats, float | Floats]]:
    """The falloff for an angle, with a bound on its absolute error."""

    def falloff(angle: Floats) -> tuple[Floats, float | Floats]:
        match shape:
            case "none":
                return np.where(angle < cutoff, 1.0, 0.0), np.where(np.abs(angle - cutoff) < 8 * _EPSILON, 1.0, 0.0)
            case "angle":
                return np.clip((cutoff - angle) / (cutoff - beam), 0, 1), 16 * _EPSILON / (cutoff - beam)
            case _:
                span = np.cos(beam) - np.cos(cutoff)
                t = np.clip((np.cos(angle) - np.cos(cutoff)) / span, 0, 1)
                return (t * t * (3 - 2 * t) if shape == "smoothstep" else t), 32 * _EPSILON / span

    return falloff


def _spot(
    emitter: Spot, receivers: Receivers, kernel: Kernel, falloff: Callable[[Floats], tuple[Floats, float | Floats]]
) -> Bounded:
    factor, error = falloff(angle_between(receivers.points - emitter.position, emitter.direction))
    bare = _from_point(kernel, emitter.position, receivers)
    shaded = Bounded(bare.value * factor, bare.error * factor + bare.value * (error + 4 * _EPSILON))
    return _times(shaded, emitter.intensity)


def _from_point(kernel: Kernel, position: Floats, receivers: Receivers) -> Bounded:
    """``cos^a(theta) / r^k`` for a point, which has no surface and so no cosine of its own."""
    towards = position - receivers.points
    distance = np.linalg.norm(towards, axis=-1)
    refuse_on_light(receivers.points, distance == 0)
    cosine = _cosine_power(dot(receivers.normals, towards) / distance, kernel.receiver)
    power = distance**-kernel.distance
    return Bounded(cosine.value * power, (cosine.error + 16 * _EPSILON * cosine.value) * power)


def _cosine_power(cosine: Floats, power: int) -> Bounded:
    value = np.where(cosine > 0, np.clip(cosine, 0, 1) ** power, 0.0)
    return Bounded(value, np.full_like(value, 8 * _EPSILON * power))


def _times(factor: Bounded, spectrum: Floats) -> Bounded:
    """A factor (N,) times a spectrum (C,): (N, C)."""
    return Bounded(factor.value[:, None], factor.error[:, None]) * spectrum
