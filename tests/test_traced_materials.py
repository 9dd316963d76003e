"""Materials in the reference tracer against closed forms of reflection and refraction, and against themselves."""

import numpy as np
import pytest
from renderings import CROWD, TOLERANCE, scene_of, unit

from oracle import Area, Constant, CosineSky, Directional, Equirectangular, Mesh, Receivers, Rectangle, Sphere
from oracle.reflection import phong, rough
from oracle.reflection.fresnel import dielectric_transmittance, diffuse_reflectance
from oracle.reflection.microfacet import GGX
from oracle.reflection.slab import slab_without_polarisation
from oracle.tracer import (
    Bitmap,
    Dielectric,
    Diffuse,
    Film,
    Instances,
    Mirror,
    Mix,
    Object,
    Phong,
    Plastic,
    RadianceMeter,
    RoughConductor,
    RoughDielectric,
    TwoSided,
    render,
)

PLANE = Rectangle([0.1, 0.2, 0], [3, 0, 0], [0, 3, 0])
ETA, K = np.array([0.2, 0.9, 1.5]), np.array([3.9, 2.5, 1.9])
COLOUR = np.array([0.9, 0.5, 0.2])
ONE = Film(1, 1)


def seen_from(direction, point=(0.0, 0.0, 0.0)):
    """A meter that looks at the point from this direction."""
    return RadianceMeter(np.asarray(point) + 2 * unit(direction), -unit(direction))


def averaged(rendering):
    """Mean over the pixels and its standard error."""
    return rendering.mean.mean(axis=(0, 1)), np.sqrt(rendering.variance.sum(axis=(0, 1))) / rendering.mean[..., 0].size


# ------------------------------------------------------------------------------------------------ parallel light


def metal(i, o, separable):
    return np.array(
        [
            float(rough.bsdf(rough.RoughConductor(GGX(0.3), *index, separable), i, o).value)
            for index in zip(ETA, K, strict=True)
        ]
    )


def glass(i, o, separable, eta=1.5):
    return np.full(3, float(rough.bsdf(rough.RoughDielectric(GGX(0.4), eta, separable), i, o).value))


def lobe(i, o):
    mirrored = np.array([-o[0], -o[1], o[2]])
    return COLOUR * (20 + 2) / (2 * np.pi) * max(i @ mirrored, 0) ** 20 * (i[2] > 0) * (o[2] > 0)


def coated(i, o):
    """Light enters through the coat, is reflected any number of times between base and coat, and leaves."""
    if i[2] < 0 or o[2] < 0:
        return np.zeros(3)
    passed = [float(dielectric_transmittance(w[2], 1.5).unpolarised.value) for w in (i, o)]
    inner = float(diffuse_reflectance(1 / 1.5).value)
    return COLOUR / np.pi * np.prod(passed) / 1.5**2 / (1 - COLOUR * inner)


def flat(i, o):
    return COLOUR / np.pi * (i[2] > 0) * (o[2] > 0)


SCATTERING = {
    "diffuse": (Diffuse(COLOUR), flat),
    "Phong": (Phong(COLOUR, 20), lobe),
    "plastic": (Plastic(COLOUR, 1.5), coated),
    "rough metal": (RoughConductor(ETA, K, 0.3), lambda i, o: metal(i, o, False)),
    "rough metal, separable": (RoughConductor(ETA, K, 0.3, True), lambda i, o: metal(i, o, True)),
    "rough glass": (RoughDielectric(1.5, 0.4), lambda i, o: glass(i, o, False)),
    "rough glass, separable": (RoughDielectric(1.5, 0.4, True), lambda i, o: glass(i, o, True)),
    "rough bubble": (RoughDielectric(0.7, 0.4), lambda i, o: glass(i, o, False, 0.7)),
    "mix": (
        Mix(Diffuse(COLOUR), RoughConductor(ETA, K, 0.3), 0.3),
        lambda i, o: 0.7 * flat(i, o) + 0.3 * metal(i, o, False),
    ),
    "two-sided": (
        TwoSided(Diffuse(COLOUR), Phong(COLOUR, 20)),
        lambda i, o: flat(i, o) + lobe(i * [1, 1, -1], o * [1, 1, -1]),
    ),
}


@pytest.mark.parametrize("name", SCATTERING)
def test_parallel_light_is_scattered_by_the_bsdf(name):
    material, bsdf = SCATTERING[name]
    rng = np.random.default_rng(5)
    lit = 0
    for _ in range(60):
        i, o = (unit(w) for w in rng.normal(size=(2, 3)))
        if min(abs(i[2]), abs(o[2])) < 0.05:
            continue
        scene = scene_of([Directional(-i, [3.0, 2.0, 1.0])], Object(PLANE, material))
        expected = bsdf(i, o) * abs(i[2]) * [3.0, 2.0, 1.0]
        shown = render(scene, seen_from(o), ONE, spp=8, strategy="light", bounces=1)
        np.testing.assert_allclose(shown.mean[0, 0], expected, rtol=2e-4, atol=1e-7)
        lit += expected.any()
    assert lit > 8


# ----------------------------------------------------------------------------------------------------- agreement

