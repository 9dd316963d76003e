"""Furnaces and enclosures in the reference tracer: the lossless loses nothing, and n bounces leave what they must."""

import numpy as np
import pytest

from oracle import Constant, Mesh, Point, Rectangle, Sphere
from oracle.reflection import albedo, phong, rough
from oracle.reflection.microfacet import GGX
from oracle.tracer import (
    Checker,
    Conductor,
    Dielectric,
    Diffuse,
    Film,
    Mirror,
    Mix,
    Object,
    Perspective,
    Phong,
    Plastic,
    RadianceMeter,
    RoughConductor,
    RoughDielectric,
    Scene,
    TwoSided,
    render,
)

WHITE = Diffuse([1, 1, 1])
SKY = Constant([1, 1, 1])
CAMERA = Perspective([0, -4, 0], [0, 0, 0], [0, 0, 1], 0.7)
FILM = Film(24, 24)
# Single precision, a few dozen operations along a path.
ROUNDING = 2e-5


def seen_from(cosine):
    """A meter that looks at the origin of the plane z = 0 under an angle."""
    towards = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    return RadianceMeter(towards, -towards)


def box(half=1.0):
    """The walls of a closed cube, seen from inside; 12 triangles."""
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    inwards = [face for face in faces if np.linalg.det(corners[list(face)]) < 0]
    turned = [face if face in inwards else face[::-1] for face in faces]
    return Mesh(corners, turned)


def assert_exactly(image, expected):
    np.testing.assert_allclose(image.mean, np.broadcast_to(expected, image.mean.shape), rtol=ROUNDING)


def assert_within_errors(image, expected, errors=6.0, precision=2e-3):
    """The mean of all pixels, whose standard error must be small enough to tell."""
    mean, error = image.mean.mean(axis=(0, 1)), np.sqrt(image.variance.sum(axis=(0, 1))) / image.mean[..., 0].size
    assert (error <= precision * np.abs(expected)).all(), error / expected
    np.testing.assert_array_less(np.abs(mean - expected), errors * error + ROUNDING * np.abs(expected))


LOSSLESS = {
    "diffuse": WHITE,
    "mirror": Mirror(),
    "dielectric": Dielectric(1.5),
    "thin air": Dielectric(1 / 1.33),
    "mix": Mix(WHITE, Mirror(), 0.3),
    "mix with glass": Mix(Mirror(), Dielectric(1.5), 0.6),
    "two-sided": TwoSided(WHITE, Mirror()),
    "checker": Diffuse(Checker([1, 1, 1], [1, 1, 1])),
}


@pytest.mark.parametrize("strategy", ["mis", "bsdf"])
@pytest.mark.parametrize("material", LOSSLESS.values(), ids=LOSSLESS)
def test_lossless_spheres_vanish_in_a_white_furnace(material, strategy):
    image = render(Scene([Object(Sphere([0, 0, 0], 1.0), material)], [SKY]), CAMERA, FILM, spp=32, strategy=strategy)
    assert_exactly(image, 1.0)


def test_a_lossless_object_that_is_not_convex_vanishes_too():
    rings = [Object(Sphere([x, 0, 0], 0.7), WHITE) for x in (-0.5, 0.5)]
    assert_exactly(render(Scene(rings, [SKY]), CAMERA, FILM, spp=32), 1.0)


def test_white_plastic_loses_nothing_on_average():
    scene = Scene([Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), Plastic([1, 1, 1], 1.5))], [SKY])
    for cosine in (1.0, 0.6, 0.1):
        assert_within_errors(render(scene, seen_from(cosine), Film(32, 32), spp=64), 1.0)


@pytest.mark.parametrize("cosine", [0.9, 0.5, 0.15])
@pytest.mark.parametrize("alpha", [0.05, 0.3, 0.8])
def test_rough_metal_reflects_its_albedo(cosine, alpha):
    eta, k = [0.2, 0.9, 1.5], [3.9, 2.5, 1.9]
    floor = Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), RoughConductor(eta, k, alpha))
    image = render(Scene([floor], [SKY]), seen_from(cosine), Film(32, 32), spp=64)
    metals = [rough.RoughConductor(GGX(alpha), *pair) for pair in zip(eta, k, strict=True)]
    expected = np.array([float(albedo.directional_albedo(metal, cosine).value) for metal in metals])
    assert_within_errors(image, expected)


