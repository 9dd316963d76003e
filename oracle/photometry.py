"""Light as the eye weighs it: lumens for watts, and the luminance of RGB."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, finite
from oracle.radiometry import PHOTOMETRIC, RADIOMETRIC, Measure, Quantity
from oracle.spectra import Spectrum, photopic_efficiency, rgb_space

# The SI fixes 683 lm/W at 540 THz, which is 555.016 nm in air. V(lambda) peaks at 555 nm, so that, to be strict, its
# factor is 683.002; the CIE, colour-science and every renderer round to 683, which is 3e-6 less.
LUMINOUS_EFFICACY = 683.0

_REC709 = np.array([0.2126, 0.7152, 0.0722])


def luminous(spectrum: Spectrum) -> float:
    """Photometric value of a spectrum: 683 lm/W times the integral of V(lambda) X(lambda).

    The unit is that of ``X d-lambda`` with lm in place of W: W/nm become lm, W/(m^2 sr nm) become cd/m^2.

    Notes
    -----
    Trapezoids between all samples of the spectrum and of V(lambda), which is given for each nanometre from 360 to
    830 nm; for samples at whole nanometres that is the sum that CIE 15 prescribes.
    """
    return LUMINOUS_EFFICACY * _weighed(spectrum)


def luminous_efficacy(spectrum: Spectrum) -> float:
    """Luminous efficacy of radiation [lm/W]: luminous over radiant value, the latter over all samples given.

    Raises
    ------
    InvalidArgument
        If the spectrum is 0 everywhere.
    """
    radiant = float(np.trapezoid(spectrum.values, spectrum.wavelengths))
    if radiant == 0:
        raise InvalidArgument("spectrum is 0 everywhere, so that it has no efficacy")
    return LUMINOUS_EFFICACY * (_weighed(spectrum) / radiant)


def photometric(measure: Measure, efficacy: float) -> Measure:
    """Photometric counterpart of a radiometric measure, for light of a luminous efficacy [lm/W].

    Radiance in W/(m^2 sr) becomes luminance in cd/m^2, and so on for every quantity.

    Raises
    ------
    InvalidArgument
        If the measure's unit is not that of a radiometric quantity, or the efficacy is not in (0, 683].
    """
    return _converted(measure, _checked(efficacy), RADIOMETRIC, PHOTOMETRIC)


def radiometric(measure: Measure, efficacy: float) -> Measure:
    """Radiometric counterpart of a photometric measure, for light of a luminous efficacy [lm/W].

    Raises
    ------
    InvalidArgument
        If the measure's unit is not that of a photometric quantity, or the efficacy is not in (0, 683].
    """
    return _converted(measure, 1 / _checked(efficacy), PHOTOMETRIC, RADIOMETRIC)


def luminance(rgb: ArrayLike, space: str = "sRGB") -> Floats:
    """Luminance of linear RGB, shape (..., 3), relative to that of white (1, 1, 1), right to a few ulp; shape (...).

    For sRGB and Rec.709 ``0.2126 R + 0.7152 G + 0.0722 B`` [IEC 61966-2-1]; for another colour space of
    colour-science the middle row of its matrix to XYZ.

    Raises
    ------
    InvalidArgument
        If the last axis is not 3, a number is not finite, or colour-science does not know the space.
    """
    colours = finite("rgb", rgb, (3,))
    weights = _REC709 if space == "sRGB" else np.asarray(rgb_space(space).matrix_RGB_to_XYZ[1])
    result: Floats = np.asarray(colours @ weights)
    return result


def _weighed(spectrum: Spectrum) -> float:
    """Integral of V(lambda) times the spectrum."""
    eye = photopic_efficiency()
    low, high = spectrum.wavelengths[[0, -1]]
    samples = np.union1d(spectrum.wavelengths, eye.wavelengths)
    samples = samples[(samples >= low) & (samples <= high)]
    return float(np.trapezoid(eye.at(samples) * spectrum.at(samples), samples))


def _checked(efficacy: float) -> float:
    number = finite("efficacy", efficacy)
    if number.ndim or not 0 < number <= LUMINOUS_EFFICACY:
        raise InvalidArgument(
            f"efficacy is {efficacy} lm/W; it must be a number from 0 to {LUMINOUS_EFFICACY:g}, excluding 0"
        )
    return float(number)


def _converted(measure: Measure, factor: float, given: tuple[Quantity, ...], wanted: tuple[Quantity, ...]) -> Measure:
    for own, other in zip(given, wanted, strict=True):
        if measure.has_unit_of(own):
            return Measure(measure.of(own) * factor, other.unit)
    known = ", ".join(dict.fromkeys(quantity.unit for quantity in given))
    raise InvalidArgument(f"measure has the unit {measure.unit}; expected one of {known}")
