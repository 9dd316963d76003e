"""Solid angles against the excess of spherical polygons, and a contour integral, in ball arithmetic."""

import math

import numpy as np
from flint import acb, arb, ctx
from hypothesis import strategies as st
from verification import Form
from verified.disk import axes, near_the_rim, placed
from verified.geometry import (
    ball,
    balls,
    between,
    cross,
    directions,
    dot,
    frame,
    minus,
    norm,
    number,
    plus,
    powers_of_ten,
    receivers,
    times,
    unit,
)

from oracle.shapes import Disk, Polygon, Rectangle, Sphere
from oracle.solid_angles import cone, plane_angle, solid_angle


def excess(corners, point):
    """Sum of the angles of the spherical polygon, minus those of a flat one: area on the sphere."""
    offsets = [minus(corner, balls(point)) for corner in corners]
    count = len(offsets)
    total = arb(0)
    for i, here in enumerate(offsets):
        before, after = cross(here, offsets[i - 1]), cross(here, offsets[(i + 1) % count])
        # From the edge ahead to the one behind, seen from the point at whose left hand the inside is.
        angle = arb.atan2(dot(cross(after, before), here) / norm(here), dot(after, before))
        total += angle if angle > 0 else angle + 2 * arb.pi()
    area = total - (count - 2) * arb.pi()
    # The other way round, these were the angles of all that is outside.
    return number(area if area < 2 * arb.pi() else 4 * arb.pi() - area)


def excess_of_polygon(configuration):
    vertices, point = configuration
    return excess([balls(vertex) for vertex in vertices], point)


def excess_of_rectangle(configuration):
    center, u, v = (balls(part) for part in configuration[:3])
    corners = [plus(center, plus(times(u, s), times(v, t))) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return excess(corners, configuration[3])


def contour(configuration):
    """Solid angle of a disk: w . (x x dx) / (|x| (|x| + w . x)), integrated along the rim, is the area on the sphere.

    It is the vector potential of a monopole, singular only opposite to w, the direction from the point to the plane.
    """
    center, front, radius, point = configuration
    offset = minus(balls(center), balls(point))
    height = abs(dot(unit(balls(front)), offset))
    u, v = axes(balls(front))
    # A ball around 0 has products, but no powers.
    along_u, along_v = dot(offset, u), dot(offset, v)
    aside = along_u * along_u + along_v * along_v
    aside = aside.sqrt() if aside > 0 else arb(0)
    r = ball(radius)
    squared, swing = height**2 + aside**2 + r**2, 2 * r * aside
    if not (height > 0 and squared > swing):
        return None
    closest = (squared - swing).sqrt()
    narrow = closest / (squared + swing).sqrt()

    # By the angle from where the rim is nearest, up to a right angle as atan(narrow sinh(y)).
    def far(f, analytic):
        x = (squared - swing * f.cos()).sqrt(analytic=analytic)
        return r * (r - aside * f.cos()) / (x * (x + height))

    def near(y, analytic):
        w = narrow * y.sinh()
        root = (1 + w * w).sqrt(analytic=analytic)
        x = closest * y.cosh() / root
        return r * (r - aside * (1 - w * w) / root**2) / (x * (x + height)) * 2 * narrow * y.cosh() / root**2

    total = acb.integral(near, 0, (1 / narrow).asinh()).real + acb.integral(far, arb.pi() / 2, arb.pi()).real
    return number(2 * total)


def cap(configuration):
    center, radius, point = configuration
    offset, r = minus(balls(center), balls(point)), ball(radius)
    squared = dot(offset, offset)
    if squared < r * r:
        return 4 * math.pi
    if not squared > r * r:
        return None
    return number(2 * arb.pi() * (1 - (1 - r * r / squared).sqrt()))


def angle_of_segment(configuration):
    start, end, point = configuration
    # The arc cosine of small angles loses half of the digits.
    with ctx.workprec(320):
        a, b = minus(balls(start), balls(point)), minus(balls(end), balls(point))
        cosine = dot(a, b) / (norm(a) * norm(b))
        return number(cosine.acos()) if abs(cosine) < 1 else None


def of(shape):
    """The closed form of a shape that is built from all of a configuration but the last."""

    def computed(configuration):
        found = solid_angle(shape(*configuration[:-1]), configuration[-1])
        return float(found.value), float(found.error)

    return computed


def of_cone(angle):
    value = float(cone(angle))
    return value, 4 * 2.3e-16 * value


def of_segment(configuration):
    found = plane_angle(*configuration)
    return float(found.value), float(found.error)


@st.composite
def polygons(draw):
    """Polygons of any size and direction, mostly not convex, some of them thin, with points from 1e-6 to 1e6 sizes."""
    count = draw(st.integers(3, 8))
    widths = np.array([draw(between(1, 2.4)) for _ in range(count)])
    angles = 2 * np.pi * np.cumsum(widths) / widths.sum()
    radii = np.array([draw(between(0.3, 1)) for _ in range(count)])
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(count)])
    flat[:, 1] *= draw(st.sampled_from([1.0, 1.0, 1e-3]))
    front = draw(directions())
    rotation = np.column_stack([*frame(front), front])
    size = draw(st.just(1.0) | powers_of_ten(-6, 6))
    center = size * np.array([draw(st.just(0.0) | between(-3, 3)) for _ in range(3)])
    point, _ = draw(receivers())
    return center + size * flat @ rotation.T, center + size * (rotation @ point)


@st.composite
def rectangles(draw):
    center, front, size, point, _, _ = draw(placed(receivers()))
    u, v = frame(front)
    return center, size * u, size * draw(powers_of_ten(-3, 0)) * v, point


@st.composite
def spheres(draw):
    radius = draw(st.just(1.0) | powers_of_ten(-6, 6))
    center = radius * np.array([draw(st.just(0.0) | between(-3, 3)) for _ in range(3)])
    distance = draw(between(0, 1) | powers_of_ten(-9, 6).map(lambda x: 1 + x))
    return center, radius, center + radius * distance * draw(directions())


@st.composite
def segments(draw):
    start = np.array([draw(between(-1, 1)) for _ in range(3)])
    end = start + draw(powers_of_ten(-6, 3)) * draw(directions())
    along = draw(between(-2, 3))
    return start, end, start + along * (end - start) + draw(powers_of_ten(-9, 6)) * draw(directions())


disks = placed(receivers() | near_the_rim()).map(lambda drawn: drawn[:4])

FORMS = [
    Form("solid angle of a polygon", polygons(), of(Polygon), excess_of_polygon, share=0.01),
    Form("solid angle of a rectangle", rectangles(), of(Rectangle), excess_of_rectangle, share=0.01),
    Form("solid angle of a disk", disks, of(Disk), contour, share=0.01),
    Form("solid angle of a sphere", spheres(), of(Sphere), cap),
    Form("solid angle of a cone", between(1e-9, math.pi), of_cone,
         lambda angle: number(2 * arb.pi() * (1 - ball(angle).cos()))),
    Form("plane angle of a segment", segments(), of_segment, angle_of_segment, share=0.01),
]  # fmt: skip
