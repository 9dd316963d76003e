"""Microfacets against their definitions in angles, and against integrals over the slopes of the surface."""

import math

import numpy as np
from flint import arb
from hypothesis import strategies as st
from verification import Form
from verified.fresnel import by_amplitudes, exactly, take
from verified.geometry import balls, between, dot, integral, number, plus, powers_of_ten, times, unit

from oracle.reflection.albedo import directional_albedo
from oracle.reflection.microfacet import (
    GGX,
    Beckmann,
    masking,
    masking_shadowing,
    normal_density,
    visible_normal_density,
)
from oracle.reflection.rough import RoughConductor, RoughDielectric, RoughMirror, bsdf

ALPHAS = st.one_of(between(0.05, 1), powers_of_ten(-3, 0.5))


@st.composite
def distributions(draw):
    kind = draw(st.sampled_from([GGX, Beckmann]))
    alpha = draw(ALPHAS)
    return kind, alpha, draw(ALPHAS) if draw(st.booleans()) else alpha


@st.composite
def above(draw):
    """Unit vectors of the upper hemisphere: anywhere, grazing and nearly normal."""
    match draw(st.sampled_from(["free", "grazing", "normal"])):
        case "free":
            z = draw(between(0.01, 1))
        case "grazing":
            z = draw(powers_of_ten(-6, -1))
        case "normal":
            z = 1 - draw(powers_of_ten(-16, -2))
    phi = draw(between(0, 6.25))
    s = math.sqrt((1 - z) * (1 + z))
    return np.array([s * math.cos(phi), s * math.sin(phi), z])


@st.composite
def normals_of(draw, kind, alpha, alpha_y):
    """Normals where the distribution has them."""
    xi = draw(between(0, 0.9999))
    slope = math.sqrt(xi / (1 - xi)) if kind is GGX else math.sqrt(-math.log1p(-xi))
    phi = draw(between(0, 6.25))
    m = np.array([-alpha * slope * math.cos(phi), -alpha_y * slope * math.sin(phi), 1.0])
    return m / np.linalg.norm(m)


@st.composite
def seen_normals(draw):
    distribution = draw(distributions())
    return distribution, draw(above()), draw(normals_of(*distribution))


@st.composite
def mirrored_pairs(draw):
    """Two directions on one side whose half vector is a likely normal, and now and then any two."""
    distribution, i, m = draw(seen_normals())
    o = 2 * (m @ i) * m - i
    if not o[2] > 1e-7 or draw(st.integers(0, 9)) == 0:
        o = draw(above())
    return distribution, i, o


@st.composite
def refracted_pairs(draw):
    """Two directions on either side of a dielectric, related by a likely normal, and its index."""
    distribution, i, m = draw(seen_normals())
    eta = draw(st.one_of(between(1.05, 3), between(0.3, 0.95)))
    c = m @ i
    radicand = eta**2 - 1 + c**2
    if c > 0 and radicand > 0:
        o = (-i + (c - math.sqrt(radicand)) * m) / eta
    if c <= 0 or radicand <= 0 or not o[2] < -1e-7:
        o = -draw(above())
    o = o / np.linalg.norm(o)
    return (distribution, i, o, eta) if draw(st.booleans()) else (distribution, o, i, eta)


# ------------------------------------------------------------------------------------------------ references


def density(distribution, m):
    """D from the tangent of the normal's tilt and its azimuth."""
    kind, alpha, alpha_y = distribution
    x, y, z = unit(m)
    if not z > 0:
        return arb(0)
    squared_sine = x * x + y * y
    tangent2 = squared_sine / z**2
    spread = (x * x / arb(alpha) ** 2 + y * y / arb(alpha_y) ** 2) / squared_sine if squared_sine > 0 else arb(0)
    scale = 1 / (arb.pi() * arb(alpha) * arb(alpha_y) * z**4)
    return scale * (-tangent2 * spread).exp() if kind is Beckmann else scale / (1 + tangent2 * spread) ** 2


def shadow(distribution, w):
    """Smith's Lambda, from a = 1/(alpha tan) in the direction's own roughness."""
    kind, alpha, alpha_y = distribution
    x, y, z = unit(w)
    rough = ((arb(alpha) * x) ** 2 + (arb(alpha_y) * y) ** 2).sqrt()
    if rough == 0:
        return arb(0)
    a = abs(z) / rough
    if kind is GGX:
        return ((1 + 1 / a**2).sqrt() - 1) / 2
    return (a.erf() - 1) / 2 + (-a * a).exp() / (2 * a * arb.pi().sqrt())


