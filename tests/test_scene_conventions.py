"""What scenes mean, as two renderers that share no code show it: Mitsuba reads exports, the tracer translations."""

import numpy as np
import pytest
from scipy.special import expn

from oracle.tracer import render
from reference_scenes import model
from reference_scenes.export import export
from reference_scenes.tracing import to_tracer


@pytest.fixture(params=["mitsuba", "tracer"])
def show(request, tmp_path):
    """Render a scene: image (H, W, 3)."""
    if request.param == "tracer":
        return lambda scene, spp=16: render(*to_tracer(scene), spp=max(spp, 16), seed=1).mean
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")

    def image(scene, spp=16):
        loaded = mitsuba.load_file(str(export(scene, "mitsuba3", tmp_path)))
        return np.array(mitsuba.render(loaded, spp=spp, seed=1), dtype=np.float64)

    return image


def from_above(width, columns, rows, z=2.0):
    """An orthographic view of the plane z = 0, with x to the right and y upwards if seen from above."""
    return {
        "camera": model.OrthographicCamera(
            origin=(0.0, 0.0, z), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), width=width
        ),
        "film": model.Film(width=columns, height=rows),
    }


PIXEL = {"film": model.Film(width=1, height=1)}
BOARD = model.Rectangle(center=(0.0, 0.0, 0.0), half_u=(2.0, 0.0, 0.0), half_v=(0.0, 1.5, 0.0))
CORNERS = ((-2.0, -1.5, 0.0), (2.0, -1.5, 0.0), (2.0, 1.5, 0.0), (-2.0, 1.5, 0.0))
PLACES = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
MESH_BOARD = model.Mesh(vertices=CORNERS, triangles=((0, 1, 2), (0, 2, 3)), uv=PLACES)
TEXELS = np.random.default_rng(1).uniform(0, 5, (3, 4, 3))
SUNNY = TEXELS.copy()
SUNNY[0, 1] = (1e4, 2e-3, 7.0)
UP = np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0])
FRONT = np.cross(UP, [0.3, 1.0, 0.2]) / np.linalg.norm(np.cross(UP, [0.3, 1.0, 0.2]))
WHITE = model.Diffuse(reflectance=(1.0, 1.0, 1.0))
# Single precision, and directions that are compared with each other in it.
DIGITS = 1e-5


def lamp(shape, radiance, **more):
    return model.AreaEmitter(shape=shape, radiance=radiance, **more)


# ------------------------------------------------------------------------------------------------- textures


@pytest.mark.parametrize("board", [BOARD, MESH_BOARD], ids=["rectangle", "mesh"])
def test_row_0_of_a_bitmap_is_at_the_top_and_values_of_any_size_stay(show, board):
    bitmap = model.Bitmap(texels=SUNNY, smooth=False)
    image = show(model.Scene(emitters=(lamp(board, bitmap),), **from_above(4.0, 4, 3)))
    assert image == pytest.approx(SUNNY, rel=DIGITS)


def test_a_smooth_bitmap_is_linear_between_the_centres_of_texels_and_goes_round(show):
    image = show(model.Scene(emitters=(lamp(BOARD, model.Bitmap(texels=TEXELS)),), **from_above(4.0, 4, 3)), 40_000)
    # The mean over a texel of what is linear between centres, along each axis.
    weights = np.array([1, 6, 1]) / 8
    expected = sum(
        weights[1 + i] * weights[1 + j] * np.roll(TEXELS, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)
    )
    # Independent samples of values that differ by 1 or so.
    assert image == pytest.approx(expected, abs=0.02)


def test_a_checker_has_its_even_field_at_the_origin(show):
    checker = model.Checker(even=(1.0, 20.0, 0.5), odd=(0.0, 0.25, 3.0), columns=4.0, rows=3.0)
    image = show(model.Scene(emitters=(lamp(BOARD, checker),), **from_above(4.0, 4, 3)))
    is_even = (np.add.outer(np.arange(3)[::-1], np.arange(4)) % 2 == 0)[..., None]
    assert image == pytest.approx(np.where(is_even, checker.even, checker.odd), rel=DIGITS)


@pytest.mark.parametrize("kind", ["bitmap", "checker"])
def test_reflectances_are_textured_like_lamps(show, kind):
    if kind == "bitmap":
        texture, expected = model.Bitmap(texels=TEXELS / 5, smooth=False), TEXELS / 5
    else:
        texture = model.Checker(even=(1.0, 0.5, 0.25), odd=(0.0, 0.25, 0.75), columns=4.0, rows=3.0)
        is_even = (np.add.outer(np.arange(3)[::-1], np.arange(4)) % 2 == 0)[..., None]
        expected = np.where(is_even, texture.even, texture.odd)
    sun = model.DirectionalEmitter(direction=(0.0, 0.0, -1.0), irradiance=(np.pi, np.pi, np.pi))
    board = model.Object(shape=BOARD, material=model.Diffuse(reflectance=texture))
    image = show(model.Scene(objects=(board,), emitters=(sun,), **from_above(4.0, 4, 3)))
    assert image == pytest.approx(expected, rel=DIGITS)


