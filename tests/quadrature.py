"""Irradiance by quadrature of its definition, to judge closed forms; nothing here is taken from `oracle`.

A light of radiance 1 W/(m^2 sr) gives the receiver at x with normal n

    E = integral over the light of max(cos_receiver, 0) max(cos_light, 0) / r^2 dA   [W/m^2].

The integrand has kinks where a cosine becomes 0. Every domain is therefore cut there beforehand, so that only smooth
functions are integrated and the results are good to about 1e-13 for flat lights and 1e-20 for spheres.
"""

from itertools import pairwise

import mpmath
import numpy as np
from scipy.integrate import cubature

DIGITS = 30


def unit(vector):
    """The vector scaled to length 1."""
    vector = np.asarray(vector, float)
    return vector / np.linalg.norm(vector)


def orthonormal(axis):
    """Two unit vectors u, v with u x v along `axis`."""
    axis = unit(axis)
    u = unit(np.cross(np.eye(3)[np.abs(axis).argmin()], axis))
    return u, np.cross(axis, u)


def converged(integrand, low, high):
    """Adaptive Gauss-Kronrod quadrature over a box; an integral that it does not master is an error."""
    result = cubature(integrand, low, high, rule="gk21", rtol=1e-11, atol=1e-300, max_subdivisions=3000)
    assert result.status == "converged", result.error
    return float(result.estimate)


def transfer(towards, area, light_normal, normal):
    """cos cos / r^2 dA of light elements at offsets `towards` (N, 3) from the receiver, with areas (N,)."""
    squared = (towards**2).sum(axis=1)
    return np.maximum(towards @ normal, 0) * np.maximum(-(towards @ light_normal), 0) / squared**2 * area


# ------------------------------------------------------------------------------------------------ polygon


def of_polygon(vertices, point, normal):
    """Irradiance of a one-sided polygon of radiance 1: the signed triangles of any fan add up to any polygon."""
    vertices, point, normal = np.asarray(vertices, float), np.asarray(point, float), unit(normal)
    fan = [(vertices[0], vertices[i], vertices[i + 1]) for i in range(1, len(vertices) - 1)]
    front = unit(sum(np.cross(b - a, c - a) for a, b, c in fan))
    if (point - vertices[0]) @ front <= 0:
        return 0.0
    total = 0.0
    for triangle in fan:
        piece = above_horizon(triangle, point, normal)
        for i in range(1, len(piece) - 1):
            total += _of_triangle(piece[0], piece[i], piece[i + 1], front, point, normal)
    return total


def above_horizon(triangle, point, normal):
    """The corners of the part of a triangle that the receiver's hemisphere contains, in order."""
    heights = [(corner - point) @ normal for corner in triangle]
    kept = []
    for i in range(3):
        j = (i + 1) % 3
        if heights[i] >= 0:
            kept.append(triangle[i])
        if heights[i] * heights[j] < 0:
            kept.append(triangle[i] + heights[i] / (heights[i] - heights[j]) * (triangle[j] - triangle[i]))
    return kept


def _of_triangle(a, b, c, front, point, normal):
    """Over y = a + s (b - a) + s t (c - b) with s, t in [0, 1], whose area element is `doubled` s ds dt."""
    doubled = np.cross(b - a, c - a) @ front
    if doubled == 0:
        return 0.0

    def integrand(st):
        s, t = st.T
        offsets = (a - point) + s[:, None] * (b - a) + (s * t)[:, None] * (c - b)
        return transfer(offsets, s * doubled, front, normal)

    return converged(integrand, [0, 0], [1, 1])


# --------------------------------------------------------------------------------------------------- disk


def of_disk(center, front, radius, point, normal):
    """Irradiance of a one-sided disk of radiance 1, in strips parallel to the receiver's horizon.

    With v along which the height above the horizon grows and u across, the disk is
    y = c + R sin(a) v + R cos(a) s u for -1 < s < 1, and the horizon cuts off all a below some angle.
    """
    center, front, normal = np.asarray(center, float), unit(front), unit(normal)
    offset = center - point
    if offset @ front >= 0:
        return 0.0
    uphill = normal - (normal @ front) * front
    slope = np.linalg.norm(uphill)
    if slope > 0:
        v = uphill / slope
        u = np.cross(v, front)
        cut = -(normal @ offset) / (radius * (normal @ v))
    else:
        u, v = orthonormal(front)
        cut = -np.inf if normal @ offset > 0 else np.inf
    if cut >= 1:
        return 0.0
    lowest = np.arcsin(max(cut, -1.0))

    def integrand(angle_and_s):
        angle, s = angle_and_s.T
        across, along = radius * np.cos(angle) * s, radius * np.sin(angle)
        offsets = offset + across[:, None] * u + along[:, None] * v
        return transfer(offsets, (radius * np.cos(angle)) ** 2, front, normal)

    return converged(integrand, [lowest, -1], [np.pi / 2, 1])


