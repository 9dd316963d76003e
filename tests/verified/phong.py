"""Phong-type lobes against Arvo's recurrences, in ball arithmetic with as many digits as their cancellation takes.

Stokes' theorem gives, for the exponent n, axis a, edges with outward normals m_i and arc length s [Arvo 1995]:
(n+1) T(n) = (n-1) T(n-2) + sum (a . m_i) int (w . a)^(n-1) ds, which begins with the solid angle or with nothing, and
(n+2) T(n, 1) = n (a . n) T(n-1) + sum int (w . a)^n (n . m_i) ds. The powers are integrated by parts.
"""

from itertools import pairwise

import numpy as np
from flint import arb, ctx
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

from oracle.emitters import Area, Receivers
from oracle.reflection import phong
from oracle.shapes import Polygon

# Numbers below are no irradiance any more, and float64 runs out of exponents.
DARK = 1e-250
# Bits of precision, tried one after the other.
PRECISIONS = (160, 640, 2560)


class Undecided(Exception):
    """It is not known on which side something lies."""


def positive(value):
    if value > 0:
        return True
    if value < 0 or value == 0:
        return False
    raise Undecided


def clip(offsets, normal):
    heights = [dot(normal, offset) for offset in offsets]
    kept = []
    for i, start in enumerate(offsets):
        j = (i + 1) % len(offsets)
        if positive(heights[i]):
            kept.append(start)
        if positive(heights[i]) != positive(heights[j]):
            kept.append(plus(start, times(minus(offsets[j], start), heights[i] / (heights[i] - heights[j]))))
    return kept


def solid_angle(directions):
    total = arb(0)
    a = directions[0]
    for b, c in pairwise(directions[1:]):
        below = 1 + dot(a, b) + dot(b, c) + dot(c, a)
        total += 2 * arb.atan2(dot(a, cross(b, c)), below)
    return total


def powers(b, c, axis, parity, last):
    """Integrals of (w . axis)^j along the arc between two directions, for j = parity, parity + 2, ..., last."""
    normal = cross(b, c)
    m = unit(normal)
    arc = arb.atan2(norm(normal), dot(b, c))
    height = dot(axis, m)
    squared = 1 - height**2
    ends = [(dot(axis, end), dot(axis, cross(m, end))) for end in (b, c)]
    found = [arc] if parity == 0 else [ends[0][1] - ends[1][1]]
    raised = [z**parity * z for z, _ in ends]
    for j in range(parity + 2, last + 1, 2):
        boundary = raised[0] * ends[0][1] - raised[1] * ends[1][1]
        found.append((boundary + (j - 1) * squared * found[-1]) / j)
        raised = [r * z * z for r, (z, _) in zip(raised, ends, strict=True)]
    return m, height, found


