"""Light in homogeneous media."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import Field

from oracle import emitters
from oracle.bounded import Bounded
from oracle.truth.case import Case, InvalidField, Law, building
from oracle.truth.fields import Light, Model, NonNegative, UnitVector, Vector
from oracle.truth.light import in_form, receivers_of
from oracle.truth.things import DirectionalEmitter, PointEmitter, Receiver, amount_of, channels, emitter_of

if TYPE_CHECKING:
    from oracle import media

Coefficient = Annotated[Light, Field(description="1/m")]


class Medium(Model):
    """A homogeneous medium: coefficients [1/m], and the mean cosine g of the Henyey-Greenstein phase function."""

    absorption: Coefficient
    scattering: Coefficient
    asymmetry: Annotated[float, Field(strict=True, gt=-1, lt=1)] = 0.0


class Ray(Model):
    """A segment along which one looks: origin [m], unit direction, length [m]."""

    origin: Vector
    direction: UnitVector
    length: NonNegative


class HalfSpace(Model):
    """All behind the plane through `point` [m]; the unit vector `normal` points out of it."""

    point: Vector
    normal: UnitVector


class Transmittance(Case):
    """Part of the radiance that is left after a distance [m] in a homogeneous medium."""

    unit = "1"
    varying = "distance"

    quantity: Literal["transmittance"]
    extinction: Coefficient
    distance: NonNegative

    def law(self) -> Law:
        """Beer and Lambert's."""
        return Law("exp(-sigma_t d)", "Bouguer 1729; Lambert 1760; Beer 1852")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Parts (N,), or (N, C)."""
        from oracle.media import transmittance

        extinction = together[0].extinction
        distances = np.array([case.distance for case in together])
        return in_form(transmittance(channels(extinction), distances), extinction)


class AttenuatedIrradiance(Case):
    """Irradiance [W/m^2] of a point light in a medium that fills all space; what is scattered on the way is lost."""

    unit = "W/m^2"
    varying = "receiver"

    quantity: Literal["attenuated_irradiance"]
    emitter: PointEmitter
    receiver: Receiver
    medium: Medium

    def law(self) -> Law:
        """Inverse square, cosine, and attenuation."""
        return Law("I cos(theta) / r^2 exp(-sigma_t r)", "Lambert 1760; Beer 1852")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Irradiance (N,), or (N, C)."""
        from oracle.media import point_irradiance

        first = together[0]
        emitter, medium = _in_medium(first.emitter, first.medium)
        assert isinstance(emitter, emitters.Point)
        found = point_irradiance(emitter, receivers_of([case.receiver for case in together]), medium)
        return in_form(found, first.emitter.intensity, first.medium.absorption, first.medium.scattering)


class ScatteredRadiance(Case):
    """Radiance [W/(m^2 sr)] at the origin of a ray of light that was scattered once on the ray: a halo, a beam in fog.

    A point light shines in a medium that fills all space; a directional light enters one that fills a half-space.
    """

    unit = "W/(m^2 sr)"
    varying = "ray"

    quantity: Literal["scattered_radiance"]
    emitter: Annotated[PointEmitter | DirectionalEmitter, Field(discriminator="type")]
    ray: Ray
    medium: Medium
    boundary: HalfSpace | None = None

    def law(self) -> Law:
        """The airlight integral."""
        if isinstance(self.emitter, PointEmitter):
            return Law("integral of sigma_s p(angle) I exp(-sigma_t (t + r)) / r^2 dt", "Chandrasekhar 1960")
        return Law("integral of sigma_s p(angle) E exp(-sigma_t (t + b(t))) dt", "Chandrasekhar 1960")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Radiance (N,), or (N, C)."""
        from oracle import media

        first = together[0]
        if isinstance(first.emitter, PointEmitter) != (first.boundary is None):
            raise InvalidField("/boundary", "belongs to a directional light, and not to a point")
        rays = media.Rays(
            np.array([case.ray.origin for case in together]),
            np.array([case.ray.direction for case in together]),
            np.array([case.ray.length for case in together]),
        )
        emitter, medium = _in_medium(first.emitter, first.medium)
        if isinstance(emitter, emitters.Point):
            found = media.scattered_point(emitter, rays, medium)
        else:
            assert isinstance(emitter, emitters.Directional)
            assert first.boundary is not None
            boundary = media.HalfSpace(np.array(first.boundary.point), np.array(first.boundary.normal))
            found = media.scattered_directional(emitter, rays, medium, boundary)
        return in_form(found, amount_of(first.emitter), first.medium.absorption, first.medium.scattering)


def _in_medium(model: PointEmitter | DirectionalEmitter, medium: Medium) -> tuple[emitters.Emitter, media.Medium]:
    """Emitter and medium with the same number of channels; what is one number is that in all of them."""
    from oracle import media

    amounts = {"medium/absorption": medium.absorption, "medium/scattering": medium.scattering}
    amounts = {"emitter": amount_of(model), **amounts}
    count = max(len(channels(amount)) for amount in amounts.values())
    for name, amount in amounts.items():
        if len(channels(amount)) not in (1, count):
            raise InvalidField(f"/{name}", f"has {len(channels(amount))} channels, another has {count}")
    given, absorption, scattering = (
        tuple(np.broadcast_to(channels(amount), count).tolist()) for amount in amounts.values()
    )
    name = "intensity" if isinstance(model, PointEmitter) else "irradiance"
    with building("medium"):
        built = media.Medium(np.array(absorption), np.array(scattering), medium.asymmetry)
    return emitter_of(model.model_copy(update={name: given})), built
