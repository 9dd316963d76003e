"""Units are checked, and what emitters send out obeys the laws that connect its quantities."""

import numpy as np
import pytest

from oracle import radiometry as r
from oracle.arrays import InvalidArgument
from oracle.emitters import Area, Constant, CosineSky, Directional, Line, Point, Receivers, Spot
from oracle.irradiances import irradiance
from oracle.radiometry import Measure, Unit, collected_flux, emitting, exitance, flux, intensity, radiosity
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere

ORIGIN, UP = np.zeros(3), np.array([0.0, 0.0, 1.0])
SPOT = Spot(ORIGIN, UP, [3.0, 5.0], 0.3, 0.7)
LINE = Line(ORIGIN, [0, 2, 0], [3.0, 5.0])
L_SHAPE = Polygon([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]])
TETRAHEDRON = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
SHAPES = [L_SHAPE, Rectangle(ORIGIN, [1, 0, 0], [0, 2, 0]), Disk(ORIGIN, UP, 2.0), Sphere(ORIGIN, 2.0), TETRAHEDRON]
AREAS = [3.0, 8.0, 4 * np.pi, 16 * np.pi, 1.5 + np.sqrt(3) / 2]
# A few roundings of float64.
ROUNDING = 1e-14


def over_all_directions():
    """Directions and weights of a product quadrature of the unit sphere: Gauss in z, trapezoids around it."""
    z, w = np.polynomial.legendre.leggauss(400)
    phi = np.arange(400) * 2 * np.pi / 400
    s = np.sqrt(1 - z * z)[:, None]
    z = np.broadcast_to(z[:, None], (400, 400))
    directions = np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1)
    return directions, np.broadcast_to(w[:, None] * 2 * np.pi / 400, (400, 400))


# ------------------------------------------------------------------------------------------------------ units


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("cd", "lm/sr"),
        ("lx", "lm/m^2"),
        ("nit", "cd/m^2"),
        ("nit", "lm/(m^2 sr)"),
        ("J", "W s"),
        ("W/(m^2 sr)", "W*m^-2*sr^-1"),
        ("mW/cm^2", "W/m^2"),
    ],
)
def test_spellings_of_one_unit_are_alike(one, other):
    assert Unit.parse(one).like(Unit.parse(other))


@pytest.mark.parametrize(
    ("one", "other"), [("W/m^2", "W/(m^2 sr)"), ("W", "lm"), ("W", "W/sr"), ("J", "W"), ("lx", "nit")]
)
def test_units_of_different_quantities_are_not_alike(one, other):
    assert not Unit.parse(one).like(Unit.parse(other))


@pytest.mark.parametrize("text", ["", " ", "W/m^2 sr", "W/m^2/sr", "foo", "W//m", "W/( )", "W^", "2 W", "W/()", "W^0"])
def test_what_is_no_unit_is_refused_with_its_text(text):
    with pytest.raises(InvalidArgument, match="unit"):
        Measure(1, text)


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("mW/cm^2", r.IRRADIANCE, 10.0),
        ("kW/(m^2 sr)", r.RADIANCE, 1000.0),
        ("uW/mm^2", r.EXITANCE, 1.0),
        ("mlm", r.LUMINOUS_FLUX, 0.001),
        ("mcd", r.LUMINOUS_INTENSITY, 0.001),
        ("klx", r.ILLUMINANCE, 1000.0),
        ("mJ", r.RADIANT_ENERGY, 0.001),
        ("W/m^2", r.IRRADIANCE, 1.0),
    ],
)
def test_prefixes_scale(unit, quantity, factor):
    np.testing.assert_allclose(Measure([1.0, 2.0], unit).of(quantity), [factor, 2 * factor], rtol=1e-15)


def test_a_wrong_unit_is_refused_with_argument_unit_given_and_unit_expected():
    with pytest.raises(InvalidArgument, match=r"^light has the unit W/m\^2; radiance is in W/\(m\^2 sr\)$"):
        Measure(1, "W/m^2").of(r.RADIANCE, "light")


def test_photometric_quantities_differ_from_their_counterparts_by_the_lumen():
    for own, other in zip(r.RADIOMETRIC, r.PHOTOMETRIC, strict=True):
        assert Unit.parse(own.unit) * Unit.parse("lm/W") == Unit.parse(other.unit), own


