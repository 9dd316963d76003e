"""Vector irradiance against integrals of its definition in ball arithmetic, one component of it at a time.

Flat shapes are integrated in polar coordinates around the receiver's foot (polygons) or their centre (disks), where one
or both integrals are elementary, and not along their contour as `oracle` does.
"""

import math

import numpy as np
from flint import acb, arb
from hypothesis import strategies as st
from verification import Form
from verified import line, point_like
from verified.environment import maps, skies
from verified.geometry import (
    ball,
    balls,
    between,
    cross,
    directions,
    dot,
    frame,
    integral,
    minus,
    norm,
    number,
    powers_of_ten,
    precise,
    receivers,
    times,
    unit,
)

from oracle.emitters import Area, CosineSky, Equirectangular, Line, Spot
from oracle.shapes import Disk, Polygon, Sphere
from oracle.vector_irradiances import vector_irradiance


def of(emitter, point, axis):
    """Value and bound of one component of one channel."""
    found = vector_irradiance(emitter, point)
    return float(found.value[axis, 0]), float(found.error[axis, 0])


def with_axis(strategy):
    return st.tuples(strategy, st.integers(0, 2))


# ------------------------------------------------------------------------------------------- points and lines


def exact_spot(configuration):
    (emitter, point, _), axis = configuration
    offset = minus(balls(emitter.position), balls(point))
    part = point_like.falloff(emitter, point) if isinstance(emitter, Spot) else arb(1)
    return 0.0 if part == 0 or offset[axis] == 0 else number(part * offset[axis] / norm(offset) ** 3)


def computed_spot(configuration):
    (emitter, point, _), axis = configuration
    return of(emitter, point, axis)


def exact_line(configuration):
    (start, end, point, _), axis = configuration
    return line.exact_along(start, end, point, balls(np.eye(3)[axis]), False)


def computed_line(configuration):
    (start, end, point, _), axis = configuration
    return of(Line(start, end, [1.0]), point, axis)


# ------------------------------------------------------------------------------------------------------- shapes


@precise
def exact_polygon(configuration):
    """Polar coordinates around the foot, from it to each edge: by the radius, and by parts over the angle."""
    (vertices, point, two_sided), axis = configuration
    p = balls(point)
    offsets = [minus(balls(vertex), p) for vertex in vertices]
    edges = [minus(b, a) for a, b in zip(offsets, offsets[1:] + offsets[:1], strict=True)]
    area = [arb(0)] * 3
    for a, b in zip(offsets, edges, strict=True):
        area = [x + y for x, y in zip(area, cross(a, b), strict=True)]
    w = unit(area)
    h = -dot(w, offsets[0])
    if vertices[:, 2].any() and abs(h) < 1e-15 * float(norm(edges[0])):
        return None
    if h == 0 or (h < 0 and not two_sided):
        return 0.0
    side, h = (-1 if h > 0 else 1), abs(h)
    total = arb(0)
    for start, edge in zip(offsets, edges, strict=True):
        length, along = norm(edge), unit(edge)
        # The edge's line in the plane: its point nearest to the foot at the signed distance d along `out`.
        out = cross(along, w)
        d = dot(out, start)
        if not abs(d) > 0:
            continue
        first = dot(along, start)
        away = (d * d + h * h).sqrt()

        def primitive(s, d=d, along=along, out=out, away=away):
            # Radius rho and angle f = atan(s / d): over rho remain ``rho^2 / (h^2 + rho^2) / 2`` upright, and across
            # ``(atan(rho / h) - h rho / (h^2 + rho^2)) / 2``, times the direction's cosine or sine.
            rho = (d * d + s * s).sqrt()
            upright = d * (s / away).atan() / away
            flat, turned = (rho / h).atan() / rho, (s / away).atan() / away
            return side * w[axis] * upright + out[axis] * (s * flat - h * turned) - along[axis] * d * flat

        total += (primitive(first + length) - primitive(first)) / 2
    return number(total)


