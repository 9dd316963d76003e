"""View factors of disks and spheres in any position, against integrals in one variable less than the form's own."""

import numpy as np
from flint import acb, arb, ctx
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
    precise,
    times,
    with_bits,
)
from verified.view_factors import computed, root

from oracle.shapes import Disk, Polygon, Sphere


def rules():
    """Doubly exponential rules on (0, 1) [Takahasi and Mori 1974], each with half the step of those before it together.

    Of each node its distances from both ends and its weight.
    """
    found = []
    with ctx.workprec(256):
        for level in range(5):
            per_unit = 4 * 2**level
            nodes = []
            for k in range(-17 * 2**level, 17 * 2**level + 1):
                if k % 2 or not level:
                    t = arb(k) / per_unit
                    grown = (arb.pi() * t.sinh()).exp()
                    weight = arb.pi() * t.cosh() * grown / (1 + grown) ** 2
                    nodes.append((grown / (1 + grown), 1 / (1 + grown), weight))
            found.append((arb(1) / per_unit, nodes))
    return found


RULES = rules()


def integral(function, low, high):
    """Integral of a function with square roots at both ends, to 1e-14 at least if it converges.

    Each halving of the step doubles the digits: once a step changes the 10th digit, another one does not tell.
    """
    # What is left of the interval at either end keeps its digits: functions take distances from both.
    span = high - low
    total, before = arb(0), None
    for step, nodes in RULES:
        total += sum((function(span * u, span * v) * weight for u, v, weight in nodes), arb(0))
        value = total * step * span
        if before is not None and abs(value - before) < 1e-10 * abs(value):
            return value
        before = value
    return None


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
    """Integral of an analytic function of one `acb`; what it has beyond 16 digits is for parts that cancel."""
    return acb.integral(lambda z, _: curve(z), low, high, rel_tol=arb(2) ** -(ctx.prec // 2)).real


def lies_in_front(disk, heights, lean):
    """Whether a disk is wholly above a plane, by the height of its centre and the sine of the planes' angle."""
    return heights - ball(disk.radius) * lean > 0


def potential(disk, aside, squared, turning):
    """``dx . integral of log r dy`` along the rim of a disk at the origin with normal z.

    At x, whose square and whose squared distance from the axis are given, it is circular: ``-2 pi R^2 (z x x) /
    (p + sqrt(p^2 - q^2))`` with ``p = x^2 + R^2`` and ``q = 2 R`` times the distance. Given is ``(z x x) . dx`` as
    well, and the result lacks ``2 pi R^2``.
    """
    p = squared + ball(disk.radius) ** 2
    return -turning / (p + root(p * p - (4 * ball(disk.radius) ** 2) * aside))


@with_bits(128, 256)
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

    # On the rim all of it is made of sines and cosines.
    squared, first, second = dot(center, center) + ball(other.radius) ** 2, 2 * dot(center, u), 2 * dot(center, v)
    (a, b), (c, d), (e, f) = center[:2], u[:2], v[:2]

    def around(t):
        sine, cosine = acb(t).sin(), acb(t).cos()
        x, y = a + c * cosine + e * sine, b + d * cosine + f * sine
        turning = (c * f - d * e) + (a * f - b * e) * cosine - (a * d - b * c) * sine
        return potential(disk, x * x + y * y, squared + first * cosine + second * sine, turning)

    total = along(around, 0, arb.pi()) + along(around, arb.pi(), 2 * arb.pi())
    return number(total / arb.pi())


@with_bits(128, 256)
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
        e = minus(b, a)
        turning = a[0] * e[1] - a[1] * e[0]
        aside = a[0] ** 2 + a[1] ** 2, 2 * (a[0] * e[0] + a[1] * e[1]), e[0] ** 2 + e[1] ** 2
        squared = dot(a, a), 2 * dot(a, e), dot(e, e)

        def on_edge(t, aside=aside, squared=squared, turning=turning):
            near, far = (c + t * (d + t * q) for c, d, q in (aside, squared))
            return potential(disk, near, far, turning)

        total += along(on_edge, 0, 1)
    return number(total / arb.pi())


# -------------------------------------------------------------------------------------------------- cut spheres


def cut_sphere(squared, height, radius, above, below):
    """Projected solid angle of a sphere that the horizon cuts.

    Its centre is at a squared distance and a height; it reaches so far above and below the horizon. With h = d/R,
    x = sqrt(h^2 - 1) and y = -x cot(theta): ``(cos(theta) acos(y) - x sin(theta) sqrt(1 - y^2)) / h^2 +
    atan(sin(theta) sqrt(1 - y^2) / x)`` [Snyder 1996].
    """
    beside = squared - height * height
    x = (squared / radius**2 - 1).sqrt()
    # 1 - y^2 = (R^2 - height^2) / (R sin(theta))^2
    inside = (above * below * squared / beside).sqrt() / radius
    y = -x * height / beside.sqrt()
    distance = squared.sqrt()
    sine, cosine = beside.sqrt() / distance, height / distance
    angle = arb.atan2(inside, y)
    return (cosine * angle - x * sine * inside) * radius**2 / squared + (sine * inside / x).atan()


@st.composite
def spheres(draw):
    """Two radii, the larger one last, and the gap between them."""
    large = draw(st.sampled_from([1.0, draw(powers_of_ten(-6, 6))]))
    small = large * draw(st.sampled_from([1.0, draw(powers_of_ten(-3, 0))]))
    return small, large, small * draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-2, 2)))


