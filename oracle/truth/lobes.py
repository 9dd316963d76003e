"""What glossy surfaces do to light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field

from oracle.bounded import Bounded
from oracle.emitters import Area
from oracle.truth.case import Case, Law, building
from oracle.truth.fields import Fraction, Reflectance, UnitVector
from oracle.truth.light import in_form, receivers_of
from oracle.truth.things import PolygonEmitter, Receiver, RectangleEmitter, channels, emitter_of

Exponent: TypeAlias = Annotated[int, Field(strict=True, ge=0, le=10_000)]


class PhongRadiance(Case):
    """Radiance [W/(m^2 sr)] that a modified Phong lobe reflects from a polygonal light to a viewer."""

    unit = "W/(m^2 sr)"
    varying = "receiver"

    quantity: Literal["phong_radiance"]
    emitter: Annotated[PolygonEmitter | RectangleEmitter, Field(discriminator="type")]
    receiver: Receiver
    towards_viewer: UnitVector
    exponent: Exponent
    reflectance: Reflectance

    def law(self) -> Law:
        """Double-axis moments."""
        return Law("k_s (n + 2) / (2 pi) L integral of max(w . r, 0)^n (w . normal) dw", "Arvo 1995")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Radiance (N,), or (N, C)."""
        from oracle.reflection.phong import reflected_radiance

        first = together[0]
        with building("emitter"):
            emitter = emitter_of(first.emitter)
        assert isinstance(emitter, Area)
        receivers = receivers_of([case.receiver for case in together])
        viewer, rho = np.array(first.towards_viewer), channels(first.reflectance)
        found = reflected_radiance(emitter, receivers, viewer, first.exponent, rho)
        return in_form(found, first.emitter.radiance, first.reflectance)


class PhongAlbedo(Case):
    """Part of the light from one direction that a modified Phong lobe with k_s = 1 reflects: what a furnace shows."""

    unit = "1"
    varying = "cosine"

    quantity: Literal["phong_albedo"]
    cosine: Fraction
    exponent: Exponent

    def law(self) -> Law:
        """The double-axis moment of the hemisphere."""
        return Law("(n + 2) / (2 pi) integral of max(w . r, 0)^n (w . normal) dw", "Arvo 1995")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Albedos (N,)."""
        from oracle.reflection.phong import directional_albedo

        return directional_albedo(np.array([case.cosine for case in together]), together[0].exponent)