def test_a_measure_holds_finite_numbers_only():
    with pytest.raises(InvalidArgument, match=r"value\[1\]"):
        Measure([1, np.nan], "W")


# ------------------------------------------------------------------------------------------------------- flux


@pytest.mark.parametrize(("shape", "area"), list(zip(SHAPES, AREAS, strict=True)))
def test_flux_of_a_diffuse_surface_is_pi_times_area_times_radiance(shape, area):
    np.testing.assert_allclose(flux(Area(shape, [1, 2])).value, np.pi * area * np.array([1, 2]), rtol=ROUNDING)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_second_side_doubles_the_flux(shape):
    np.testing.assert_array_equal(flux(Area(shape, [1], two_sided=True)).value, 2 * flux(Area(shape, [1])).value)


@pytest.mark.parametrize(
    "emitter",
    [
        Point(ORIGIN, [1, 2]),
        SPOT,
        LINE,
        *(Area(shape, [1, 2]) for shape in SHAPES),
        *(Area(shape, [1, 2], two_sided=True) for shape in SHAPES[:3]),
    ],
)
def test_flux_is_the_integral_of_intensity_over_all_directions(emitter):
    directions, weights = over_all_directions()
    total = np.einsum("ij,ijc->c", weights, intensity(emitter, directions).value)
    # The kinks of intensity limit the quadrature.
    np.testing.assert_allclose(total, flux(emitter).value, rtol=2e-5)


def test_flux_of_a_point_falls_on_a_sphere_around_it():
    point = Point([0.1, 0.2, 0.3], [1.0])
    directions, weights = over_all_directions()
    received = irradiance(point, Receivers(2 * directions, -directions)).value[..., 0]
    np.testing.assert_allclose((weights * received).sum() * 4, flux(point).value[0], rtol=1e-12)


def test_a_spot_with_a_sharp_edge_shines_its_intensity_into_a_cone():
    # Up to the width of its edge, relative to the cone.
    sharp = Spot(ORIGIN, UP, [1], 0.5 - 1e-9, 0.5)
    np.testing.assert_allclose(flux(sharp).value, 4 * np.pi * np.sin(0.25) ** 2, rtol=1e-8)


def test_a_narrow_spot_keeps_its_digits():
    # Series for small angles: pi/3 (b^2 + b c + c^2), with relative corrections of the order of the angle squared.
    b, c = 1e-9, 3e-9
    expected = np.pi / 3 * (b * b + b * c + c * c)
    np.testing.assert_allclose(flux(Spot(ORIGIN, UP, [1], b, c)).value, expected, rtol=ROUNDING)


@pytest.mark.parametrize("emitter", [Directional(UP, [1]), Constant([1]), CosineSky(UP, [1], [1])])
def test_what_is_infinitely_far_away_has_neither_flux_nor_intensity(emitter):
    for ask in (flux, lambda e: intensity(e, UP)):
        with pytest.raises(InvalidArgument, match=type(emitter).__name__):
            ask(emitter)


# ---------------------------------------------------------------------------------- intensity and other conversions


def test_intensity_of_a_sphere_is_the_same_everywhere():
    value = intensity(Area(Sphere([1, 2, 3], 2), [1]), np.eye(3)).value
    np.testing.assert_allclose(value, 4 * np.pi, rtol=ROUNDING)


def test_a_flat_surface_is_dark_from_behind_and_from_the_edge():
    for shape in SHAPES[:3]:
        value = intensity(Area(shape, [1]), [[0, 0, -1], [1, 0, 0]]).value
        np.testing.assert_array_equal(value, 0)


@pytest.mark.parametrize("emitter", [SPOT, LINE, *(Area(shape, [1, 2]) for shape in SHAPES[:4])])
def test_far_away_irradiance_is_intensity_over_squared_distance(emitter):
    towards = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    received = irradiance(emitter, Receivers(1e7 * towards, -towards)).value * 1e14
    # The emitter's size in units of the distance.
    np.testing.assert_allclose(received, intensity(emitter, towards).value, rtol=1e-6)


def test_exitance_is_pi_times_radiance():
    np.testing.assert_allclose(exitance(Area(SHAPES[0], [1, 2])).value, [np.pi, 2 * np.pi], rtol=ROUNDING)


