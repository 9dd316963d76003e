"""What emitters send out: conversions between flux, intensity, exitance and radiance.

Integrals over all directions and over the emitter's surface of ``dPhi = I d-omega = L cos(theta) dA d-omega``.
"""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from functools import reduce
from operator import add
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, direction, light
from oracle.bounded import Bounded
from oracle.emitters import Area, Constant, Directional, Emitter, Line, Point, Spot
from oracle.radiometry.quantities import EXITANCE, FLUX, INTENSITY, IRRADIANCE, RADIANCE, Measure, Quantity
from oracle.radiometry.units import Unit
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere

_EPSILON = float(np.finfo(np.float64).eps)

AnyEmitter = TypeVar("AnyEmitter", Point, Spot, Directional, Line, Area, Constant)


def flux(emitter: Emitter) -> Bounded:
    """Flux that an emitter sends out in all directions together [W], shape (C,).

    Raises
    ------
    InvalidArgument
        If the emitter is infinitely far away; see `collected_flux`.

    Notes
    -----
    ======  ===============================================================
    Point   ``4 pi I``
    Spot    ``2 pi I (1 - (sin c - sin b) / (c - b))``, b and c the beam's and the cutoff's half angle
    Line    ``pi^2 I' l``, since a length dl sends ``I' sin(g)`` and ``2 pi`` times the integral of sin^2 is pi^2
    Area    ``pi L A``, twice that for two sides
    ======  ===============================================================
    """
    match emitter:
        case Point():
            return _few_ulp(4 * np.pi) * emitter.intensity
        case Spot():
            return _spot_solid_angle(emitter) * emitter.intensity
        case Line():
            return (
                _few_ulp(np.pi**2 * float(np.linalg.norm(emitter.end - emitter.start))) * emitter.intensity_per_length
            )
        case Area():
            sides = 2 if emitter.two_sided else 1
            return _area(emitter.shape) * (sides * np.pi) * emitter.radiance
        case _:
            raise InvalidArgument(
                f"emitter is a {type(emitter).__name__}, which has no flux of its own; "
                "collected_flux is what a surface gets"
            )


def exitance(emitter: Area) -> Bounded:
    """Exitance ``pi L`` [W/m^2], shape (C,), of each shining side of a diffuse emitter [Lambert 1760]."""
    return _few_ulp(np.pi) * emitter.radiance


def radiosity(emitted: ArrayLike, reflectance: ArrayLike, irradiance: ArrayLike) -> Floats:
    """Radiosity ``B = M + rho E`` [W/m^2] of a diffuse surface, right to a few ulp.

    Parameters
    ----------
    emitted, irradiance : array_like
        Exitance M and irradiance E [W/m^2], at least 0; all three broadcast.
    reflectance : array_like
        In [0, 1].

    Raises
    ------
    InvalidArgument
        If a number is out of its domain, or the shapes do not fit.
    """
    m, rho, e = light("emitted", emitted), reflectance_of(reflectance), light("irradiance", irradiance)
    try:
        np.broadcast_shapes(m.shape, rho.shape, e.shape)
    except ValueError:
        raise InvalidArgument(
            f"emitted {m.shape}, reflectance {rho.shape} and irradiance {e.shape} do not fit together"
        ) from None
    result: Floats = m + rho * e
    return result


def reflectance_of(reflectance: ArrayLike) -> Floats:
    """Return a reflectance of any shape, checked to lie in [0, 1]."""
    array = light("reflectance", reflectance)
    if (array > 1).any():
        raise InvalidArgument(f"reflectance reaches {array.max()}, it must lie in [0, 1]")
    return array


