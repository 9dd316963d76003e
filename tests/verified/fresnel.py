"""Fresnel's equations against their other forms: sums and differences of angles, amplitudes, Walsh's integral."""

import math
from contextlib import contextmanager

from flint import acb, arb, ctx
from hypothesis import strategies as st
from verification import Form
from verified.geometry import between, number, powers_of_ten

from oracle.reflection.fresnel import (
    conductor_reflectance,
    dielectric_reflectance,
    dielectric_transmittance,
    diffuse_reflectance,
    refracted_cosine,
)
from oracle.reflection.slab import slab_reflectance, slab_transmittance, slab_without_polarisation


@contextmanager
def digits(bits=400):
    """The squares that nearly cancel at Brewster's and at the critical angle need more than the usual digits."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


INDICES = st.one_of(
    between(1, 3),
    between(0.3, 1),
    powers_of_ten(-6, 6),
    st.builds(lambda sign, size: 1 + sign * size, st.sampled_from([1, -1]), powers_of_ten(-16, -1)),
)


@st.composite
def incidences(draw):
    """Cosine and index: anywhere, grazing, normal, and close to Brewster's and to the critical angle."""
    eta = draw(INDICES)
    match draw(st.sampled_from(["free", "grazing", "normal", "brewster", "critical"])):
        case "free":
            cosine = draw(between(0, 1))
        case "grazing":
            cosine = draw(powers_of_ten(-12, -1))
        case "normal":
            cosine = 1 - draw(powers_of_ten(-16, -1))
        case "brewster":
            cosine = math.cos(math.atan(eta)) * (1 + draw(st.sampled_from([0, 1, -1])) * draw(powers_of_ten(-16, -2)))
        case "critical":
            lower = min(eta, 1 / eta)
            cosine = math.sqrt((1 - lower) * (1 + lower))
            cosine *= 1 + draw(st.sampled_from([0, 1, -1])) * draw(powers_of_ten(-16, -2))
    return draw(st.sampled_from([1, -1])) * min(cosine, 1.0), eta


@st.composite
def before_conductors(draw):
    cosine = abs(draw(incidences())[0])
    parts = st.one_of(between(0, 10), powers_of_ten(-5, 6))
    match draw(st.sampled_from(["free", "weak", "lossless"])):
        case "free":
            return cosine, draw(parts), draw(parts)
        case "weak":
            return cosine, draw(parts), draw(st.one_of(st.just(0.0), powers_of_ten(-16, -2)))
        case "lossless":
            return cosine, draw(st.one_of(st.just(0.0), powers_of_ten(-16, -2))), draw(parts)


def by_angles(cosine, eta):
    """Both reflectances as balls, by Fresnel's sine and tangent laws."""
    c, n = arb(abs(cosine)), arb(eta)
    ratio = 1 / n if cosine >= 0 else n
    if eta == 1:
        return arb(0), arb(0)
    if c == 1:
        r = ((n - 1) / (n + 1)) ** 2
        return r, r
    sine = (1 - c * c).sqrt() * ratio
    if sine >= 1 or c == 0:
        return arb(1), arb(1)
    incident, refracted = c.acos(), sine.asin()
    minus, plus = incident - refracted, incident + refracted
    s = (minus.sin() / plus.sin()) ** 2
    return s, s * (plus.cos() / minus.cos()) ** 2


def by_amplitudes(cosine, eta, k):
    c, n = acb(cosine), acb(arb(eta), arb(k))
    if n == 1:
        return arb(0), arb(0)
    q = (n * n - 1 + c * c).sqrt()
    s = (c - q) / (c + q)
    p = (n * n * c - q) / (n * n * c + q)
    return abs(s) ** 2, abs(p) ** 2


def walsh(eta):
    """Walsh's closed form for eta > 1; the reciprocal law for eta < 1."""
    n = arb(eta) if eta > 1 else 1 / arb(eta)
    external = (
        arb(1) / 2
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * ((n - 1) / (n + 1)).log()
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * n.log()
    )
    return external if eta > 1 else 1 - (1 - external) / n**2