# ---------------------------------------------------------------------------------------------------- sides


@pytest.mark.parametrize("z", [2.0, -2.0])
@pytest.mark.parametrize("two_sided", [True, False])
def test_a_lamp_shines_to_both_sides_if_it_says_so(show, z, two_sided):
    bitmap = model.Bitmap(texels=TEXELS, smooth=False)
    image = show(model.Scene(emitters=(lamp(BOARD, bitmap, two_sided=two_sided),), **from_above(4.0, 4, 3, z)))
    seen = TEXELS if z > 0 else TEXELS[:, ::-1] if two_sided else np.zeros_like(TEXELS)
    assert image == pytest.approx(seen, rel=DIGITS)


@pytest.mark.parametrize("z", [2.0, -2.0, 0.5])
@pytest.mark.parametrize(
    "shape",
    [
        model.Disk(center=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), radius=1.0),
        model.Sphere(center=(0.0, 0.0, 0.0), radius=1.0),
    ],
    ids=["disk", "sphere"],
)
def test_disks_and_spheres_do_so_too(show, shape, z):
    scene = model.Scene(emitters=(lamp(shape, (1.0, 2.0, 3.0), two_sided=True),), **from_above(0.1, 1, 1, z))
    assert show(scene)[0, 0] == pytest.approx([1, 2, 3], rel=DIGITS)


@pytest.mark.parametrize(
    ("material", "above", "below"),
    [
        (model.Diffuse(reflectance=(0.5, 0.5, 0.5)), 0.5, 0.0),
        (model.TwoSided(front=model.Diffuse(reflectance=(0.5, 0.5, 0.5))), 0.5, 0.5),
        (model.TwoSided(front=WHITE, back=model.Diffuse(reflectance=(0.25, 0.25, 0.25))), 1.0, 0.25),
        (model.Mirror(reflectance=(0.75, 0.75, 0.75)), 0.75, 0.75),
        (model.TwoSided(front=model.Mirror(), back=model.Diffuse(reflectance=(0.0, 0.0, 0.0))), 1.0, 0.0),
        (model.Conductor(eta=(2.0, 2.0, 2.0), k=(0.0, 0.0, 0.0)), 1 / 9, 0.0),
        # Radiance is compressed by the square of the index on the way in, and spread out on the way back.
        (model.Dielectric(eta=1.5), 0.04 + 0.96 / 2.25, 0.04 + 0.96 * 2.25),
        (model.Mix(first=WHITE, second=model.Diffuse(reflectance=(0.5, 0.5, 0.5)), weight=0.25), 0.875, 0.0),
    ],
    ids=["diffuse", "two-sided", "two materials", "mirror", "mirror in front", "conductor", "dielectric", "mix"],
)
def test_opaque_materials_but_mirrors_have_a_black_back(show, material, above, below):
    # Under light of radiance 1 from everywhere what is seen is what the surface reflects and lets through in all.
    sky = model.ConstantEmitter(radiance=(1.0, 1.0, 1.0))
    board = model.Object(shape=BOARD, material=material)
    for z, expected in ((2.0, above), (-2.0, below)):
        image = show(model.Scene(objects=(board,), emitters=(sky,), **from_above(0.1, 4, 4, z)), 4096)
        assert image.mean(axis=(0, 1)) == pytest.approx([expected] * 3, rel=5e-3)


