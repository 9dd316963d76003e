"""Media by their definition, integrals along the ray and over angles, in ball arithmetic."""

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
    integral,
    minus,
    norm,
    number,
    powers_of_ten,
    times,
    unit,
)

from oracle import half_space, media
from oracle.emitters import Directional, Point, Receivers

# Float64 has no smaller numbers of full precision.
DARK = 1e-290

asymmetries = st.one_of(between(-0.95, 0.95), st.just(0.0), powers_of_ten(-4, -1).map(lambda x: 1 - x))
coefficients = st.one_of(powers_of_ten(-6, 2), between(0.01, 1))


def first(bounded):
    return float(bounded.value.flat[0]), float(bounded.error.flat[0])


def bright(value, digits=14):
    """The value as a float, unless it is too dark for float64."""
    found = number(value, digits)
    return found if found is None or found > DARK else None


def phase(bracket, g):
    """Henyey and Greenstein's function by its denominator."""
    return (1 - g * g) / (4 * arb.pi() * bracket * bracket.sqrt())


def exact_phase(configuration):
    cosine, g = balls(configuration)
    return number(phase(1 + g * g - 2 * g * cosine, g))


def exact_point(configuration):
    position, point, normal, absorption, scattering = configuration
    towards = minus(balls(position), balls(point))
    cosine = dot(unit(balls(normal)), towards)
    if cosine <= 0:
        return 0.0 if cosine < 0 else None
    r = norm(towards)
    return bright(cosine / r**3 * (-(ball(absorption) + ball(scattering)) * r).exp())


def point(configuration):
    position, where, normal, absorption, scattering = configuration
    medium = media.Medium([absorption], [scattering])
    return first(media.point_irradiance(Point(position, [1.0]), Receivers(where, normal), medium))


# ----------------------------------------------------------------------------------------------------- airlight


@st.composite
def airlights(draw):
    """A ray of length about 1 that passes a light at a distance, which may be small."""
    origin, along = np.array([draw(between(-2, 2)) for _ in range(3)]), draw(directions())
    u, _ = frame(along)
    nearest = draw(st.one_of(between(-3, 4), powers_of_ten(-3, 3)))
    position = origin + nearest * along + draw(st.one_of(powers_of_ten(-4, 2), between(0.1, 2))) * u
    length = draw(st.one_of(between(0.5, 2), powers_of_ten(-4, 4)))
    return origin, along, length, position, draw(coefficients), draw(coefficients), draw(asymmetries)


def airlight(configuration):
    origin, along, length, position, absorption, scattering, g = configuration
    medium = media.Medium([absorption], [scattering], g)
    return first(media.scattered_point(Point(position, [1.0]), media.Rays(origin, along, length), medium))


def exact_airlight(configuration):
    """Along the ray at ``h sinh(x)`` from the place that is nearest to the light, which is at the distance h."""
    origin, along, length, position, absorption, scattering, g = configuration
    towards, d = minus(balls(position), balls(origin)), unit(balls(along))
    nearest = dot(towards, d)
    h = norm(cross(towards, d))
    s, sigma, g = ball(scattering), ball(absorption) + ball(scattering), ball(g)
    start = norm(towards)

    def integrand(x, analytic):
        # The light's path is start - nearest + h (sinh(x) + cosh(x)) long.
        grown, fallen = x.exp(), (-x).exp()
        cosh = (grown + fallen) / 2
        # 1 + g^2 + 2 g tanh(x), without a difference of nearly equal numbers.
        bracket = (1 - g) ** 2 + 2 * g * grown / cosh if g > 0 else (1 + g) ** 2 - 2 * g * fallen / cosh
        root = bracket.sqrt(analytic=analytic)
        return (sigma * (start - nearest - h * grown)).exp() / (h * cosh * bracket * root)

    low, high = (-nearest / h).asinh(), ((ball(length) - nearest) / h).asinh()
    size = acb.integral(integrand, low, high, rel_tol=arb(10) ** -17).real
    return bright(size * s * (1 - g * g) / (4 * arb.pi()) * (-sigma * start).exp())


# --------------------------------------------------------------------------------------------- directional light


