"""Light that arrives at a receiver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from oracle import emitters as sources
from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.emitters import Receivers
from oracle.irradiances import irradiance
from oracle.truth.case import Case, Law, building
from oracle.truth.fields import Vector
from oracle.truth.laws import irradiance_of
from oracle.truth.things import (
    Emitter,
    Receiver,
    Shape,
    amount_of,
    emitter_of,
    shape_of,
)


class _Lit(Case):
    """What one emitter does, or several together."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["emitter"]}, {"required": ["emitters"]}]},
    )
    unit = "W/m^2"

    emitter: Emitter | None = None
    emitters: Annotated[tuple[Emitter, ...], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _something_shines(self) -> Self:
        if (self.emitter is None) == (self.emitters is None):
            raise ValueError("needs either emitter or emitters")
        return self

    def shining(self) -> dict[str, Emitter]:
        """All emitters by their JSON pointer."""
        if self.emitter is not None:
            return {"emitter": self.emitter}
        return {f"emitters/{index}": emitter for index, emitter in enumerate(self.emitters or ())}

    def built(self) -> list[sources.Emitter]:
        """All emitters of `oracle`; raises InvalidField."""
        result = []
        for name, emitter in self.shining().items():
            with building(name):
                result.append(emitter_of(emitter))
        return result

    def in_form(self, found: Bounded) -> Bounded:
        """A result (..., C) in the form in which the emitters' light was given."""
        return in_form(found, *(amount_of(emitter) for emitter in self.shining().values()))


class Irradiance(_Lit):
    """Irradiance [W/m^2] at a receiver, clipped at its horizon, of one emitter or of several together.

    Occluders hide any points and parallel light; from flat emitters only flat ones do.
    """

    varying = "receiver"

    quantity: Literal["irradiance"]
    receiver: Receiver
    occluders: tuple[Shape, ...] = ()

    def law(self) -> Law:
        """The closed form for the kind of emitter; of several, each once."""
        laws = list(dict.fromkeys(irradiance_of(emitter) for emitter in self.shining().values()))
        hidden = "; of what the occluders leave" if self.occluders else ""
        formula = " + ".join(law.formula for law in laws) + hidden
        return Law(formula, "; ".join(dict.fromkeys(law.source for law in laws)))

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Irradiance of shape (N,), or (N, C) if an emitter has channels."""
        first = together[0]
        occluders = []
        for index, occluder in enumerate(first.occluders):
            with building(f"occluders/{index}"):
                occluders.append(shape_of(occluder))
        receivers = receivers_of([case.receiver for case in together])
        return first.in_form(irradiance(first.built(), receivers, occluders))


class VectorIrradiance(_Lit):
    """Integral of radiance times direction [W/m^2] at a point: three components, with no horizon to clip them."""

    varying = "point"

    quantity: Literal["vector_irradiance"]
    point: Vector

    def law(self) -> Law:
        """The definition."""
        return Law("integral of L w dw", "Gershun 1939")

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Vectors of shape (N, 3), or (N, 3, C) if an emitter has channels."""
        from oracle.vector_irradiances import vector_irradiance

        points = np.array([case.point for case in together])
        return together[0].in_form(vector_irradiance(together[0].built(), points))


def receivers_of(models: Sequence[Receiver]) -> Receivers:
    """Receivers of shape (N,)."""
    points = np.array([model.point for model in models])
    normals = np.array([model.normal for model in models])
    return Receivers(points, normals)


def in_form(found: Bounded, *amounts: float | tuple[float, ...]) -> Bounded:
    """A result (..., C) without its last axis if all that it depends on were single numbers."""
    if any(isinstance(amount, tuple) for amount in amounts):
        return found
    value: Floats = found.value[..., 0]
    return Bounded(value, found.error[..., 0])