def test_radiosity_adds_what_is_reflected():
    np.testing.assert_allclose(radiosity([1, 2], 0.5, [[3], [5]]), [[2.5, 3.5], [3.5, 4.5]], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((-1, 0, 0), "emitted"),
        ((0, 1.5, 0), "reflectance"),
        ((0, 0, np.nan), "irradiance"),
        (([1, 2], 0, [1, 2, 3]), "fit"),
    ],
)
def test_radiosity_refuses_what_no_surface_has(arguments, name):
    with pytest.raises(InvalidArgument, match=name):
        radiosity(*arguments)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_constant_environment_sends_pi_l_to_each_square_metre(shape):
    environment = Constant([3.0])
    np.testing.assert_allclose(
        collected_flux(environment, shape).value, 3 * flux(Area(shape, [1])).value, rtol=ROUNDING
    )


def test_directional_light_is_caught_by_the_projected_area():
    slanted = Directional([0.6, 0, -0.8], [10.0])
    expected = [10 * 0.8 * 3, 10 * 0.8 * 8, 10 * 0.8 * 4 * np.pi, 10 * 4 * np.pi]
    for shape, value in zip(SHAPES[:4], expected, strict=True):
        np.testing.assert_allclose(collected_flux(slanted, shape).value, value, rtol=ROUNDING)


def test_a_closed_mesh_catches_what_passes_through_its_shadow():
    # Seen along z, the tetrahedron covers half a square metre.
    np.testing.assert_allclose(collected_flux(Directional(-UP, [1]), TETRAHEDRON).value, 0.5, rtol=ROUNDING)


def test_only_shapes_collect_and_only_from_far_away():
    with pytest.raises(InvalidArgument, match="shape"):
        collected_flux(Constant([1]), "disk")
    with pytest.raises(InvalidArgument, match="Point"):
        collected_flux(Point(ORIGIN, [1]), SHAPES[0])


# ------------------------------------------------------------------------------------------------- from a measure


@pytest.mark.parametrize("emitter", [Point(ORIGIN, [0]), SPOT, LINE, *(Area(s, [0], True) for s in SHAPES)])
def test_an_emitter_made_from_a_flux_has_that_flux(emitter):
    made = emitting(emitter, Measure([2000.0, 3000.0], "mW"))
    np.testing.assert_allclose(flux(made).value, [2, 3], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("emitter", "unit", "field", "factor"),
    [
        (Point(ORIGIN, [0]), "W/sr", "intensity", 1),
        (SPOT, "W/sr", "intensity", 1),
        (Area(SHAPES[0], [0]), "W/(m^2 sr)", "radiance", 1),
        (Area(SHAPES[0], [0]), "W/m^2", "radiance", 1 / np.pi),
        (Directional(UP, [0]), "W/m^2", "irradiance", 1),
        (Constant([0]), "W/(m^2 sr)", "radiance", 1),
        (Constant([0]), "W/m^2", "radiance", 1 / np.pi),
    ],
)
def test_the_unit_tells_which_quantity_is_given(emitter, unit, field, factor):
    np.testing.assert_allclose(getattr(emitting(emitter, Measure([7.0], unit)), field), 7 * factor, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("emitter", "unit", "expected"),
    [
        (Point(ORIGIN, [0]), "W/(m^2 sr)", "intensity in W/sr or flux in W"),
        (Area(SHAPES[0], [0]), "W/sr", "radiance in W/(m^2 sr) or exitance in W/m^2 or flux in W"),
        (Directional(UP, [0]), "W", "irradiance in W/m^2"),
        (Point(ORIGIN, [0]), "cd", "photometric"),
    ],
)
def test_a_unit_that_does_not_fit_the_emitter_is_refused(emitter, unit, expected):
    with pytest.raises(InvalidArgument) as caught:
        emitting(emitter, Measure([1.0], unit))
    assert unit in str(caught.value)
    assert expected in str(caught.value)


def test_no_emitter_takes_negative_light():
    with pytest.raises(InvalidArgument, match="measure"):
        emitting(Point(ORIGIN, [0]), Measure([-1.0], "W"))


def test_a_sky_is_not_made_from_one_measure():
    with pytest.raises(InvalidArgument, match="CosineSky"):
        emitting(CosineSky(UP, [1], [1]), Measure([1.0], "W"))