@st.composite
def beams(draw):
    """A ray in the half-space below z = 0."""
    origin = np.array([draw(between(-2, 2)), draw(between(-2, 2)), -draw(powers_of_ten(-4, 1))])
    along, light = draw(directions()), draw(directions())
    light[2] = -abs(light[2]) - 1e-3
    length = draw(powers_of_ten(-4, 2))
    if length * along[2] > -0.999 * origin[2]:
        length = -0.999 * origin[2] / along[2]
    return (
        origin,
        along,
        length,
        light / np.linalg.norm(light),
        draw(coefficients),
        draw(coefficients),
        draw(asymmetries),
    )


def beam(configuration):
    origin, along, length, light, absorption, scattering, g = configuration
    medium = media.Medium([absorption], [scattering], g)
    surface = media.HalfSpace(np.zeros(3), [0.0, 0.0, 1.0])
    rays = media.Rays(origin, along, length)
    return first(media.scattered_directional(Directional(light, [1.0]), rays, medium, surface))


def exact_beam(configuration):
    origin, along, length, light, absorption, scattering, g = configuration
    o, d, beam, g = balls(origin), unit(balls(along)), unit(balls(light)), ball(g)
    sigma = ball(absorption) + ball(scattering)
    depth = integral(lambda t: (-sigma * (t + (o[2] + t * d[2]) / beam[2])).exp(), arb(0), ball(length))
    return bright(depth * ball(scattering) * phase(1 + g * g + 2 * g * dot(beam, d), g))


# ---------------------------------------------------------------------------------------------------- half-space


def angles(step):
    """Doubly exponential rule on (0, pi/2) [Takahasi and Mori 1974]: what of each node log H is made of."""
    found = []
    bits = ctx.prec
    try:
        ctx.prec = 800
        for k in range(round(-4.5 / step), round(4.5 / step) + 1):
            t = arb(k) * step
            x = arb.pi() * t.sinh()
            angle = arb.pi() / 2 / (1 + (-x).exp())
            weight = arb.pi() / 2 * step * arb.pi() * t.cosh() / (2 + 2 * x.cosh())
            found.append((weight, 1 - angle * angle.cot(), angle.cos() ** 2, angle.sin() ** 2))
    finally:
        ctx.prec = bits
    return found


ANGLES = angles(1 / 64)


def log_h(cosine, albedo):
    """Stibbs and Weir's integral over an angle."""
    m, w = ball(cosine), ball(albedo)
    terms = (f * ((1 - w) + w * lost).log() / (c + m * m * s) for f, lost, c, s in ANGLES)
    return -m / arb.pi() * sum(terms, arb(0))


FORMS = [
    Form(
        "Henyey-Greenstein phase function",
        st.tuples(st.one_of(between(-1, 1), powers_of_ten(-12, 0).map(lambda x: 1 - x)), asymmetries),
        lambda configuration: first(media.henyey_greenstein(*configuration)),
        exact_phase,
    ),
    Form(
        "Transmittance",
        st.tuples(powers_of_ten(-6, 3), powers_of_ten(-9, 3)),
        lambda configuration: first(media.transmittance(configuration[:1], configuration[1])),
        lambda configuration: bright((-ball(configuration[0]) * ball(configuration[1])).exp()),
    ),
    Form(
        "Point light in a medium",
        st.tuples(
            directions().map(lambda d: 3 * d),
            st.builds(times, directions().map(list), powers_of_ten(-3, 3)).map(np.array),
            directions(),
            coefficients,
            coefficients,
        ),
        point,
        exact_point,
        share=0.01,
    ),
    Form("Single scattering of a point light", airlights(), airlight, exact_airlight, share=0.01),
    Form("Single scattering of parallel light", beams(), beam, exact_beam, share=0.01),
    Form(
        "H function of a half-space",
        st.tuples(
            st.one_of(between(0, 1), powers_of_ten(-6, 0)),
            st.one_of(between(0, 1), powers_of_ten(-9, 0).map(lambda x: 1 - x), st.just(1.0)),
        ),
        lambda configuration: first(half_space.h_function(*configuration)),
        lambda configuration: number(log_h(*configuration).exp()),
    ),
    Form(
        "Albedo of a half-space",
        st.tuples(between(0, 1), st.one_of(between(0, 0.999), powers_of_ten(-9, -0.01))),
        lambda configuration: first(half_space.half_space_albedo(*configuration)),
        lambda configuration: number(1 - log_h(*configuration).exp() * (1 - ball(configuration[1])).sqrt()),
        share=0.01,
    ),
]
