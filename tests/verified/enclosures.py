"""Enclosures and diffuse spheres, in ball arithmetic: bounce by bounce, by Cramer's rule, and by integrals."""

import math

import numpy as np
from flint import arb, arb_mat, ctx
from hypothesis import strategies as st
from verification import Form
from verified.geometry import ball, balls, between, cross, directions, dot, integral, minus, norm, number, powers_of_ten

from oracle import enclosures
from oracle.emitters import Area, Point
from oracle.reflection import lambert
from oracle.shapes import Rectangle, Sphere

reflectances = st.one_of(between(0, 1), powers_of_ten(-12, 0), powers_of_ten(-12, 0).map(lambda x: 1 - x), st.just(0.0))
losing = st.one_of(between(0, 0.99), powers_of_ten(-12, 0).map(lambda x: min(1 - x, 1 - 1e-12)), st.just(0.0))
emissions = st.one_of(powers_of_ten(-6, 6), st.just(0.0))
bounces = st.one_of(st.integers(0, 40), powers_of_ten(1, 2.5).map(round))


def first(bounded):
    """Value and bound of the first surface in the only channel."""
    return float(bounded.value.flat[0]), float(bounded.error.flat[0])


# ------------------------------------------------------------------------------------------------ closed forms


def exact_box(configuration):
    emission, rho, count = configuration
    total = arb(0)
    for _ in range(count + 1):
        total = ball(emission) + ball(rho) * total
    return number(total)


def two_surfaces(view_factors, emission, rho, count):
    """First radiosity of two surfaces: all bounces by Cramer's rule, or so many by repetition."""
    (a, b), (r, s), f = balls(emission), balls(rho), view_factors
    if count is None:
        determinant = (1 - r * f[0][0]) * (1 - s * f[1][1]) - r * s * f[0][1] * f[1][0]
        return number((a * (1 - s * f[1][1]) + r * f[0][1] * b) / determinant)
    x, y = a, b
    for _ in range(count):
        x, y = a + r * (f[0][0] * x + f[0][1] * y), b + s * (f[1][0] * x + f[1][1] * y)
    return number(x)


def plates(configuration):
    emission, rho, count = configuration
    return first(enclosures.parallel_plates(np.array(emission)[:, None], np.array(rho)[:, None], count))


def exact_plates(configuration):
    emission, rho, count = configuration
    return two_surfaces([[arb(0), arb(1)], [arb(1), arb(0)]], emission, rho, count)


def spheres(configuration):
    radii, emission, rho, count, outer = configuration
    result = enclosures.concentric_spheres(*radii, np.array(emission)[:, None], np.array(rho)[:, None], count)
    return float(result.value[int(outer), 0]), float(result.error[int(outer), 0])


def exact_spheres(configuration):
    (small, large), emission, rho, count, outer = configuration
    seen = (ball(small) / ball(large)) ** 2
    factors = [[arb(0), arb(1)], [seen, 1 - seen]]
    if outer:
        factors, emission, rho = [row[::-1] for row in factors[::-1]], emission[::-1], rho[::-1]
    return two_surfaces(factors, emission, rho, count)


@st.composite
def patches(draw):
    """View factors of an open or nearly closed enclosure of three to five patches."""
    count = draw(st.integers(3, 5))
    rows = []
    for _ in range(count):
        row = np.array([draw(between(0, 1)) for _ in range(count)]) + 1e-3
        rows.append(row / row.sum() * draw(st.sampled_from([1 - 1e-12, 0.9, 0.1])))
    rho = [draw(losing) for _ in range(count)]
    return np.array(rows), [draw(emissions) for _ in range(count)], rho, draw(st.one_of(st.none(), st.integers(0, 20)))


def patchwork(configuration):
    factors, emission, rho, count = configuration
    return first(enclosures.radiosity(factors, np.array(emission)[:, None], np.array(rho)[:, None], count))


def exact_patchwork(configuration):
    factors, emission, rho, count = configuration
    size = len(rho)
    given = arb_mat(size, 1, balls(emission))
    step = arb_mat(size, size, [ball(rho[i]) * ball(factors[i, j]) for i in range(size) for j in range(size)])
    if count is None:
        identity = arb_mat(size, size, [arb(i == j) for i in range(size) for j in range(size)])
        return number((identity - step).solve(given)[0, 0])
    total = given
    for _ in range(count):
        total = given + step * total
    return number(total[0, 0])


# ------------------------------------------------------------------------------------------ integrating sphere


@st.composite
def sphere_and_source(draw):
    radius = draw(powers_of_ten(-2, 3))
    centre = radius * np.array([draw(between(-2, 2)) for _ in range(3)])
    place = centre + radius * draw(st.one_of(between(0, 0.95), st.just(0.0))) * draw(directions())
    count = draw(st.one_of(st.none(), st.integers(0, 20)))
    rho = draw(losing if count is None else reflectances)
    return centre, radius, place, draw(directions()), rho, draw(powers_of_ten(-3, 3)), count