def computed_polygon(configuration):
    (vertices, point, two_sided), axis = configuration
    return of(Area(Polygon(vertices), [1.0], two_sided), point, axis)


@precise
def exact_disk(configuration):
    """Ring by ring: a ring's integrals of 1/d^4 and cos(f)/d^4 are elementary."""
    (center, normal, radius, point, two_sided), axis = configuration
    disk = Disk(center, normal, radius)
    w = unit(balls(disk.normal))
    offset = minus(balls(disk.center), balls(point))
    h = dot(w, offset)
    if abs(h) < 1e-30:
        return None
    if h > 0 and not two_sided:
        return 0.0
    flat = minus(offset, times(w, h))
    rho = norm(flat) if any(not x.contains(0) for x in flat) else arb(0)
    u = times(flat, 1 / rho) if rho > 0 else [arb(0)] * 3

    r = ball(radius)
    if not rho > 0:
        # With t = r^2, the ring's 1/d^4.
        return number(h * abs(h) * integral(lambda t: arb.pi() * w[axis] / (t + h * h) ** 2, 0, r * r))
    # With d^2 = t + rho^2 + h^2 - 2 rho r cos(f), the integrals over f have the third power of
    # sqrt((t - rho^2 + h^2)^2 + (2 h rho)^2) below; let that be 2 h rho cosh(y).
    scale, shift = 2 * abs(h) * rho, rho * rho - h * h

    def ring(y):
        t = shift + scale * y.sinh()
        d = rho * rho + h * h + t
        return (u[axis] * rho * (d - 2 * t) + w[axis] * h * d) / y.cosh() ** 2

    low, high = (-shift / scale).asinh(), ((r * r - shift) / scale).asinh()
    total = acb.integral(lambda y, _: ring(y), low, high, rel_tol=arb(2) ** -90).real
    return number(arb.pi() * abs(h) * total / scale**2)


def computed_disk(configuration):
    (center, normal, radius, point, two_sided), axis = configuration
    return of(Area(Disk(center, normal, radius), [1.0], two_sided), point, axis)


def exact_sphere(configuration):
    """Directions at the angle a from the centre's, up to the sphere's angular radius, average to cos(a) along it."""
    (center, radius, point), axis = configuration
    offset, r = minus(balls(center), balls(point)), ball(radius)
    distance = norm(offset)
    if distance < r:
        return 0.0
    widest = (r / distance).asin()
    total = integral(lambda a: 2 * arb.pi() * a.sin() * a.cos(), 0, widest)
    return 0.0 if offset[axis] == 0 else number(total * offset[axis] / distance)


def computed_sphere(configuration):
    (center, radius, point), axis = configuration
    return of(Area(Sphere(center, radius), [1.0]), point, axis)


# ------------------------------------------------------------------------------------------------- environments


def exact_sky(configuration):
    (up, _, horizon, zenith), axis = configuration
    emitter = CosineSky(up, [horizon], [zenith])
    low, high = ball(horizon), ball(zenith)
    total = integral(lambda a: (low + (high - low) * a.cos()) * a.cos() * a.sin(), 0, arb.pi() / 2)
    along = ball(emitter.up[axis])
    return 0.0 if along == 0 else number(2 * arb.pi() * total * along)


def computed_sky(configuration):
    (up, _, horizon, zenith), axis = configuration
    return of(CosineSky(up, [horizon], [zenith]), np.zeros(3), axis)


def exact_map(configuration):
    (radiance, up, front, _), axis = configuration
    emitter = Equirectangular(radiance[..., None], up, front)
    u, f = balls(emitter.up), balls(emitter.front)
    third = cross(u, f)
    rows, columns = radiance.shape
    total = arb(0)
    around = []
    for j in range(columns):
        ends = 2 * arb.pi() * j / columns, 2 * arb.pi() * (j + 1) / columns
        around.append((integral(lambda a: a.cos(), *ends), integral(lambda a: a.sin(), *ends), ends[1] - ends[0]))
    for i in range(rows):
        ends = arb.pi() * i / rows, arb.pi() * (i + 1) / rows
        across = integral(lambda a: a.sin() ** 2, *ends)
        upwards = integral(lambda a: a.sin() * a.cos(), *ends)
        for j, (cosine, sine, width) in enumerate(around):
            flat = f[axis] * cosine + third[axis] * sine
            total += ball(radiance[i, j]) * (across * flat + upwards * width * u[axis])
    return number(total)


