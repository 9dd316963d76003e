"""Laws of rough surfaces: normalisation, reciprocity, energy, and a second opinion from another renderer."""

import numpy as np
import pytest
from scipy.special import erfc

from oracle.arrays import InvalidArgument
from oracle.reflection.albedo import (
    average_albedo,
    directional_albedo,
    directional_reflectance,
    directional_transmittance,
    furnace_loss,
)
from oracle.reflection.fresnel import conductor_reflectance, dielectric_reflectance, diffuse_reflectance
from oracle.reflection.microfacet import (
    GGX,
    Beckmann,
    masking,
    masking_shadowing,
    normal_density,
    visible_normal_density,
)
from oracle.reflection.rough import RoughConductor, RoughDielectric, RoughMirror, bsdf

DISTRIBUTIONS = [GGX(0.5), GGX(0.2, 0.7), Beckmann(0.3), Beckmann(0.6, 0.25)]
KINDS = pytest.mark.parametrize("kind", [GGX, Beckmann])


def direction_of(theta, phi):
    return np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)


def direction(degrees, azimuth=0.0):
    return np.array(direction_of(np.radians(degrees), np.radians(azimuth)))


def facets(distribution, radial=240, around=240):
    """Normals of the upper hemisphere and their weights D cos d(omega), dense where the distribution is."""
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    # Slopes tan(v) times alpha, so that GGX's long tail ends at pi/2.
    v, weights = (nodes + 1) * np.pi / 4, weights * np.pi / 4
    phi = (np.arange(around) + 0.5) * 2 * np.pi / around
    a_x, a_y = (float(a) for a in distribution.alphas)
    t = np.tan(v)[:, None]
    slopes = np.stack(np.broadcast_arrays(-a_x * t * np.cos(phi), -a_y * t * np.sin(phi), 1.0), axis=-1)
    normals = slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
    # The slopes' area, and cos^3 from there to solid angle.
    area = a_x * a_y * t / np.cos(v)[:, None] ** 2 * weights[:, None] * 2 * np.pi / around
    return normals, area * normals[..., 2] ** 3


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_facets_cover_the_surface_once(distribution):
    normals, solid_angles = facets(distribution)
    total = np.sum(normal_density(distribution, normals).value * normals[..., 2] * solid_angles)
    assert total == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("w", [direction(0), direction(40, 30), direction(75, 80)])
def test_seen_facets_cover_what_is_seen_of_the_surface(distribution, w):
    normals, solid_angles = facets(distribution, 160, 320)
    facing = np.maximum(normals @ w, 0)
    total = np.sum(normal_density(distribution, normals).value * facing * solid_angles)
    # The sum of the facing facets' areas has a kink where they turn away.
    assert masking(distribution, w).value * total == pytest.approx(w[2], rel=1e-3)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_visible_normals_are_a_density(distribution):
    normals, solid_angles = facets(distribution, 160, 320)
    total = np.sum(visible_normal_density(distribution, direction(70, 20), normals).value * solid_angles)
    # As above.
    assert total == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_normal_light_and_eye_see_every_facet(distribution):
    up = direction(0)
    assert masking_shadowing(distribution, up, up).value == 1
    assert masking_shadowing(distribution, up, up, separable=True).value == 1


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_correlated_masking_lies_between_separable_and_the_smaller_of_both(distribution):
    i, o = direction(70, 10), direction(50, 200)
    correlated = masking_shadowing(distribution, i, o).value
    assert masking_shadowing(distribution, i, o, separable=True).value < correlated
    assert correlated < min(masking(distribution, w).value for w in (i, o))


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("separable", [False, True])
def test_reflection_is_reciprocal(distribution, separable):
    i, o = direction(70, 10), direction(50, 200)
    for material in (
        RoughMirror(distribution, separable),
        RoughConductor(distribution, 0.2, 3.9, separable),
        RoughDielectric(distribution, 1.5, separable),
    ):
        assert bsdf(material, i, o).value == pytest.approx(bsdf(material, o, i).value, rel=1e-13)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_transmission_is_reciprocal_up_to_the_squared_indices(distribution):
    i, o = direction(40, 10), -direction(20, 30)
    material = RoughDielectric(distribution, 1.5)
    there, back = bsdf(material, i, o).value, bsdf(material, o, i).value
    assert there > 0
    assert there == pytest.approx(1.5**2 * back, rel=1e-12)