def lit_by_point(configuration):
    centre, radius, place, direction, rho, intensity, count = configuration
    source = Point(place, np.array([intensity]))
    return first(enclosures.integrating_sphere(Sphere(centre, radius), source, direction, [rho], count))


def reflected(flux, radius, rho, count):
    """Reflected light, bounce by bounce or all together."""
    r = ball(rho)
    series = r / (1 - r) if count is None else sum((r**j for j in range(1, count + 1)), arb(0))
    return flux * series / (4 * arb.pi() * ball(radius) ** 2)


def exact_lit_by_point(configuration):
    centre, radius, place, direction, rho, intensity, count = configuration
    outward = balls(direction)
    offset = minus(balls(place), balls(centre))
    # Seen from the source, with the distance from the cosine rule: no difference of nearby places.
    along = dot(offset, outward)
    squared = ball(radius) ** 2 + dot(offset, offset) - 2 * ball(radius) * along
    direct = ball(intensity) * (ball(radius) - along) / (squared * squared.sqrt())
    return number(direct + reflected(4 * arb.pi() * ball(intensity), radius, rho, count))


def panel(centre, radius):
    """A square in the sphere."""
    return Rectangle(centre + radius * np.array([0.25, 0, 0]), [0, radius * 0.25, 0], [0, 0, radius * 0.25])


def lit_by_panel(configuration):
    centre, radius, _, direction, rho, radiance, count = configuration
    source = Area(panel(centre, radius), np.array([radiance]))
    return first(enclosures.integrating_sphere(Sphere(centre, radius), source, direction, [rho], count))


def exact_lit_by_panel(configuration):
    """Lambert's formula; all of the panel is above every horizon of the sphere's inside."""
    centre, radius, _, direction, rho, radiance, count = configuration
    square = panel(centre, radius)
    point = [c + ball(radius) * x for c, x in zip(balls(centre), balls(direction), strict=True)]
    offsets = [minus(balls(vertex), point) for vertex in square.polygon.vertices]
    total = arb(0)
    for a, b in zip(offsets, offsets[1:] + offsets[:1], strict=True):
        m = cross(a, b)
        total += arb.atan2(norm(m), dot(a, b)) * dot(balls(direction), m) / norm(m) / 2
    # Seen from its back, the square goes round the other way and does not shine.
    direct = total if total > 0 else arb(0)
    u, v = (norm(balls(half)) for half in (square.half_u, square.half_v))
    flux = arb.pi() * ball(radiance) * 4 * u * v
    return number(ball(radiance) * direct + reflected(flux, radius, rho, count), digits=13)


# ----------------------------------------------------------------------------------------------- diffuse sphere


def exact_phase(angle):
    """Lit and seen longitudes; the latitudes give the same factor at all phase angles."""
    bits = ctx.prec
    try:
        # A thin crescent is the cube of a small number.
        ctx.prec = 320
        a = ball(angle)
        half = arb.pi() / 2
        return number(2 / arb.pi() * integral(lambda t: t.cos() * (t - a).cos(), a - half, half))
    finally:
        ctx.prec = bits


@st.composite
def spheres_apart(draw):
    large = draw(powers_of_ten(-3, 3))
    small = large * draw(
        st.one_of(between(0.01, 0.99), powers_of_ten(-6, -1), powers_of_ten(-9, -1).map(lambda x: 1 - x))
    )
    count = draw(st.one_of(st.none(), bounces))
    rho = [draw(losing if count is None else reflectances) for _ in range(2)]
    return (small, large), [draw(emissions) for _ in range(2)], rho, count, draw(st.booleans())


pairs = st.tuples(emissions, emissions)

FORMS = [
    Form(
        "Closed box, partial sums",
        st.tuples(powers_of_ten(-6, 6), reflectances, bounces),
        lambda configuration: first(enclosures.closed_box(configuration[:1], configuration[1:2], configuration[2])),
        exact_box,
    ),
    Form(
        "Parallel plates",
        st.one_of(
            st.tuples(pairs, st.tuples(losing, reflectances), st.none()),
            st.tuples(pairs, st.tuples(reflectances, reflectances), bounces),
        ),
        plates,
        exact_plates,
    ),
    Form("Concentric spheres", spheres_apart(), spheres, exact_spheres),
    Form("Radiosity of patches", patches(), patchwork, exact_patchwork, share=0.05),
    Form("Integrating sphere, point off its centre", sphere_and_source(), lit_by_point, exact_lit_by_point),
    # Often the square is seen edge-on and nothing is reflected.
    Form("Integrating sphere, square off its centre", sphere_and_source(), lit_by_panel, exact_lit_by_panel, 0.15),
    Form(
        "Diffuse sphere, phase curve",
        st.one_of(between(0, math.pi), powers_of_ten(-12, 0).map(lambda x: math.pi - x), powers_of_ten(-12, 0)),
        lambda angle: first(lambert.phase_function(np.array([angle]))),
        exact_phase,
    ),
]
