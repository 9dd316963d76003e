"""Light as the eye weighs it, and spectra for colours."""

import subprocess
import sys

import colour
import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.photometry import LUMINOUS_EFFICACY, luminance, luminous, luminous_efficacy, photometric, radiometric
from oracle.radiometry import LUMINANCE, PHOTOMETRIC, RADIOMETRIC, Measure
from oracle.spectra import Spectrum, illuminant, photopic_efficiency, reflectance_rgb, reflectance_spectrum


def line_at(wavelength):
    """A watt within a nanometre around a wavelength."""
    return Spectrum([wavelength - 1, wavelength, wavelength + 1], [0.0, 1.0, 0.0])


def test_a_watt_at_555_nm_is_683_lumens():
    # The triangle's base reaches where V is a little below 1.
    assert luminous(line_at(555)) == pytest.approx(683, rel=1e-12)
    assert luminous_efficacy(line_at(555)) == pytest.approx(683, rel=1e-12)


@pytest.mark.parametrize(("wavelength", "efficiency"), [(510, 0.503), (610, 0.503), (555, 1.0), (400, 0.000396)])
def test_the_eye_weighs_as_the_cie_tabulates(wavelength, efficiency):
    assert photopic_efficiency().at(wavelength) == pytest.approx(efficiency, rel=1e-3)


@pytest.mark.parametrize("name", ["A", "D65", "E", "FL2"])
def test_efficacy_agrees_with_colour_science(name):
    # Colour-science samples V at the illuminant's 5 nm, this package at 1 nm.
    expected = colour.luminous_efficacy(colour.SDS_ILLUMINANTS[name])
    assert luminous_efficacy(illuminant(name)) == pytest.approx(expected, rel=5e-3)


def test_illuminant_a_has_the_efficacy_of_planck_at_2856_kelvin_within_its_range():
    lamp = illuminant("A")
    wavelengths = lamp.wavelengths
    planck = wavelengths**-5 / np.expm1(1.4388e7 / (2856.0 * wavelengths))
    # The table has six digits, and its second radiation constant is an older one.
    assert luminous_efficacy(lamp) == pytest.approx(luminous_efficacy(Spectrum(wavelengths, planck)), rel=1e-3)


def test_what_the_eye_cannot_see_adds_watts_but_no_lumens():
    infrared = Spectrum([900, 1000], [1.0, 1.0])
    assert luminous(infrared) == 0
    assert luminous_efficacy(infrared) == 0


def test_luminous_value_is_linear():
    d65 = illuminant("D65")
    assert luminous(Spectrum(d65.wavelengths, 3 * d65.values)) == pytest.approx(3 * luminous(d65), rel=1e-14)


def test_more_samples_of_the_same_lines_change_nothing():
    # Every sample of V lies on a whole nanometre already.
    coarse = Spectrum([400, 600, 700], [1.0, 2.0, 0.0])
    fine = np.arange(400.0, 701.0)
    assert luminous(Spectrum(fine, coarse.at(fine))) == pytest.approx(luminous(coarse), rel=1e-14)


def test_darkness_has_no_efficacy():
    with pytest.raises(InvalidArgument, match="spectrum"):
        luminous_efficacy(Spectrum([400, 500], [0, 0]))


def test_there_and_back_is_the_same_measure_for_every_quantity():
    for own, other in zip(RADIOMETRIC, PHOTOMETRIC, strict=True):
        there = photometric(Measure([2.0], own.unit), 100.0)
        np.testing.assert_allclose(there.of(other), 200.0, rtol=1e-15)
        np.testing.assert_allclose(radiometric(there, 100.0).of(own), 2.0, rtol=1e-15)


def test_prefixes_are_kept_in_mind():
    value = photometric(Measure(3.0, "mW/(cm^2 sr)"), LUMINOUS_EFFICACY).of(LUMINANCE)
    np.testing.assert_allclose(value, 30 * 683, rtol=1e-14)


@pytest.mark.parametrize(("convert", "unit"), [(photometric, "lm"), (radiometric, "W"), (photometric, "W/m")])
def test_a_measure_of_the_other_kind_is_refused(convert, unit):
    with pytest.raises(InvalidArgument, match=f"unit {unit}; expected"):
        convert(Measure(1.0, unit), 100.0)


@pytest.mark.parametrize("efficacy", [0.0, -1.0, np.nan, 684.0])
def test_no_light_has_such_an_efficacy(efficacy):
    with pytest.raises(InvalidArgument, match="efficacy"):
        photometric(Measure(1.0, "W"), efficacy)


