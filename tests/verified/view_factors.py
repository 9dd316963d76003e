"""View factors against integrals in ball arithmetic, each along another variable than the form's own."""

import math
from itertools import pairwise

import numpy as np
from flint import acb, arb, ctx
from hypothesis import strategies as st
from verification import Form
from verified.geometry import (
    ball,
    balls,
    between,
    cross,
    dot,
    minus,
    norm,
    number,
    plus,
    powers_of_ten,
    precise,
    times,
)

from oracle import view_factors
from oracle.shapes import Disk, Polygon, Rectangle, Sphere


def integral(function, low, high):
    """Integral of an analytic function of one `acb` to about 19 digits, proven."""
    if not low < high:
        return arb(0)
    return acb.integral(lambda z, _: function(z), low, high, rel_tol=arb(2) ** -62).real


def root(square):
    return acb(square).sqrt(analytic=True)


def computed(configuration):
    result = view_factors.view_factor(*configuration)
    return float(result.value), float(result.error)


# ------------------------------------------------------------------------------------------------- rectangles


@st.composite
def intervals(draw, gap):
    """Two half lengths and the offset of the centres: alike or not, aligned, touching or far aside."""
    a = draw(st.sampled_from([1.0, 1.0, draw(powers_of_ten(-1, 1)), draw(powers_of_ten(-6, 6))]))
    b = draw(st.sampled_from([a, a * draw(powers_of_ten(-1, 1)), a * draw(powers_of_ten(-6, 6))]))
    offset = draw(st.sampled_from([0.0, a + b, a - b, draw(between(-3, 3)) * max(a, b), draw(between(-3, 3)) * gap]))
    return a, b, offset


@st.composite
def parallel(draw):
    gap = draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-1, 1)))
    (a, b, x), (c, d, y) = draw(intervals(gap)), draw(intervals(gap))
    source = Rectangle([0, 0, 0], [a, 0, 0], [0, c, 0])
    return source, Rectangle([x, y, gap], [0, d, 0], [b, 0, 0])


def ends(a, b, offset):
    """Differences of the ends of two intervals, from the least to the greatest."""
    a, b, offset = ball(a), ball(b), ball(offset)
    wide, narrow = a + b, abs(a - b)
    return [offset - wide, offset - narrow, offset + narrow, offset + wide]


with ctx.workprec(256):
    GAUSS = [arb.legendre_p_root(20, k, weight=True) for k in range(20)]


def over_differences(strips, u, unit):
    """Integral over two intervals with differences u of a function of the difference, which is ``unit sinh(t)``.

    What the strips send is analytic where Im t is below pi/2: Gauss's rule with 20 nodes on panels no longer than 2,
    whose error falls as 3.4^-40, leaves 1e-20 of it.
    """
    t = [(x / unit).asinh() for x in u]
    total = arb(0)
    for low, high, weight in (
        (t[0], t[1], lambda difference: difference - u[0]),
        (t[1], t[2], lambda difference: u[1] - u[0]),
        (t[2], t[3], lambda difference: u[3] - difference),
    ):
        if not low < high:
            continue
        panels = math.ceil(float(high - low) / 2)
        half = (high - low) / (2 * panels)
        for panel in range(panels):
            for node, factor in GAUSS:
                z = low + (2 * panel + 1 + node) * half
                grown = z.exp()
                difference, length = unit * (grown - 1 / grown) / 2, unit * (grown + 1 / grown) / 2
                total += weight(difference) * strips(difference, length) * length * (factor * half)
    return total


@precise
def exact_parallel(configuration):
    """Strips across both rectangles in closed form, integrated along x with the density of their differences."""
    source, target = configuration
    x, y, gap = target.center
    a, c, b, d = source.half_u[0], source.half_v[1], target.half_v[0], target.half_u[1]
    v, gap = ends(c, d, y), ball(gap)

    def strips(_, r):
        second = sum(sign * x * (x / r).atan() for x, sign in zip(v, (1, -1, -1, 1), strict=True))
        return gap**2 * second / (2 * arb.pi() * r**3)

    return number(over_differences(strips, ends(a, b, x), gap) / (4 * ball(a) * ball(c)))


@st.composite
def perpendicular(draw):
    size = draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-1, 1)))
    a, b, x = draw(intervals(size))
    heights = st.one_of(st.just(0.0), powers_of_ten(-6, 6), powers_of_ten(-1, 1), between(-0.9, 0))
    c, d = size, draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-1, 1)))
    y, z = draw(heights), draw(heights)
    # The source lies at y > 0 in the plane z = 0, the target at z > 0 in the plane y = 0 and faces it.
    source = Rectangle([0, c + y * c if y < 0 else c + y, 0], [a, 0, 0], [0, c, 0])
    return source, Rectangle([x, 0, d + z * d if z < 0 else d + z], [0, 0, d], [b, 0, 0])