ROUGH = {
    "Phong": Phong(COLOUR, 20),
    "plastic": Plastic(COLOUR, 1.5),
    "rough metal": RoughConductor(ETA, K, 0.3),
    "rough metal, separable": RoughConductor(ETA, K, 0.5, True),
    "rough glass": RoughDielectric(1.5, 0.4),
    "rough bubble": RoughDielectric(1 / 1.4, 0.4),
    "diffuse and rough metal": Mix(Diffuse(COLOUR), RoughConductor(ETA, K, 0.3), 0.6),
    "Phong and mirror": Mix(Phong(COLOUR, 5), Mirror(), 0.3),
    "rough glass and diffuse": Mix(RoughDielectric(1.5, 0.4), Diffuse(COLOUR), 0.4),
    "two-sided": TwoSided(Mix(Diffuse(COLOUR), RoughConductor(ETA, K, 0.3), 0.6), Phong(COLOUR, 10)),
}
# Any sample that does not follow its density, and any wrong weight, tells the strategies apart.
LAMPS = [
    Area(Rectangle([-1, 0.3, 1.5], [0, 0.8, 0], [0.6, 0, 0.6]), [9.0, 7.0, 5.0]),
    Area(Sphere([-0.6, -0.5, -1.4], 0.7), [5.0, 7.0, 9.0]),
]
SKY = Equirectangular(np.random.default_rng(1).random((6, 10, 3)) ** 4, [0, 0, 1], [1, 0, 0])


@pytest.mark.parametrize("name", ROUGH)
@pytest.mark.parametrize("view", [[0.7, 0.1, 0.8], [0.8, 0.2, -0.4]], ids=["from the front", "from behind"])
def test_all_strategies_agree_on_every_material(name, view):
    scene = scene_of([*LAMPS, SKY], Object(PLANE, ROUGH[name]), CROWD)
    meter, film = seen_from(view), Film(16, 16)
    found = {
        strategy: averaged(render(scene, meter, film, spp=128, seed=seed, strategy=strategy, bounces=1))
        for seed, strategy in enumerate(("mis", "light", "bsdf", "hemisphere"))
    }
    mean, error = found["mis"]
    if view[2] < 0 and name in ("Phong", "plastic", "rough metal", "rough metal, separable", "diffuse and rough metal"):
        assert all((black == 0).all() for black, _ in found.values())
        return
    assert (error < 0.01 * mean).all()
    for other, other_error in found.values():
        assert (other_error < 0.06 * mean).all()
        assert (np.abs(other - mean) < 5 * np.hypot(error, other_error) + 1e-6).all()


@pytest.mark.parametrize("exponent", [1, 10, 200])
@pytest.mark.parametrize("strategy", ["mis", "light", "bsdf"])
def test_phong_s_lobe_over_a_lamp_is_known(exponent, strategy):
    lamp = Area(Rectangle([-1.2, 0.3, 1.5], [0, 0.8, 0], [0.6, 0, 0.2]), [9.0, 7.0, 5.0])
    for view in ([0.7, -0.1, 0.8], [0.5, 0.1, 0.3]):
        receivers = Receivers(np.zeros(3), np.array([0.0, 0, 1]))
        expected = phong.reflected_radiance(lamp, receivers, unit(view), exponent, COLOUR).value
        scene = scene_of([lamp], Object(PLANE, Phong(COLOUR, exponent)))
        shown = render(scene, seen_from(view), Film(16, 16), spp=256, strategy=strategy, bounces=1)
        mean, error = averaged(shown)
        assert (error < 0.02 * expected).all()
        assert (np.abs(mean - expected) < np.maximum(TOLERANCE * expected, 5 * error)).all()


# --------------------------------------------------------------------------------------------- mirrors and glass


def test_mirrors_and_glass_send_rays_where_they_belong():
    # Two glowing walls parallel to the surface, on which colours grow with x and y, tell where rays arrive.
    across, along = np.meshgrid(np.arange(16.0), np.arange(15.0, -1, -1))
    ramp = Bitmap(np.stack([across, along, np.full((16, 16), 1.0)], axis=-1))
    above = Object(Rectangle([0, 0, 4], [0, 8, 0], [8, 0, 0]), None, ramp)
    below = Object(Rectangle([0, 0, -4], [8, 0, 0], [0, 8, 0]), None, ramp)

    def slope(material, wall, towards):
        red, green, blue = render(scene_of([], Object(PLANE, material), wall), seen_from(towards), ONE, spp=256).mean[
            0, 0
        ]
        # Texels are a metre wide; u goes along y on the wall above.
        u, v = red / blue - 7.5, green / blue - 7.5
        return np.array([u, v] if wall is below else [v, u]) / 4

    for towards in ([0.5, 0.3, 0.8], [-0.7, 0.6, 0.6]):
        sine = -unit(towards)[:2]
        reflected = sine / unit(towards)[2]
        refracted = sine / 1.5 / np.sqrt(1 - sine @ sine / 1.5**2)
        np.testing.assert_allclose(slope(Mirror(), above, towards), reflected, atol=1e-5)
        np.testing.assert_allclose(slope(Dielectric(1.5), above, towards), reflected, atol=1e-5)
        np.testing.assert_allclose(slope(Dielectric(1.5), below, towards), refracted, atol=1e-5)