# ------------------------------------------------------------------------------------------------- sphere


def of_sphere(center, radius, point, normal):
    """Irradiance of a sphere of radiance 1 that shines outwards, in 30 digits.

    With alpha the angle, at the sphere's center, from the receiver to a point of its surface, distance and light
    cosine depend on alpha alone; along each circle of the same alpha the height above the horizon is A + B cos(beta).
    """
    with mpmath.workdps(DIGITS):
        center, point, normal = (mpmath.matrix([float(x) for x in vector]) for vector in (center, point, normal))
        normal /= mpmath.norm(normal)
        radius = mpmath.mpf(float(radius))
        back = point - center
        distance = mpmath.norm(back)
        along = sum(n * b for n, b in zip(normal, back, strict=True)) / distance
        across = mpmath.sqrt(max(1 - along**2, 0))
        seen = mpmath.acos(radius / distance)

        def on_circle(alpha):
            a = (radius * mpmath.cos(alpha) - distance) * along
            b = radius * mpmath.sin(alpha) * across
            if a <= -b:
                return mpmath.mpf(0)
            half = mpmath.pi if a >= b else mpmath.acos(-a / b)
            heights = 2 * (a * half + b * mpmath.sin(half))
            squared = distance**2 + radius**2 - 2 * distance * radius * mpmath.cos(alpha)
            return heights * (distance * mpmath.cos(alpha) - radius) * radius**2 * mpmath.sin(alpha) / squared**2

        # Where the horizon touches such a circle: cos(alpha -+ psi) = d cos(psi) / R with cos(psi) = |along|.
        reach = distance * abs(along) / radius
        kinks = {mpmath.mpf(0), seen}
        if reach < 1:
            psi = mpmath.acos(min(abs(along), 1))
            kinks |= {alpha for sign in (1, -1) if 0 < (alpha := abs(psi + sign * mpmath.acos(reach))) < seen}
        return float(mpmath.quad(on_circle, sorted(kinks)))


# ------------------------------------------------------------------------------------ emitters without area


def of_point(position, point, normal):
    """Irradiance of a point of intensity 1: I cos(theta) / r^2, theta from the arc cosine in 30 digits."""
    with mpmath.workdps(DIGITS):
        towards = [mpmath.mpf(float(p)) - mpmath.mpf(float(q)) for p, q in zip(position, point, strict=True)]
        theta = angle_between(normal, towards)
        squared = sum(t**2 for t in towards)
        return float(mpmath.cos(theta) / squared) if theta < mpmath.pi / 2 else 0.0


def angle_between(a, b):
    """The angle between two vectors, at the current number of digits."""
    a, b = ([mpmath.mpf(float(x)) if not isinstance(x, mpmath.mpf) else x for x in v] for v in (a, b))
    product = sum(x * y for x, y in zip(a, b, strict=True))
    lengths = mpmath.sqrt(sum(x**2 for x in a) * sum(y**2 for y in b))
    return mpmath.acos(min(max(product / lengths, -1), 1))


def of_environment():
    """Irradiance of radiance 1 from everywhere, over directions in polar coordinates around the normal."""
    return converged(
        lambda directions: np.cos(directions[:, 0]) * np.sin(directions[:, 0]), [0, 0], [np.pi / 2, 2 * np.pi]
    )


def over_sphere(function, kinks=()):
    """Integral over all unit vectors of a function that takes them as (N, 3), smooth between some polar angles."""

    def integrand(theta_and_phi):
        theta, phi = theta_and_phi.T
        sine = np.sin(theta)
        return sine * function(np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=1))

    return sum(
        converged(integrand, [first, 0], [last, 2 * np.pi]) for first, last in pairwise([0.0, *sorted(kinks), np.pi])
    )
