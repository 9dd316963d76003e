"""Expected images against hand computation, Embree and Mitsuba 3, and the refusal of scenes without a closed form."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quadrature import unit
from scipy import stats

from oracle import pixels
from oracle.emitters import Area, Receivers, Spot
from oracle.irradiances import irradiance
from oracle.shapes import Disk, Polygon, Sphere
from reference_scenes import model
from reference_scenes.closed_form import NoClosedForm, camera_rays, closed_form, film_radiance, require_closed_form
from reference_scenes.export import export
from reference_scenes.families import FAMILIES

quick = settings(derandomize=True, deadline=None, max_examples=20)

WHITE = model.Diffuse(reflectance=(1.0, 1.0, 1.0))
GREY = model.Diffuse(reflectance=(0.6, 0.4, 0.2))
BLACK = model.Diffuse(reflectance=(0.0, 0.0, 0.0))
ONE = (1.0, 1.0, 1.0)
RGB = (3.0, 2.0, 1.0)
# From above onto the plane z = 0: the image's x is the world's x, its y points against the world's y.
ABOVE = model.Camera(origin=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov_x=40.0)


def floor(material=GREY, height=0.0, half_size=10.0):
    shape = model.Rectangle(center=(0.0, 0.0, height), half_u=(half_size, 0.0, 0.0), half_v=(0.0, half_size, 0.0))
    return model.Object(shape=shape, material=material)


def ball(center, radius=0.2, material=BLACK):
    return model.Object(shape=model.Sphere(center=center, radius=radius), material=material)


def rectangle(center, half_u, half_v):
    return model.Rectangle(center=center, half_u=half_u, half_v=half_v)


def lamp(height=2.0, radiance=RGB):
    """A rectangle above the floor that faces down."""
    shape = rectangle((0.0, 0.0, height), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0))
    return model.AreaEmitter(shape=shape, radiance=radiance)


def scene(*parts, camera=ABOVE, width=12, height=8, pixel_filter=None):
    film = model.Film(width=width, height=height, filter=pixel_filter or model.BoxFilter())
    objects = tuple(part for part in parts if isinstance(part, model.Object))
    emitters = tuple(part for part in parts if not isinstance(part, model.Object))
    return model.Scene(objects=objects, emitters=emitters, camera=camera, film=film)


POINT = model.PointEmitter(position=(0.5, 0.2, 2.0), intensity=RGB)
SKY = model.ConstantEmitter(radiance=RGB)


# ---------------------------------------------------------------------------------------------------- camera


def test_a_ray_through_every_corner_of_the_film_by_hand():
    # Looking along +x with z up: the image's right is -y. A field of 90 degrees makes the film 2 wide at distance 1;
    # 4 x 2 pixels make it 1 high.
    camera = model.Camera(origin=(1.0, 2.0, 3.0), target=(5.0, 2.0, 3.0), up=(0.0, 0.0, 1.0), fov_x=90.0)
    origins, directions = camera_rays(
        scene(camera=camera, width=4, height=2), np.array([0.0, 4, 0, 4, 2, 0.5]), np.array([0.0, 0, 2, 2, 1, 0.5])
    )
    np.testing.assert_array_equal(origins, np.broadcast_to([1, 2, 3], (6, 3)))
    by_hand = [[1, 1, 0.5], [1, -1, 0.5], [1, 1, -0.5], [1, -1, -0.5], [1, 0, 0], [1, 0.75, 0.25]]
    np.testing.assert_allclose(directions, by_hand, rtol=1e-14, atol=1e-14)


def test_up_need_not_be_upright():
    leaning = ABOVE.model_copy(update={"up": (0.0, 1.0, 0.7)})
    x, y = np.array([0.0, 3.3]), np.array([1.0, 2.2])
    np.testing.assert_allclose(camera_rays(scene(camera=leaning), x, y), camera_rays(scene(), x, y), atol=1e-15)


def test_the_field_of_view_is_that_of_the_width_whatever_the_height():
    half = np.tan(np.radians(20))
    for height in (1, 8, 50):
        _, directions = camera_rays(scene(height=height), np.array([0.0, 12.0]), np.full(2, height / 2))
        np.testing.assert_allclose(directions[:, 0], [-half, half], rtol=1e-14)


@pytest.mark.parametrize(
    ("world", "column", "row"), [((-1, 1), 0, 0), ((1, 1), -1, 0), ((-1, -1), 0, -1), ((1, -1), -1, -1)]
)
def test_what_lies_left_and_above_in_the_world_is_seen_left_and_above(world, column, row):
    half_width = 4 * np.tan(np.radians(20))
    corner = (world[0] * half_width, world[1] * half_width * 8 / 12, 0.0)
    image = closed_form(scene(SKY, ball(corner, radius=0.05))).radiance
    dark = np.argwhere(image[..., 0] < RGB[0] - 1e-3)
    assert dark.tolist() == [[row % 8, column % 12]]


def test_a_mesh_is_seen_where_embree_sees_it():
    from oracle.tracer import RayCaster

    rng = np.random.default_rng(4)
    vertices = rng.uniform(-1.2, 1.2, (15, 3))
    triangles = rng.permutation(15).reshape(-1, 3)
    mesh = model.Mesh(vertices=tuple(map(tuple, vertices.tolist())), triangles=tuple(map(tuple, triangles.tolist())))
    camera = model.Camera(origin=(2.0, 3.0, 1.5), target=(0.1, 0.0, 0.2), up=(0.1, 0.2, 1.0), fov_x=50.0)
    width, height, per_axis = 18, 12, 16
    image = closed_form(
        scene(SKY, model.Object(shape=mesh, material=BLACK), camera=camera, width=width, height=height)
    ).radiance
    # Coverage by 256 rays in each pixel, with the camera set up here anew.
    forward = unit(np.subtract(camera.target, camera.origin))
    right = unit(np.cross(forward, camera.up))
    u, v = np.meshgrid(*((np.arange(n * per_axis) + 0.5) / per_axis for n in (width, height)))
    scale = np.tan(np.radians(25)) * 2 / width
    directions = (
        forward
        + ((u.ravel() - width / 2) * scale)[:, None] * right
        - ((v.ravel() - height / 2) * scale)[:, None] * np.cross(right, forward)
    )
    hit = (
        RayCaster(vertices, triangles).closest_hit(np.broadcast_to(camera.origin, directions.shape), directions)[1] >= 0
    )
    covered = hit.reshape(height, per_axis, width, per_axis).mean(axis=(1, 3))
    assert 0.1 < covered.mean() < 0.8
    # An edge through a pixel moves its count by about one row of 16 rays at worst.
    np.testing.assert_allclose(image[..., 0] / RGB[0], 1 - covered, atol=0.06)
    np.testing.assert_allclose(image[..., 0].mean() / RGB[0], 1 - covered.mean(), atol=2e-3)


# ------------------------------------------------------------------------------------------ radiance on the film


def seen_from_above(x, y, width=12, height=8, fov_x=40.0):
    """Where on the plane z = 0 the camera ABOVE looks, at film positions."""
    scale = 4 * np.tan(np.radians(fov_x / 2)) * 2 / width
    return np.stack([(x - width / 2) * scale, -(y - height / 2) * scale, 0 * x], axis=-1)


X, Y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.1, 11.9, 9), np.linspace(0.1, 7.9, 7)))


@pytest.mark.parametrize(
    ("emitter", "light"),
    [
        (lamp(5.0), Area(Polygon([[-0.5, 0.5, 5], [0.5, 0.5, 5], [0.5, -0.5, 5], [-0.5, -0.5, 5]]), RGB)),
        (
            model.AreaEmitter(
                shape=model.Disk(center=(1.0, 0.5, 5.0), normal=(0.0, 0.3, -1.0), radius=0.7), radiance=RGB
            ),
            Area(Disk([1, 0.5, 5], unit([0, 0.3, -1]), 0.7), RGB),
        ),
        (
            model.AreaEmitter(shape=model.Sphere(center=(2.0, 1.0, 5.0), radius=0.6), radiance=RGB),
            Area(Sphere([2, 1, 5], 0.6), RGB),
        ),
        (
            model.SpotEmitter(
                position=(1.0, 0.5, 5.0), direction=(-0.2, 0.0, -1.0), intensity=RGB, beam_width=8.0, cutoff_angle=14.0
            ),
            Spot([1, 0.5, 5], unit([-0.2, 0, -1]), RGB, np.radians(8), np.radians(14)),
        ),
    ],
    ids=["rectangle", "disk", "sphere", "spot"],
)  # fmt: skip
def test_a_floor_shows_reflectance_over_pi_times_irradiance(emitter, light):
    radiance, _ = film_radiance(scene(floor(), emitter))(X, Y)
    expected = np.array(GREY.reflectance) / np.pi * irradiance(light, Receivers(seen_from_above(X, Y), [0, 0, 1])).value
    assert expected.max() > 0
    # Positions on the floor carry a few roundings, which the edge of the spot's cone amplifies.
    np.testing.assert_allclose(radiance, expected, rtol=1e-10, atol=1e-14)


def test_a_point_lights_a_floor_by_hand():
    # At the foot of a point 2 m above: E = I / 4; L = rho / pi E.
    point = model.PointEmitter(position=(0.0, 0.0, 2.0), intensity=RGB)
    radiance, _ = film_radiance(scene(floor(), point))(np.array([6.0]), np.array([4.0]))
    np.testing.assert_allclose(radiance[0], [0.6 * 3 / 4 / np.pi, 0.4 * 2 / 4 / np.pi, 0.2 / 4 / np.pi], rtol=1e-14)


def test_lights_add_up():
    lights = [POINT, SKY, model.DirectionalEmitter(direction=(0.3, 0.1, -1.0), irradiance=(1.0, 3.0, 2.0))]
    alone = [film_radiance(scene(floor(), light))(X, Y)[0] for light in lights]
    np.testing.assert_allclose(film_radiance(scene(floor(), *lights))(X, Y)[0], sum(alone), rtol=1e-14)


def test_front_sides_alone_reflect_and_shine():
    upside_down = floor().model_copy(update={"shape": rectangle((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (0.0, -10.0, 0.0))})
    assert not closed_form(scene(upside_down, POINT)).radiance.any()
    # From above one sees the back of a lamp that faces down.
    assert not closed_form(scene(lamp(1.0))).radiance.any()
    facing_up = model.AreaEmitter(shape=rectangle((0.0, 0.0, 1.0), (9.0, 0.0, 0.0), (0.0, 9.0, 0.0)), radiance=RGB)
    np.testing.assert_allclose(closed_form(scene(facing_up)).radiance, np.broadcast_to(RGB, (8, 12, 3)), rtol=1e-15)


def test_the_nearest_surface_is_seen():
    for order in (1, -1):
        parts = [ball((0.0, 0.0, 1.0), 0.5), floor()][::order]
        radiance, _ = film_radiance(scene(*parts, POINT))(np.array([6.0, 0.5]), np.array([4.0, 0.5]))
        assert not radiance[0].any()
        assert radiance[1].all()


def test_an_empty_scene_is_black_and_one_with_a_sky_shows_it():
    assert not closed_form(scene()).radiance.any()
    both = closed_form(scene(SKY, SKY)).radiance
    np.testing.assert_allclose(both, np.broadcast_to(RGB, (8, 12, 3)) * 2, rtol=1e-15)


def test_the_expectation_says_how_it_was_computed():
    expectation = closed_form(scene(floor(), POINT), formulas=("L = rho/pi E (Lambert 1760)",))
    assert expectation.provenance.method == "closed form"
    assert expectation.provenance.formulas == ("L = rho/pi E (Lambert 1760)",)
    assert not expectation.standard_error.any()
    assert expectation.valid.all()
    assert expectation.radiance.shape == expectation.error_bound.shape == (8, 12, 3)
    # A smooth image is known to 1e-5 of itself and of the whole image's mean.
    assert np.all(expectation.error_bound <= 1e-5 * (expectation.radiance + expectation.radiance.mean(axis=(0, 1))))


def test_a_pixel_is_the_mean_over_its_square():
    parts = (floor(), ball((0.3, 0.1, 1.0), 0.4), POINT)
    image = closed_form(scene(*parts)).radiance
    per_axis = 64
    x, y = np.meshgrid(*((np.arange(n * per_axis) + 0.5) / per_axis for n in (12, 8)))
    sampled = film_radiance(scene(*parts))(x.ravel(), y.ravel())[0]
    sampled = sampled.reshape(8, per_axis, 12, per_axis, 3).mean(axis=(1, 3))
    # An edge through 64 x 64 points is counted to about a tenth of a row.
    np.testing.assert_allclose(image, sampled, atol=2e-3 * image.max())
    np.testing.assert_allclose(image.mean(axis=(0, 1)), sampled.mean(axis=(0, 1)), rtol=2e-4)


@pytest.mark.parametrize("count", [1, 2, 25, 40])
def test_the_shadows_of_any_number_of_lights_are_told_apart(count):
    # More lights than a label has bits: each casts a shadow of its own.
    positions = np.array([(2.5 * np.cos(a), 2.0 * np.sin(a), 2.0) for a in np.linspace(0, 6, count)])
    lights = [model.PointEmitter(position=p, intensity=ONE) for p in positions.tolist()]
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.01, 11.99, 100), np.linspace(0.01, 7.99, 80)))
    _, label = film_radiance(scene(floor(), ball((0.0, 0.0, 0.5), 0.2), *lights))(x, y)
    # Around each point of the floor the same: seen, or hidden by the ball, from each light.
    points = seen_from_above(x, y)
    towards = positions[:, None] - points
    along = np.clip(((np.array([0, 0, 0.5]) - points) * towards).sum(-1) / (towards**2).sum(-1), 0, 1)
    hidden = np.linalg.norm(points + along[..., None] * towards - [0, 0, 0.5], axis=-1) < 0.2
    # The ball, seen from above at distance 4 - 0.5, covers directions of less than asin(0.2 / 3.5) around its center.
    on_ball = np.hypot(points[:, 0], points[:, 1]) / 4 < np.tan(np.arcsin(0.2 / 3.5))
    states = np.packbits(hidden, axis=0).T[~on_ball]
    assert len(np.unique(states, axis=0)) > count
    # As many labels as states, and as many as pairs of both: one for one.
    pairs = np.column_stack([states, label[~on_ball][:, None].view(np.uint8).reshape(len(states), 8)])
    assert len(np.unique(states, axis=0)) == len(np.unique(label[~on_ball])) == len(np.unique(pairs, axis=0))
    assert not set(label[on_ball]) & set(label[~on_ball])


def test_the_kinks_of_a_spot_are_within_the_bound():
    spot = model.SpotEmitter(
        position=(0.3, 0.2, 3.0), direction=(0.0, 0.0, -1.0), intensity=RGB, beam_width=10.0, cutoff_angle=11.0
    )
    expectation = closed_form(scene(floor(), spot, width=6, height=4))
    per_axis = 100
    x, y = np.meshgrid(*((np.arange(n * per_axis) + 0.5) / per_axis for n in (6, 4)))
    sampled = film_radiance(scene(floor(), spot, width=6, height=4))(x.ravel(), y.ravel())[0]
    sampled = sampled.reshape(4, per_axis, 6, per_axis, 3).mean(axis=(1, 3))
    # The midpoint rule errs by 3e-5 at the kinks.
    allowed = expectation.error_bound + 5e-5 * expectation.radiance.max()
    assert np.all(np.abs(expectation.radiance - sampled) <= allowed)


@quick
@given(st.floats(0.2, 1.5), st.floats(0.1, 1.0), st.floats(-1, 1))
def test_a_white_ball_in_white_light_is_invisible(radius, radiance, x):
    sky = model.ConstantEmitter(radiance=(radiance, 1.0, 2.0))
    small = scene(sky, ball((x, 0.3, 0.0), radius, WHITE), width=3, height=2)
    np.testing.assert_allclose(
        closed_form(small).radiance, np.broadcast_to([radiance, 1.0, 2.0], (2, 3, 3)), rtol=1e-12
    )


# ------------------------------------------------------------------------------------------------ hard shadows


def tessellated(shape):
    """A shape as a mesh for Embree, on the outside of round ones by less than 1e-3 of their size."""
    match shape:
        case model.Rectangle():
            c, u, v = map(np.array, (shape.center, shape.half_u, shape.half_v))
            return np.array([c - u - v, c + u - v, c + u + v, c - u + v]), np.array([[0, 1, 2], [0, 2, 3]])
        case model.Disk():
            n = unit(shape.normal)
            u = unit(np.cross(n, np.eye(3)[np.abs(n).argmin()]))
            angles = np.linspace(0, 2 * np.pi, 256, endpoint=False)
            rim = np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * np.cross(n, u)
            corners = np.concatenate([shape.center + shape.radius * rim, [shape.center]])
            return corners, np.array([[256, i, (i + 1) % 256] for i in range(256)])
        case model.Sphere():
            polar, azimuth = np.meshgrid(np.linspace(0, np.pi, 129), np.linspace(0, 2 * np.pi, 257), indexing="ij")
            on = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
            at = np.arange(129 * 257).reshape(129, 257)
            a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
            return np.add(shape.center, shape.radius * on.reshape(-1, 3)), np.concatenate(
                [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
            )


@pytest.mark.parametrize("seed", range(12))
def test_the_hard_shadow_falls_where_embree_is_occluded(seed):
    from oracle.tracer import RayCaster

    member = FAMILIES["hard-shadow"].member(seed)
    occluder, light = RayCaster(*tessellated(member.objects[1].shape)), np.array(member.emitters[0].position)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, member.film.width, 5000), rng.uniform(0, member.film.height, 5000)
    image = film_radiance(member)
    radiance, label = image(x, y)
    origins, directions = camera_rays(member, x, y)
    t = -origins[:, 2] / directions[:, 2]
    on_floor = (t > 0) & ~occluder.occluded(origins, directions, np.where(t > 0, t, 1))
    points = origins + t[:, None] * directions
    # Just above the floor, whose own mesh is not needed.
    shadowed = np.zeros(len(x), bool)
    shadowed[on_floor] = occluder.occluded(points[on_floor], light - points[on_floor], 1.0)
    # Round occluders are polygonal here: leave out what a tenth of a pixel may change.
    clear = np.ones(len(x), bool)
    for dx, dy in ((0.1, 0), (-0.1, 0), (0, 0.1), (0, -0.1)):
        clear &= image(x + dx, y + dy)[1] == label
    sure = on_floor & clear
    assert sure.mean() > 0.5
    assert 0.01 < shadowed[sure].mean() < 0.6
    np.testing.assert_array_equal(radiance[sure].max(axis=1) == 0, shadowed[sure])


def test_a_surface_does_not_shadow_itself():
    # A ball lit from the side: lit wherever it faces the light, to the very terminator.
    light = model.PointEmitter(position=(5.0, 1.0, 3.0), intensity=RGB)
    parts = scene(ball((0.2, 0.1, 0.3), 1.0, GREY), light)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 12, 301), np.linspace(0, 8, 201)))
    radiance, _ = film_radiance(parts)(x, y)
    origins, directions = camera_rays(parts, x, y)
    offset = origins - [0.2, 0.1, 0.3]
    a, b, c = (directions**2).sum(1), (offset * directions).sum(1), (offset**2).sum(1) - 1
    hit = b * b > a * c
    normal = offset[hit] + ((-b[hit] - np.sqrt((b * b - a * c)[hit])) / a[hit])[:, None] * directions[hit]
    cosine = ((np.array(light.position) - [0.2, 0.1, 0.3] - normal) * normal).sum(1)
    lit = radiance[hit].max(axis=1) > 0
    # 1e-6 from the terminator the light is 1e-6 of full.
    np.testing.assert_array_equal(lit[np.abs(cosine) > 1e-6], cosine[np.abs(cosine) > 1e-6] > 0)


# ----------------------------------------------------------------------------------------- what has no closed form

TETRAHEDRON = model.Mesh(
    vertices=((0.0, 0.0, 3.0), (1.0, 0.0, 3.0), (0.0, 1.0, 3.0), (0.0, 0.0, 3.5)),
    triangles=((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
)
TRIANGLE = model.Mesh(vertices=((0.0, 0.0, 3.0), (0.0, 1.0, 3.0), (1.0, 0.0, 3.0)), triangles=((0, 1, 2),))
CEILING = model.Object(shape=rectangle((0.0, 0.0, 5.0), (9.0, 0.0, 0.0), (0.0, -9.0, 0.0)), material=GREY)
WALL = model.Object(shape=rectangle((9.0, 0.0, 1.0), (0.0, 9.0, 0.0), (0.0, 0.0, 0.5)), material=GREY)


PARALLEL = model.OrthographicCamera(origin=ABOVE.origin, target=ABOVE.target, up=ABOVE.up, width=2.0)
CHECKER = model.Checker(even=ONE, odd=(0.0, 0.0, 0.0))
UP = ((0.0, 0.0, 1.0),) * 3
ONE_TRIANGLE = model.Mesh(vertices=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), triangles=((0, 1, 2),))
BENT = model.Object(shape=ONE_TRIANGLE.model_copy(update={"normals": UP}), material=GREY)
AS_IT_IS = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
COPIES = model.Object(shape=model.Instances(mesh=ONE_TRIANGLE, transforms=(AS_IT_IS,)), material=BLACK)


@pytest.mark.parametrize(
    ("refused", "message"),
    [
        (
            scene(floor(), lamp(), pixel_filter=model.GaussianFilter()),
            "/film/filter is gaussian; closed forms need the box filter",
        ),
        (scene(floor(), CEILING, POINT), "/objects/0/shape and /objects/1/shape both reflect and may light each other"),
        (scene(POINT, WALL, floor()), "/objects/0/shape and /objects/1/shape both reflect and may light each other"),
        (
            scene(floor(), ball((0.0, 0.0, 1.0), material=GREY), POINT),
            "/objects/0/shape and /objects/1/shape both reflect and may light each other",
        ),
        (scene(floor(), ball((0.0, 0.0, 1.0)), lamp()), "/objects/1/shape may hide /emitters/0 from /objects/0"),
        (scene(ball((0.0, 0.0, 1.0)), floor(), POINT, lamp()), "/objects/0/shape may hide /emitters/1 from /objects/1"),
        # An occluder that reaches from behind the lamp to its front, or from below the floor above it.
        (scene(floor(), ball((0.0, 0.0, 2.1)), lamp()), "/objects/1/shape may hide /emitters/0 from /objects/0"),
        (scene(floor(), ball((0.0, 0.0, -0.1)), lamp()), "/objects/1/shape may hide /emitters/0 from /objects/0"),
        (scene(floor(), lamp(2.0), lamp(1.0)), "/emitters/1/shape may hide /emitters/0 from /objects/0"),
        (scene(floor(), lamp(1.0), lamp(2.0)), "/emitters/0/shape may hide /emitters/1 from /objects/0"),
        (
            scene(floor(), model.AreaEmitter(shape=TETRAHEDRON, radiance=RGB)),
            "/emitters/0/shape is a mesh of several triangles, which may hide each other",
        ),
        (
            scene(model.Object(shape=TETRAHEDRON, material=GREY), POINT),
            "/objects/0/shape reflects and may not be convex; use a rectangle, disk, sphere or triangle",
        ),
        (
            scene(ball((0.0, 0.0, 0.0), 1.0, GREY), ball((2.0, 0.0, 0.0)), SKY),
            "/objects/1/shape may hide /emitters/0 from /objects/0",
        ),
        (scene(floor(), lamp(), SKY), "/emitters/0/shape may hide /emitters/1 from /objects/0"),
        # Other than diffuse surfaces, uniform light and a pinhole.
        (
            scene(floor(model.Plastic(reflectance=ONE, eta=1.5)), POINT),
            "/objects/0/material is plastic; closed forms of images need diffuse",
        ),
        (
            scene(floor(model.Diffuse(reflectance=CHECKER)), POINT),
            "/objects/0/material/reflectance is a texture; closed forms of images need one colour",
        ),
        (
            scene(floor(), COPIES, POINT),
            "/objects/1/shape holds instances, which may hide each other or light each other",
        ),
        (scene(BENT, POINT), "/objects/0/shape/normals bend it; closed forms need the surface as it is"),
        (
            scene(floor(), lamp(radiance=CHECKER)),
            "/emitters/0/radiance is a texture; closed forms of images need one colour",
        ),
        (
            scene(floor(), lamp().model_copy(update={"two_sided": True})),
            "/emitters/0/two_sided is true; closed forms of images need light from the front alone",
        ),
        (
            scene(floor(), model.SkyEmitter(zenith=RGB)),
            "/emitters/0 is sky; closed forms of images need a constant environment",
        ),
        (
            scene(floor(), POINT, camera=PARALLEL),
            "/camera is orthographic; closed forms of images need a perspective camera",
        ),
        (
            scene(floor(), POINT).model_copy(update={"medium": model.Medium(absorption=ONE, scattering=ONE)}),
            "/medium scatters or absorbs; closed forms of images need empty space",
        ),
        # A sphere has no side behind which an occluder would be harmless.
        (
            scene(floor(), ball((0.0, 0.0, 3.0)),
                  model.AreaEmitter(shape=model.Sphere(center=(0.0, 0.0, 2.0), radius=0.3), radiance=RGB)),
            "/objects/1/shape may hide /emitters/0 from /objects/0",
        ),
    ],
)  # fmt: skip
def test_a_scene_without_closed_form_is_refused_by_the_path_of_what_stands_in_the_way(refused, message):
    for attempt in (require_closed_form, film_radiance, closed_form):
        with pytest.raises(NoClosedForm) as caught:
            attempt(refused)
        assert str(caught.value) == message


def test_the_paths_in_a_refusal_lead_to_the_parts_of_the_scene():
    refused = scene(ball((0.0, 0.0, 1.0)), floor(), POINT, lamp())
    with pytest.raises(NoClosedForm) as caught:
        require_closed_form(refused)
    document = json.loads(refused.model_dump_json())
    paths = [word for word in str(caught.value).split() if word.startswith("/")]
    assert len(paths) == 3
    for path in paths:
        place = document
        for part in path.strip("/").split("/"):
            place = place[int(part)] if part.isdecimal() else place[part]


@pytest.mark.parametrize(
    "accepted",
    [
        scene(floor(), lamp(), ball((0.0, 0.0, 2.5))),
        scene(floor(), lamp(), ball((0.0, 0.0, 2.2))),
        scene(floor(), lamp(), ball((0.0, 0.0, -0.2))),
        scene(floor(), lamp(), model.Object(shape=TETRAHEDRON, material=BLACK)),
        scene(floor(), POINT, ball((0.0, 0.0, 1.0)), model.Object(shape=TETRAHEDRON, material=BLACK)),
        scene(floor(), SKY, ball((0.0, 0.0, -1.0))),
        # One lamp behind the other, and two side by side in one plane.
        scene(floor(), lamp(2.0), model.AreaEmitter(shape=rectangle((3.0, 0.0, 2.0), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0)),
                                                    radiance=RGB)),
        scene(floor(), model.AreaEmitter(shape=TRIANGLE, radiance=RGB)),
        scene(model.Object(shape=TRIANGLE, material=GREY), POINT),
        scene(ball((0.0, 0.0, 0.0), 1.0, GREY), SKY),
        scene(ball((0.0, 0.0, 0.0), 1.0, GREY), lamp()),
        # Back to back, and side by side in one plane: neither sees the other.
        scene(floor(half_size=1.0), model.Object(shape=rectangle((3.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
                                                 material=WHITE), POINT),
        scene(floor(), floor(BLACK, height=1.0), POINT),
        scene(SKY, POINT, lamp(), model.Object(shape=TETRAHEDRON, material=BLACK)),
        scene(),
    ],
)  # fmt: skip
def test_a_harmless_occluder_is_no_obstacle(accepted):
    require_closed_form(accepted)


# ----------------------------------------------------------------------------------------------------- Mitsuba 3

# Every family as drawn with one seed, and on half of its film with two more.
CASES = [(name, 0, 1) for name in FAMILIES] + [(name, seed, 2) for name in FAMILIES for seed in (1, 2)]
IMAGES, SPP = 32, 8
TILES = 6, 4
# All channels of all cases, half of the chance of a false alarm for whole images and half for tiles.
FALSE_ALARM = 1e-6
# Mitsuba computes in single precision.
SINGLE = 2e-5


def member_on_film(name, seed, shrink):
    member = FAMILIES[name].member(seed)
    size = {"width": member.film.width // shrink, "height": member.film.height // shrink}
    return member.model_copy(update={"film": member.film.model_copy(update=size)})


def rendered(member, folder):
    """Independent renderings of a scene, shape (IMAGES, height, width, 3)."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    loaded = mitsuba.load_file(str(export(member, "mitsuba3", folder)))
    return np.stack([np.array(mitsuba.render(loaded, spp=SPP, seed=k), float) for k in range(IMAGES)])