def slab(r, t):
    """Light sent back, and let through, after the faces' infinitely many exchanges, written out as rays meet them."""
    return r + t * r * t / (1 - r * r), t * t / (1 - r * r)


def exactly(function):
    def exact(configuration):
        with digits():
            value = function(*configuration)
            return None if value is None else number(value)

    return exact


def take(function):
    def computed(configuration):
        result = function(*configuration)
        return float(result.value), float(result.error)

    return computed


def slab_of(polarisation, which):
    def exact(cosine, eta):
        r = by_angles(abs(cosine), eta)
        r = (r[0] + r[1]) / 2 if polarisation is None else r[polarisation]
        if r == 1:
            return arb(1 - which)
        return slab(r, 1 - r)[which]

    return exactly(exact)


def slab_mean(which):
    def exact(cosine, eta):
        return sum((arb(1 - which) if r == 1 else slab(r, 1 - r)[which]) / 2 for r in by_angles(abs(cosine), eta))

    return exactly(exact)


def cosine_behind(cosine, eta):
    sine = (1 - arb(cosine) ** 2).sqrt() * (1 / arb(eta) if cosine >= 0 else arb(eta))
    return arb(0) if sine >= 1 else sine.asin().cos()


FORMS = [
    Form(
        "Fresnel, dielectric, s",
        incidences(),
        take(lambda c, eta: dielectric_reflectance(c, eta).s),
        exactly(lambda c, eta: by_angles(c, eta)[0]),
    ),
    Form(
        "Fresnel, dielectric, p",
        incidences(),
        take(lambda c, eta: dielectric_reflectance(c, eta).p),
        exactly(lambda c, eta: by_angles(c, eta)[1]),
        share=0.05,
    ),
    Form(
        "Fresnel, dielectric, unpolarised",
        incidences(),
        take(lambda c, eta: dielectric_reflectance(c, eta).unpolarised),
        exactly(lambda c, eta: sum(by_angles(c, eta)) / 2),
        share=0.001,
    ),
    Form(
        "Fresnel, dielectric, transmitted",
        incidences(),
        take(lambda c, eta: dielectric_transmittance(c, eta).unpolarised),
        exactly(lambda c, eta: 1 - sum(by_angles(c, eta)) / 2),
        share=0.02,
    ),
    Form("Snell's law", incidences(), take(refracted_cosine), exactly(cosine_behind), share=0.02),
    Form(
        "Fresnel, conductor, s",
        before_conductors().filter(lambda of: math.hypot(*of[1:]) >= 1e-6),
        take(lambda c, eta, k: conductor_reflectance(c, eta, k).s),
        exactly(lambda c, eta, k: by_amplitudes(c, eta, k)[0]),
    ),
    Form(
        "Fresnel, conductor, p",
        before_conductors().filter(lambda of: math.hypot(*of[1:]) >= 1e-6),
        take(lambda c, eta, k: conductor_reflectance(c, eta, k).p),
        exactly(lambda c, eta, k: by_amplitudes(c, eta, k)[1]),
        share=0.05,
    ),
    Form(
        "Fresnel, diffuse light",
        INDICES.filter(lambda eta: eta != 1).map(lambda eta: (eta,)),
        take(diffuse_reflectance),
        exactly(walsh),
    ),
    Form(
        "slab, reflected",
        incidences(),
        take(lambda c, eta: slab_reflectance(c, eta).unpolarised),
        slab_mean(0),
        share=0.001,
    ),
    Form(
        "slab, transmitted",
        incidences(),
        take(lambda c, eta: slab_transmittance(c, eta).unpolarised),
        slab_mean(1),
        share=0.02,
    ),
    Form(
        "slab without polarisation, reflected",
        incidences(),
        take(lambda c, eta: slab_without_polarisation(c, eta).reflectance),
        slab_of(None, 0),
    ),
    Form(
        "slab without polarisation, transmitted",
        incidences(),
        take(lambda c, eta: slab_without_polarisation(c, eta).transmittance),
        slab_of(None, 1),
        share=0.02,
    ),
]