def intensity(emitter: Emitter, directions: ArrayLike) -> Bounded:
    """Intensity [W/sr] towards distant observers in the unit `directions`, shape (..., 3); the result has (..., C).

    A shape shines with ``L A cos(theta)`` for each flat piece and ``pi R^2 L`` for a sphere; a line with
    ``I' l sin(gamma)``. The triangles of a mesh do not hide one another.

    Raises
    ------
    InvalidArgument
        If the emitter is infinitely far away, or a direction has not the length 1.
    """
    towards = direction("directions", directions)
    match emitter:
        case Point():
            ones = np.ones(towards.shape[:-1])
            return _with_channels(Bounded(ones, 0 * ones), emitter.intensity)
        case Spot():
            span = emitter.cutoff_angle - emitter.beam_width
            angle = angle_between(towards, emitter.direction)
            linear = (emitter.cutoff_angle - angle) / span
            falloff = np.clip(linear, 0, 1)
            # The angle's error is some ulp of itself and of its sine's terms; it counts only where the intensity falls.
            first, second = np.abs(towards), np.abs(emitter.direction)
            terms = np.roll(first, 1, -1) * np.roll(second, -1) + np.roll(first, -1, -1) * np.roll(second, 1)
            rounding = 8 * _EPSILON * (angle + emitter.cutoff_angle + np.linalg.norm(terms, axis=-1)) / span
            falls = np.abs(linear - 0.5) <= 0.5 + rounding
            error = np.where(falls, rounding, 0.0) + 4 * _EPSILON * falloff
            return _with_channels(Bounded(falloff, error), emitter.intensity)
        case Line():
            along = emitter.end - emitter.start
            across = np.linalg.norm(np.cross(along, towards), axis=-1)
            error = np.full_like(across, 16 * _EPSILON * np.linalg.norm(along))
            return _with_channels(Bounded(across, error), emitter.intensity_per_length)
        case Area():
            return _with_channels(_projected_area(emitter.shape, towards, emitter.two_sided), emitter.radiance)
        case _:
            raise InvalidArgument(f"emitter is a {type(emitter).__name__}, which is too far away to have an intensity")


def collected_flux(emitter: Directional | Constant, shape: Shape) -> Bounded:
    """Flux [W], shape (C,), that falls on the front of a convex shape from infinitely far away.

    ``E`` times the area projected along the light's direction, or ``pi L A`` from a constant environment. Of a mesh
    each triangle counts as if nothing hid it.

    Raises
    ------
    InvalidArgument
        If the emitter is of another kind, for which `oracle.irradiances` has to be integrated, or the shape is none.
    """
    if not isinstance(shape, Shape):
        raise InvalidArgument(f"shape is a {type(shape).__name__}, not one of oracle.shapes")
    match emitter:
        case Directional():
            return _with_channels(_projected_area(shape, -emitter.direction, False), emitter.irradiance)
        case Constant():
            return _area(shape) * np.pi * emitter.radiance
        case _:
            raise InvalidArgument(f"emitter is a {type(emitter).__name__}, not Directional or Constant")


def emitting(emitter: AnyEmitter, measure: Measure) -> AnyEmitter:
    """Return the emitter with what it sends out set by a measure of one of its quantities; the unit tells which.

    Parameters
    ----------
    emitter : Point, Spot, Line, Area, Directional or Constant
        Where and how it shines; its own brightness does not matter.
    measure : Measure
        At least 0, shape (C,). For Point and Spot intensity [W/sr] or flux [W], for Area radiance [W/(m^2 sr)],
        exitance [W/m^2] or flux [W], for Line flux [W], for Directional irradiance [W/m^2], for Constant radiance or
        the irradiance ``pi L`` of an unobstructed receiver; each also with a prefix. A spot's intensity is that
        within its beam. Converting costs a few ulp.

    Raises
    ------
    InvalidArgument
        If the unit belongs to none of these, also if it is photometric: `oracle.photometry.radiometric` converts.
    """
    field, factors = _accepted(emitter)
    for quantity, factor in factors.items():
        if measure.has_unit_of(quantity):
            changes: dict[str, Any] = {field: light("measure", measure.of(quantity)) / factor}
            return dataclasses.replace(emitter, **changes)
    names = " or ".join(f"{quantity.name} in {quantity.unit}" for quantity in factors)
    hint = "; oracle.photometry.radiometric converts photometric values" if Unit.parse(measure.unit).powers[1] else ""
    raise InvalidArgument(f"measure has the unit {measure.unit}; a {type(emitter).__name__} takes {names}{hint}")


def angle_between(vectors: Floats, axis: Floats) -> Floats:
    """Angle [rad] between vectors (..., 3) and one axis (3,), right to a few ulp of pi also where it is small."""
    sine = np.linalg.norm(np.cross(vectors, axis), axis=-1)
    result: Floats = np.arctan2(sine, vectors @ axis)
    return result


