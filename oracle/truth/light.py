"""Light that arrives at a receiver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from oracle.arrays import Floats
from oracle.bounded import Bounded
from oracle.emitters import Area, Directional, Point, Receivers, Spot
from oracle.irradiance import irradiance, projected_solid_angle
from oracle.truth.case import Case, InvalidField, Law, building
from oracle.truth.fields import TwoSided
from oracle.truth.laws import irradiance_of, projected_solid_angle_of
from oracle.truth.things import (
    Emitter,
    Receiver,
    Shape,
    amount_of,
    emitter_of,
    shape_of,
)


class Irradiance(Case):
    """Irradiance [W/m^2] at a receiver, clipped at its horizon, of one emitter or of several together.

    Occluders hide any points and parallel light; from flat emitters only flat ones do.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["emitter"]}, {"required": ["emitters"]}]},
    )
    unit = "W/m^2"
    varying = "receiver"

    quantity: Literal["irradiance"]
    emitter: Emitter | None = None
    emitters: Annotated[tuple[Emitter, ...], Field(min_length=1)] | None = None
    receiver: Receiver
    occluders: tuple[Shape, ...] = ()

    @model_validator(mode="after")
    def _something_shines(self) -> Self:
        if (self.emitter is None) == (self.emitters is None):
            raise ValueError("an irradiance needs either emitter or emitters")
        return self

    def _shining(self) -> dict[str, Emitter]:
        """All emitters by their JSON pointer."""
        if self.emitter is not None:
            return {"emitter": self.emitter}
        return {f"emitters/{index}": emitter for index, emitter in enumerate(self.emitters or ())}

    def law(self) -> Law:
        """The closed form for the kind of emitter; of several, each once."""
        laws = list(dict.fromkeys(irradiance_of(emitter) for emitter in self._shining().values()))
        hidden = "; of what the occluders leave" if self.occluders else ""
        formula = " + ".join(law.formula for law in laws) + hidden
        return Law(formula, "; ".join(dict.fromkeys(law.source for law in laws)))

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Irradiance of shape (N,), or (N, C) if an emitter has channels."""
        first = together[0]
        receivers = receivers_of([case.receiver for case in together])
        shining = first._shining()
        if first.occluders:
            parts = [_past_occluders(first, name, emitter, receivers) for name, emitter in shining.items()]
        else:
            built = []
            for name, emitter in shining.items():
                with building(name):
                    built.append(emitter_of(emitter))
            parts = [irradiance(built, receivers)]
        found = parts[0]
        for part in parts[1:]:
            if part.value.shape != found.value.shape:
                raise InvalidField("/emitters", "their numbers of channels differ")
            found = found + part
        return in_form(found, *(amount_of(emitter) for emitter in shining.values()))


def _past_occluders(case: Irradiance, name: str, emitter: Emitter, receivers: Receivers) -> Bounded:
    """Irradiance (N, C) of what the occluders of a case leave of an emitter."""
    from oracle.visibility import visible, visible_projected_solid_angle

    occluders = []
    for index, occluder in enumerate(case.occluders):
        with building(f"occluders/{index}"):
            occluders.append(shape_of(occluder))
    with building(name):
        built = emitter_of(emitter)
    if isinstance(built, Area):
        factor = visible_projected_solid_angle(built.shape, receivers, occluders, built.two_sided)
        return Bounded(factor.value[:, None], factor.error[:, None]) * built.radiance
    if isinstance(built, Point | Spot | Directional):
        seen = visible(built, receivers.points, occluders)
        return irradiance(built, receivers) * seen[:, None].astype(np.float64)
    raise InvalidField(f"/{name}/type", "what occluders leave is known for points, parallel light and flat shapes only")


class ProjectedSolidAngle(Case):
    """Solid angle [sr] of a shape's front, or both sides, at a receiver, weighted with the receiver's cosine."""

    unit = "sr"
    varying = "receiver"

    quantity: Literal["projected_solid_angle"]
    shape: Shape
    receiver: Receiver
    two_sided: TwoSided = False

    def law(self) -> Law:
        """The closed form for the kind of shape."""
        return projected_solid_angle_of(self.shape)

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Projected solid angles of shape (N,)."""
        with building("shape"):
            built = shape_of(together[0].shape)
        return projected_solid_angle(built, receivers_of([case.receiver for case in together]), together[0].two_sided)


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