def computed_map(configuration):
    (radiance, up, front, _), axis = configuration
    return of(Equirectangular(radiance[..., None], up, front), np.zeros(3), axis)


# -------------------------------------------------------------------------------------------------- strategies


def rotation(draw):
    axis = draw(directions())
    u, v = frame(axis)
    return np.column_stack([u, v, axis])


@st.composite
def polygons(draw):
    """Triangles and notched quadrilaterals of size 1; receivers all around, or beside an edge or corner."""
    height, apex = draw(powers_of_ten(-4, 0)), draw(between(-2, 2))
    corners = [[-1, 0, 0], [1, 0, 0], [apex, height, 0]]
    notched = draw(st.booleans())
    if notched:
        corners = [[-1, -1, 0], [1, -1, 0], [draw(between(-0.9, 1)), draw(between(-0.9, 1)), 0], [-1, 1, 0]]
    corners = np.array(corners, dtype=float)
    point, _ = draw(receivers())
    if draw(st.booleans()):
        i, along = draw(st.integers(0, len(corners) - 1)), draw(st.sampled_from([0.0, 0.3, 1.0]))
        on_edge = corners[i] + along * (corners[(i + 1) % len(corners)] - corners[i])
        point = on_edge + draw(powers_of_ten(-6, 0)) * draw(directions())
    # Four corners would no longer lie in one plane when rounded.
    if not notched and draw(st.booleans()):
        turn = rotation(draw)
        corners, point = corners @ turn.T, turn @ point
    return corners, point, draw(st.booleans())


@st.composite
def disks(draw):
    point, _ = draw(receivers())
    if draw(st.booleans()):
        turn = draw(between(0, 6.25))
        point = np.array([math.cos(turn), math.sin(turn), 0]) + draw(powers_of_ten(-6, 0)) * draw(directions())
    center, normal = np.zeros(3), np.array([0.0, 0, 1])
    if draw(st.booleans()):
        turn = rotation(draw)
        point, normal = turn @ point, turn[:, 2] / np.linalg.norm(turn[:, 2])
    return center, normal, 1.0, point, draw(st.booleans())


@st.composite
def spheres(draw):
    away = draw(directions())
    radius = draw(powers_of_ten(-3, 3))
    center = draw(st.sampled_from([0.0, 1.0])) * draw(directions())
    height = draw(powers_of_ten(-6, 6)) * draw(st.sampled_from([1, 1, 1, -1]))
    return center, radius, center + radius * max(1 + height, 0.1) * away


# Bounds are relative to the vector's length, or to all the light of a map: single components may be far smaller.
FORMS = [
    Form("vector irradiance of points", with_axis(point_like.points()), computed_spot, exact_spot),
    Form("vector irradiance of spots", with_axis(point_like.spots()), computed_spot, exact_spot, share=0.05),
    Form("vector irradiance of lines", with_axis(line.lines()), computed_line, exact_line, share=0.05),
    Form("vector irradiance of polygons", with_axis(polygons()), computed_polygon, exact_polygon, share=0.15),
    Form("vector irradiance of disks", with_axis(disks()), computed_disk, exact_disk, share=0.15),
    Form("vector irradiance of spheres", with_axis(spheres()), computed_sphere, exact_sphere, share=0.05),
    Form("vector irradiance of skies", with_axis(skies()), computed_sky, exact_sky),
    Form("vector irradiance of maps", with_axis(maps()), computed_map, exact_map, share=0.15),
]
