"""Light that is reflected again and again: the closed solutions of `oracle.enclosures`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from oracle import shapes
from oracle.arrays import Floats, InvalidArgument
from oracle.bounded import Bounded
from oracle.emitters import Area, Point
from oracle.truth.case import Case, InvalidField, Law, building
from oracle.truth.fields import Length, Light, NonNegative, Radiance, Reflectance, UnitVector
from oracle.truth.light import in_form
from oracle.truth.things import Emitter, Sphere, amount_of, channels, emitter_of

# Reflections that count: 0 is emission alone, null is all of them.
Bounces: TypeAlias = Annotated[int, Field(strict=True, ge=0, le=10**6)] | None


class _Enclosure(Case):
    """What the walls of enclosures have in common; cases that are computed together are all the same."""

    unit = "W/(m^2 sr)"
    bounces: Bounces = None

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """The same value for each case."""
        found = together[0].found()
        shape = (len(together), *found.value.shape)
        return Bounded(np.broadcast_to(found.value, shape), np.broadcast_to(found.error, shape))

    def found(self) -> Bounded:
        """Value and error bound of one case."""
        raise NotImplementedError


class ClosedBox(_Enclosure):
    """Radiance everywhere in a closed enclosure of any shape whose walls emit and reflect uniformly."""

    quantity: Literal["closed_box"]
    emission: Radiance
    reflectance: Reflectance

    def law(self) -> Law:
        """The Neumann series or its limit."""
        return Law("Le / (1 - rho)" if self.bounces is None else "Le (1 + rho + ... + rho^n)", "Kajiya 1986")

    def found(self) -> Bounded:
        """One value, or one for each channel."""
        from oracle.enclosures import closed_box

        found = closed_box(channels(self.emission), channels(self.reflectance), self.bounces)
        return in_form(found, self.emission, self.reflectance)


class ParallelPlates(_Enclosure):
    """Radiance of each of two infinite parallel plates that face each other."""

    quantity: Literal["parallel_plates"]
    emission: tuple[Radiance, Radiance]
    reflectance: tuple[Reflectance, Reflectance]

    def law(self) -> Law:
        """The solution of two equations; with bounces, its series up to them."""
        return Law("L1 = (Le1 + rho1 Le2) / (1 - rho1 rho2)", "Hottel and Sarofim 1967")

    def found(self) -> Bounded:
        """One value for each plate, or for each plate one for each channel."""
        from oracle.enclosures import parallel_plates

        found = parallel_plates(*_surfaces(self.emission, self.reflectance), self.bounces)
        return in_form(found, *self.emission, *self.reflectance)


class ConcentricSpheres(_Enclosure):
    """Radiance of the outside of a sphere, and of the inside of a larger one around it."""

    quantity: Literal["concentric_spheres"]
    inner_radius: Length
    outer_radius: Length
    emission: tuple[Radiance, Radiance]
    reflectance: tuple[Reflectance, Reflectance]

    def law(self) -> Law:
        """The two equations of radiosity."""
        return Law(
            "L2 = (Le2 + rho2 F21 Le1) / (1 - rho2 (1 - F21 (1 - rho1))), F21 = (r/R)^2", "Howell's catalogue, C"
        )

    def found(self) -> Bounded:
        """One value for each sphere, or for each sphere one for each channel."""
        from oracle.enclosures import concentric_spheres

        emission, rho = _surfaces(self.emission, self.reflectance)
        found = concentric_spheres(self.inner_radius, self.outer_radius, emission, rho, self.bounces)
        return in_form(found, *self.emission, *self.reflectance)


class Radiosity(_Enclosure):
    """Radiosity [W/m^2] of diffuse patches with known view factors."""

    unit: ClassVar[str] = "W/m^2"

    quantity: Literal["radiosity"]
    view_factors: Annotated[tuple[tuple[NonNegative, ...], ...], Field(min_length=1)]
    exitance: Annotated[tuple[Annotated[Light, Field(description="W/m^2")], ...], Field(min_length=1)]
    reflectance: Annotated[tuple[Reflectance, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _sizes_agree(self) -> Self:
        count = len(self.exitance)
        if len(self.reflectance) != count or any(len(row) != count for row in (self.view_factors, *self.view_factors)):
            raise ValueError("view_factors (N rows of N), exitance (N) and reflectance (N) differ in size")
        return self

    def law(self) -> Law:
        """The linear equation of radiosity."""
        return Law("B = M + rho F B", "Goral, Torrance, Greenberg and Battaile 1984")

    def found(self) -> Bounded:
        """One value for each patch, or for each patch one for each channel."""
        from oracle.enclosures import radiosity

        exitance, rho = _surfaces(self.exitance, self.reflectance)
        found = radiosity(np.array(self.view_factors), exitance, rho, self.bounces)
        return in_form(found, *self.exitance, *self.reflectance)


class IntegratingSphere(_Enclosure):
    """Irradiance [W/m^2] on the inside of a diffuse sphere, in a `direction` from its centre, of a source in it."""

    unit: ClassVar[str] = "W/m^2"
    varying = "direction"

    quantity: Literal["integrating_sphere"]
    sphere: Sphere
    source: Emitter
    direction: UnitVector
    reflectance: Reflectance

    def law(self) -> Law:
        """Direct light, and the reflected light that is the same everywhere."""
        return Law("E_direct + Phi rho (1 + rho + ...) / A", "Ulbricht 1900")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """One value, or one for each channel."""
        from oracle.enclosures import integrating_sphere

        first = together[0]
        with building("source"):
            source = emitter_of(first.source)
            if not isinstance(source, Point | Area):
                raise InvalidArgument("is no source that a sphere can hold: neither a point nor a shape that shines")
        sphere = shapes.Sphere(np.array(first.sphere.center), first.sphere.radius)
        directions = np.array([case.direction for case in together])
        found = integrating_sphere(sphere, source, directions, channels(first.reflectance), first.bounces)
        return in_form(found, amount_of(first.source), first.reflectance)


def _surfaces(
    emission: Sequence[float | tuple[float, ...]], reflectance: Sequence[float | tuple[float, ...]]
) -> tuple[Floats, Floats]:
    """Emission and reflectance of N surfaces, (N, C) each; what is one number is that in all channels."""
    count = max(len(channels(one)) for one in (*emission, *reflectance))
    rows = []
    for row in (emission, reflectance):
        for index, one in enumerate(row):
            if len(channels(one)) not in (1, count):
                name = "emission" if row is emission else "reflectance"
                raise InvalidField(f"/{name}/{index}", f"has {len(channels(one))} channels, another has {count}")
        rows.append(np.array([np.broadcast_to(channels(one), count) for one in row]))
    return rows[0], rows[1]