# ---------------------------------------------------------------------------------------------------------- RGB


def test_luminance_weighs_linear_srgb_as_its_standard_says():
    np.testing.assert_allclose(luminance(np.eye(3)), [0.2126, 0.7152, 0.0722], rtol=1e-15)


@pytest.mark.parametrize("space", ["sRGB", "ITU-R BT.709", "ITU-R BT.2020", "ACEScg", "Display P3"])
def test_white_has_luminance_one(space):
    # Some standards round their matrices to four digits.
    np.testing.assert_allclose(luminance([[1, 1, 1]], space), 1, rtol=1e-4)


def test_other_primaries_have_other_weights():
    np.testing.assert_allclose(luminance(np.eye(3), "ITU-R BT.2020"), [0.2627, 0.6780, 0.0593], atol=1e-4)


def test_an_unknown_space_is_refused():
    with pytest.raises(InvalidArgument, match="space is 'nonsense'"):
        luminance([1, 1, 1], "nonsense")


# ------------------------------------------------------------------------------------------------------- spectra


@pytest.mark.parametrize(
    "rgb",
    [(0, 0, 0), (1, 1, 1), (0.5, 0.5, 0.5), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.2, 0.5, 0.7), (0.01, 0.002, 0.03)],
)
def test_a_colour_survives_the_way_through_its_spectrum(rgb):
    spectrum = reflectance_spectrum(rgb)
    # What the docstring promises.
    np.testing.assert_allclose(reflectance_rgb(spectrum), rgb, atol=1e-3)
    assert spectrum.values.min() >= 0
    assert spectrum.values.max() <= 1


def test_a_colour_survives_in_another_space():
    spectrum = reflectance_spectrum((0.3, 0.4, 0.5), "ITU-R BT.2020")
    np.testing.assert_allclose(reflectance_rgb(spectrum, "ITU-R BT.2020"), (0.3, 0.4, 0.5), atol=1e-3)


def test_grey_reflects_all_wavelengths_alike():
    # Up to the tenth of a percent to which the colour is met.
    np.testing.assert_allclose(reflectance_spectrum((0.5, 0.5, 0.5)).values, 0.5, atol=0.02)


def test_a_colour_that_nothing_reflects_is_refused():
    with pytest.raises(InvalidArgument, match="is no reflectance"):
        reflectance_spectrum((0, 1, 0), "ITU-R BT.2020")


@pytest.mark.parametrize("rgb", [(1, 1), (1, 2, 0), (-0.1, 0, 0), (np.nan, 0, 0)])
def test_what_is_no_reflectance_is_refused(rgb):
    with pytest.raises(InvalidArgument, match="rgb"):
        reflectance_spectrum(rgb)


def test_a_reflectance_above_one_is_refused():
    with pytest.raises(InvalidArgument, match="reflectance reaches 2"):
        reflectance_rgb(Spectrum([400, 700], [1, 2]))


@pytest.mark.parametrize(
    ("wavelengths", "values", "name"),
    [
        ([400], [1], "wavelengths"),
        ([400, 400], [1, 1], r"wavelengths\[1\]"),
        ([-1, 400], [1, 1], r"wavelengths\[0\]"),
        ([400, 500], [1], "values"),
        ([400, 500], [1, -1], r"values\[1\]"),
    ],
)
def test_what_is_no_spectrum_is_refused(wavelengths, values, name):
    with pytest.raises(InvalidArgument, match=name):
        Spectrum(wavelengths, values)


def test_an_unknown_illuminant_is_refused():
    with pytest.raises(InvalidArgument, match="D66"):
        illuminant("D66")


def test_colour_science_does_not_change_how_numpy_prints():
    program = (
        "import numpy as np, oracle.spectra as s; before = np.get_printoptions(); s.illuminant('A');"
        "assert np.get_printoptions() == before"
    )
    finished = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr


def test_no_warning_escapes_and_colour_science_waits_until_it_is_needed():
    program = (
        "import sys, oracle.photometry as p, oracle.spectra as s; p.luminance([1, 1, 1]);"
        "assert 'colour' not in sys.modules;"
        "s.reflectance_rgb(s.reflectance_spectrum([.1, .2, .3])); p.luminous(s.illuminant('A'))"
    )
    finished = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    assert not finished.stderr
