"""Textures, maps and sensors of the reference tracer: what is where, to the last texel and pixel."""

import numpy as np
import pytest
from renderings import CROWD, assert_right, irradiances, looking_down, scene_of, unit
from scipy.ndimage import map_coordinates
from scipy.stats import norm

from oracle import Area, Directional, Equirectangular, Mesh, Rectangle, Sphere
from oracle.tracer import (
    Bitmap,
    Checker,
    Diffuse,
    Film,
    IrradianceMeter,
    Object,
    Orthographic,
    Perspective,
    RadianceMeter,
    TwoSided,
    first_hits,
    render,
)

BOARD = Rectangle([0.3, 0.2, 0], [1.2, 0, 0], [0, 0.8, 0])
TEXELS = np.random.default_rng(4).random((2, 3, 3))
EVEN, ODD = np.array([1.0, 0.5, 0.25]), np.array([0.125, 0.75, 1.0])
SUN = Directional([0, 0, -1], np.full(3, np.pi))
# The board's corners as a mesh with its own texture coordinates.
CORNERS, FACES = BOARD.polygon.vertices, [[0, 1, 2], [0, 2, 3]]
UV = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def board_with(texture, uv=None, glowing=True):
    """The board as a rectangle, or as a mesh if it has texture coordinates."""
    shape = BOARD if uv is None else Mesh(CORNERS, FACES, uv=uv)
    return Object(shape, None, texture) if glowing else Object(shape, Diffuse(texture))


def picture(board, film):
    """What a camera above sees, the sun shining on it."""
    return render(scene_of([SUN], board), looking_down(BOARD), film, spp=16, bounces=1).mean


