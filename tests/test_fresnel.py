"""Laws of reflection and refraction at smooth interfaces and slabs."""

import numpy as np
import pytest

from oracle.arrays import InvalidArgument
from oracle.reflection.fresnel import (
    brewster_angle,
    conductor_reflectance,
    critical_angle,
    dielectric_reflectance,
    dielectric_transmittance,
    diffuse_reflectance,
    reflect,
    refract,
    refracted_cosine,
)
from oracle.reflection.slab import slab_reflectance, slab_transmittance, slab_without_polarisation

COSINES = np.concatenate([np.linspace(0.001, 1, 41), [1e-9]])
INDICES = np.array([0.4, 0.75, 1 - 1e-9, 1 + 1e-12, 1.33, 1.5, 2.4, 1e3])[:, None]
# A dozen roundings.
ROUNDING = 1e-14


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_glass_reflects_four_percent_of_normal_light():
    assert dielectric_reflectance(1, 1.5).unpolarised.value == pytest.approx(0.04, rel=ROUNDING)


def test_reflectance_of_a_barely_visible_interface_keeps_its_digits():
    # ((eta - 1)/(eta + 1))^2 for eta = 1 + 2^-40.
    expected = (2.0**-40 / (2 + 2.0**-40)) ** 2
    assert dielectric_reflectance(1, 1 + 2.0**-40).unpolarised.value == pytest.approx(expected, rel=ROUNDING)


def test_interface_between_equal_media_is_not_there():
    cosine = np.array([1, 0.3, 0, -0.2])
    assert (dielectric_reflectance(cosine, 1).unpolarised.value == 0).all()
    assert (dielectric_transmittance(cosine, 1).unpolarised.value == 1).all()


@pytest.mark.parametrize("polarisation", ["s", "p", "unpolarised"])
def test_what_a_dielectric_does_not_reflect_passes(polarisation):
    for side in (1, -1):
        reflected = getattr(dielectric_reflectance(side * COSINES, INDICES), polarisation).value
        passed = getattr(dielectric_transmittance(side * COSINES, INDICES), polarisation).value
        np.testing.assert_allclose(reflected + passed, 1, rtol=0, atol=ROUNDING)