def moment(configuration, double):
    vertices, point, normal, axis, n = configuration
    p, up, a = balls(point), unit(balls(normal)), unit(balls(axis))
    offsets = [minus(balls(vertex), p) for vertex in vertices]
    area = [arb(0)] * 3
    relative = [minus(balls(vertex), balls(vertices[0])) for vertex in vertices]
    for b, c in pairwise(relative):
        area = plus(area, cross(b, c))
    if not positive(-dot(area, offsets[0])):
        return arb(0)
    seen = clip(offsets, up)
    seen = clip(seen, a) if seen else seen
    if len(seen) < 3:
        return arb(0)
    # Counter-clockwise as seen from outside of the sphere of directions.
    seen = [unit(offset) for offset in reversed(seen)]
    parity, last = (n % 2, n) if double else ((n - 1) % 2, n - 1)
    lower = last - 2 if double else last
    edges = [powers(b, c, a, parity, last) for b, c in zip(seen, seen[1:] + seen[:1], strict=True)] if last >= 0 else []
    axial = arb(0)
    # The exponent of the axial moment is lower + 1.
    if (lower + 1) % 2 == 0:
        axial += solid_angle(seen)
    for _, height, found in edges:
        axial += height * sum(found[: max(0, (lower - parity) // 2 + 1)], arb(0))
    if not double:
        return axial / (n + 1)
    result = sum((dot(up, m) * found[-1] for m, _, found in edges), arb(0))
    if n > 0:
        # (n - 1 + 1) T(n - 1) is what `axial` holds.
        result += dot(a, up) * axial
    return result / (n + 2)


def exact(configuration, double):
    bits = ctx.prec
    try:
        for precision in PRECISIONS:
            ctx.prec = precision
            try:
                value = moment(configuration, double)
            except Undecided:
                continue
            found = number(value)
            if found is not None:
                return found if found == 0 or found > DARK else None
    finally:
        ctx.prec = bits
    return None


def computed(configuration, double):
    vertices, point, normal, axis, n = configuration
    function = phong.double_axis_moment if double else phong.axial_moment
    result = function(Polygon(vertices), Receivers(point, normal), axis, n)
    return float(result.value), float(result.error)


# ------------------------------------------------------------------------------------------------- strategies


SHAPES = {
    "square": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "triangle": [(-1, -0.5), (0.75, -1), (0.25, 1)],
    "L": [(-1, -1), (1, -1), (1, -0.25), (-0.5, -0.25), (-0.5, 1), (-1, 1)],
}


@st.composite
def configurations(draw, nearest, furthest, names=("square", "square", "triangle", "L")):
    flat = SHAPES[draw(st.sampled_from(names))] if names else [(-1, 0), (1, 0), (0.5, draw(powers_of_ten(-3, -1)))]
    vertices = np.array([(x, y, 0.0) for x, y in flat])
    point, normal = draw(receivers(nearest, furthest))
    # An axis towards the light, or near to it, or anywhere; exponents from flat to nearly a mirror.
    towards = np.array([draw(between(-0.5, 0.5)), draw(between(-0.5, 0.5)), 0.0]) - point
    towards /= np.linalg.norm(towards)
    match draw(st.sampled_from(["at", "near", "near", "free"])):
        case "at":
            axis = towards
        case "near":
            u, v = frame(towards)
            turn = draw(between(0, 6.25))
            axis = towards + draw(powers_of_ten(-6, 0)) * (np.cos(turn) * u + np.sin(turn) * v)
        case "free":
            axis = draw(directions())
    exponent = draw(st.one_of(st.integers(0, 8), powers_of_ten(0.5, 3).map(round)))
    return vertices, point, normal, axis / np.linalg.norm(axis), exponent


def form(name, double, share, *arguments):
    return Form(
        name,
        configurations(*arguments),
        lambda configuration: computed(configuration, double),
        lambda configuration: exact(configuration, double),
        share,
    )


# ---------------------------------------------------------------------------------------- radiance and albedo


@st.composite
def views(draw):
    vertices, point, normal, axis, exponent = draw(configurations(-2, 2))
    # The viewer for whom `axis` is about the mirrored direction.
    view = 2 * (axis @ normal) * normal - axis
    return vertices, point, normal, view / np.linalg.norm(view), exponent


def reflected(configuration):
    vertices, point, normal, view, exponent = configuration
    light = Area(Polygon(vertices), np.array([2.0]))
    result = phong.reflected_radiance(light, Receivers(point, normal), view, exponent, [0.5])
    return float(result.value[0]), float(result.error[0])


def exact_reflected(configuration):
    """The moment's derivation, for a mirrored direction in balls."""
    vertices, point, normal, view, exponent = configuration
    up, v = unit(balls(normal)), unit(balls(view))
    cosine = dot(up, v)
    if not cosine > 0:
        return 0.0 if cosine < 0 else None
    bits = ctx.prec
    try:
        for precision in PRECISIONS:
            ctx.prec = precision
            up, v = unit(balls(normal)), unit(balls(view))
            axis = minus(times(up, 2 * dot(up, v)), v)
            try:
                value = moment((vertices, point, normal, axis, exponent), True) * (exponent + 2) / (2 * arb.pi())
            except Undecided:
                continue
            found = number(value)
            if found is not None:
                return found if found == 0 or found > DARK else None
    finally:
        ctx.prec = bits
    return None


def albedo(configuration):
    result = phong.directional_albedo(*configuration)
    return float(result.value), float(result.error)


def exact_albedo(configuration):
    """Around the normal: azimuth outside, where the lobe is cut at most on the far side."""
    cosine, n = configuration
    g = arb(cosine)
    sine = (1 - g * g).sqrt()
    # Over the angle t in the plane of axis and normal, and the elevation above that plane: w . axis is cos(t) cos(e)
    # and w . normal is cos(t + angle) cos(e), so that the elevation's integral is one of int cos^(n+2) de.
    half = arb.pi() / 2
    angle = arb.atan2(sine, g)
    elevation = arb.pi().sqrt() * (arb(n + 3) / 2).gamma() / (arb(n + 4) / 2).gamma()
    across = integral(lambda t: t.cos() ** n * (t + angle).cos(), -half, half - angle)
    return number(elevation * across * (n + 2) / (2 * arb.pi()))


FORMS = [
    form("Phong lobe over a polygon, axial moment", False, 0.01, -2, 2),
    form("Phong lobe over a polygon, double-axis moment", True, 0.01, -2, 2),
    # Slivers seen from 1e-6 beside the polygon's plane.
    form("Phong lobe over a polygon, axial moment, 1e-6 to 1e6 sizes away", False, 0.03, -6, 6),
    form("Phong lobe over a polygon, double-axis moment, 1e-6 to 1e6 sizes away", True, 0.06, -6, 6),
    # Needles 0.1 to 1e-3 thin, whose long edges nearly cancel.
    form("Phong lobe over a nearly collinear polygon, axial moment", False, 0.01, -1, 2, ()),
    form("Phong lobe over a nearly collinear polygon, double-axis moment", True, 0.06, -1, 2, ()),
    Form("Phong lobe, radiance reflected from a polygon", views(), reflected, exact_reflected, 0.01),
    Form(
        "Phong lobe, directional albedo",
        st.tuples(
            st.one_of(between(0, 1), powers_of_ten(-12, 0), powers_of_ten(-12, -1).map(lambda x: 1 - x)),
            st.one_of(st.integers(0, 10), powers_of_ten(0, 4).map(round)),
        ),
        albedo,
        exact_albedo,
    ),
]
