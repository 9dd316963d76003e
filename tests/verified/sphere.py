"""Irradiance of spheres against the definition as a contour integral along the visible rim, in ball arithmetic."""

import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.disk import axes, covered
from verified.geometry import ball, balls, between, directions, dot, frame, minus, number, powers_of_ten, times, unit

from oracle import emitters, shapes
from oracle.irradiances import irradiance


def exact(configuration):
    """Irradiance of radiance 1."""
    center, radius, point, normal, two_sided = configuration
    offset, r = minus(balls(center), balls(point)), ball(radius)
    squared = dot(offset, offset)
    if squared < r * r:
        return math.pi if two_sided else 0.0
    # Within half an angle sigma around the axis; on the unit sphere, the rim is a circle of radius sin(sigma).
    height_squared = squared - r * r
    cos_sigma = (height_squared / squared).sqrt() if height_squared > 0 else arb(0)
    sin_sigma = r / squared.sqrt()
    u, v = axes(offset)
    return number(abs(covered(times(unit(offset), cos_sigma), u, v, sin_sigma, unit(balls(normal)))) / 2)


def computed(configuration):
    center, radius, point, normal, two_sided = configuration
    light = emitters.Area(shapes.Sphere(center, radius), [1.0], two_sided)
    found = irradiance(light, emitters.Receivers(point, normal))
    return float(found.value[0]), float(found.error[0])


@st.composite
def configurations(draw):
    """Spheres of any size, with receivers in or next to contact up to 1e6 radii away, often cut by the horizon."""
    radius = draw(st.just(1.0) | powers_of_ten(-6, 6))
    center = radius * np.array([draw(st.just(0.0) | between(-3, 3)) for _ in range(3)])
    towards = draw(directions())
    distance = 1 + draw(powers_of_ten(-9, 6)) if draw(between(0, 1)) < 0.95 else draw(between(0, 1))
    u, v = frame(towards)
    spin = draw(between(0, 6.25))
    across = math.cos(spin) * u + math.sin(spin) * v
    match draw(st.sampled_from(["free", "facing", "cut", "sliver"])):
        case "free":
            cosine = draw(between(-1, 1))
        case "facing":
            cosine = 1.0
        case "cut":
            cosine = draw(between(-1, 1)) / max(distance, 1)
        case "sliver":
            cosine = draw(st.sampled_from([-1, 1])) * (1 - draw(powers_of_ten(-6, -1))) / max(distance, 1)
    normal = cosine * towards + math.sqrt(1 - cosine * cosine) * across
    point = center - radius * distance * towards
    return center, radius, point, normal / np.linalg.norm(normal), draw(st.booleans())


FORMS = [Form("sphere", configurations(), computed, exact, share=0.01)]
