"""Spectra: tabulated data, and reflectance spectra for RGB colours, both by colour-science.

Wavelengths are in nanometres. colour-science is loaded when first needed, since that takes a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, finite, light, replace

if TYPE_CHECKING:
    from colour import RGB_Colourspace, SpectralDistribution

# Colour difference at which the search for a reflectance spectrum ends; a hundredth of one that can just be seen.
_DIFFERENCE = 0.0024


@dataclass(frozen=True, eq=False)
class Spectrum:
    """A spectrum, linear between samples and 0 beyond them.

    Wavelengths [nm], shape (N,), N >= 2, strictly increasing; values, shape (N,), at least 0: a reflectance, or a
    radiometric quantity per nanometre.
    """

    wavelengths: Floats
    values: Floats

    def __post_init__(self) -> None:
        wavelengths, values = finite("wavelengths", self.wavelengths), light("values", self.values)
        if wavelengths.ndim != 1 or len(wavelengths) < 2:
            raise InvalidArgument(f"wavelengths has shape {wavelengths.shape}, it must be (N,) with N >= 2")
        if values.shape != wavelengths.shape:
            raise InvalidArgument(f"values has shape {values.shape}, wavelengths has {wavelengths.shape}")
        falling = np.flatnonzero(np.diff(wavelengths) <= 0)
        if wavelengths[0] <= 0 or len(falling):
            index = int(falling[0]) + 1 if len(falling) else 0
            raise InvalidArgument(f"wavelengths[{index}] is {wavelengths[index]}, they must be positive and increase")
        replace(self, wavelengths=wavelengths, values=values)

    def at(self, wavelengths: ArrayLike) -> Floats:
        """Values at other wavelengths [nm] of any shape."""
        asked = finite("wavelengths", wavelengths)
        result: Floats = np.interp(asked, self.wavelengths, self.values, left=0.0, right=0.0)
        return np.asarray(result)


def _load_colour() -> None:
    """Load colour-science, and take back that it makes NumPy print everywhere as its version 1.13 did."""
    options = np.get_printoptions()
    import_module("colour")
    np.set_printoptions(**options)


def illuminant(name: str) -> Spectrum:
    """Relative spectral power of a standard illuminant, such as A, D65 or FL2 [CIE 15].

    Raises
    ------
    InvalidArgument
        If colour-science knows no illuminant of this name.
    """
    _load_colour()
    from colour import SDS_ILLUMINANTS

    return _spectrum(_known("name", name, SDS_ILLUMINANTS))


def photopic_efficiency() -> Spectrum:
    """Spectral luminous efficiency V(lambda) of photopic vision, 360 to 830 nm in steps of 1 nm [CIE 1924]."""
    _load_colour()
    from colour.colorimetry import SDS_LEFS_PHOTOPIC

    return _spectrum(SDS_LEFS_PHOTOPIC["CIE 1924 Photopic Standard Observer"])


def reflectance_spectrum(rgb: ArrayLike, space: str = "sRGB") -> Spectrum:
    """Smooth reflectance spectrum that has a linear RGB colour under its colour space's white.

    Parameters
    ----------
    rgb : array_like
        Linear RGB in [0, 1], shape (3,).
    space : str
        A colour space of colour-science whose white is a CIE illuminant, such as sRGB or ITU-R BT.2020.

    Returns
    -------
    Spectrum
        From 360 to 780 nm in steps of 5 nm, with values in [0, 1].

    Raises
    ------
    InvalidArgument
        If a component lies outside [0, 1], the space or its white is unknown, or no such reflectance was found: a
        wider space than sRGB has colours brighter than any reflectance can be.

    Notes
    -----
    A sigmoid of a quadratic polynomial in the wavelength [Jakob and Hanika 2019], fitted by colour-science, in about
    half a second. `reflectance_rgb` returns the colour within 1e-3, for most colours within 1e-4.
    """
    _load_colour()
    from colour.recovery import XYZ_to_sd_Jakob2019

    colour = finite("rgb", rgb)
    if colour.shape != (3,):
        raise InvalidArgument(f"rgb has shape {colour.shape}, it must be (3,)")
    outside = np.flatnonzero((colour < 0) | (colour > 1))
    if len(outside):
        raise InvalidArgument(f"rgb[{outside[0]}] is {colour[outside[0]]}, reflectance lies in [0, 1]")
    chosen, observer, white = _observed(space)
    fitted, difference = XYZ_to_sd_Jakob2019(
        chosen.matrix_RGB_to_XYZ @ colour, observer, white, {"max_error": _DIFFERENCE}, additional_data=True
    )
    if difference > 10 * _DIFFERENCE:
        raise InvalidArgument(
            f"rgb {colour.tolist()} in {space} is no reflectance; the nearest differs by {difference:.2g}"
        )
    return _spectrum(fitted)


def reflectance_rgb(reflectance: Spectrum, space: str = "sRGB") -> Floats:
    """Linear RGB, shape (3,), of a reflectance under the white of a colour space, for the CIE 1931 observer.

    Components of colours outside the space's gamut are negative. Wavelengths from 360 to 780 nm in steps of 5 nm
    count; a spectrum that ends before is 0 there.

    Raises
    ------
    InvalidArgument
        If a value exceeds 1, or the space or its white is unknown.
    """
    _load_colour()
    from colour import SpectralDistribution
    from colour.colorimetry import sd_to_XYZ_integration

    if (reflectance.values > 1).any():
        raise InvalidArgument(f"reflectance reaches {reflectance.values.max()}, it must lie in [0, 1]")
    chosen, observer, white = _observed(space)
    sampled = SpectralDistribution(reflectance.at(white.wavelengths), white.wavelengths)
    xyz = sd_to_XYZ_integration(sampled, observer, white) / 100
    result: Floats = chosen.matrix_XYZ_to_RGB @ xyz
    return result


def rgb_space(name: str) -> RGB_Colourspace:
    """Return a colour space of colour-science by its name.

    Raises
    ------
    InvalidArgument
        If there is none.
    """
    _load_colour()
    from colour import RGB_COLOURSPACES

    space: RGB_Colourspace = _known("space", name, RGB_COLOURSPACES)
    return space


def _observed(space: str) -> tuple[RGB_Colourspace, Any, SpectralDistribution]:
    """A colour space, the CIE 1931 observer, and the space's white on the observer's wavelengths."""
    _load_colour()
    from colour import MSDS_CMFS, SDS_ILLUMINANTS
    from colour.recovery.jakob2019 import SPECTRAL_SHAPE_JAKOB2019

    chosen = rgb_space(space)
    white = _known("space's white", chosen.whitepoint_name, SDS_ILLUMINANTS).copy().align(SPECTRAL_SHAPE_JAKOB2019)
    return chosen, MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(SPECTRAL_SHAPE_JAKOB2019), white


def _known(argument: str, name: str | None, table: Any) -> Any:
    if name not in table:
        raise InvalidArgument(f"{argument} is {name!r}; known are {', '.join(sorted(table))}")
    return table[name]


def _spectrum(distribution: SpectralDistribution) -> Spectrum:
    return Spectrum(finite("wavelengths", distribution.wavelengths), finite("values", distribution.values))