@precise
def exact_perpendicular(configuration):
    """Strips across both rectangles in closed form, integrated along x with the density of their differences."""
    source, target = configuration
    a, b = source.half_u[0], target.half_v[0]
    u = ends(a, b, target.center[0])
    y1, y2 = (ball(source.center[1]) + sign * ball(source.half_v[1]) for sign in (-1, 1))
    z1, z2 = (ball(target.center[2]) + sign * ball(target.half_u[2]) for sign in (-1, 1))
    y1, z1 = max(y1, arb(0)), max(z1, arb(0))
    touching = y1 == 0 and z1 == 0
    squares = [y2**2 + z1**2, y1**2 + z2**2, y2**2 + z2**2] + ([] if touching else [y1**2 + z1**2])

    def strips(difference, _):
        arguments = [difference * difference + square for square in squares]
        if touching:
            return (arguments[0] * arguments[1] / arguments[2]).log() / (4 * arb.pi())
        return (arguments[0] * arguments[1] / (arguments[2] * arguments[3])).log() / (4 * arb.pi())

    total = over_differences(strips, u, min(squares).sqrt())
    if touching:
        # The fourth logarithm, that of the squared difference, in closed form.
        second = [(x * x * abs(x).log() if x != 0 else arb(0)) - 3 * x * x / 2 for x in u]
        total -= (second[0] - second[1] - second[2] + second[3]) / (4 * arb.pi())
    return number(total / (4 * ball(a) * ball(source.half_v[1])))


# ------------------------------------------------------------------------------------------ disks and spheres

UP = np.array([0.0, 0.0, 1.0])


@st.composite
def coaxial(draw):
    """Two radii and a distance."""
    return tuple(draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-1, 1))) for _ in range(3))


def disks(configuration):
    first, second, height = configuration
    return Disk([0, 0, 0], UP, first), Disk([0, 0, height], -UP, second)


@precise
def exact_disks(configuration):
    """Contour integral over both rims, ``cos(phi) log(r)``, by parts."""
    first, second, height = balls(configuration)
    apart = height**2 + (first - second) ** 2

    def along_rims(t):
        half = (t / 2).sin() ** 2
        return 4 * half * (1 - half) / (apart + 4 * first * second * half)

    # Graded towards 0, where the rims are nearest.
    low = (apart / (first * second)).sqrt() / 10
    cuts = [arb(0)]
    while low < 1:
        cuts.append(low)
        low = 8 * low
    total = sum((integral(along_rims, x, y) for x, y in pairwise([*cuts, arb.pi()])), arb(0))
    return number(total * 2 * second**2 / arb.pi())


@st.composite
def spheres(draw):
    radius, height = draw(powers_of_ten(-6, 6)), draw(powers_of_ten(-6, 6))
    return draw(between(0.1, 1)) * height, radius, height


def sphere_and_disk(configuration):
    radius, target, height = configuration
    return Sphere([0, 0, 0], radius), Disk([0, 0, height], -UP, target)


@precise
def exact_sphere(configuration):
    """What rings of the disk receive from the whole sphere, (R / d)^2 cos, by reciprocity."""
    _, target, height = balls(configuration)
    ring = integral(lambda t: t / (root(t * t + height**2) ** 3), arb(0), target)
    return number(ring * height / 2)


# ----------------------------------------------------------------------------------------------------- strings


@st.composite
def strips(draw):
    """Two segments as ((x, y), (x, y)), touching, apart, or far apart; behind each other or not."""
    size = draw(st.one_of(powers_of_ten(-6, 6), powers_of_ten(-1, 1)))
    middle = [draw(between(-2, 2)) * max(1.0, size), draw(powers_of_ten(-6, 6))]
    turn = draw(between(0, 6.25))
    half = size * np.array([math.cos(turn), math.sin(turn)])
    start, end = middle + half, middle - half
    return np.array([[-1.0, 0.0], [1.0, 0.0]]), np.array([start, draw(st.sampled_from([end, end, [1.0, 0.0]]))])


def crossed(configuration):
    result = view_factors.crossed_strings(*configuration)
    return float(result.value), float(result.error)