def test_nothing_is_reflected_along_or_below_the_surface():
    below = -direction(30)
    along = np.array([1.0, 0.0, 0.0])
    for material in (RoughMirror(GGX(0.5)), RoughConductor(GGX(0.5), 0.2, 3.9)):
        for pair in ((below, below), (direction(30), below), (direction(30), along), (along, along)):
            assert bsdf(material, *pair).value == 0


def test_turning_the_roughness_turns_the_lobe():
    i, o = direction(40, 10), direction(60, 170)
    turned = [w @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) for w in (i, o)]
    # x becomes y: what was rough along x is rough along y.
    before = bsdf(RoughMirror(GGX(0.2, 0.6)), i, o).value
    assert bsdf(RoughMirror(GGX(0.6, 0.2)), *turned).value == pytest.approx(before, rel=1e-13)


# ------------------------------------------------------------------------------------------------------- albedos


def seen_from(kind, alpha, z):
    """Smith's Lambda as the papers write it."""
    a = z / (alpha * np.sqrt(1 - z**2))
    if kind is GGX:
        return (np.sqrt(1 + a**-2) - 1) / 2
    return (np.exp(-(a**2)) / (a * np.sqrt(np.pi)) - erfc(a)) / 2


def slopes(kind, alpha, w, radial=200, around=400):
    """Facets over the plane of slopes and how many w sees of each, with their weights; they add up to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    v, weights = (nodes + 1) * np.pi / 4, weights * np.pi / 4
    phi = (np.arange(around) + 0.5) * np.pi / around
    t = np.tan(v)[:, None]
    density = 1 / (1 + t**2) ** 2 if kind is GGX else np.exp(-(t**2))
    share = density * t / np.cos(v)[:, None] ** 2 * weights[:, None] * 2 / around
    m = np.stack(np.broadcast_arrays(-alpha * t * np.cos(phi), -alpha * t * np.sin(phi), 1.0), axis=-1)
    m /= np.linalg.norm(m, axis=-1, keepdims=True)
    cosine = m @ w
    return m, np.maximum(cosine, 0), share * np.maximum(cosine, 0) / m[..., 2] / w[2]


@KINDS
@pytest.mark.parametrize(("alpha", "degrees"), [(0.2, 20), (0.5, 75), (1.0, 60)])
def test_reflected_power_is_the_sum_over_the_microfacets(kind, alpha, degrees):
    w = direction(degrees)
    m, cosine, seen = slopes(kind, alpha, w)
    z = 2 * cosine * m[..., 2] - w[2]
    ours, theirs = seen_from(kind, alpha, w[2]), seen_from(kind, alpha, np.clip(z, 1e-12, 1 - 1e-15))
    fresnel = conductor_reflectance(np.minimum(cosine, 1), 0.2, 3.9).unpolarised.value
    for f, make in ((1.0, RoughMirror), (fresnel, lambda *of: RoughConductor(of[0], 0.2, 3.9, of[1]))):
        for separable, g in ((False, 1 / (1 + ours + theirs)), (True, 1 / (1 + ours) / (1 + theirs))):
            expected = np.sum(np.where(z > 0, seen * g * f, 0.0))
            albedo = directional_albedo(make(kind(alpha), separable), w[2])
            # The sum has a kink where reflected rays meet the horizon.
            assert albedo.value == pytest.approx(expected, abs=2e-4)


@KINDS
@pytest.mark.parametrize(
    ("alpha", "degrees", "eta", "separable"), [(0.3, 40, 1.5, False), (0.6, 70, 1.33, True), (0.4, 30, 1 / 1.5, False)]
)
def test_power_at_a_dielectric_is_the_sum_over_the_microfacets(kind, alpha, degrees, eta, separable):
    w = direction(degrees)
    m, cosine, seen = slopes(kind, alpha, w)
    reflectance = dielectric_reflectance(np.minimum(cosine, 1), eta).unpolarised.value
    refracted = np.sqrt(np.maximum(1 - (1 - cosine**2) / eta**2, 0))
    mirrored = 2 * cosine * m[..., 2] - w[2]
    onwards = w[2] / eta - (cosine / eta - refracted) * m[..., 2]
    ours = seen_from(kind, alpha, w[2])
    found = []
    for z, f in ((mirrored, reflectance), (onwards, 1 - reflectance)):
        theirs = seen_from(kind, alpha, np.clip(z, 1e-12, 1 - 1e-15))
        g = 1 / (1 + ours) / (1 + theirs) if separable else 1 / (1 + ours + theirs)
        found.append(np.sum(np.where(z > 0, seen * f * g, 0.0)))
    material = RoughDielectric(kind(alpha), eta, separable)
    # Kinks at the horizon and at the critical angle.
    assert directional_reflectance(material, w[2]).value == pytest.approx(found[0], abs=3e-4)
    assert directional_transmittance(material, w[2]).value == pytest.approx(found[1], abs=3e-4)


@KINDS
@pytest.mark.parametrize(
    ("make", "side", "level", "accuracy"),
    [
        (lambda d: RoughMirror(d, separable=True), 1, 0.8, 1e-10),
        (lambda d: RoughConductor(d, 0.2, 3.9), 1, 0.8, 1e-10),
        (lambda d: RoughDielectric(d, 1.5), 1, 0.8, 1e-10),
        # Refraction ends at edges: of azimuth, and at the level from where only overhanging facets would send light.
        (lambda d: RoughDielectric(d, 1.5), -1, np.arccos(direction(50)[2] / 1.5), 1e-5),
        (lambda d: RoughDielectric(d, 1 / 1.5, separable=True), -1, np.arccos(direction(50)[2] * 1.5), 1e-5),
    ],
)
def test_albedo_is_the_integral_of_the_bsdf(kind, make, side, level, accuracy):
    w, material = direction(50), make(kind(0.4))
    nodes, weights = np.polynomial.legendre.leggauss(60)
    theta = np.concatenate([a + (b - a) * (nodes + 1) / 2 for a, b in ((0, level), (level, np.pi / 2))])
    phi = (nodes + 1) * np.pi / 2
    o = np.stack(np.broadcast_arrays(*direction_of(theta[:, None], phi)), axis=-1)
    o[..., 2] *= side
    rings = np.concatenate([level * weights, (np.pi / 2 - level) * weights]) / 2 * np.sin(theta) * np.cos(theta)
    total = rings @ bsdf(material, w, o).value @ (weights * np.pi)
    function = directional_reflectance if side == 1 else directional_transmittance
    assert function(material, w[2]).value == pytest.approx(total, abs=accuracy)


def test_roughest_ggx_mirror_seen_from_above():
    albedo = directional_albedo(RoughMirror(GGX(1.0)), 1.0)
    assert abs(albedo.value - (1 - np.log(2))) <= albedo.error < 1e-12


def test_separable_masking_loses_more():
    cosine = np.cos(np.radians(75))
    losses = [furnace_loss(RoughMirror(GGX(0.5), separable), cosine).value for separable in (False, True)]
    # By quadrature of the BRDF over both angles with mpmath, in 15 digits.
    assert losses == pytest.approx([1 - 0.761369925256459, 1 - 0.723399847815241], rel=1e-13)


@KINDS
def test_no_surface_returns_more_than_it_gets(kind):
    alpha, cosine = np.array([1e-2, 0.7])[:, None], np.cos(np.radians([0, 60, 89.9]))
    for sign in (1, -1):
        albedo = directional_albedo(RoughDielectric(kind(alpha), 1.5), sign * cosine)
        assert (albedo.value <= 1 + albedo.error).all()
        assert (albedo.value > 0.4).all()


@KINDS
def test_smooth_limit_is_fresnels_reflectance(kind):
    cosine = np.cos(np.radians([0, 30, 60]))
    material = RoughDielectric(kind(1e-4), 1.5)
    # What roughness changes is of the order of its square.
    np.testing.assert_allclose(
        directional_reflectance(material, cosine).value,
        dielectric_reflectance(cosine, 1.5).unpolarised.value,
        atol=1e-6,
    )
    np.testing.assert_allclose(directional_albedo(material, cosine).value, 1, atol=1e-6)


def test_average_albedo_is_the_mean_of_directional_ones():
    nodes, weights = np.polynomial.legendre.leggauss(40)
    cosine, weights = (nodes + 1) / 2, weights / 2
    mean = np.sum(2 * cosine * weights * directional_albedo(RoughMirror(GGX(0.7)), cosine).value)
    average = average_albedo(RoughMirror(GGX(0.7)))
    # The albedo's derivative is infinite along the surface.
    assert average.value == pytest.approx(mean, abs=1e-6)
    assert average.error < 1e-11


def test_diffuse_light_is_reflected_alike_by_a_nearly_smooth_interface():
    cosine, weights = np.polynomial.legendre.leggauss(60)
    cosine, weights = (cosine + 1) / 2, weights / 2
    reflected = directional_reflectance(RoughDielectric(GGX(1e-3), 1.5), cosine).value
    # GGX's tail, of the order of alpha.
    assert np.sum(2 * cosine * weights * reflected) == pytest.approx(float(diffuse_reflectance(1.5).value), abs=1e-3)


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (lambda: GGX([0.1, 0.0]), r"alpha\[1\] is 0.0"),
        (lambda: Beckmann(0.1, -1), r"alpha_y is -1"),
        (lambda: normal_density(GGX(0.1), [0, 0, 3]), "length 3"),
        (lambda: visible_normal_density(GGX(0.1), [0, 0, -1], [0, 0, 1]), "from above"),
        (lambda: masking(GGX([0.1, 0.2]), np.eye(3)), "do not fit together"),
        (lambda: RoughDielectric(GGX(0.1), 1.0), "eta is 1"),
        (lambda: RoughConductor(GGX(0.1), 0.2, np.nan), "k is nan"),
        (lambda: directional_albedo(RoughMirror(GGX(0.1, 0.2)), 0.5), "isotropic"),
        (lambda: directional_albedo(RoughMirror(GGX(0.1)), 0.0), "from 1e-6"),
        (lambda: directional_albedo(RoughMirror(GGX(0.1)), -0.5), "side of the light"),
    ],
)
def test_impossible_arguments_are_refused(call, complaint):
    with pytest.raises(InvalidArgument, match=complaint):
        call()


# ------------------------------------------------------------------------------------------------ second opinion


@pytest.fixture(scope="module")
def mitsuba():
    module = pytest.importorskip("mitsuba")
    module.set_variant("scalar_rgb")
    return module


def opinion(mitsuba, description, incoming, outgoing):
    """Mitsuba's BSDF; it traces from the eye, and its value holds the cosine at the light."""
    surface = mitsuba.SurfaceInteraction3f()
    surface.wi = [float(x) for x in outgoing]
    value = mitsuba.load_dict(description).eval(mitsuba.BSDFContext(), surface, [float(x) for x in incoming])
    return float(np.array(value)[0]) / abs(incoming[2])