def _accepted(emitter: Emitter) -> tuple[str, dict[Quantity, float]]:
    """The field with an emitter's brightness, and by what each quantity has to be divided to give it."""
    match emitter:
        case Point():
            return "intensity", {INTENSITY: 1.0, FLUX: 4 * np.pi}
        case Spot():
            return "intensity", {INTENSITY: 1.0, FLUX: float(_spot_solid_angle(emitter).value)}
        case Line():
            unit = dataclasses.replace(emitter, intensity_per_length=np.ones(1))
            return "intensity_per_length", {FLUX: float(flux(unit).value[0])}
        case Area():
            unit_area = dataclasses.replace(emitter, radiance=np.ones(1))
            return "radiance", {RADIANCE: 1.0, EXITANCE: np.pi, FLUX: float(flux(unit_area).value[0])}
        case Directional():
            return "irradiance", {IRRADIANCE: 1.0}
        case Constant():
            return "radiance", {RADIANCE: 1.0, IRRADIANCE: np.pi}
        case _:
            raise InvalidArgument(f"emitter is a {type(emitter).__name__}, whose brightness is not one number")


def _few_ulp(value: float) -> Bounded:
    return Bounded(np.asarray(value), np.asarray(8 * _EPSILON * abs(value)))


def _with_channels(factor: Bounded, spectrum: Floats) -> Bounded:
    """A factor (...) times a spectrum (C,): (..., C)."""
    return Bounded(factor.value[..., None], factor.error[..., None]) * spectrum


def _spot_solid_angle(emitter: Spot) -> Bounded:
    """Integral of the falloff over all directions: ``2 pi (1 - (sin c - sin b) / (c - b))``.

    With the mean m and half the difference d of the two angles that is ``2 pi (1 - cos(m) sin(d)/d)``, here written
    as ``2 sin^2(m/2) + cos(m) (1 - sin(d)/d)``, which keeps its digits in narrow cones.
    """
    m = (emitter.cutoff_angle + emitter.beam_width) / 2
    d = (emitter.cutoff_angle - emitter.beam_width) / 2
    # The series of 1 - sin(d)/d, since the difference cancels.
    square = d * d
    small = square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72 * (1 - square / 110))))
    missing = small if d < 0.1 else 1 - np.sin(d) / d
    value = 2 * np.pi * (2 * np.sin(m / 2) ** 2 + np.cos(m) * missing)
    lost = 0.0 if d < 0.1 else 4 * np.pi * _EPSILON
    return Bounded(np.asarray(value), np.asarray(16 * _EPSILON * value + lost))


def _area(shape: Shape) -> Bounded:
    """Area of one side."""
    match shape:
        case Polygon():
            return _few_ulp(float(np.linalg.norm(_vector_area(shape))))
        case Mesh():
            return reduce(add, (_area(polygon) for polygon in shape.polygons))
        case Rectangle() | Disk() | Sphere():
            return _few_ulp(shape.area)


def _projected_area(shape: Shape, towards: Floats, two_sided: bool) -> Bounded:
    """Area (...) that the front, or both sides, of a convex shape shows to the far ends of unit vectors (..., 3)."""
    match shape:
        case Sphere():
            ones = np.ones(towards.shape[:-1])
            return _few_ulp(np.pi * shape.radius**2) * ones
        case Mesh():
            return reduce(add, (_projected_area(polygon, towards, two_sided) for polygon in shape.polygons))
        case Polygon() | Rectangle() | Disk():
            oriented = _vector_area(shape) if isinstance(shape, Polygon) else shape.area * shape.normal
            shown = towards @ oriented
            # Of a polygon each component is exact, of the others the whole vector.
            size = np.abs(oriented) if isinstance(shape, Polygon) else np.full(3, np.linalg.norm(oriented))
            rounding = 16 * _EPSILON * (np.abs(towards) @ size)
            if two_sided:
                return Bounded(np.abs(shown), rounding)
            return Bounded(np.maximum(shown, 0), np.where(shown > -rounding, rounding, 0.0))


def _vector_area(shape: Polygon) -> Floats:
    """Area times the front's normal, each component right to half an ulp.

    In float64 the cross products of slivers cancel, so the sum is one of exact fractions.
    """
    vertices = [[Fraction(float(x)) for x in vertex] for vertex in shape.vertices]
    pairs = list(zip(vertices, vertices[1:] + vertices[:1], strict=True))
    doubled = [sum(a[i] * b[i - 2] - a[i - 2] * b[i] for a, b in pairs) for i in (1, 2, 0)]
    return np.array([float(component) / 2 for component in doubled])