def visible_part(distribution, w):
    """G1 as what it means: z over the projected area of all facets that face w, summed over their slope towards w."""
    kind, alpha, alpha_y = distribution
    x, y, z = unit(balls(w))
    rough = ((arb(alpha) * x) ** 2 + (arb(alpha_y) * y) ** 2).sqrt()
    if rough == 0:
        return arb(1)
    if kind is GGX:
        # Slopes rough * tan(u) have the density cos(u)/2.
        last = (z / rough).atan()
        area = integral(lambda u: (u.cos() * z - u.sin() * rough) / 2, -arb.pi() / 2, last)
    else:
        last = min(z / rough, arb(14))
        area = integral(lambda u: (-u * u).exp() * (z - rough * u), -14, last) / arb.pi().sqrt()
    return z / area


def together_seen(distribution, i, o, separable):
    first, second = shadow(distribution, i), shadow(distribution, o)
    return 1 / ((1 + first) * (1 + second)) if separable else 1 / (1 + first + second)


def visible_density(distribution, w, m):
    w, m = unit(balls(w)), unit(balls(m))
    return max(dot(w, m), arb(0)) * density(distribution, m) / ((1 + shadow(distribution, w)) * w[2])


def conductor(configuration, eta, k, separable):
    distribution, i, o = configuration
    i, o = unit(balls(i)), unit(balls(o))
    h = unit(plus(i, o))
    fresnel = sum(by_amplitudes(dot(i, h), eta, k)) / 2
    g = together_seen(distribution, i, o, separable)
    return fresnel * g * density(distribution, h) / (4 * i[2] * o[2])


def dielectric(configuration, separable):
    """Walter's equation as written, with the smaller of the two indices set to 1."""
    distribution, i, o, eta = configuration
    i, o = unit(balls(i)), unit(balls(o))
    n_i, n_o = (arb(1), arb(eta)) if i[2] > 0 else (arb(eta), arb(1))
    h = unit(times(plus(times(i, n_i), times(o, n_o)), -1))
    if h[2] < 0:
        h = times(h, -1)
    c_i, c_o = dot(i, h), dot(o, h)
    if not (c_i * i[2] > 0 and c_o * o[2] > 0):
        return arb(0)
    # Amplitudes with both cosines at hand.
    c, d = abs(c_i), abs(c_o)
    s = (n_i * c - n_o * d) / (n_i * c + n_o * d)
    p = (n_o * c - n_i * d) / (n_o * c + n_i * d)
    passed = 1 - (s * s + p * p) / 2
    g = together_seen(distribution, i, o, separable)
    jacobian = n_o**2 / (n_i * c_i + n_o * c_o) ** 2
    return c * d / abs(i[2] * o[2]) * jacobian * passed * g * density(distribution, h)


GAUSS = [arb.legendre_p_root(24, k, weight=True) for k in range(24)]


