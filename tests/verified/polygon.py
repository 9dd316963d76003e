"""Irradiance of polygons against the definition as a contour integral, in ball arithmetic.

Directions omega above the horizon, weighted with n . omega, are what their projection along n covers of the unit disk
around the receiver [Nusselt 1928]. That area is half the integral of n . (omega x d omega) along its boundary: here,
edge by edge, by rigorous quadrature of n . (V x dV) / |V|^2. Where the polygon's boundary passes through the horizon,
it goes on along the horizon's circle, which adds half its angle.
"""

import math
from itertools import pairwise

import numpy as np
from flint import arb
from hypothesis import assume
from hypothesis import strategies as st
from verification import Form
from verified.geometry import (
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
    plus,
    powers_of_ten,
    receivers,
    times,
    unit,
)

from oracle import emitters, shapes
from oracle.irradiances import irradiance


def exact(configuration):
    """Irradiance of radiance 1, or None where it is not known to which side of the plane the receiver is."""
    vertices, point, normal, two_sided = configuration
    p, n = balls(point), unit(balls(normal))
    offsets = [minus(balls(vertex), p) for vertex in vertices]
    relative = [minus(balls(vertex), balls(vertices[0])) for vertex in vertices]
    area = [arb(0)] * 3
    for a, b in pairwise(relative):
        area = plus(area, cross(a, b))
    height = -dot(area, offsets[0]) / norm(area)
    if height == 0:
        return 0.0
    if abs(height) < 1e-15 * float(norm(relative[1])):
        return None
    if height < 0 and not two_sided:
        return 0.0

    heights = [dot(n, offset) for offset in offsets]
    pieces, crossings = [], []
    for i, start in enumerate(offsets):
        end = offsets[(i + 1) % len(offsets)]
        z0, z1 = heights[i], heights[(i + 1) % len(offsets)]
        if z0 < 0 and z1 < 0:
            continue
        if (z0 < 0) != (z1 < 0):
            crossing = plus(start, times(minus(end, start), z0 / (z0 - z1)))
            crossings.append((crossing, 1 if z0 < 0 else -1))
            start, end = (crossing, end) if z0 < 0 else (start, crossing)
        pieces.append((start, end))
    total = arb(0)
    for start, end in pieces:
        edge = minus(end, start)
        moment = dot(n, cross(start, edge))
        length = norm(edge)
        if length == 0 or moment == 0:
            continue
        # By the distance from the edge's line, the integrand is moment / (h^2 + s^2): smooth in asinh(s/h).
        foot = -dot(start, edge) / length
        h2 = dot(start, start) - foot * foot
        line = dot(cross(start, edge), cross(start, edge)).sqrt() / length
        if not line > 0:
            continue
        low, high = ((-foot) / line).asinh(), ((length - foot) / line).asinh()
        del h2
        total += moment / length / line * integral(lambda x: 1 / x.cosh(), low, high)
    if crossings:
        # The horizon's circle, from each crossing to a common direction and back.
        u = unit(crossings[0][0])
        v = cross(n, u)
        for crossing, sign in crossings[1:]:
            total += sign * arb.atan2(dot(v, crossing), dot(u, crossing))
    return number(abs(total) / 2)


def computed(configuration):
    vertices, point, normal, two_sided = configuration
    light = emitters.Area(shapes.Polygon(vertices), [1.0], two_sided)
    found = irradiance(light, emitters.Receivers(point, normal))
    return float(found.value[0]), float(found.error[0])


# ------------------------------------------------------------------------------------------------- strategies


def placed(draw, corners):
    """A polygon of size 1 around the origin of the plane z = 0, with a receiver, both turned, scaled or left alone."""
    point, normal = draw(receivers())
    if draw(st.booleans()):
        # Beside an edge or corner instead, down to 1e-6 of the size.
        i = draw(st.integers(0, len(corners) - 1))
        along = draw(st.sampled_from([0.0, 0.3, 1.0]))
        on_edge = corners[i] + along * (corners[(i + 1) % len(corners)] - corners[i])
        point = on_edge + draw(powers_of_ten(-6, 0)) * draw(directions())
    if draw(st.integers(0, 9)) == 0:
        point[2] = 0.0
    if draw(st.booleans()):
        axis = draw(directions())
        u, v = frame(axis)
        rotation = np.column_stack([u, v, axis])
        corners, point, normal = corners @ rotation.T, rotation @ point, rotation @ normal
        normal = normal / np.linalg.norm(normal)
    return corners, point, normal, draw(st.booleans())


@st.composite
def rectangles(draw):
    a, b = 1.0, draw(powers_of_ten(-4, 0))
    return placed(draw, np.array([[-a, -b, 0], [a, -b, 0], [a, b, 0], [-a, b, 0]]))


@st.composite
def needles(draw):
    """Triangles, nearly collinear ones among them."""
    height = draw(powers_of_ten(-8, 0))
    apex = draw(between(-2, 2))
    return placed(draw, np.array([[-1, 0, 0], [1, 0, 0], [apex, height, 0]]))


@st.composite
def stars(draw):
    """Simple polygons, mostly not convex."""
    count = draw(st.integers(3, 8))
    widths = np.array([draw(between(1, 2.5)) for _ in range(count)])
    assume(widths.max() < 0.49 * widths.sum())
    angles = 2 * math.pi * np.cumsum(widths) / widths.sum()
    radii = np.array([draw(between(0.2, 1)) for _ in range(count)])
    return placed(draw, np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(count)]))


# Slivers above the horizon and emitters seen edge-on are ill-conditioned; needles of 1e-8 are both, often.
FORMS = [
    Form("irradiance of rectangles", rectangles(), computed, exact, share=0.1),
    Form("irradiance of triangles", needles(), computed, exact, share=0.4),
    Form("irradiance of polygons", stars(), computed, exact, share=0.12),
]
