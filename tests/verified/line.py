"""Irradiance of lines against the definition: the integral of sine, cosine and inverse square along the line.

The part above the horizon is found exactly; with x = asinh(s/h), s the place along the line, the integrand
``h n . p / |p|^4 ds`` is analytic and varies slowly however near the line is.
"""

import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.geometry import (
    balls,
    between,
    directions,
    dot,
    frame,
    integral,
    minus,
    norm,
    number,
    powers_of_ten,
    times,
    unit,
)

from oracle.emitters import Line, Receivers
from oracle.irradiances import irradiance


def exact(configuration):
    """Irradiance of intensity 1 per metre; None on the line."""
    start, end, point, normal = configuration
    return exact_along(start, end, point, balls(Receivers(point, normal).normals), True)


def exact_along(start, end, point, n, clipped):
    """Irradiance of a surface with normal n, or the component along n of the vector irradiance."""
    a = minus(balls(start), balls(point))
    edge = minus(balls(end), balls(start))
    length, t = norm(edge), unit(edge)
    first = dot(a, t)
    last = first + length
    foot = minus(a, times(t, first))
    h = norm(foot)
    if all(x == 0 for x in foot) or not h > 0:
        return 0.0 if first > 0 or last < 0 else None
    if first <= 1e-15 * length and last >= -1e-15 * length and not h > 1e-24 * length:
        # Twice the digits of float64 put it on the line, ends included, where nothing is computed.
        return None
    up, flat = dot(n, foot), dot(n, t)
    if clipped:
        z1, z2 = up + flat * first, up + flat * last
        if z1 <= 0 and z2 <= 0:
            return 0.0
        if z1 < 0:
            first = -up / flat
        elif z2 < 0:
            last = -up / flat

    def integrand(x):
        c = x.cosh()
        return (up / h + flat * x.sinh()) / c**3

    low, high = (first / h).asinh(), (last / h).asinh()
    # Where the line is far, the integrand decays by ten orders of magnitude and has to be cut for relative accuracy.
    pieces = [x for x in map(arb, (-12, -6, -2, 2, 6, 12)) if low < x < high]
    return number(integral(integrand, low, high, pieces) / h)


def computed(configuration):
    start, end, point, normal = configuration
    found = irradiance(Line(start, end, [1.0]), Receivers(point, normal))
    return float(found.value[0]), float(found.error[0])


@st.composite
def lines(draw):
    """A line of length 1 or so, and a receiver at 1e-6 to 1e6 from it, near its extension, or anywhere."""
    axis = draw(directions())
    start = draw(st.sampled_from([0.0, 0.0, 10.0])) * draw(directions())
    end = start + draw(powers_of_ten(-3, 1)) * axis
    u, v = frame(axis)
    turn = draw(between(0, 6.25))
    across = math.cos(turn) * u + math.sin(turn) * v
    distance = draw(powers_of_ten(-6, 6))
    match draw(st.sampled_from(["beside", "beside", "extension", "far"])):
        case "beside":
            point = start + draw(between(-1, 2)) * (end - start) + distance * across
        case "extension":
            offset = draw(powers_of_ten(-3, 3)) * draw(st.sampled_from([1, -1]))
            point = (end if offset > 0 else start) + offset * axis + draw(powers_of_ten(-9, -2)) * across
        case "far":
            point = start + distance * draw(directions())
    towards = start + draw(between(0, 1)) * (end - start) - point
    size = np.linalg.norm(towards)
    towards = towards / size if size else across
    match draw(st.sampled_from(["free", "facing", "cut", "grazing"])):
        case "free":
            normal = draw(directions())
        case "facing":
            normal = towards
        case "cut" | "grazing" as how:
            u, v = frame(towards)
            spin = draw(between(0, 6.25))
            normal = math.cos(spin) * u + math.sin(spin) * v
            if how == "grazing":
                normal = normal + draw(st.sampled_from([1, -1])) * draw(powers_of_ten(-6, -1)) * towards
    return start, end, point, normal / np.linalg.norm(normal)


FORMS = [Form("irradiance of lines", lines(), computed, exact, share=0.02)]
