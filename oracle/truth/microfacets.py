"""Albedos of rough surfaces: what a right implementation of single scattering shows in a furnace."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field

from oracle.bounded import Bounded
from oracle.truth.case import Case, Law, building
from oracle.truth.fields import Cosine, Model, NonNegative, Number

if TYPE_CHECKING:
    from oracle.reflection import rough


class _Material(Model):
    """Isotropic roughness: Smith's masking and shadowing, height-correlated unless `separable`."""

    distribution: Literal["ggx", "beckmann"]
    alpha: NonNegative
    separable: Annotated[bool, Field(strict=True)] = False


class RoughMirror(_Material):
    """Microfacets that reflect everything."""

    type: Literal["mirror"] = "mirror"


class RoughConductor(_Material):
    """Microfacets of a conductor with the relative index ``eta + i k``."""

    type: Literal["conductor"] = "conductor"
    eta: NonNegative
    k: NonNegative


class RoughDielectric(_Material):
    """Microfacets of a dielectric with the index `eta` behind relative to in front."""

    type: Literal["dielectric"] = "dielectric"
    eta: Number


Material: TypeAlias = Annotated[RoughMirror | RoughConductor | RoughDielectric, Field(discriminator="type")]
_LAW = Law("integral of D G2 F / (4 cos_i cos_o) cos_o do, and of refraction", "Walter et al. 2007; Heitz 2014")


class MicrofacetAlbedo(Case):
    """Part of the light from one direction that leaves a rough surface, reflected or refracted once."""

    unit = "1"
    varying = "cosine"

    quantity: Literal["microfacet_albedo"]
    material: Material
    cosine: Cosine

    def law(self) -> Law:
        """The integral over the model."""
        return _LAW

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Albedos (N,)."""
        from oracle.reflection.albedo import directional_albedo

        with building("material"):
            material = _material_of(together[0].material)
        return directional_albedo(material, np.array([case.cosine for case in together]))


class MicrofacetAverageAlbedo(Case):
    """Part of diffuse light that leaves a rough surface, reflected or refracted once."""

    unit = "1"

    quantity: Literal["microfacet_average_albedo"]
    material: Material

    def law(self) -> Law:
        """The mean over directions."""
        return Law(f"2 integral of albedo(c) c dc, albedo(c) = {_LAW.formula}", _LAW.source)

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """The same value for each case."""
        from oracle.reflection.albedo import average_albedo

        with building("material"):
            found = average_albedo(_material_of(together[0].material))
        count = (len(together),)
        return Bounded(np.broadcast_to(found.value, count), np.broadcast_to(found.error, count))


def _material_of(model: Material) -> rough.Material:
    from oracle.reflection import rough
    from oracle.reflection.microfacet import GGX, Beckmann

    kind = GGX if model.distribution == "ggx" else Beckmann
    distribution = kind(np.array(model.alpha))
    match model:
        case RoughMirror():
            return rough.RoughMirror(distribution, model.separable)
        case RoughConductor():
            return rough.RoughConductor(distribution, np.array(model.eta), np.array(model.k), model.separable)
        case RoughDielectric():
            return rough.RoughDielectric(distribution, np.array(model.eta), model.separable)
