"""Irradiance of emitters without size: cosine and inverse-square law, evaluated in ball arithmetic."""

import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
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
    powers_of_ten,
)

from oracle.emitters import Directional, Point, Receivers, Spot
from oracle.irradiances import irradiance


def of(emitter, point, normal):
    found = irradiance(emitter, Receivers(point, normal))
    return float(found.value[0]), float(found.error[0])


def falloff(emitter, point):
    """Linear in the angle between beam width and cutoff angle."""
    away, axis = minus(balls(point), balls(emitter.position)), balls(emitter.direction)
    angle = arb.atan2(norm(cross(away, axis)), dot(away, axis))
    full, none = ball(emitter.beam_width), ball(emitter.cutoff_angle)
    part = (none - angle) / (none - full)
    return arb(0) if part < 0 else arb(1) if part > 1 else part


def exact_point(configuration):
    emitter, point, normal = configuration
    offset = minus(balls(emitter.position), balls(point))
    height = dot(balls(Receivers(point, normal).normals), offset)
    if height <= 0:
        return 0.0
    part = falloff(emitter, point) if isinstance(emitter, Spot) else arb(1)
    return 0.0 if part == 0 else number(part * height / norm(offset) ** 3)


def exact_directional(configuration):
    emitter, normal = configuration
    height = -dot(balls(emitter.direction), balls(Receivers(np.zeros(3), normal).normals))
    return 0.0 if height <= 0 else number(height)


def turned(draw, axis, angle):
    """A unit vector at this angle from an axis."""
    u, v = frame(axis)
    turn = draw(between(0, 6.25))
    return math.cos(angle) * axis + math.sin(angle) * (math.cos(turn) * u + math.sin(turn) * v)


def facing(draw, axis):
    """A normal that is free, or nearly across `axis`, on either side."""
    if draw(st.booleans()):
        normal = draw(directions())
    else:
        normal = turned(draw, axis, math.pi / 2 + draw(st.sampled_from([1, -1])) * draw(powers_of_ten(-9, -1)))
    return normal / np.linalg.norm(normal)


@st.composite
def points(draw):
    position = draw(st.sampled_from([0.0, 1.0, 100.0])) * draw(directions())
    towards = draw(directions())
    return Point(position, [1.0]), position - draw(powers_of_ten(-6, 6)) * towards, facing(draw, towards)


@st.composite
def spots(draw):
    """Receivers anywhere, or near the axis, the edge of the full beam or the cutoff."""
    cutoff = draw(between(0.01, 3.1))
    beam = cutoff * draw(st.sampled_from([0.01, 0.5, 0.9, 0.999]))
    position, axis = draw(st.sampled_from([0.0, 1.0])) * draw(directions()), draw(directions())
    edge = draw(st.sampled_from([0.0, beam, cutoff]))
    angle = draw(st.one_of(between(0, math.pi), powers_of_ten(-6, -2).map(lambda x: abs(edge - x))))
    away = turned(draw, axis, angle)
    point = position + draw(powers_of_ten(-6, 6)) * away
    return Spot(position, axis, [1.0], beam, cutoff), point, facing(draw, -away)


@st.composite
def directionals(draw):
    direction = draw(directions())
    return Directional(direction, [1.0]), facing(draw, direction)


FORMS = [
    Form("irradiance of points", points(), lambda c: of(*c), exact_point, share=0.05),
    Form("irradiance of spots", spots(), lambda c: of(*c), exact_point, share=0.05),
    Form(
        "irradiance of directional light",
        directionals(),
        lambda c: of(c[0], np.zeros(3), c[1]),
        exact_directional,
        share=0.05,
    ),
]