def fields(columns, rows, across, up):
    """A picture of a checker, columns from the left and rows from below; each field several pixels wide."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows)[::-1])
    colours = np.where(((i + j) % 2 == 0)[..., None], EVEN, ODD)
    return colours.repeat(across, axis=1).repeat(up, axis=0)


@pytest.mark.parametrize("glowing", [True, False], ids=["emission", "reflectance"])
@pytest.mark.parametrize("uv", [None, UV], ids=["rectangle", "mesh"])
def test_fields_of_a_checker_begin_with_the_even_one_at_the_origin(glowing, uv):
    board = board_with(Checker(EVEN, ODD, 6, 2), uv, glowing)
    np.testing.assert_allclose(picture(board, Film(12, 8)), fields(6, 2, 2, 4), rtol=1e-5)


def test_fields_of_a_checker_go_on_below_zero():
    board = board_with(Checker(EVEN, ODD, 3, 2), 2 * UV - 2)
    np.testing.assert_allclose(picture(board, Film(12, 8)), fields(6, 4, 2, 2), rtol=1e-5)


@pytest.mark.parametrize("glowing", [True, False], ids=["emission", "reflectance"])
@pytest.mark.parametrize("uv", [None, UV], ids=["rectangle", "mesh"])
def test_a_bitmap_lies_on_a_surface_as_on_a_screen(glowing, uv):
    board = board_with(Bitmap(TEXELS, smooth=False), uv, glowing)
    np.testing.assert_allclose(picture(board, Film(6, 4)), TEXELS.repeat(2, axis=0).repeat(2, axis=1), rtol=1e-5)


def test_a_bitmap_is_repeated():
    board = board_with(Bitmap(TEXELS, smooth=False), 3 * UV - 1)
    np.testing.assert_allclose(
        picture(board, Film(18, 12)), np.tile(TEXELS, (3, 3, 1)).repeat(2, 0).repeat(2, 1), rtol=1e-5
    )


def test_a_smooth_bitmap_is_interpolated_between_the_centres_of_texels():
    scene = scene_of([], board_with(Bitmap(TEXELS)))
    for a, b in np.random.default_rng(0).uniform(-1, 1, (40, 2)):
        point = BOARD.center + a * BOARD.half_u + b * BOARD.half_v
        seen = render(scene, RadianceMeter(point + BOARD.normal, -BOARD.normal), Film(1, 1), spp=8).mean[0, 0]
        at = [[(1 - b) / 2 * 2 - 0.5], [(1 + a) / 2 * 3 - 0.5]]
        expected = [map_coordinates(TEXELS[..., k], at, order=1, mode="grid-wrap")[0] for k in range(3)]
        np.testing.assert_allclose(seen, expected, rtol=1e-5)


# ----------------------------------------------------------------------------------------- emission that varies

FLOOR = Rectangle([0.2, 0.1, 0], [1.2, 0, 0], [0, 0.8, 0])
FILM = Film(6, 4)


def texel_lamps(height, texels):
    """The rectangles that the texels of a board are which hangs at this height and shines downwards."""
    rows, columns = texels.shape[:2]
    u, v = BOARD.half_u / columns, BOARD.half_v / rows
    return [
        Area(
            Rectangle(BOARD.center + [0, 0, height] + (2 * column + 1 - columns) * u + (rows - 1 - 2 * row) * v, u, -v),
            texels[row, column],
        )
        for row in range(rows)
        for column in range(columns)
    ]


@pytest.mark.parametrize("strategy", ["light", "bsdf", "mis"])
@pytest.mark.parametrize("height", [0.4, 4])
@pytest.mark.parametrize("is_mesh", [False, True], ids=["rectangle", "mesh"])
@pytest.mark.parametrize("texture", ["bitmap", "checker"])
def test_a_lamp_with_a_texture_shines_like_its_texels(strategy, height, is_mesh, texture):
    pattern = TEXELS if texture == "bitmap" else fields(4, 2, 1, 1)
    emission = Bitmap(TEXELS, smooth=False) if texture == "bitmap" else Checker(EVEN, ODD, 4, 2)
    if is_mesh:
        shape = Mesh(CORNERS + np.array([0, 0, height]), [[0, 2, 1], [0, 3, 2]], uv=UV)
    else:
        # Turned by half around its u axis, v goes down the texture.
        shape = Rectangle(BOARD.center + height * BOARD.normal, BOARD.half_u, -BOARD.half_v)
        pattern = pattern[::-1]
    measured = render(
        scene_of([], Object(shape, None, emission)),
        IrradianceMeter(FLOOR),
        FILM,
        spp=1 << 12,
        strategy=strategy,
        bounces=0,
    )
    assert_right(measured, irradiances(texel_lamps(height, pattern), FLOOR, FILM), known_to=0.02)


def test_a_map_surrounds_the_scene_as_stated():
    up, front = unit([0.2, 0.3, 0.8]), unit(np.cross([0.2, 0.3, 0.8], [0, 1, 0]))
    texels = np.random.default_rng(3).random((5, 7, 3))
    scene = scene_of([Equirectangular(texels, up, front)])
    left = np.cross(up, front)
    for row in range(5):
        for column in range(7):
            theta, phi = (row + 0.3) / 5 * np.pi, (column + 0.8) / 7 * 2 * np.pi
            direction = np.cos(theta) * up + np.sin(theta) * (np.cos(phi) * front + np.sin(phi) * left)
            seen = render(scene, RadianceMeter([0, 0, 0], direction), Film(1, 1), spp=8).mean[0, 0]
            np.testing.assert_allclose(seen, texels[row, column], rtol=1e-6)


# ------------------------------------------------------------------------------------------------------- sensors


@pytest.mark.parametrize("crowd", [[], [CROWD]], ids=["few surfaces", "a hierarchy"])
def test_cameras_see_along_the_rays_of_a_pinhole(crowd):
    origin, target, up = np.array([1.0, -2, 1.5]), np.array([0.2, 0.3, 0.1]), np.array([0.1, 0, 1])
    scene = scene_of(
        [], Object(BOARD, Diffuse(EVEN)), Object(Sphere([0.2, 0.1, 0.5], 0.3), TwoSided(Diffuse(ODD))), *crowd
    )
    film = Film(24, 18)
    forward = unit(target - origin)
    right = unit(np.cross(forward, up))
    down = np.cross(forward, right)
    x, y = np.meshgrid((np.arange(24) + 0.5) / 24 - 0.5, ((np.arange(18) + 0.5) / 18 - 0.5) * 18 / 24)
    aside = x[..., None] * right + y[..., None] * down
    for sensor, origins, directions in (
        (Perspective(origin, target, up, 1.1), origin, forward + 2 * np.tan(0.55) * aside),
        (Orthographic(origin, target, up, 3.0), origin + 3 * aside, np.broadcast_to(forward, aside.shape)),
    ):
        found = first_hits(scene, sensor, film)
        assert set(np.unique(found.object)) == {-1, 0, 1}
        directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        hit = found.object >= 0
        np.testing.assert_allclose(
            (origins + found.distance[..., None] * directions)[hit], found.position[hit], atol=3e-6
        )
        board, ball = found.object == 0, found.object == 1
        np.testing.assert_allclose(found.position[board][:, 2], 0, atol=1e-6)
        np.testing.assert_allclose(found.normal[board], np.broadcast_to([0, 0, 1], found.normal[board].shape))
        np.testing.assert_allclose(found.albedo[board], np.broadcast_to(EVEN, found.albedo[board].shape))
        from_centre = found.position[ball] - [0.2, 0.1, 0.5]
        np.testing.assert_allclose(np.linalg.norm(from_centre, axis=-1), 0.3, rtol=1e-5)
        np.testing.assert_allclose(found.normal[ball], from_centre / 0.3, atol=1e-5)
        np.testing.assert_allclose(found.albedo[ball], np.broadcast_to(ODD, found.albedo[ball].shape))
        assert np.isinf(found.distance[~hit]).all()


def test_a_gaussian_filter_blurs_edges_by_its_width():
    # The right half of the board glows; the filter's cut at four standard deviations takes 3e-4 off its wings.
    half = Rectangle([0.9, 0.2, 0], [0.6, 0, 0], [0, 8, 0])
    film = Film(8, 40, gaussian=0.8)
    seen = render(scene_of([], Object(half, None, [1, 1, 1])), looking_down(BOARD), film, spp=1 << 11)
    distance = np.arange(8) + 0.5 - 4
    expected = norm.cdf(distance / 0.8) - norm.cdf((distance - 4) / 0.8)
    error = np.sqrt(seen.variance[..., 0].sum(axis=0)) / 40
    assert error.max() < 1e-3
    assert (np.abs(seen.mean[..., 0].mean(axis=0) - expected) < 5 * error + 3e-4).all()
