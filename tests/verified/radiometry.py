"""Fluxes and intensities against their integrals, or against other formulas, in ball arithmetic."""

import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.geometry import ball, balls, between, cross, directions, dot, integral, minus, norm, number, powers_of_ten

from oracle.emitters import Area, Line, Spot
from oracle.radiometry import flux, intensity
from oracle.shapes import Mesh, Polygon, Rectangle


def first(bounded):
    return float(bounded.value.ravel()[0]), float(bounded.error.ravel()[0])


@st.composite
def cones(draw):
    """Half angles of beam and cutoff: wide and narrow, close together and far apart."""
    cutoff = draw(st.one_of(between(0.01, 3.14), powers_of_ten(-6, 0)))
    inner = draw(st.one_of(between(0.01, 0.99), powers_of_ten(-9, -0.01), powers_of_ten(-12, -1).map(lambda x: 1 - x)))
    return cutoff * inner, cutoff


def spot_flux(cone):
    return first(flux(Spot([0, 0, 0], [0, 0, 1], [1], *cone)))


def spot_flux_exact(cone):
    beam, cutoff = map(ball, cone)
    full = integral(lambda a: a.sin(), arb(0), beam)
    falling = integral(lambda a: (cutoff - a) / (cutoff - beam) * a.sin(), beam, cutoff)
    return number(2 * arb.pi() * (full + falling))


@st.composite
def cones_and_directions(draw):
    """Directions anywhere, or at a known part of the way from beam to cutoff."""
    cone = draw(cones())
    axis = np.array([0.0, 0.0, 1.0])
    angle = cone[0] + draw(between(0, 1)) * (cone[1] - cone[0])
    turn = draw(between(0, 6.25))
    on_slope = np.array([math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle)])
    return cone, axis, draw(st.sampled_from([on_slope, draw(directions())]))


def spot_intensity(configuration):
    cone, axis, towards = configuration
    return first(intensity(Spot([0, 0, 0], axis, [1], *cone), towards))


def spot_intensity_exact(configuration):
    (beam, cutoff), axis, towards = configuration
    a, t = balls(axis), balls(towards)
    cosine, sine = dot(a, t), norm(cross(a, t))
    angle = arb.atan2(sine, cosine)
    falloff = (ball(cutoff) - angle) / (ball(cutoff) - ball(beam))
    if falloff <= 0:
        return 0.0
    return 1.0 if falloff >= 1 else number(falloff)


@st.composite
def segments(draw):
    """A line, often short and far from the origin."""
    start = 10 * np.array([draw(between(-1, 1)) for _ in range(3)])
    end = start + draw(powers_of_ten(-6, 6)) * draw(directions())
    return start, end


def line_flux(segment):
    return first(flux(Line(*segment, [1])))


def line_flux_exact(segment):
    start, end = map(balls, segment)
    # Over all directions around the line, whose solid angle is 2 pi sin(g) dg.
    sine_over_sphere = integral(lambda g: g.sin() ** 2, arb(0), arb.pi()) * 2 * arb.pi()
    return number(sine_over_sphere * norm(minus(end, start)))


@st.composite
def flat_shapes(draw, corners):
    """Convex polygons of any size and orientation, down to slivers, also far from the origin."""
    u = draw(directions())
    v = np.cross(u, draw(directions()) + 0.01 * np.eye(3)[np.abs(u).argmin()])
    v /= np.linalg.norm(v)
    scale = draw(powers_of_ten(-6, 6))
    thin = draw(st.one_of(between(0.1, 1), powers_of_ten(-6, -1)))
    angles = np.cumsum([draw(between(0.5, 1.5)) for _ in range(corners)]) * (6.0 / (1.5 * corners))
    flat = scale * (np.cos(angles)[:, None] * u + thin * np.sin(angles)[:, None] * v)
    return flat + scale * draw(st.sampled_from([0.0, 10.0])) * draw(directions())


def vector_area(vertices):
    """Half the cross product of a quadrilateral's diagonals, or of two edges that meet at the last corner."""
    v = [balls(vertex) for vertex in vertices]
    if len(v) == 4:
        return [x / 2 for x in cross(minus(v[2], v[0]), minus(v[3], v[1]))]
    return [x / 2 for x in cross(minus(v[0], v[2]), minus(v[1], v[2]))]


def polygon_flux(vertices):
    return first(flux(Area(Polygon(vertices), [1])))


def polygon_flux_exact(vertices):
    return number(arb.pi() * norm(vector_area(vertices)))


def seen(configuration):
    return first(intensity(Area(Polygon(configuration[0]), [1]), configuration[1]))


def seen_exact(configuration):
    vertices, towards = configuration
    shown = dot(vector_area(vertices), balls(towards))
    return number(shown) if shown > 0 else 0.0


def mesh_flux(vertices):
    return first(flux(Area(Mesh(vertices, [[0, 1, 2], [0, 2, 3]]), [1], two_sided=True)))


def mesh_flux_exact(vertices):
    halves = norm(vector_area(vertices[[0, 1, 2]])) + norm(vector_area(vertices[[0, 2, 3]]))
    return number(2 * arb.pi() * halves)


@st.composite
def rectangles(draw):
    u = draw(directions())
    v = np.cross(u, np.eye(3)[np.abs(u).argmin()])
    v /= np.linalg.norm(v)
    return draw(powers_of_ten(-6, 6)) * u, draw(powers_of_ten(-6, 6)) * v


def rectangle_flux(halves):
    return first(flux(Area(Rectangle([0, 0, 0], *halves), [1])))


def rectangle_flux_exact(halves):
    return number(4 * arb.pi() * norm(cross(*map(balls, halves))))


FORMS = [
    Form("flux of a spot", cones(), spot_flux, spot_flux_exact),
    # Close to the cutoff the intensity is a difference of nearly equal angles.
    Form("intensity of a spot", cones_and_directions(), spot_intensity, spot_intensity_exact, share=0.2),
    Form("flux of a line", segments(), line_flux, line_flux_exact),
    Form("flux of a triangle", flat_shapes(3), polygon_flux, polygon_flux_exact),
    Form("flux of a quadrilateral", flat_shapes(4), polygon_flux, polygon_flux_exact),
    Form("flux of a mesh", flat_shapes(4), mesh_flux, mesh_flux_exact),
    Form("flux of a rectangle", rectangles(), rectangle_flux, rectangle_flux_exact),
    Form("intensity of a polygon", st.tuples(flat_shapes(4), directions()), seen, seen_exact, share=0.001),
]
