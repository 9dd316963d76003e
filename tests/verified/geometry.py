"""What the references share: vectors in ball arithmetic, and strategies for shapes and receivers."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from flint import acb, arb, ctx
from hypothesis import strategies as st

# Arb works with this many bits (38 digits) and bounds what it loses.
ctx.prec = 128


def ball(x):
    """A float64 as an exact ball."""
    return arb(float(x))


def balls(vector):
    """A vector of float64 as exact balls."""
    return [arb(float(x)) for x in vector]


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), arb(0))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def plus(a, b):
    return [x + y for x, y in zip(a, b, strict=True)]


def times(a, factor):
    return [x * factor for x in a]


def norm(a):
    return dot(a, a).sqrt()


def unit(a):
    return times(a, 1 / norm(a))


def integral(function, low, high, pieces=()):
    """Integral of an analytic function of one `acb`, cut at `pieces`, as a ball that holds the truth."""
    ends = [arb(low), *pieces, arb(high)]
    return sum((acb.integral(lambda z, _: function(z), a, b).real for a, b in pairwise(ends)), arb(0))


def with_bits(*several):
    """Run a reference with so many bits, and with more of them as long as its number is not known."""

    def decorated(reference):
        def run(configuration):
            for bits in several:
                with ctx.workprec(bits):
                    found = reference(configuration)
                if found is not None:
                    return found
            return None

        return run

    return decorated


# Of these, the cancelling terms of far or thin shapes may take 150.
precise = with_bits(256)


def number(value, digits=14):
    """The middle of a ball as a float; None if it is wider than the digits asked for."""
    middle, radius = value.mid(), value.rad()
    if not radius < abs(middle) * arb(10) ** -digits and not (middle == 0 and radius == 0):
        return None
    return float(middle)


# ------------------------------------------------------------------------------------------------- strategies


# Strategies are kept, for to set one up costs more than to draw from it.
kept = lru_cache(maxsize=1000)


@kept
def between(low, high):
    return st.floats(low, high, allow_subnormal=False)


@kept
def powers_of_ten(low, high):
    """Log-uniform numbers."""
    return between(low, high).map(lambda exponent: 10.0**exponent)


@kept
@st.composite
def directions(draw):
    """Unit vectors; the axes and planes of the coordinates are not rare."""
    z, phi = draw(between(-1, 1)), draw(between(0, 6.25))
    s = math.sqrt(1 - z * z)
    vector = np.array([s * math.cos(phi), s * math.sin(phi), z])
    return vector / np.linalg.norm(vector)


def frame(axis):
    """Two unit vectors u, v with u x v along `axis`."""
    u = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


@kept
@st.composite
def receivers(draw, nearest=-6.0, furthest=6.0, within=3.0):
    """A point and a unit normal for a shape of size 1 in the plane z = 0: at 1e-6 to 1e6 sizes, facing anyhow.

    Often the horizon cuts the shape, or grazes it.
    """
    side = draw(st.sampled_from([1, 1, 1, -1]))
    height = draw(powers_of_ten(nearest, furthest))
    reach = draw(between(0, within)) * max(1.0, height)
    angle = draw(between(0, 6.25))
    point = np.array([reach * math.cos(angle), reach * math.sin(angle), side * height])
    turn = draw(between(0, 6.25))
    somewhere = draw(between(0, 1)) * np.array([math.cos(turn), math.sin(turn), 0])
    towards = somewhere - point
    towards /= np.linalg.norm(towards)
    u, v = frame(towards)
    spin = draw(between(0, 6.25))
    across = math.cos(spin) * u + math.sin(spin) * v
    match draw(st.sampled_from(["free", "facing", "cut", "grazing"])):
        case "free":
            normal = draw(directions())
        case "facing":
            normal = towards
        case "cut":
            normal = across
        case "grazing":
            normal = across + draw(st.sampled_from([1, -1])) * draw(powers_of_ten(-6, -1)) * towards
    return point, normal / np.linalg.norm(normal)
