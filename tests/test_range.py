"""Numbers at the ends of the range: whatever is asked, there is a finite answer with a bound, or a reason in words.

The suite turns warnings into errors, so that an overflow that NumPy would only mention fails here.
"""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, reject, settings
from hypothesis import strategies as st

from oracle import (
    Area,
    Constant,
    CosineSky,
    Directional,
    Disk,
    InvalidArgument,
    Line,
    Mesh,
    Point,
    Polygon,
    Receivers,
    Rectangle,
    Sphere,
    Spot,
    irradiance,
    media,
    projected_solid_angle,
    solid_angle,
    vector_irradiance,
    view_factor,
    visible,
)
from oracle.enclosures import closed_box, concentric_spheres, integrating_sphere
from oracle.radiometry import flux, intensity
from oracle.view_factors import crossed_strings
from oracle.visibility import conic_shadow, polygon_shadow, visible_projected_solid_angle

sizes = st.sampled_from([1e-18, 3e-18, 1e-9, 0.5, 1.0, 1e9, 3e17, 1e18])
numbers = st.one_of(
    st.sampled_from([0.0, 0.0, 1.0, -1.0]), st.builds(lambda a, s: a * s, sizes, st.sampled_from([-1, 1]))
)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
units = vectors.filter(lambda v: v.any()).map(lambda v: v / np.abs(v).max()).map(lambda v: v / np.linalg.norm(v))
amounts = st.sampled_from([0.0, 1e-300, 1e-36, 1.0, 1e18, 1e36])


def built(kind, *arguments):
    """Instances of a class, those aside that it refuses."""

    def make(*values):
        try:
            return kind(*values)
        except InvalidArgument:
            reject()

    return st.builds(make, *arguments)


@st.composite
def rectangles(draw):
    n = draw(units)
    u = np.cross(n, np.eye(3)[np.abs(n).argmin()])
    u /= np.linalg.norm(u)
    return draw(built(Rectangle, vectors, sizes.map(lambda a: a * u), sizes.map(lambda b: b * np.cross(n, u))))


def as_mesh(rectangle):
    return Mesh(rectangle.polygon.vertices, [[0, 1, 2], [0, 2, 3]])


flat = st.one_of(rectangles(), built(lambda one: one.polygon, rectangles()), built(as_mesh, rectangles()))
shapes = st.one_of(flat, built(Disk, vectors, units, sizes), built(Sphere, vectors, sizes))
channels = amounts.map(lambda light: [light])
lights = st.one_of(
    built(Area, shapes, channels, st.booleans()),
    built(Point, vectors, channels),
    built(Spot, vectors, units, channels, st.just(0.2), st.just(0.4)),
    built(Directional, units, channels),
    built(Line, vectors, vectors, channels),
    built(Constant, channels),
    built(CosineSky, units, channels, channels),
)
receivers = built(Receivers, vectors, units)


def answered(compute, *arguments):
    """The result, of finite numbers, or None if it is refused."""
    try:
        result = compute(*arguments)
    except InvalidArgument:
        return None
    for part in (result.value, result.error):
        assert np.isfinite(part).all(), result
    assert (result.error >= 0).all()
    return result


