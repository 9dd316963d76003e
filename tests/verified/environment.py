"""Irradiance of environments against integrals over the sphere of directions in ball arithmetic.

The map is integrated over the azimuth, after an elementary integral over the polar angle of what is above the
receiver's horizon, which is where ``cot(polar) = -cos(azimuth) flat / upright``.
"""

import itertools
import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.geometry import balls, between, cross, directions, dot, frame, integral, norm, number, powers_of_ten, unit

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


def over_azimuths(function, start, end, flat, upright):
    """Integral over the azimuth from the normal's, between kinks.

    Where the horizon is nearly vertical it rushes through all polar angles beside the azimuths +-pi/2. There the
    variable is t with ``tan(azimuth -+ pi/2) = upright/flat sinh(t)``, in which it does not.
    """
    ratio = abs(upright) / flat if flat > 0 else arb(1)
    if upright == 0 or ratio > 0.2:
        return integral(function, start, end)
    eighth = arb.pi() / 4
    inside = [eighth * k for k in range(-25, 26, 2) if start < eighth * k < end]
    total = arb(0)
    ends = [start, *inside, end]
    for a, b in itertools.pairwise(ends):
        quarters = round(float((a + b) / 4 / eighth))
        if quarters % 2 == 0:
            total += integral(function, a, b)
            continue

        quarter = 2 * eighth * quarters

        def swept(t, quarter=quarter):
            w = ratio * t.sinh()
            return function(quarter + w.atan()) * ratio * t.cosh() / (1 + w * w)

        total += integral(swept, ((a - quarter).tan() / ratio).asinh(), ((b - quarter).tan() / ratio).asinh())
    return total


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

    def primitive(x, edge):
        """Antiderivative of (x sin + upright cos) sin over the polar angle."""
        return x * (edge - edge.sin() * edge.cos()) / 2 + upright * edge.sin() ** 2 / 2

    middle = (start + end) / 2
    level = arb.pi() / 2 + (flat * middle.cos() / upright).atan() if upright != 0 else None
    parts = []
    for i, value in enumerate(radiance):
        top, bottom = polar[i], polar[i + 1]
        if level is None:
            parts += [(value, top, bottom)] if middle.cos() > 0 else []
        elif upright > 0:
            parts += [(value, top, bottom)] if bottom <= level else [(value, top, None)] if top < level else []
        else:
            parts += [(value, top, bottom)] if top >= level else [(value, None, bottom)] if bottom > level else []

    def integrand(azimuth):
        x = flat * azimuth.cos()
        total = 0 * azimuth
        for value, top, bottom in parts:
            a, b = (arb.pi() / 2 + (x / upright).atan() if e is None else e + 0 * azimuth for e in (top, bottom))
            total += arb(float(value)) * (primitive(x, b) - primitive(x, a))
        return total

    return over_azimuths(integrand, start, end, flat, upright) if parts else arb(0)


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
    Form("irradiance of maps", maps(), computed_map, exact_map),
]