def both(configuration):
    small, large, gap = configuration
    return Sphere([0, 0, 0], small), Sphere([0, 0, small + large + gap], large)


@precise
def exact_spheres(configuration):
    """Over the cosine of the angle to the line of centres; the irradiance of the whole sphere is elementary."""
    small, large = both(configuration)
    r, big, distance = ball(small.radius), ball(large.radius), ball(large.center[2])
    if not distance > r + big:
        return None

    def received(from_dark, from_whole):
        height = distance * from_dark - big
        squared = distance**2 - r**2 - 2 * r * height
        return cut_sphere(squared, height, big, distance * from_dark, distance * from_whole)

    def antiderivative(cosine):
        """Of ``D (D c - r) / d^3`` with ``d^2 = D^2 + r^2 - 2 D r c``."""
        d = (r**2 + distance**2 - 2 * r * distance * cosine).sqrt()
        return (distance * cosine - r) / (r * d) + d / r**2

    seen = arb.pi() * big**2 * (antiderivative(arb(1)) - antiderivative((r + big) / distance)) / distance
    cut = integral(received, (r - big) / distance, (r + big) / distance)
    return None if cut is None else number((seen + cut) / (2 * arb.pi()))


@st.composite
def sunk_spheres(draw):
    """A disk in the plane z = 0, and a sphere that the plane cuts beside it."""
    radius = draw(st.sampled_from([1.0, draw(powers_of_ten(-3, 3))]))
    height = radius * draw(between(-0.98, 0.98))
    circle = np.sqrt((radius - height) * (radius + height))
    size = radius * draw(st.one_of(powers_of_ten(-3, 3), powers_of_ten(-1, 1)))
    gap = draw(st.one_of(powers_of_ten(-3, 3), powers_of_ten(-1, 1))) * min(radius, size)
    return Disk([circle + size + gap, 0, 0], [0, 0, 1], size), Sphere([0, 0, height], radius)


@precise
def exact_sunk(configuration):
    """Rings of the plane around the sphere, of each of which an arc is on the disk."""
    disk, sphere = configuration
    aside, size = ball(disk.center[0]), ball(disk.radius)
    height, radius = ball(sphere.center[2]), ball(sphere.radius)
    nearest = aside - size
    if not nearest**2 + height**2 > radius**2:
        return None

    def ring(beyond, before):
        rho = nearest + beyond
        # Law of cosines, for half the angle.
        half = 2 * arb.atan2((beyond * before).sqrt(), ((2 * nearest + beyond) * (2 * aside + beyond)).sqrt())
        return cut_sphere(rho * rho + height**2, height, radius, radius + height, radius - height) * 2 * rho * half

    flux = integral(ring, nearest, aside + size)
    return None if flux is None else number(flux / (arb.pi() ** 2 * size**2))


FORMS = [
    Form("view factor of disks in any position", pairs_of_disks(), computed, exact_disks, share=0.05),
    Form("view factor of a disk and a triangle", disks_and_triangles(), computed, exact_triangle, share=0.05),
    Form("view factor of spheres", spheres(), lambda c: computed(both(c)), exact_spheres, share=0.05),
    # Next to the sphere, the cut sphere's own bound grows.
    Form("view factor of a disk and a sphere in its plane", sunk_spheres(), computed, exact_sunk, share=0.1),
]