@pytest.mark.parametrize("cosine", [1.0, 0.55, 0.2])
def test_a_pane_of_glass_reflects_and_transmits_as_known(cosine):
    # Its faces' fronts are outside.
    faces = [
        Object(Rectangle([0, 0, 0], [50, 0, 0], [0, 50, 0]), Dielectric(1.5)),
        Object(Rectangle([0, 0, -0.1], [0, 50, 0], [50, 0, 0]), Dielectric(1.5)),
    ]
    meter = seen_from([np.sqrt(1 - cosine**2), 0, cosine])
    known = slab_without_polarisation(cosine, 1.5)
    for up, expected in ((1, known.reflectance), (-1, known.transmittance)):
        bright = CosineSky([0, 0, up], [1, 1, 1], [1, 1, 1])
        mean, error = averaged(render(scene_of([bright], *faces), meter, Film(32, 32), spp=64))
        assert (error < 2e-3).all()
        assert (np.abs(mean - float(expected.value)) < np.maximum(TOLERANCE * expected.value, 5 * error)).all()


@pytest.mark.parametrize("eta", [1.5, 0.8])
def test_radiance_inside_a_medium_is_its_index_squared(eta):
    ball = Object(Sphere([0, 0, 0], 1), Dielectric(eta))
    inside = RadianceMeter([0.1, 0.5, -0.2], unit([0.3, 0.8, 0.4]))
    shown = render(scene_of([Constant([1, 1, 1])], ball), inside, Film(16, 16), spp=64)
    np.testing.assert_allclose(shown.mean, eta**2, rtol=2e-5)


def test_what_is_seen_through_nested_glass_is_unchanged():
    shells = [Object(Sphere([0, 0, 0], radius), Dielectric(eta)) for radius, eta in ((1, 1.3), (0.7, 1.2), (0.4, 0.5))]
    shown = render(
        scene_of([Constant([1, 1, 1])], *shells), seen_from([0.3, 1, 0.2], [0.1, 0, 0.2]), Film(8, 8), spp=64
    )
    np.testing.assert_allclose(shown.mean, 1, rtol=3e-5)


# --------------------------------------------------------------------------------------------- sides and normals


def test_lamps_shine_from_their_fronts_or_from_both_sides():
    for two_sided in (False, True):
        lamp = Object(PLANE, None, [3, 2, 1], two_sided)
        front, back = (render(scene_of([], lamp), seen_from([0.3, 0.1, z]), ONE, spp=8).mean[0, 0] for z in (0.8, -0.8))
        np.testing.assert_array_equal(front, [3, 2, 1])
        np.testing.assert_array_equal(back, np.multiply(two_sided, [3, 2, 1]))


CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
NORMALS = np.array([unit([-0.3, -0.2, 1]), unit([0.5, -0.1, 1]), unit([0.1, 0.6, 1])])
WEIGHTS = np.array([0.5, 0.2, 0.3])
TOWARDS_LIGHT = unit([0.2, -0.3, 0.9])


def brightness(surface, point, view):
    """What a white diffuse surface shows, over what it would show facing the light."""
    shown = render(scene_of([Directional(-TOWARDS_LIGHT, [np.pi] * 3)], surface), seen_from(view, point), ONE, spp=8)
    return shown.mean[0, 0, 0]


def test_interpolated_normals_shade_meshes():
    surface = Object(Mesh(CORNERS, [[0, 1, 2]], NORMALS), Diffuse([1, 1, 1]))
    expected = unit(WEIGHTS @ NORMALS) @ TOWARDS_LIGHT
    assert np.isclose(brightness(surface, WEIGHTS @ CORNERS, [0.1, 0.2, 1]), expected, rtol=1e-5)


@pytest.mark.parametrize("sign", [1, -1], ids=["turned", "mirrored"])
@pytest.mark.parametrize("normals", [None, NORMALS], ids=["flat", "with normals"])
def test_instances_are_shaded_like_the_mesh_that_they_are(sign, normals):
    linear = np.array([[sign * 1.5, 0.2, 0.0], [0.1, 0.7, 0.3], [0.0, -0.2, 1.1]])
    transform = np.column_stack([linear, [0.3, -0.2, 0.5]])
    instance = Instances(Mesh(CORNERS, [[0, 1, 2]], normals), Diffuse([1, 1, 1]), [transform])
    # Normals are gradients, and go with the inverse transposed.
    of_corners = np.array([[0.0, 0, 1]] * 3) if normals is None else normals
    normal = unit(np.linalg.inv(linear).T @ (WEIGHTS @ of_corners))
    point = linear @ (WEIGHTS @ CORNERS) + transform[:, 3]
    front = unit(np.linalg.inv(linear).T @ [0, 0, 1])
    assert np.isclose(brightness(instance, point, front), normal @ TOWARDS_LIGHT, rtol=1e-5)
    assert brightness(instance, point, -front) == 0