def fuzz(**given_ones):
    """Some hundred configurations."""

    def decorate(test):
        relaxed = settings(
            max_examples=100,
            deadline=None,
            derandomize=True,
            database=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        return relaxed(given(**given_ones)(test))

    return decorate


@fuzz(light=lights, receiver=receivers)
def test_irradiance_is_finite(light, receiver):
    answered(irradiance, light, receiver)


@fuzz(light=lights, receiver=receivers, occluders=st.lists(shapes, min_size=1, max_size=2))
def test_irradiance_past_occluders_is_finite(light, receiver, occluders):
    answered(irradiance, light, receiver, occluders)


@fuzz(light=lights, point=vectors)
def test_vector_irradiance_is_finite(light, point):
    answered(vector_irradiance, light, point)


@fuzz(shape=shapes, receiver=receivers)
def test_solid_angles_are_finite(shape, receiver):
    answered(solid_angle, shape, receiver.points)
    answered(projected_solid_angle, shape, receiver, True)


@fuzz(source=shapes, target=shapes)
def test_view_factors_are_finite(source, target):
    result = answered(view_factor, source, target)
    assert result is None or result.value <= 1 + result.error


@fuzz(a=st.tuples(numbers, numbers), b=st.tuples(numbers, numbers), c=st.tuples(numbers, numbers))
def test_crossed_strings_are_finite(a, b, c):
    answered(crossed_strings, [a, b], [b, c])


@fuzz(light=lights, direction=units)
def test_what_emitters_send_is_finite(light, direction):
    answered(flux, light)
    answered(intensity, light, direction)


@fuzz(light=lights, occluder=shapes, ground=rectangles(), point=vectors)
def test_shadows_have_finite_edges(light, occluder, ground, point):
    try:
        visible(light, point, [occluder])
        shadow = polygon_shadow(light.shape if isinstance(light, Area) else light, occluder, ground)
        assert np.isfinite(shadow.penumbra).all()
        assert np.isfinite(shadow.umbra).all()
    except InvalidArgument:
        pass
    try:
        shadow = conic_shadow(light, occluder, ground)
        assert all(np.isfinite(arc).all() for arc in shadow.arcs(1e-2 * float(np.abs(ground.half_u).max())))
    except InvalidArgument:
        pass


@fuzz(light=flat, receiver=receivers, occluder=flat)
def test_penumbrae_are_finite(light, receiver, occluder):
    answered(visible_projected_solid_angle, light, receiver, [occluder])


@fuzz(
    coefficients=st.tuples(amounts, amounts),
    asymmetry=st.sampled_from([-1 + 1e-15, -0.5, 0.0, 0.9, 1 - 1e-15]),
    origin=vectors,
    along=units,
    length=st.one_of(st.just(0.0), sizes),
    position=vectors,
    up=units,
    light=amounts,
)
def test_light_in_media_is_finite(coefficients, asymmetry, origin, along, length, position, up, light):
    medium = media.Medium([coefficients[0]], [coefficients[1]], asymmetry)
    rays = media.Rays(origin, along, length)
    answered(media.transmittance, [coefficients[0]], length)
    answered(media.point_irradiance, Point(position, [light]), Receivers(origin, along), medium)
    answered(media.scattered_point, Point(position, [light]), rays, medium)
    answered(media.scattered_directional, Directional(-up, [light]), rays, medium, media.HalfSpace(position, up))


@fuzz(
    light=amounts,
    rho=st.sampled_from([0.0, 1e-300, 0.5, 1 - 1e-16, 1.0]),
    bounces=st.sampled_from([None, 0, 1, 10**6]),
    radii=st.tuples(sizes, sizes),
    source=shapes,
    direction=units,
)
def test_enclosures_are_finite(light, rho, bounces, radii, source, direction):
    answered(closed_box, [light], [rho], bounces)
    few = None if bounces is None else min(bounces, 3)
    answered(concentric_spheres, *radii, [[light], [light]], [[rho], [rho]], few)
    wall = Sphere([0, 0, 0], radii[0])
    answered(integrating_sphere, wall, Area(source, [light]), direction, [rho], bounces)


@pytest.mark.parametrize(
    ("message", "make"),
    [
        (
            "vertices[1, 0] is 2e+18, coordinates lie within 1e+18 m",
            lambda: Polygon([[0, 0, 0], [2e18, 0, 0], [0, 1, 0]]),
        ),
        ("the extent of vertices is 1e-19 m", lambda: Polygon(1e-19 * np.eye(3))),
        ("center[2] is -1e+100", lambda: Sphere([0, 0, -1e100], 1)),
        ("radius is 1e-19 m, lengths lie between 1e-18 and 1e+18 m", lambda: Disk([0, 0, 0], [0, 0, 1], 1e-19)),
        ("radius is 1.1e+18 m", lambda: Sphere([0, 0, 0], 1.1e18)),
        ("the length of half_v is 1e-20 m", lambda: Rectangle([0, 0, 0], [1, 0, 0], [0, 1e-20, 0])),
        (
            "the extent of triangles[1] is 1e-30 m",
            lambda: Mesh([*np.eye(3), *1e-30 * np.eye(3)], [[0, 1, 2], [3, 4, 5]]),
        ),
        ("points[1, 2] is 1e+19", lambda: Receivers([[0, 0, 0], [0, 0, 1e19]], [0, 0, 1])),
        ("position[0] is 1e+200", lambda: Point([1e200, 0, 0], [1.0])),
        ("intensity[1] is 1e+37, light is at most 1e+36", lambda: Point([0, 0, 0], [1.0, 1e37])),
        ("the length from start to end is 1e-20 m", lambda: Line([0, 0, 0], [0, 0, 1e-20], [1.0])),
        ("lengths is 1e+19", lambda: media.Rays([0, 0, 0], [0, 0, 1], 1e19)),
        ("lengths[0] is -1.0, a distance is at least 0", lambda: media.Rays([0, 0, 0], [0, 0, 1], [-1.0])),
        ("the shortest segment of target is 1e-20 m", lambda: crossed_strings([[0, 0], [1, 0]], [[0, 1e-20], [0, 0]])),
    ],
)
def test_what_leaves_the_range_is_refused_by_name_and_index(message, make):
    with pytest.raises(InvalidArgument, match=re.escape(message)):
        make()


def test_the_sun_fits_into_the_range():
    # 3.828e26 W from 149.6 million kilometres away are the solar constant [IAU 2015, resolutions B2 and B3].
    sun = Point([0, 0, 149.5978707e9], [3.828e26 / (4 * np.pi)])
    np.testing.assert_allclose(irradiance(sun, Receivers([0, 0, 0], [0, 0, 1])).value, 1361, rtol=1e-3)
