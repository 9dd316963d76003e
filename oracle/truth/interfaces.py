"""What smooth surfaces and slabs do to light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Literal, Self, TypeAlias

import numpy as np

from oracle.bounded import Bounded
from oracle.truth.case import Case, Law
from oracle.truth.fields import Cosine, Fraction, NonNegative, Number

if TYPE_CHECKING:
    from oracle.reflection.interface import Polarised

Polarisation: TypeAlias = Literal["unpolarised", "s", "p"]


class _Interface(Case):
    """A fraction of power at an angle of incidence; `polarisation` is across (s) or in (p) the plane of incidence."""

    unit = "1"
    varying = "cosine"
    formula: ClassVar[str]
    source: ClassVar[str]

    def law(self) -> Law:
        """The law of the quantity."""
        return Law(self.formula, self.source)


class DielectricReflectance(_Interface):
    """Fraction that a smooth dielectric reflects; a negative cosine is light from behind, where the index is `eta`."""

    formula = "r_s = ((n_i cos_i - n_t cos_t) / (n_i cos_i + n_t cos_t))^2, r_p alike, or their mean"
    source = "Fresnel 1823; Born and Wolf 1999"

    quantity: Literal["dielectric_reflectance"]
    cosine: Cosine
    eta: Number
    polarisation: Polarisation = "unpolarised"

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Fractions (N,)."""
        from oracle.reflection.fresnel import dielectric_reflectance

        first = together[0]
        return _chosen(dielectric_reflectance(_cosines(together), first.eta), first.polarisation)


class DielectricTransmittance(_Interface):
    """Fraction of power that a smooth dielectric lets through."""

    formula = "1 - r_s, 1 - r_p, or their mean"
    source = "Fresnel 1823; Born and Wolf 1999"

    quantity: Literal["dielectric_transmittance"]
    cosine: Cosine
    eta: Number
    polarisation: Polarisation = "unpolarised"

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Fractions (N,)."""
        from oracle.reflection.fresnel import dielectric_transmittance

        first = together[0]
        return _chosen(dielectric_transmittance(_cosines(together), first.eta), first.polarisation)


class ConductorReflectance(_Interface):
    """Fraction that a smooth conductor with the relative index ``eta + i k`` reflects."""

    formula = "|r_s|^2 and |r_p|^2 with the index eta + i k, or their mean"
    source = "Fresnel 1823; Born and Wolf 1999"

    quantity: Literal["conductor_reflectance"]
    cosine: Fraction
    eta: NonNegative
    k: NonNegative
    polarisation: Polarisation = "unpolarised"

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Fractions (N,)."""
        from oracle.reflection.fresnel import conductor_reflectance

        first = together[0]
        return _chosen(conductor_reflectance(_cosines(together), first.eta, first.k), first.polarisation)


# What a renderer without polarisation makes of it legitimately differs, hence "ignored".
SlabPolarisation: TypeAlias = Literal["unpolarised", "s", "p", "ignored"]


class SlabReflectance(_Interface):
    """Fraction that a clear slab sends back, with all reflections inside; "ignored" forgets polarisation inside."""

    formula = "2 r / (1 + r) for each polarisation, or their mean; ignored: with the mean r"
    source = "Stokes 1862"

    quantity: Literal["slab_reflectance"]
    cosine: Cosine
    eta: Number
    polarisation: SlabPolarisation = "unpolarised"

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Fractions (N,)."""
        from oracle.reflection.slab import slab_reflectance, slab_without_polarisation

        first = together[0]
        if first.polarisation == "ignored":
            return slab_without_polarisation(_cosines(together), first.eta).reflectance
        return _chosen(slab_reflectance(_cosines(together), first.eta), first.polarisation)


class SlabTransmittance(_Interface):
    """Fraction that a clear slab lets through, with all reflections inside; `polarisation` as for its reflectance."""

    formula = "(1 - r) / (1 + r) for each polarisation, or their mean; ignored: with the mean r"
    source = "Stokes 1862"

    quantity: Literal["slab_transmittance"]
    cosine: Cosine
    eta: Number
    polarisation: SlabPolarisation = "unpolarised"

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Fractions (N,)."""
        from oracle.reflection.slab import slab_transmittance, slab_without_polarisation

        first = together[0]
        if first.polarisation == "ignored":
            return slab_without_polarisation(_cosines(together), first.eta).transmittance
        return _chosen(slab_transmittance(_cosines(together), first.eta), first.polarisation)


_WithCosine: TypeAlias = (
    DielectricReflectance | DielectricTransmittance | ConductorReflectance | SlabReflectance | SlabTransmittance
)


def _chosen(polarised: Polarised, polarisation: str) -> Bounded:
    found: Bounded = getattr(polarised, polarisation)
    return found


def _cosines(together: Sequence[_WithCosine]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([case.cosine for case in together])