def test_instances_keep_their_front_whichever_way_their_vertices_go(show):
    triangle = model.Mesh(vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), triangles=((0, 1, 2),))
    as_it_is = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    mirrored = ((-1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    turned = ((1.0, 0.0, 0.0, 0.0), (0.0, -1.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0))
    moved = ((1.0, 0.0, 0.0, -0.5), (0.0, 1.0, 0.0, -0.75), (0.0, 0.0, 1.0, 0.0))
    copies = model.Instances(mesh=triangle, transforms=(as_it_is, mirrored, turned, moved))
    sun = model.DirectionalEmitter(direction=(0.0, 0.0, -1.0), irradiance=(np.pi, np.pi, np.pi))
    scene = model.Scene(objects=(model.Object(shape=copies, material=WHITE),), emitters=(sun,), **from_above(1.0, 4, 4))
    image = show(scene)[..., 0]
    assert image[0] == pytest.approx([1] * 4)
    assert image[2, 2:] == pytest.approx([0, 0])
    assert image[3, :2] == pytest.approx([1, 1])


def test_normals_of_vertices_turn_the_surface_that_is_shaded(show):
    leaning = model.Mesh(vertices=CORNERS, triangles=((0, 1, 2), (0, 2, 3)), normals=((0.0, 3.0, 4.0),) * 4)
    sun = model.DirectionalEmitter(direction=(0.0, 0.0, -1.0), irradiance=(np.pi, np.pi, np.pi))
    scene = model.Scene(
        objects=(model.Object(shape=leaning, material=WHITE),), emitters=(sun,), **from_above(1.0, 1, 1)
    )
    assert show(scene)[0, 0] == pytest.approx([0.8] * 3, rel=DIGITS)


# --------------------------------------------------------------------------------------------- environments


def towards(direction):
    x, y, z = (float(number) for number in direction)
    return {"camera": model.RadianceMeter(origin=(0.0, 0.0, 0.0), direction=(x, y, z)), **PIXEL}


def test_an_image_goes_round_the_pole_counter_clockwise_from_its_front(show):
    image = model.ImageEmitter(radiance=SUNNY, up=tuple(UP), front=tuple(FRONT))
    for row, column in ((0, 0), (0, 3), (1, 1), (1, 2), (2, 0), (2, 2)):
        polar, azimuth = np.pi * (row + 0.3) / 3, 2 * np.pi * (column + 0.8) / 4
        around = np.cos(azimuth) * FRONT + np.sin(azimuth) * np.cross(UP, FRONT)
        seen = show(model.Scene(emitters=(image,), **towards(np.cos(polar) * UP + np.sin(polar) * around)))
        assert seen[0, 0] == pytest.approx(SUNNY[row, column], rel=DIGITS)


@pytest.mark.parametrize("horizon", [None, (4.0, 0.0, 1.0)])
def test_a_sky_is_linear_in_the_sine_of_the_elevation_over_black_ground(show, horizon):
    sky = model.SkyEmitter(zenith=(3.0, 6.0, 9.0), horizon=horizon, up=tuple(UP))
    low, high = np.array((1.0, 2.0, 3.0) if horizon is None else horizon), np.array(sky.zenith)
    for elevation in np.radians([-60.0, -0.5, 0.5, 30.0, 80.0, 90.0]):
        seen = show(model.Scene(emitters=(sky,), **towards(np.sin(elevation) * UP + np.cos(elevation) * FRONT)))
        expected = low + (high - low) * np.sin(elevation) if elevation > 0 else np.zeros(3)
        # Mitsuba's sky is interpolated between rows that are 0.1 degrees apart.
        assert seen[0, 0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("kind", ["image", "sky"])
def test_environments_give_the_irradiance_of_their_closed_form(show, kind):
    from oracle import emitters
    from oracle.irradiances import irradiance

    surface = model.Rectangle(center=(0.0, 0.0, 0.0), half_u=(1.0, 0.0, 0.0), half_v=(0.0, 1.0, 0.0))
    if kind == "image":
        emitter = model.ImageEmitter(radiance=SUNNY, up=tuple(UP), front=tuple(FRONT))
        same = emitters.Equirectangular(SUNNY, UP, FRONT)
    else:
        emitter = model.SkyEmitter(zenith=(3.0, 6.0, 9.0), up=tuple(UP))
        same = emitters.CosineSky.cie_overcast(UP, np.array([3.0, 6.0, 9.0]))
    board = model.Object(shape=surface, material=WHITE)
    view = from_above(0.1, 8, 8)
    image = show(model.Scene(objects=(board,), emitters=(emitter,), **view), 4096)
    expected = irradiance(same, emitters.Receivers(np.zeros(3), np.array([0.0, 0.0, 1.0]))).value / np.pi
    assert image.mean(axis=(0, 1)) == pytest.approx(expected, rel=3e-3)


# ------------------------------------------------------------------------------------------------- sensors

METER = model.IrradianceMeter(
    surface=model.Rectangle(center=(0.0, 0.0, 1.0), half_u=(1.0, 0.0, 0.0), half_v=(0.0, 1.0, 0.0))
)


def test_columns_of_an_irradiance_meter_go_along_u_and_rows_against_v(show):
    near = model.Rectangle(center=(0.5, 0.5, 1.1), half_u=(0.3, 0.0, 0.0), half_v=(0.0, -0.3, 0.0))
    image = show(
        model.Scene(emitters=(lamp(near, (1.0, 1.0, 1.0)),), camera=METER, film=model.Film(width=2, height=2)), 1024
    )
    assert image[0, 1].min() > 10 * max(image[0, 0].max(), image[1].max())


def test_an_irradiance_meter_measures_irradiance(show):
    sky = model.ConstantEmitter(radiance=(1.0, 2.0, 3.0))
    image = show(model.Scene(emitters=(sky,), camera=METER, **PIXEL))
    assert image[0, 0] == pytest.approx(np.pi * np.array([1, 2, 3]), rel=DIGITS)


@pytest.mark.parametrize("medium", [None, model.Medium(absorption=(0.1, 0.1, 0.1), scattering=(0.0, 0.0, 0.0))])
def test_an_irradiance_meter_hides_nothing(show, medium):
    # Light goes through the meter to the ceiling that it faces.
    ceiling = model.Rectangle(center=(0.0, 0.0, 2.0), half_u=(1.0, 0.0, 0.0), half_v=(0.0, -1.0, 0.0))
    below = model.Rectangle(center=(0.0, 0.0, 0.0), half_u=(0.5, 0.0, 0.0), half_v=(0.0, 0.5, 0.0))
    small = METER.model_copy(
        update={"surface": METER.surface.model_copy(update={"half_u": (0.01, 0.0, 0.0), "half_v": (0.0, 0.01, 0.0)})}
    )
    scene = model.Scene(
        objects=(model.Object(shape=ceiling, material=WHITE),),
        emitters=(lamp(below, (1.0, 1.0, 1.0)),),
        medium=medium,
        camera=small,
        film=model.Film(width=16, height=16),
    )
    wide = scene.model_copy(update={"camera": METER})
    assert show(wide, 1024).mean() > 0.5 * show(scene, 1024).mean() > 0


# -------------------------------------------------------------------------------------------------- medium


def test_an_irradiance_meter_stands_in_the_medium(show):
    fog = model.Medium(absorption=(1.0, 1.0, 1.0), scattering=(0.0, 0.0, 0.0))
    ceiling = model.Rectangle(center=(0.0, 0.0, 2.0), half_u=(50.0, 0.0, 0.0), half_v=(0.0, -50.0, 0.0))
    scene = model.Scene(
        emitters=(lamp(ceiling, (1.0, 1.0, 1.0)),), medium=fog, camera=METER, film=model.Film(width=16, height=16)
    )
    # A ceiling without end, 1 m above: 2 pi times the integral of mu exp(-1/mu); the rest is behind 49 m of fog.
    assert show(scene, 1024).mean() == pytest.approx(2 * np.pi * expn(3, 1.0), rel=0.01)


@pytest.mark.parametrize("absorption", [(0.5, 0.5, 0.5), (0.0, 0.5, 3.0)], ids=["grey", "coloured"])
def test_a_medium_dims_what_is_behind_it(show, absorption):
    fog = model.Medium(absorption=absorption, scattering=(0.0, 0.0, 0.0))
    image = show(model.Scene(emitters=(lamp(BOARD, (1.0, 1.0, 1.0)),), medium=fog, **from_above(1.0, 16, 16)), 1024)
    assert image.mean(axis=(0, 1)) == pytest.approx(np.exp(-2 * np.array(absorption)), rel=0.02)


@pytest.mark.parametrize("asymmetry", [-0.6, 0.0, 0.6])
def test_a_medium_scatters_forwards_if_its_asymmetry_is_positive(show, asymmetry):
    from oracle import emitters, media

    # The halo of a point light in thin fog, looked at past the light.
    fog = model.Medium(absorption=(0.0, 0.0, 0.0), scattering=(1e-3, 1e-3, 1e-3), asymmetry=asymmetry)
    point = model.PointEmitter(position=(0.0, 0.0, 0.0), intensity=(1.0, 1.0, 1.0))
    ray = {"camera": model.RadianceMeter(origin=(0.5, 0.0, -2.0), direction=(0.0, 0.0, 1.0)), **PIXEL}
    wall = model.Object(
        shape=model.Disk(center=(0.5, 0.0, 0.0), normal=(0.0, 0.0, -1.0), radius=0.4),
        material=model.Diffuse(reflectance=(0.0, 0.0, 0.0)),
    )
    image = show(model.Scene(objects=(wall,), emitters=(point,), medium=fog, **ray), 200_000)
    segment = media.Rays(np.array([0.5, 0.0, -2.0]), np.array([0.0, 0.0, 1.0]), np.array(2.0))
    same = media.Medium(np.zeros(3), np.full(3, 1e-3), asymmetry)
    expected = media.scattered_point(emitters.Point(np.zeros(3), np.ones(3)), segment, same).value
    # Mitsuba scatters one path in 500 here, so that some 400 tell.
    assert image[0, 0] == pytest.approx(expected, rel=0.2)
