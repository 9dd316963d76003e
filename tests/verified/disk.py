"""Irradiance of disks against the definition as a contour integral, in ball arithmetic.

Directions omega above the horizon, weighted with n . omega, are what their projection along n covers of the unit disk
around the receiver [Nusselt 1928]. That area is half the integral of n . (omega x d omega) along its boundary: here
along the disk's rim, by rigorous quadrature of n . (V x dV) / |V|^2, and along the horizon, where it is an angle.
"""

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
    integral,
    minus,
    number,
    plus,
    powers_of_ten,
    receivers,
    times,
    unit,
)

from oracle import emitters, shapes
from oracle.irradiances import irradiance


def covered(center, u, v, radius, normal):
    """Twice what the projection of a disk with orthonormal axes u, v covers above the horizon, up to its sign.

    All in balls and relative to the receiver.
    """
    cu, cv, squared = dot(center, u), dot(center, v), dot(center, center) + radius * radius
    # Nothing on the axis, as far as these digits tell. Elsewhere u is turned to point away from the receiver.
    aside = cu * cu + cv * cv
    aside = aside.sqrt() if aside > 0 else arb(0)
    if aside > 0:
        c, s = cu / aside, cv / aside
        u, v = plus(times(u, c), times(v, s)), minus(times(v, c), times(u, s))
    swing = 2 * radius * aside
    if not squared > swing:
        # On the rim, where there is no limit.
        return arb("nan")
    middle = dot(normal, center)
    nu, nv = dot(normal, u), dot(normal, v)
    reach = radius * (nu * nu + nv * nv).sqrt()
    cut = abs(middle) < reach
    if middle < 0 and not cut:
        return arb(0)
    # On the rim V = center - radius (u cos f + v sin f), f counts from where it is nearest to the receiver and the
    # integrand may be nearly singular. All is a trigonometric polynomial of first degree.
    highest = arb(0)
    if cut:
        # Away from the branch cut.
        highest = arb.atan2(nv, nu) + arb.pi() if nu > 0 else arb.atan2(-nv, -nu)
    half = (-middle / reach).acos() if cut else arb.pi()
    first, last = highest - half, highest + half
    along, across = -dot(normal, cross(center, v)) * radius, dot(normal, cross(center, u)) * radius
    constant = radius**2 * dot(normal, cross(u, v))

    def far(f):
        return (constant + along * f.cos() + across * f.sin()) / (squared - swing * f.cos())

    # With w = tan(f/2) = narrow sinh(y) the denominator is a multiple of cosh(y)^2, and nothing is singular.
    narrow = ((squared - swing) / (squared + swing)).sqrt()

    def near(y):
        w = narrow * y.sinh()
        numerator = constant * (1 + w * w) + along * (1 - w * w) + 2 * across * w
        return 2 * narrow * numerator / ((1 + w * w) * (squared - swing) * y.cosh())

    total, start = arb(0), first
    while start < last:
        # Quarters of the rim: every other one is near.
        turn = math.floor(float(start / arb.pi()) + 0.5 + 1e-12)
        end = (turn + 0.5) * arb.pi()
        end = end if end < last else last
        if turn % 2 or not swing > 0:
            total += integral(far, start, end)
        else:
            low, high = (((f - turn * arb.pi()) / 2).tan() / narrow for f in (start, end))
            total += integral(near, low.asinh(), high.asinh())
        if not end > start:
            break
        start = end
    if cut:
        start, end = (plus(center, times(plus(times(u, f.cos()), times(v, f.sin())), -radius)) for f in (first, last))
        total += arb.atan2(dot(normal, cross(end, start)), dot(end, start))
    return total


def axes(normal):
    """Orthonormal balls u, v, with u x v along a normal of any length."""
    w = unit(normal)
    smallest = min(range(3), key=lambda i: abs(float(w[i])))
    u = unit(cross([arb(int(i == smallest)) for i in range(3)], w))
    return u, cross(w, u)


def exact(configuration):
    """Irradiance of radiance 1, or None where it is not known to which side of the plane the receiver is."""
    center, front, radius, point, normal, two_sided = configuration
    offset = minus(balls(center), balls(point))
    height = -dot(balls(front), offset)
    if height == 0:
        return 0.0
    if not (height > 0 or height < 0):
        return None
    if height < 0 and not two_sided:
        return 0.0
    u, v = axes(balls(front))
    return number(abs(covered(offset, u, v, ball(radius), unit(balls(normal)))) / 2)


def computed(configuration):
    center, front, radius, point, normal, two_sided = configuration
    light = emitters.Area(shapes.Disk(center, front, radius), [1.0], two_sided)
    found = irradiance(light, emitters.Receivers(point, normal))
    return float(found.value[0]), float(found.error[0])


@st.composite
def placed(draw, receivers):
    """A disk of any size, anywhere, facing anyhow, with a receiver given in the frame of the unit disk."""
    point, normal = draw(receivers)
    front = draw(directions() | st.just(np.array([0.0, 0.0, 1.0])))
    rotation = np.column_stack([*frame(front), front])
    radius = draw(st.just(1.0) | powers_of_ten(-6, 6))
    center = radius * np.array([draw(st.just(0.0) | between(-3, 3)) for _ in range(3)])
    normal = rotation @ normal
    two_sided = draw(st.booleans())
    return center, front, radius, center + radius * (rotation @ point), normal / np.linalg.norm(normal), two_sided


@st.composite
def near_the_rim(draw):
    """Receivers next to the rim, in every direction from it, or in the disk's plane; for a unit disk in z = 0."""
    distance, side = draw(powers_of_ten(-6, -0.5)), draw(between(0, 6.25))
    height = draw(st.just(0.0) | st.just(distance * math.sin(side)))
    point = np.array([1 + distance * math.cos(side), 0, height])
    tilt = draw(st.sampled_from([0.0, 1e-6, 1e-3, 1.0])) * draw(directions())
    normal = draw(directions()) if draw(st.booleans()) else np.array([0.0, 0.0, draw(st.sampled_from([-1, 1]))]) + tilt
    return point, normal / np.linalg.norm(normal) if np.linalg.norm(normal) else np.array([0.0, 0.0, 1.0])


FORMS = [
    Form("disk, anywhere", placed(receivers()), computed, exact, share=0.02),
    Form("disk, receiver next to the rim", placed(near_the_rim()), computed, exact, share=0.7),
]