def test_reflectance_is_the_same_along_the_refracted_ray():
    behind = refracted_cosine(COSINES, 1.5).value
    there, back = dielectric_reflectance(COSINES, 1.5), dielectric_reflectance(-behind, 1.5)
    # The rounded cosine behind, amplified where the reflectance is steep: up to 1/cos(critical) and Brewster's zero.
    np.testing.assert_allclose(back.s.value, there.s.value, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(back.p.value[10:-1], there.p.value[10:-1], rtol=1e-10, atol=1e-15)


def test_light_from_behind_sees_the_inverse_index():
    behind, front = dielectric_reflectance(-0.9, 2.0), dielectric_reflectance(0.9, 0.5)
    assert behind.p.value == pytest.approx(front.p.value, rel=ROUNDING)


def test_parallel_polarised_light_is_not_reflected_at_brewsters_angle():
    eta = INDICES[:, 0]
    # The rounded cosine misses the zero by half an ulp, which large indices multiply.
    assert (dielectric_reflectance(np.cos(brewster_angle(eta)), eta).p.value < 1e-31 * np.maximum(eta, 1) ** 2).all()


def test_all_light_is_reflected_beyond_the_critical_angle_and_not_before():
    angle = critical_angle(1.5)
    assert dielectric_reflectance(-np.cos(angle + 1e-9), 1.5).unpolarised.value == 1
    assert dielectric_transmittance(-np.cos(angle + 1e-9), 1.5).unpolarised.value == 0
    assert dielectric_reflectance(-np.cos(angle - 1e-9), 1.5).unpolarised.value < 1 - 1e-5


def test_critical_angle_keeps_its_digits_for_nearly_equal_media():
    # pi/2 - sqrt(2 d), to first order in d.
    assert np.pi / 2 - critical_angle(1 + 2.0**-50) == pytest.approx(np.sqrt(2 * 2.0**-50), rel=1e-7)


def test_conductor_without_absorption_is_a_dielectric():
    conductor, dielectric = conductor_reflectance(COSINES, 1.5, 0), dielectric_reflectance(COSINES, 1.5)
    np.testing.assert_array_equal(conductor.unpolarised.value, dielectric.unpolarised.value)


def test_conductor_at_normal_incidence():
    # ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2), written out for 0.2 + 3i.
    expected = (0.64 + 9) / (1.44 + 9)
    assert conductor_reflectance(1, 0.2, 3).unpolarised.value == pytest.approx(expected, rel=ROUNDING)


def test_grazing_light_is_reflected_by_everything():
    assert dielectric_reflectance(0, INDICES).unpolarised.value == pytest.approx(np.ones_like(INDICES), rel=ROUNDING)
    assert conductor_reflectance(0, [0.2, 2], [3, 0.1]).unpolarised.value == pytest.approx([1, 1], rel=ROUNDING)


def test_refracted_ray_obeys_snell_and_stays_in_the_plane():
    random = np.random.default_rng(3)
    w, n = unit(random.normal(size=(2, 1000, 3)))
    t = refract(w, n, 1.5)
    ratio = np.where(np.sum(w * n, axis=-1) > 0, 1.5, 1 / 1.5)
    passes = np.any(t != 0, axis=-1)
    assert 500 < passes.sum() < 1000
    np.testing.assert_allclose(np.linalg.norm(t[passes], axis=-1), 1, atol=1e-11)
    np.testing.assert_allclose((np.cross(n, w) + ratio[:, None] * np.cross(n, t))[passes], 0, atol=ROUNDING)
    assert (np.sum(w * n, axis=-1) * np.sum(t * n, axis=-1))[passes].max() < 0


def test_mirrored_ray_leaves_at_the_same_angle_on_the_same_side():
    random = np.random.default_rng(3)
    w, n = unit(random.normal(size=(2, 100, 3)))
    r = reflect(w, n)
    np.testing.assert_allclose(np.sum(r * n, axis=-1), np.sum(w * n, axis=-1), atol=ROUNDING)
    np.testing.assert_allclose(np.cross(n, r + w), 0, atol=ROUNDING)


def test_diffuse_light_through_an_interface_is_reciprocal():
    # The same power passes both ways through a furnace whose radiance is as n^2.
    outside, inside = diffuse_reflectance(1.5).value, diffuse_reflectance(1 / 1.5).value
    assert 1 - inside == pytest.approx((1 - outside) / 1.5**2, rel=ROUNDING)


@pytest.mark.parametrize("eta", [1.5, 1 / 1.5, 4.0])
def test_diffuse_reflectance_is_the_mean_over_the_hemisphere(eta):
    cosine = (np.arange(200_000) + 0.5) / 200_000
    mean = np.mean(2 * cosine * dielectric_reflectance(cosine, eta).unpolarised.value)
    # The midpoint rule, with a kink at the critical angle.
    assert diffuse_reflectance(eta).value == pytest.approx(mean, abs=1e-7)


def test_slab_keeps_all_light():
    reflected, passed = slab_reflectance(COSINES, INDICES), slab_transmittance(COSINES, INDICES)
    np.testing.assert_allclose(reflected.unpolarised.value + passed.unpolarised.value, 1, atol=ROUNDING)


def test_slab_is_the_sum_of_its_internal_reflections():
    r, t = (f(0.4, 1.5).s.value for f in (dielectric_reflectance, dielectric_transmittance))
    expected = r + sum(t * t * r ** (2 * bounce + 1) for bounce in range(60))
    assert slab_reflectance(0.4, 1.5).s.value == pytest.approx(expected, rel=ROUNDING)


def test_forgetting_polarisation_darkens_a_slab_at_brewsters_angle():
    cosine = np.cos(brewster_angle(1.5))
    # There r_s is (5/13)^2 and r_p is 0: (1 + 144/194)/2, and with the mean 25/338 at every face 313/363.
    assert slab_transmittance(cosine, 1.5).unpolarised.value == pytest.approx(169 / 194, rel=ROUNDING)
    assert slab_without_polarisation(cosine, 1.5).transmittance.value == pytest.approx(313 / 363, rel=ROUNDING)


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (lambda: dielectric_reflectance([0.5, 1.1], 1.5), r"cosine\[1\] is 1.1"),
        (lambda: dielectric_reflectance(0.5, -1.5), r"eta is -1.5"),
        (lambda: dielectric_reflectance(np.nan, 1.5), r"cosine is nan"),
        (lambda: dielectric_reflectance([0.5, 0.6], [1.5, 1.5, 1.5]), "do not fit together"),
        (lambda: conductor_reflectance(-0.1, 0.2, 3), r"cosine is -0.1"),
        (lambda: conductor_reflectance(0.1, 0.2, -3), r"k is -3"),
        (lambda: conductor_reflectance(0.1, 0, 0), "both below"),
        (lambda: slab_reflectance(0.5, 0), r"eta is 0"),
        (lambda: refract([0, 0, 2], [0, 0, 1], 1.5), "directions has length 2"),
        (lambda: diffuse_reflectance([1.5, np.inf]), r"eta\[1\] is inf"),
    ],
)
def test_impossible_arguments_are_refused(call, complaint):
    with pytest.raises(InvalidArgument, match=complaint):
        call()
