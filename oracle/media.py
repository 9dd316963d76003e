"""Light in homogeneous media: attenuation and single scattering. All orders of scattering are in `half_space`.

Coefficients are given for each colour channel in 1/m, lengths in metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, direction, dot, position, replace, spectrum, vector, way
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import Directional, Point, Receivers
from oracle.irradiances import irradiance
from oracle.reflection.domain import together, within

_EPSILON = float(np.finfo(np.float64).eps)
# What has decayed by this exponent is lost in float64.
_GONE = 45.0
# Gauss rule for one panel of the airlight integral: at most `_PANEL` long, with no less than `_FEWEST` of them.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_PANEL = 2.0
_FEWEST = 6


@dataclass(frozen=True, eq=False)
class Medium:
    """A homogeneous medium that absorbs and scatters.

    Absorption and scattering coefficients [1/m], shape (C,) each. `asymmetry` is the mean cosine g in (-1, 1) of the
    angle by which light is turned, with the Henyey-Greenstein phase function: positive is forward, 0 is isotropic.
    """

    absorption: Floats
    scattering: Floats
    asymmetry: float = 0.0

    def __post_init__(self) -> None:
        replace(
            self,
            absorption=spectrum("absorption", self.absorption),
            scattering=spectrum("scattering", self.scattering),
            asymmetry=float(_asymmetry(self.asymmetry)),
        )
        if self.absorption.shape != self.scattering.shape:
            raise InvalidArgument(
                f"absorption {self.absorption.shape} and scattering {self.scattering.shape} differ in shape"
            )

    @property
    def extinction(self) -> Floats:
        """Sum of absorption and scattering [1/m], shape (C,)."""
        return self.absorption + self.scattering


@dataclass(frozen=True, eq=False)
class Rays:
    """Segments along which one looks: origins [m] and unit directions, shape (..., 3), lengths [m], shape (...)."""

    origins: Floats
    directions: Floats
    lengths: Floats

    def __post_init__(self) -> None:
        origins, directions = position("origins", self.origins), direction("directions", self.directions)
        lengths = way("lengths", self.lengths)
        try:
            shape = np.broadcast_shapes(origins.shape[:-1], directions.shape[:-1], lengths.shape)
        except ValueError:
            shapes = f"origins {origins.shape}, directions {directions.shape} and lengths {lengths.shape}"
            raise InvalidArgument(f"{shapes} do not fit together") from None
        replace(
            self,
            origins=np.broadcast_to(origins, (*shape, 3)),
            directions=np.broadcast_to(directions, (*shape, 3)),
            lengths=np.broadcast_to(lengths, shape),
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """How many rays along each axis."""
        return self.lengths.shape


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """All that lies behind the plane through `point` [m], which the unit vector `normal` points away from."""

    point: Floats
    normal: Floats

    def __post_init__(self) -> None:
        replace(self, point=vector("point", self.point), normal=direction("normal", vector("normal", self.normal)))


# -------------------------------------------------------------------------------------------------- attenuation


def transmittance(extinction: ArrayLike, distance: ArrayLike) -> Bounded:
    """Part of the radiance that is left after a distance in a homogeneous medium.

    Parameters
    ----------
    extinction : array_like
        [1/m], at least 0, shape (C,).
    distance : array_like
        [m], at least 0, shape (...).

    Returns
    -------
    Bounded
        In [0, 1], shape (..., C).

    Notes
    -----
    ``exp(-sigma_t d)`` [Bouguer 1729; Lambert 1760; Beer 1852].
    """
    depth = way("distance", distance)[..., None] * spectrum("extinction", extinction)
    value = np.exp(-depth)
    return Bounded(value, _EPSILON * (2 + depth) * value + np.finfo(np.float64).smallest_subnormal * (depth > 700))


def point_irradiance(emitter: Point, receivers: Receivers, medium: Medium) -> Bounded:
    """Irradiance of a point light in a medium: direct light alone, without what is scattered on the way.

    Parameters
    ----------
    emitter : Point
        Intensity [W/sr], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3).
    medium : Medium
        Fills all space; C channels.

    Returns
    -------
    Bounded
        Irradiance [W/m^2], shape (..., C).

    Notes
    -----
    ``I cos(theta) / r^2 exp(-sigma_t r)``.
    """
    _demand_channels(emitter.intensity, medium)
    bare = irradiance(emitter, receivers)
    away = receivers.points - emitter.position
    left = transmittance(medium.extinction, np.sqrt(dot(away, away)))
    # The distance is rounded by some ulp, which tell by the optical depth.
    depth = np.sqrt(dot(away, away))[..., None] * medium.extinction
    error = bare.error * left.value + bare.value * (left.error + 4 * _EPSILON * depth * left.value)
    value = bare.value * left.value
    return Bounded(value, error + _EPSILON * value)


# --------------------------------------------------------------------------------------------- single scattering


def henyey_greenstein(cosine: ArrayLike, asymmetry: ArrayLike) -> Bounded:
    """Phase function [1/sr]: the density of directions after light was scattered once, which integrates to 1.

    Parameters
    ----------
    cosine : array_like
        Of the angle between the directions in which light travels before and after, in [-1, 1]: 1 is straight on.
    asymmetry : array_like
        The mean of that cosine, g in (-1, 1): positive is forward, 0 isotropic.

    Returns
    -------
    Bounded
        Shape of the arguments broadcast together.

    Notes
    -----
    ``(1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2))`` [Henyey and Greenstein 1941]. With the angle between the light's
    and the viewer's direction, both pointing away from the particle, the last sign turns. The bracket is summed as
    ``(1 - |g|)^2 + 2 |g| (1 - sign(g) cos)``, where nothing cancels in the sharp peak.
    """
    mu, g = together(
        cosine=within("cosine", cosine, -1, 1, "it must be in [-1, 1]"),
        asymmetry=_asymmetry(asymmetry),
    )
    value = _henyey_greenstein(1 - np.sign(g) * mu, g)
    return Bounded(value, 12 * _EPSILON * value)


def scattered_directional(emitter: Directional, rays: Rays, medium: Medium, boundary: HalfSpace) -> Bounded:
    """Radiance that arrives at the origins of rays through a medium, scattered once out of parallel light.

    Parameters
    ----------
    emitter : Directional
        Light that enters through the boundary. Its irradiance [W/m^2], shape (C,), is that before it enters, of a
        surface facing it.
    rays : Rays
        Segments inside the medium, shape (...).
    medium : Medium
        C channels.
    boundary : HalfSpace
        Where the medium is. There is no refraction.

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C).

    Raises
    ------
    InvalidArgument
        If a segment leaves the medium or the light does not enter it.

    Notes
    -----
    The way of the light to the point at t has length ``b(t) = b0 + b1 t``, hence
    ``L = sigma_s p E exp(-sigma_t b0) (1 - exp(-s)) / s * length`` with ``s = sigma_t (1 + b1) length``; where the way
    becomes shorter along the ray the far end takes the place of the origin, so that no exponential overflows
    [Chandrasekhar 1960, single scattering in a plane-parallel atmosphere].
    """
    _demand_channels(emitter.irradiance, medium)
    normal = boundary.normal
    steepness = -float(emitter.direction @ normal)
    if steepness <= 0:
        raise InvalidArgument("direction of the light does not point into the half-space")
    offsets = boundary.point - rays.origins
    near, slope = offsets @ normal, rays.directions @ normal
    far = near - slope * rays.lengths
    scale = np.abs(offsets).max(axis=-1) + rays.lengths
    outside = np.minimum(near, far) < -8 * _EPSILON * scale
    if outside.any():
        where = [int(i) for i in np.argwhere(outside)[0]]
        raise InvalidArgument(f"rays{where or ''} leave the half-space that the medium fills")
    near, far = np.maximum(near, 0), np.maximum(far, 0)

    before, after = near / steepness, far / steepness + rays.lengths
    growth = (1 - slope / steepness) * rays.lengths
    sigma = medium.extinction
    start = sigma * np.minimum(before, after)[..., None]
    rise = sigma * np.abs(growth)[..., None]
    mean = np.where(rise > 0, -np.expm1(-rise) / np.where(rise > 0, rise, 1.0), 1.0)
    # 1 - cos(angle) from the difference of the directions, the light's and that towards the origin.
    cosines = _one_minus(-rays.directions, emitter.direction, medium.asymmetry)
    phase = _henyey_greenstein(cosines, np.float64(medium.asymmetry))
    most = medium.scattering * emitter.irradiance * (phase * rays.lengths)[..., None]
    value = most * mean * np.exp(-start)

    # Rounding of the products with the normal, each by some ulp of its terms, and what follows for the exponents.
    each = np.abs(normal)
    lost = 8 * _EPSILON * float(np.abs(emitter.direction) @ each) / steepness
    lost_slope = 8 * _EPSILON * (np.abs(rays.directions) @ each)
    lost_near = 8 * _EPSILON * (np.abs(offsets) @ each)
    lost_far = lost_near + lost_slope * rays.lengths
    way_off = (np.maximum(lost_near, lost_far) + np.maximum(near, far) * lost) / steepness
    growth_off = (lost_slope + np.abs(slope) * lost) / steepness * rays.lengths
    doubt = sigma * way_off[..., None] + sigma * growth_off[..., None] / np.maximum(2.0, rise)
    peak = 3 * abs(medium.asymmetry) / (1 - abs(medium.asymmetry))
    error = value * (_EPSILON * (24 + 4 * peak + 4 * start) + np.expm1(np.minimum(doubt, 1.0)))
    # Light that grazes the boundary so closely that its way is not known may come without loss, or not at all.
    return Bounded(value, np.where(doubt < 1, error + np.finfo(np.float64).tiny * (start > 600), most))


def scattered_point(emitter: Point, rays: Rays, medium: Medium) -> Bounded:
    """Radiance that arrives at the origins of rays, scattered once out of the light of a point: its halo in fog.

    Parameters
    ----------
    emitter : Point
        Intensity [W/sr], shape (C,).
    rays : Rays
        Segments along which one looks, shape (...).
    medium : Medium
        Fills all space; C channels.

    Returns
    -------
    Bounded
        Radiance [W/(m^2 sr)], shape (..., C). It grows as the inverse of the distance h at which a ray passes the
        light, and so does the relative error, which is about an ulp times the distance of the light over h.

    Raises
    ------
    InvalidArgument
        If a ray passes exactly through the light, where the radiance is infinite.

    Notes
    -----
    The airlight integral ``sigma_s I int p exp(-sigma_t (t + r)) / r^2 dt`` [Sun, Ramamoorthi, Narasimhan and Nayar
    2005]. With the light nearest at t0 and ``t = t0 + h sinh v`` the distance is ``r = h cosh v``, the cosine of
    the scattering angle ``-tanh v``, and what is left, ``1/h int p exp(-sigma_t h e^v) / cosh v dv``, is analytic
    for ``|Im v| < pi/2``: Gauss panels of length 2 give all digits, for forward peaks too. (Sun's angle is
    ``tan xi = e^v``.)
    """
    _demand_channels(emitter.intensity, medium)
    shape = (*rays.shape, len(emitter.intensity))
    result = Bounded(np.empty(shape), np.empty(shape))
    for part in chunks(rays.shape, at_once=512):
        along = rays.directions[part].reshape(-1, 3)
        towards = emitter.position - rays.origins[part].reshape(-1, 3)
        here = _airlight(towards, along, rays.lengths[part].reshape(-1), medium)
        result.value[part] = (here.value * emitter.intensity).reshape(result.value[part].shape)
        result.error[part] = (here.error * emitter.intensity).reshape(result.error[part].shape)
    return result


def _airlight(towards: Floats, along: Floats, lengths: Floats, medium: Medium) -> Bounded:
    """Radiance for unit intensity, shape (N, C); `towards` (N, 3) goes from the origins to the light."""
    g = medium.asymmetry
    distance = np.sqrt(dot(towards, towards))
    nearest = dot(towards, along)
    perpendicular = np.cross(towards, along)
    passing = np.sqrt(dot(perpendicular, perpendicular))
    # A light on the line of the ray but not on the segment is no harm: any tiny distance gives the same.
    least = 1e-100 * (distance + lengths)
    through = (passing <= least) & (nearest >= 0) & (nearest <= lengths)
    if through.any():
        raise InvalidArgument(f"rays[{int(np.argwhere(through)[0, 0])}] pass through the light")
    h = np.maximum(passing, least + np.finfo(np.float64).tiny)
    first = np.arcsinh(-nearest / h)
    # From the far end the light is this far; a short piece's span in v is no difference of two rounded numbers.
    rest = towards - lengths[:, None] * along
    part = lengths / (distance + np.sqrt(dot(rest, rest)) + np.finfo(np.float64).tiny)
    span = np.arcsinh((lengths - nearest) / h) - first
    span = np.where(part < 0.5, 2 * np.arctanh(np.minimum(part, 0.5)), span)

    # Where the integrand is largest: at cosh v = 1, or at the phase function's peak, or before extinction sets in.
    # Places along the ray are given by how far v has come since the origin.
    u = h[:, None] * medium.extinction
    peak = np.minimum(-np.sign(g) * np.log(1 / (1 - abs(g))), -np.log(np.maximum(u, 1e-300)))
    centre = np.clip(peak - first[:, None], 0, span[:, None])
    low = np.maximum(centre - _GONE, 0)
    # Beyond this extinction has taken all.
    at_origin = u * np.exp(first)[:, None]
    faded = np.logaddexp(centre, np.log(_GONE) - np.log(np.maximum(at_origin, 1e-300)))
    high = np.minimum(np.minimum(span[:, None], centre + _GONE), faded)

    def integrand(come: Floats) -> tuple[Floats, Floats]:
        """The integrand, and by what part of itself it changes when the light moves by one metre."""
        v = come + first[:, None, None]
        cosh = np.cosh(v)
        # 1 -+ cos(angle) = 1 +- tanh v, without cancellation.
        forward = 2 / (1 + np.exp(-2 * v if g >= 0 else 2 * v))
        # Optical depth beyond that at the origin, where it is that of the light's distance alone.
        depth = at_origin[..., None] * np.expm1(come)
        value = _henyey_greenstein(forward, np.float64(g)) * np.exp(-depth) / cosh
        bracket = (1 - abs(g)) ** 2 + 2 * abs(g) * forward
        turning = 3 * abs(g) / (cosh * bracket)
        return value, (2 + turning) / (h[:, None, None] * cosh) + medium.extinction[:, None]

    panels = max(_FEWEST, int(np.ceil((high - low).max(initial=0.0) / _PANEL)))
    width = (high - low) / panels
    starts = low[..., None] + width[..., None] * np.arange(panels)
    come = (starts[..., None] + width[..., None, None] * ((1 + _NODES) / 2)).reshape(*starts.shape[:2], -1)
    value, sensitivity = integrand(come)
    value = value * width[..., None] * np.tile(_WEIGHTS / 2, panels)
    total = value.sum(axis=-1)

    # The light seems displaced by some ulp of its distance, v is rounded, and so is the end of the segment.
    v = come + first[:, None, None]
    displaced = 4 * _EPSILON * (distance[:, None, None] + h[:, None, None] * np.cosh(v) * np.abs(v))
    moved = (value * sensitivity * displaced).sum(axis=-1)
    at_end = integrand(high[..., None])[0][..., 0]
    moved += 4 * _EPSILON * at_end * (lengths / np.maximum(np.sqrt(dot(rest, rest)), h))[:, None]
    before = medium.scattering * np.exp(-medium.extinction * distance[:, None]) / h[:, None]
    depth_error = 4 * medium.extinction * distance[:, None]
    result = before * total
    return Bounded(result, before * moved + _EPSILON * (32 + depth_error) * result)


def _henyey_greenstein(one_minus: Floats, g: Floats | np.float64) -> Floats:
    """Phase function by ``1 - sign(g) cos``."""
    size = np.abs(g)
    bracket = (1 - size) ** 2 + 2 * size * one_minus
    result: Floats = (1 - size) * (1 + size) / (4 * np.pi * bracket * np.sqrt(bracket))
    return result


def _one_minus(a: Floats, b: Floats, g: float) -> Floats:
    """``1 - sign(g) a . b`` for unit vectors, without cancellation."""
    difference = a - (1 if g >= 0 else -1) * b
    return dot(difference, difference) / 2


# ------------------------------------------------------------------------------------------------------ checks


def _asymmetry(value: ArrayLike) -> Floats:
    return within("asymmetry", value, np.nextafter(-1.0, 0), np.nextafter(1.0, 0), "it must be in (-1, 1)")


def _demand_channels(given: Floats, medium: Medium) -> None:
    if given.shape != medium.absorption.shape:
        raise InvalidArgument(f"emitter has {len(given)} channels, medium has {len(medium.absorption)}")