@precise
def exact_strings(configuration):
    """The plain difference of the strings, in digits enough; the tests integrate the theorem itself."""
    (p, q), (r, s) = ([balls(point) for point in segment] for segment in configuration)
    length = norm(minus(q, p))

    def clipped(ends, other):
        (a, b), (c, d) = ends, other
        line = minus(d, c)
        heights = [line[0] * (x[1] - c[1]) - line[1] * (x[0] - c[0]) for x in (a, b)]
        if not (heights[0] > 0 or heights[1] > 0):
            return None
        at = plus(a, times(minus(b, a), heights[0] / (heights[0] - heights[1]))) if heights[0] * heights[1] < 0 else a
        return (at if heights[0] < 0 else a), (at if heights[1] < 0 else b)

    source, target = clipped((p, q), (r, s)), clipped((r, s), (p, q))
    if source is None or target is None:
        return 0.0
    (a, b), (c, d) = source, target
    crossed, sides = norm(minus(c, a)) + norm(minus(d, b)), norm(minus(d, a)) + norm(minus(c, b))
    return number((crossed - sides) / (2 * length))


# --------------------------------------------------------------------------------------------------- triangles


UNEVEN = np.array([[0.0123, 0.0345, 0.0077], [0.0411, 0.0021, 0.0319], [0.0039, 0.0293, 0.0137]])


@st.composite
def triangles(draw):
    """Two triangles, 1e-3 to 1e6 sizes apart; those that touch are left to the sums over closed polyhedra."""
    coordinate = between(-1, 1)
    first = np.array([[0, 0, 0], [1, 0, 0], [draw(coordinate), draw(between(0.1, 1)), 0]])
    size = draw(st.sampled_from([1.0, draw(powers_of_ten(-3, 3))]))
    distance = draw(st.one_of(powers_of_ten(-3, 1), powers_of_ten(0, 6)))
    aside = np.array([draw(coordinate), draw(coordinate), 0]) * max(1.0, distance)
    second = np.array([[draw(coordinate), draw(coordinate), draw(between(0, 1))] for _ in range(3)])
    # No two edges in one plane, where the reference's square root would have a double root.
    second = (second + UNEVEN) * size
    second = second + aside + [0, 0, distance]
    return first, second


def facing(configuration):
    """Both triangles with their fronts towards each other; None if one is degenerate or its plane cuts the other."""
    first, second = configuration
    edges = np.diff(second, axis=0)
    if not np.linalg.norm(np.cross(*edges)) > 1e-9 * np.abs(edges).max() ** 2:
        return None
    heights = [dot(minus(balls(corner), balls(second[0])), exact_normal(second)) for corner in first]
    if all(h >= 0 or h.contains(0) for h in heights):
        return first, second
    return (first, second[::-1]) if all(h <= 0 or h.contains(0) for h in heights) else None


def exact_normal(triangle):
    a, b, c = (balls(corner) for corner in triangle)
    return cross(minus(b, a), minus(c, a))


def polygons(configuration):
    first, second = facing(configuration) or configuration
    return computed((Polygon(first), Polygon(second)))


@precise
def exact_triangles(configuration):
    """Double contour integral of log r, the inner one by complex logarithms."""
    pair = facing(configuration)
    if pair is None:
        return None
    first, second = ([balls(corner) for corner in triangle] for triangle in pair)
    total = arb(0)
    for i in range(3):
        for j in range(3):
            total += between_edges(first[i], first[(i + 1) % 3], second[j], second[(j + 1) % 3])
    return number(total / (arb.pi() * norm(exact_normal(pair[0]))))


def between_edges(a, b, c, d):
    """``d1 . d2`` times the integral of log r along both edges."""
    u, v = minus(b, a), minus(d, c)
    length, cosine = norm(v), dot(u, v)
    e = times(v, 1 / length)
    # Offset of the outer point t from the inner line: along it p - t k, across it the root of a quadratic.
    w = minus(c, a)
    along, slope = dot(w, e), dot(u, e)
    across, drift = minus(w, times(e, along)), minus(u, times(e, slope))
    square = dot(across, across), -2 * dot(across, drift), dot(drift, drift)

    def inner(t):
        q = root(square[0] + t * square[1] + t * t * square[2])
        total = acb(0)
        for near, sign in ((along - t * slope, -1), (along + length - t * slope, 1)):
            for z in (near + acb(0, 1) * q, near - acb(0, 1) * q):
                total += sign * z * z.log(analytic=True)
        return total / 2 - length

    return cosine / length * integral(inner, arb(0), arb(1))


FORMS = [
    Form("view factor of parallel rectangles", parallel(), computed, exact_parallel, share=0.1),
    Form("view factor of perpendicular rectangles", perpendicular(), computed, exact_perpendicular, share=0.07),
    Form("view factor of coaxial disks", coaxial(), lambda c: computed(disks(c)), exact_disks),
    Form("view factor from a sphere to a disk", spheres(), lambda c: computed(sphere_and_disk(c)), exact_sphere),
    Form("view factor by crossed strings", strips(), crossed, exact_strings, share=0.05),
    Form("view factor of triangles", triangles(), polygons, exact_triangles, share=0.05),
]