def mirrored_part(kind, alpha, cosine, separable):
    """Directional albedo of mirrors: the BRDF over azimuth by residues or Bessel functions, then over the angle.

    Proven quadrature would cost seconds; this is Gauss's in 38 digits, in steps that grow from the smallest feature on,
    away from the mirrored direction and from the horizon. It agrees with the proven digits wherever those were found.
    """
    c, a2 = arb(cosine), arb(alpha) ** 2
    s = (1 - c * c).sqrt()
    distribution = kind, alpha, alpha
    area = c * (1 + shadow(distribution, (s, arb(0), c)))

    def leaving(angle):
        z, s_o = angle.cos(), angle.sin()
        area_o = z * (1 + shadow(distribution, (s_o, arb(0), z)))
        seen = area * area_o if separable else area * z + area_o * c - c * z
        p, q = 2 + 2 * c * z, 2 * s * s_o
        if kind is Beckmann:
            # D = (p + q cos)^2 exp(-e - k cos) / (pi a^2 h^4), and exp(-k cos) has the moments I0, -I1, I0 - I1/k.
            width = a2 * (c + z) ** 2
            k = q / width
            zeroth, first = k.bessel_i(0, scaled=True), k.bessel_i(1, scaled=True)
            azimuths = p * p * zeroth - 2 * p * q * first + q * q * (zeroth - first / k)
            return z * s_o * azimuths * (k - (s * s + s_o * s_o) / width).exp() / (2 * a2 * seen * (c + z) ** 4)
        # D = ((p + q cos) / (u + v cos))^2 / (pi a^2), and p + q cos = a^2 (u + v cos) + rest.
        u, v = (s * s + s_o * s_o) / a2 + (c + z) ** 2, q / a2
        rest = p - a2 * u
        product = u * u - v * v
        root = product.sqrt()
        azimuths = a2 * a2 + 2 * a2 * rest / root + rest * rest * u / (product * root)
        return z * s_o * azimuths / (2 * a2 * seen)

    theta, right, small = c.acos(), arb.pi() / 2, arb(min(alpha, cosine))
    lower, upper, normal = theta / 2, (theta + right) / 2, arb(min(1, 0.05 / alpha))
    total = arb(0)
    for start, end, scale in (
        (theta, lower, min(small, normal)),
        (theta, upper, min(small, normal)),
        (right, upper, small),
        (arb(0), lower, normal),
    ):
        sign = 1 if end > start else -1
        last = (abs(end - start) / scale).asinh()
        panels = max(1, math.ceil(float(last) / (2 if kind is GGX else 0.5)))
        half = last / (2 * panels)
        for panel in range(panels):
            for node, weight in GAUSS:
                x = (2 * panel + 1 + node) * half
                total += leaving(start + sign * scale * x.sinh()) * x.cosh() * (weight * half * scale)
    return total


def made(distribution):
    kind, alpha, alpha_y = distribution
    return kind(alpha, alpha_y)


@st.composite
def grazing_or_not(draw):
    """Roughness down to 1e-3 and angles up to 89.99 degrees."""
    cosine = draw(st.one_of(between(0.01, 1), powers_of_ten(-3.7, 0)))
    return draw(st.sampled_from([GGX, Beckmann])), draw(ALPHAS), min(cosine, 1 - 1e-9), draw(st.booleans())


SINGLE = st.tuples(distributions(), above())

FORMS = [
    Form(
        "microfacets, D",
        seen_normals(),
        take(lambda distribution, _, m: normal_density(made(distribution), m)),
        exactly(lambda distribution, _, m: density(distribution, balls(m))),
        share=0.01,
    ),
    Form(
        "microfacets, G1",
        SINGLE,
        take(lambda distribution, w: masking(made(distribution), w)),
        exactly(visible_part),
    ),
    Form(
        "microfacets, G2 correlated",
        mirrored_pairs(),
        take(lambda distribution, i, o: masking_shadowing(made(distribution), i, o)),
        exactly(lambda distribution, i, o: together_seen(distribution, balls(i), balls(o), False)),
    ),
    Form(
        "microfacets, G2 separable",
        mirrored_pairs(),
        take(lambda distribution, i, o: masking_shadowing(made(distribution), i, o, separable=True)),
        exactly(lambda distribution, i, o: together_seen(distribution, balls(i), balls(o), True)),
    ),
    Form(
        "microfacets, visible normals",
        seen_normals(),
        take(lambda distribution, w, m: visible_normal_density(made(distribution), w, m)),
        exactly(visible_density),
        share=0.02,
    ),
    Form(
        "albedo of rough mirrors",
        grazing_or_not(),
        take(lambda kind, alpha, c, separable: directional_albedo(RoughMirror(kind(alpha), separable), c)),
        lambda configuration: number(mirrored_part(*configuration)),
        share=0.01,
    ),
    Form(
        "rough conductor",
        mirrored_pairs(),
        take(lambda distribution, i, o: bsdf(RoughConductor(made(distribution), 0.2, 3.9), i, o)),
        exactly(lambda *of: conductor(of, 0.2, 3.9, False)),
        share=0.05,
    ),
    Form(
        "rough dielectric, transmitted",
        refracted_pairs(),
        take(lambda distribution, i, o, eta: bsdf(RoughDielectric(made(distribution), eta, separable=True), i, o)),
        exactly(lambda *of: dielectric(of, True)),
        share=0.1,
    ),
]
