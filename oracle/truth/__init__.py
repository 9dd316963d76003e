"""Questions to the closed forms as data: cases, and their evaluation.

A case is what a JSON object says: a quantity, and all that it depends on. `evaluate` answers many cases at a time.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias, get_args

from pydantic import Field

from oracle.truth.case import Case, InvalidField, Law
from oracle.truth.enclosures import ClosedBox, ConcentricSpheres, IntegratingSphere, ParallelPlates, Radiosity
from oracle.truth.evaluate import Answer, evaluate
from oracle.truth.interfaces import (
    ConductorReflectance,
    DielectricReflectance,
    DielectricTransmittance,
    SlabReflectance,
    SlabTransmittance,
)
from oracle.truth.light import Irradiance, VectorIrradiance
from oracle.truth.lobes import PhongAlbedo, PhongRadiance
from oracle.truth.media import AttenuatedIrradiance, ScatteredRadiance, Transmittance
from oracle.truth.microfacets import MicrofacetAlbedo, MicrofacetAverageAlbedo
from oracle.truth.solid_angle import ProjectedSolidAngle, SolidAngle
from oracle.truth.view_factor import ViewFactor

__all__ = ["KINDS", "Answer", "AnyCase", "Case", "InvalidField", "Law", "evaluate"]

AnyCase: TypeAlias = Annotated[
    Irradiance
    | VectorIrradiance
    | SolidAngle
    | ProjectedSolidAngle
    | ViewFactor
    | ClosedBox
    | ParallelPlates
    | ConcentricSpheres
    | IntegratingSphere
    | Radiosity
    | DielectricReflectance
    | DielectricTransmittance
    | ConductorReflectance
    | SlabReflectance
    | SlabTransmittance
    | PhongRadiance
    | PhongAlbedo
    | MicrofacetAlbedo
    | MicrofacetAverageAlbedo
    | Transmittance
    | AttenuatedIrradiance
    | ScatteredRadiance,
    Field(discriminator="quantity"),
]

# The kinds of cases by the word that `quantity` holds.
KINDS: dict[str, type[Case]] = {
    get_args(kind.model_fields["quantity"].annotation)[0]: kind for kind in get_args(get_args(AnyCase)[0])
}