@pytest.mark.parametrize(("kind", "name", "tolerance"), [(GGX, "ggx", 1e-4), (Beckmann, "beckmann", 1e-2)])
@pytest.mark.parametrize("o", [direction(50, 190), direction(20, 100)])
def test_rough_conductor_agrees_with_mitsuba(mitsuba, kind, name, tolerance, o):
    i = direction(40, 10)
    description = {"type": "roughconductor", "distribution": name, "alpha_u": 0.3, "alpha_v": 0.5}
    description |= {"eta": {"type": "rgb", "value": 0.2}, "k": {"type": "rgb", "value": 3.9}}
    ours = bsdf(RoughConductor(kind(0.3, 0.5), 0.2, 3.9, separable=True), i, o).value
    # Single precision; and Mitsuba's Beckmann masking is a rational fit.
    assert ours == pytest.approx(opinion(mitsuba, description, i, o), rel=tolerance)


@pytest.mark.parametrize(("kind", "name", "tolerance"), [(GGX, "ggx", 1e-4), (Beckmann, "beckmann", 1e-2)])
@pytest.mark.parametrize(
    ("i", "o"),
    [
        (direction(40, 10), direction(50, 190)),
        (-direction(40, 10), -direction(50, 190)),
        (direction(40, 10), -direction(30, 180)),
        (-direction(20, 10), direction(30, 180)),
    ],
)
def test_rough_dielectric_agrees_with_mitsuba(mitsuba, kind, name, tolerance, i, o):
    description = {"type": "roughdielectric", "distribution": name, "alpha": 0.4, "int_ior": 1.5, "ext_ior": 1.0}
    ours = bsdf(RoughDielectric(kind(0.4), 1.5, separable=True), i, o).value
    # As above.
    assert ours == pytest.approx(opinion(mitsuba, description, i, o), rel=tolerance)