def assert_means_agree(images, expected, bound, comparisons):
    """Student's t of each of the means (K, ...), with a chance of 1e-6 / 2 that any of all comparisons fails."""
    threshold = stats.t.isf(FALSE_ALARM / 2 / comparisons / 2, len(images) - 1)
    error = images.std(axis=0, ddof=1) / np.sqrt(len(images))
    allowed = threshold * error + bound + SINGLE * expected
    excess = np.abs(images.mean(axis=0) - expected) / np.where(allowed > 0, allowed, 1)
    assert excess.max() <= 1, (
        f"{excess.max():.2f} of what is allowed at {np.unravel_index(excess.argmax(), excess.shape)}"
    )


def tiles(image):
    *leading, height, width, channels = image.shape
    columns, rows = TILES
    return image.reshape(*leading, rows, height // rows, columns, width // columns, channels).mean(axis=(-4, -2))


@pytest.mark.parametrize(("name", "seed", "shrink"), CASES)
def test_mitsuba_shows_what_is_expected(name, seed, shrink, tmp_path):
    member = member_on_film(name, seed, shrink)
    images = rendered(member, tmp_path)
    if shrink == 1:
        expectation = closed_form(member)
        expected, bound = expectation.radiance, expectation.error_bound
    else:
        # The same to three digits, which is enough here and takes less time.
        expected, bound = pixels.average(film_radiance(member), member.film.width, member.film.height, 1e-3)
    in_all = 3 * len(CASES)
    assert_means_agree(images.mean(axis=(1, 2)), expected.mean(axis=(0, 1)), bound.mean(axis=(0, 1)), in_all)
    # Where next to no light arrives, a few rare samples are no normal distribution.
    bright = tiles(expected).min(axis=-1) > 0.01 * expected.mean()
    assert bright.sum() >= 6
    in_all *= TILES[0] * TILES[1]
    assert_means_agree(tiles(images)[:, bright], tiles(expected)[bright], tiles(bound)[bright], in_all)
    dark = tiles(expected).max(axis=-1) == 0
    assert not tiles(images)[:, dark].any()
