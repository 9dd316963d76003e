"""Irradiance of environments against integrals over the sphere of directions in ball arithmetic.

The map is integrated over the polar angle of what is above the receiver's horizon, which is where ``cot(polar) =
-cos(azimuth) flat / upright``, and then over the azimuth; both integrals are elementary.
"""

import itertools
import math

import numpy as np
from flint import arb
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
    norm,
    number,
    powers_of_ten,
    precise,
    unit,
)

from oracle.emitters import Constant, CosineSky, Equirectangular, Receivers
from oracle.irradiances import irradiance


def of(emitter, normal):
    """Value and bound of one channel."""
    found = irradiance(emitter, Receivers(np.zeros(3), normal))
    return float(found.value[0]), float(found.error[0])


def stored(normal):
    """The normal that the receiver really has, after it was scaled to length 1 once more."""
    return balls(Receivers(np.zeros(3), normal).normals)


def near(axis, draw):
    """A direction that is free, or nearly along the axis, against it or across it."""
    u, v = frame(axis)
    turn = draw(between(0, 6.25))
    across = math.cos(turn) * u + math.sin(turn) * v
    small = draw(powers_of_ten(-6, -1))
    match draw(st.sampled_from(["free", "free", "along", "against", "across"])):
        case "free":
            direction = draw(directions())
        case "along":
            direction = axis + small * across
        case "against":
            direction = -axis + small * across
        case "across":
            direction = across + small * axis
    return direction / np.linalg.norm(direction)


# ----------------------------------------------------------------------------------------------------- constant


def exact_constant(configuration):
    return number(arb.pi() * arb(configuration[0]))


def computed_constant(configuration):
    return of(Constant([configuration[0]]), configuration[1])


# --------------------------------------------------------------------------------------------------------- sky


def exact_sky(configuration):
    """Over the angle around the line in which both horizons meet: what is above both is a lune."""
    up, normal, horizon, zenith = configuration
    emitter = CosineSky(up, [horizon], [zenith])
    n, u = unit(stored(normal)), unit(balls(emitter.up))
    tilt = arb.atan2(norm(cross(n, u)), dot(n, u))
    low, rise = arb(float(emitter.horizon[0])), arb(float(emitter.zenith[0])) - arb(float(emitter.horizon[0]))

    def over_lune(angle):
        """The integrals of sin^2 and sin^3 over the angle to the line are pi/2 and 4/3."""
        return (angle - tilt).cos() * (low * arb.pi() / 2 + rise * angle.cos() * 4 / 3)

    return number(integral(over_lune, tilt - arb.pi() / 2, arb.pi() / 2))


def computed_sky(configuration):
    up, normal, horizon, zenith = configuration
    return of(CosineSky(up, [horizon], [zenith]), normal)


@st.composite
def skies(draw):
    up = draw(directions())
    return up, near(up, draw), draw(powers_of_ten(-3, 3)), draw(powers_of_ten(-3, 3))


# --------------------------------------------------------------------------------------------------------- map


@precise
def exact_map(configuration):
    """Column by column, between the azimuths where the horizon passes from one row into the next."""
    radiance, up, front, normal = configuration
    emitter = Equirectangular(radiance[..., None], up, front)
    n, u, f = stored(normal), unit(balls(emitter.up)), unit(balls(emitter.front))
    x, y, upright = dot(n, f), dot(n, cross(u, f)), dot(n, u)
    rows, columns = radiance.shape
    polar = [arb.pi() * i / rows for i in range(rows + 1)]
    squared = x * x + y * y
    flat, turn = (squared.sqrt(), arb.atan2(y, x)) if squared > 1e-60 else (arb(0), arb(0))

    kinks = [turn + arb.pi() / 2, turn - arb.pi() / 2]
    if upright != 0 and flat > 0:
        for edge in polar[1:-1]:
            q = -upright * edge.cos() / (flat * edge.sin())
            if abs(q) < 1:
                kinks += [turn + q.acos(), turn - q.acos()]
    # Into the map's range of azimuths.
    circle = 2 * arb.pi()
    kinks = [kink - circle * (kink / circle).floor() for kink in kinks]
    total = arb(0)
    for j in range(columns):
        left, right = circle * j / columns, circle * (j + 1) / columns
        inside = sorted((kink for kink in kinks if left < kink < right), key=float)
        ends = [left, *inside, right]
        for start, end in itertools.pairwise(ends):
            total += over_column(start - turn, end - turn, radiance[:, j], polar, flat, upright)
    return number(total)


def over_column(start, end, radiance, polar, flat, upright):
    """Integral over a range of azimuths from the normal's, in which the horizon stays in one row."""
    width, swing = end - start, flat * (end.sin() - start.sin())

    def up_to(edge):
        """Integral of (flat cos(azimuth) sin + upright cos) sin over polar angles up to a row's edge."""
        return swing * (edge - edge.sin() * edge.cos()) / 2 + width * upright * edge.sin() ** 2 / 2

    def up_to_horizon():
        """There it is ``x (pi/2 + atan(x / upright)) / 2 + upright / 2`` with ``x = flat cos(azimuth)``, by parts."""
        ratio = flat / upright
        stretch = (1 + ratio * ratio).sqrt()

        def primitive(azimuth):
            s, c = azimuth.sin(), azimuth.cos()
            # tan(stretched) = tan(azimuth) / stretch, in the same quarter.
            stretched = azimuth + arb.atan2(s * c * (1 - stretch), stretch * c * c + s * s)
            return flat * s * (ratio * c).atan() + upright * (stretch * stretched - azimuth)

        return (swing * arb.pi() / 2 + width * upright + primitive(end) - primitive(start)) / 2

    middle = (start + end) / 2
    level = arb.pi() / 2 + (flat * middle.cos() / upright).atan() if upright != 0 else None
    total = arb(0)
    for value, top, bottom in zip(radiance, polar, polar[1:], strict=False):
        if level is None:
            part = up_to(bottom) - up_to(top) if middle.cos() > 0 else arb(0)
        elif bottom <= level if upright > 0 else top >= level:
            part = up_to(bottom) - up_to(top)
        elif upright > 0:
            part = up_to_horizon() - up_to(top) if top < level else arb(0)
        else:
            part = up_to(bottom) - up_to_horizon() if bottom > level else arb(0)
        total += arb(float(value)) * part
    return total


def computed_map(configuration):
    radiance, up, front, normal = configuration
    return of(Equirectangular(radiance[..., None], up, front), normal)


@st.composite
def maps(draw):
    """Up to 3 x 2 texels, of which a few may be a million times as bright as others."""
    rows, columns = draw(st.integers(1, 3)), draw(st.integers(1, 2))
    exponents = draw(st.lists(between(-3, 3), min_size=rows * columns, max_size=rows * columns))
    radiance = 10.0 ** np.array(exponents).reshape(rows, columns)
    up = draw(directions())
    u, v = frame(up)
    turn = draw(between(0, 6.25))
    front = math.cos(turn) * u + math.sin(turn) * v
    emitter = Equirectangular(radiance[..., None], up, front)
    axis = draw(st.sampled_from([emitter.up, emitter.front]))
    return radiance, emitter.up, emitter.front, near(axis, draw)


FORMS = [
    Form(
        "irradiance of a constant environment",
        st.tuples(powers_of_ten(-3, 3), directions()),
        computed_constant,
        exact_constant,
    ),
    Form("irradiance of skies", skies(), computed_sky, exact_sky),
    Form("irradiance of maps", maps(), computed_map, exact_map, share=0.001),
]
