"""View factors of disks and spheres in any position, against integrals in one variable less than the form's own."""

import mpmath
import numpy as np
from flint import acb, arb
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
    plus,
    powers_of_ten,
    times,
)
from verified.view_factors import computed, precise, root

from oracle.shapes import Disk, Polygon, Sphere


def integral(function, low, high):
    """Integral of a function with square roots at both ends, double exponential, to 30 digits if it converges."""
    # What is left of the interval at either end keeps its digits: functions take distances from both.
    span = high - low
    value, error = mpmath.quad(lambda u: function(span * u, span * (1 - u)) * span, [0, 1], error=True, maxdegree=8)
    return value if error < 1e-15 * abs(value) else None


# ------------------------------------------------------------------------------------- what a rim sends along a curve


@st.composite
def facing_disks(draw, radius):
    """A disk that faces the one at the origin of this radius; it may touch its plane, or be very far or very near."""
    size = radius * draw(st.one_of(powers_of_ten(-2, 2), powers_of_ten(-0.5, 0.5)))
    aside = np.array([draw(between(-2, 2)), draw(between(-2, 2)), 1.0])
    normal = draw(st.sampled_from([0.0, 0.3, 0.8])) * draw(directions()) - draw(st.sampled_from([aside, [0, 0, 1]]))
    normal /= np.linalg.norm(normal)
    gap = draw(st.one_of(powers_of_ten(-2, 1), powers_of_ten(0, 4))) * max(radius, size)
    away = max(radius, size, gap)
    return Disk([*(away * aside[:2]), gap + size * np.hypot(normal[0], normal[1])], normal, size)


@st.composite
def pairs_of_disks(draw):
    radius = draw(st.sampled_from([1.0, draw(powers_of_ten(-6, 6))]))
    return Disk([0, 0, 0], [0, 0, 1], radius), draw(facing_disks(radius))


@st.composite
def disks_and_triangles(draw):
    disk, other = draw(pairs_of_disks())
    u, v = frame(other.normal)
    angles = [draw(between(2.1 * i, 2.1 * i + 2)) for i in range(3)]
    return disk, Polygon([other.center + other.radius * (np.cos(a) * u + np.sin(a) * v) for a in angles])


def along(curve, low, high):
    """Integral of an analytic function of one `acb`, to 30 digits of its largest part: far shapes' parts cancel."""
    return acb.integral(lambda z, _: curve(z), low, high, rel_tol=arb(2) ** -100).real


def lies_in_front(disk, heights, lean):
    """Whether a disk is wholly above a plane, by the height of its centre and the sine of the planes' angle."""
    return heights - ball(disk.radius) * lean > 0


def potential(disk, x, dx):
    """``dx . integral of log r dy`` along the rim of a disk at the origin with normal z.

    With x at the height h and rho from the axis it is circular: ``-2 pi R^2 (z x x) / (p + sqrt(p^2 - q^2))`` with
    ``p = x^2 + R^2`` and ``q = 2 R rho``.
    """
    square = ball(disk.radius) ** 2
    aside = x[0] * x[0] + x[1] * x[1]
    p = aside + x[2] * x[2] + square
    return -2 * arb.pi() * square * (x[0] * dx[1] - x[1] * dx[0]) / (p + root(p * p - 4 * square * aside))


@precise
def exact_disks(configuration):
    """Contour integral over the second rim of what the first one's potential is there."""
    disk, other = configuration
    n, center = balls(other.normal), balls(other.center)
    lean = (n[0] * n[0] + n[1] * n[1]).sqrt()
    height = -dot(n, center)
    if not (lies_in_front(other, center[2], lean) and lies_in_front(disk, height, lean)):
        return None
    # The normal is taken as it is, to rounding; its axes as exact.
    level = n[1], -n[0], arb(0)
    u = times(level, ball(other.radius) / lean) if lean > 0 else [ball(other.radius), arb(0), arb(0)]
    v = cross(times(n, 1 / norm(n)), u)

    def around(t):
        sine, cosine = acb(t).sin(), acb(t).cos()
        x = plus(center, plus(times(u, cosine), times(v, sine)))
        return potential(disk, x, plus(times(u, -sine), times(v, cosine)))

    total = along(around, 0, arb.pi()) + along(around, arb.pi(), 2 * arb.pi())
    return number(total / (2 * arb.pi() ** 2 * ball(disk.radius) ** 2))


@precise
def exact_triangle(configuration):
    """Contour integral over the triangle of the disk's potential."""
    disk, triangle = configuration
    corners = [balls(corner) for corner in triangle.vertices]
    normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))
    size = norm(normal)
    if not size > 1e-6 * float(np.abs(triangle.vertices - triangle.vertices[0]).max()) ** 2:
        return None
    lean = (normal[0] ** 2 + normal[1] ** 2).sqrt() / size
    if not (lies_in_front(disk, -dot(normal, corners[0]) / size, lean) and all(x[2] > 0 for x in corners)):
        return None
    total = arb(0)
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        edge = minus(b, a)

        total += along(lambda t, a=a, e=edge: potential(disk, plus(a, times(e, acb(t))), e), 0, 1)
    return number(total / (2 * arb.pi() ** 2 * ball(disk.radius) ** 2))