@pytest.mark.parametrize("cosine", [0.9, 0.3])
@pytest.mark.parametrize("exponent", [1, 40])
def test_phong_s_lobe_reflects_its_albedo(cosine, exponent):
    floor = Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), Phong([0.7, 0.7, 0.7], exponent))
    image = render(Scene([floor], [SKY]), seen_from(cosine), Film(32, 32), spp=64)
    assert_within_errors(image, 0.7 * float(phong.directional_albedo(cosine, exponent).value))


@pytest.mark.parametrize("cosine", [0.9, 0.4, -0.8])
def test_rough_glass_reflects_and_transmits_its_albedo(cosine):
    # One side of the interface only is lit at a time: a black sky over half of the directions.
    material, model = RoughDielectric(1.5, 0.3), rough.RoughDielectric(GGX(0.3), 1.5)
    floor = Object(Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0]), material)
    image = render(Scene([floor], [SKY]), seen_from(cosine), Film(32, 32), spp=64)
    r = float(albedo.directional_reflectance(model, cosine).value)
    t = float(albedo.directional_transmittance(model, cosine).value)
    # Radiance shrinks by the square of the index that light comes from, over that where it is seen.
    squared = 1.5**2 if cosine > 0 else 1 / 1.5**2
    assert_within_errors(image, r + t / squared)


# From the fourth reflection on paths end by chance.
@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_a_closed_box_shows_the_partial_sums_of_its_bounces(bounces):
    rho = np.array([0.2, 0.5, 0.9])
    walls = Object(box(), Diffuse(rho), radiance=[1, 1, 1])
    inside = Perspective([0.3, -0.2, 0.1], [1, 0.4, 0.2], [0, 0, 1], 1.2)
    image = render(Scene([walls]), inside, FILM, spp=8, bounces=bounces, strategy="bsdf")
    assert_exactly(image, (1 - rho ** (bounces + 1)) / (1 - rho))
    alone = render(Scene([walls]), inside, FILM, spp=8, bounces=bounces, first_bounce=bounces, strategy="bsdf")
    assert_exactly(alone, rho**bounces)


@pytest.mark.parametrize("strategy", ["mis", "bsdf", "light"])
def test_a_closed_box_shines_emission_over_loss(strategy):
    for rho in ([0.0, 0.5, 0.9], [0.99, 0.98, 0.95]):
        walls = Object(box(), Diffuse(rho), radiance=[1, 1, 1])
        inside = Perspective([0.3, -0.2, 0.1], [1, 0.4, 0.2], [0, 0, 1], 1.2)
        image = render(Scene([walls]), inside, Film(16, 16), spp=128, strategy=strategy)
        assert_within_errors(image, 1 / (1 - np.array(rho)), precision=1e-2)


def test_an_integrating_sphere_is_evenly_lit_by_a_point_in_its_middle():
    rho, radius, intensity = 0.6, 2.0, 3.0
    wall = Object(Sphere([0, 0, 0], radius), TwoSided(Diffuse([rho] * 3)))
    inside = Perspective([0.5, 0.2, 0], [2, 0, 0.3], [0, 0, 1], 1.0)
    image = render(Scene([wall], [Point([0, 0, 0], [intensity] * 3)]), inside, Film(32, 32), spp=64)
    # Direct irradiance I / r^2, and the bounces: E / (1 - rho).
    assert_within_errors(image, rho / np.pi * intensity / radius**2 / (1 - rho))


@pytest.mark.parametrize("eta", [1.5, 2.4])
def test_smooth_glass_and_metal_follow_fresnel(eta):
    from oracle.reflection.fresnel import conductor_reflectance

    floor = Rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])
    for cosine in (0.95, 0.5, 0.1):
        metal = Object(floor, Conductor([eta] * 3, [1.0, 2.0, 3.0]))
        image = render(Scene([metal], [SKY]), seen_from(cosine), Film(1, 1), spp=8)
        expected = [float(conductor_reflectance(cosine, eta, k).unpolarised.value) for k in (1.0, 2.0, 3.0)]
        assert_exactly(image, expected)