# -------------------------------------------------------------------------------------------------- cut spheres


def cut_sphere(squared, height, radius, above, below):
    """Projected solid angle of a sphere that the horizon cuts.

    Its centre is at a squared distance and a height; it reaches so far above and below the horizon. With h = d/R,
    x = sqrt(h^2 - 1) and y = -x cot(theta): ``(cos(theta) acos(y) - x sin(theta) sqrt(1 - y^2)) / h^2 +
    atan(sin(theta) sqrt(1 - y^2) / x)`` [Snyder 1996].
    """
    beside = squared - height * height
    x = mpmath.sqrt(squared / radius**2 - 1)
    # 1 - y^2 = (R^2 - height^2) / (R sin(theta))^2
    inside = mpmath.sqrt(above * below * squared / beside) / radius
    y = -x * height / mpmath.sqrt(beside)
    sine, cosine = mpmath.sqrt(beside / squared), height / mpmath.sqrt(squared)
    angle = mpmath.atan2(inside, y)
    return (cosine * angle - x * sine * inside) * radius**2 / squared + mpmath.atan2(sine * inside, x)


@st.composite
def spheres(draw):
    """Two radii, the larger one last, and the gap between them."""
    large = draw(st.sampled_from([1.0, draw(powers_of_ten(-6, 6))]))
    small = large * draw(st.sampled_from([1.0, draw(powers_of_ten(-3, 0))]))
    return small, large, small * draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-2, 2)))


def both(configuration):
    small, large, gap = configuration
    return Sphere([0, 0, 0], small), Sphere([0, 0, small + large + gap], large)


def exact_spheres(configuration):
    """Over the cosine of the angle to the line of centres; the irradiance of the whole sphere is elementary."""
    small, large = both(configuration)
    with mpmath.workdps(30):
        r, big, distance = mpmath.mpf(small.radius), mpmath.mpf(large.radius), mpmath.mpf(float(large.center[2]))
        if not distance > r + big:
            return None

        def received(from_dark, from_whole):
            height = distance * from_dark - big
            squared = distance**2 - r**2 - 2 * r * height
            return cut_sphere(squared, height, big, distance * from_dark, distance * from_whole)

        def antiderivative(cosine):
            """Of ``D (D c - r) / d^3`` with ``d^2 = D^2 + r^2 - 2 D r c``."""
            d = mpmath.sqrt(r**2 + distance**2 - 2 * r * distance * cosine)
            return (distance * cosine - r) / (r * d) + d / r**2

        seen = mpmath.pi * big**2 * (antiderivative(1) - antiderivative((r + big) / distance)) / distance
        cut = integral(received, (r - big) / distance, (r + big) / distance)
        return None if cut is None else float((seen + cut) / (2 * mpmath.pi))


@st.composite
def sunk_spheres(draw):
    """A disk in the plane z = 0, and a sphere that the plane cuts beside it."""
    radius = draw(st.sampled_from([1.0, draw(powers_of_ten(-3, 3))]))
    height = radius * draw(between(-0.98, 0.98))
    circle = np.sqrt((radius - height) * (radius + height))
    size = radius * draw(st.one_of(powers_of_ten(-3, 3), powers_of_ten(-1, 1)))
    gap = draw(st.one_of(powers_of_ten(-3, 3), powers_of_ten(-1, 1))) * min(radius, size)
    return Disk([circle + size + gap, 0, 0], [0, 0, 1], size), Sphere([0, 0, height], radius)


def exact_sunk(configuration):
    """Rings of the plane around the sphere, of each of which an arc is on the disk."""
    disk, sphere = configuration
    with mpmath.workdps(30):
        aside, size = mpmath.mpf(float(disk.center[0])), mpmath.mpf(disk.radius)
        height, radius = mpmath.mpf(float(sphere.center[2])), mpmath.mpf(sphere.radius)
        if not (aside - size) ** 2 + height**2 > radius**2:
            return None

        def ring(beyond, before):
            rho = aside - size + beyond
            # Law of cosines, for half the angle.
            rest = (2 * (aside - size) + beyond) * (2 * aside + beyond)
            half = 2 * mpmath.atan2(mpmath.sqrt(beyond * before), mpmath.sqrt(rest))
            return cut_sphere(rho * rho + height**2, height, radius, radius + height, radius - height) * 2 * rho * half

        flux = integral(ring, aside - size, aside + size)
        return None if flux is None else float(flux / (mpmath.pi**2 * size**2))


FORMS = [
    Form("view factor of disks in any position", pairs_of_disks(), computed, exact_disks, share=0.05),
    Form("view factor of a disk and a triangle", disks_and_triangles(), computed, exact_triangle, share=0.05),
    Form("view factor of spheres", spheres(), lambda c: computed(both(c)), exact_spheres, share=0.05),
    # Next to the sphere, the cut sphere's own bound grows.
    Form("view factor of a disk and a sphere in its plane", sunk_spheres(), computed, exact_sunk, share=0.1),
]
