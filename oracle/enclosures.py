"""Light that is reflected again and again between diffuse surfaces: enclosures with closed solutions.

Everywhere ``bounces`` is the number of reflections that are counted: 0 is emission alone, 1 adds light that was
reflected once, and None adds all of them. Reflectances are fractions in [0, 1], one for each colour channel. Emission
and result are both radiances [W/(m^2 sr)] or both exitances and radiosities [W/m^2]: for diffuse surfaces these differ
by the factor pi.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import Floats, InvalidArgument, length, light
from oracle.bounded import Bounded
from oracle.emitters import Area, Point, Receivers
from oracle.irradiances import irradiance
from oracle.reflection.domain import together, within
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere

_EPSILON = float(np.finfo(np.float64).eps)
# View factors are often the result of a computation: their sums may exceed 1 by so much.
_SURPLUS = 1e-9
_TINY = float(np.finfo(np.float64).tiny)


def closed_box(emission: ArrayLike, reflectance: ArrayLike, bounces: int | None = None) -> Bounded:
    """Radiance (or radiosity) everywhere in a closed enclosure of any shape whose walls emit and reflect uniformly.

    Parameters
    ----------
    emission : array_like
        What the walls emit, at least 0, shape (..., C).
    reflectance : array_like
        In [0, 1], shape (..., C).
    bounces : int, optional
        Number of reflections; all of them if None.

    Returns
    -------
    Bounded
        In the unit of `emission`, shape (..., C).

    Raises
    ------
    InvalidArgument
        If the walls reflect everything and no number of bounces is given.

    Notes
    -----
    The Neumann series of the rendering equation [Kajiya 1986]: every wall point sees the same radiance in every
    direction, so that each reflection multiplies by the reflectance: ``Le (1 + rho + ... + rho^n)``.
    """
    emitted, rho = together(emission=light("emission", emission), reflectance=_reflectance(reflectance))
    value = emitted * _geometric(rho, bounces)
    return Bounded(value, 8 * _EPSILON * value)


def bounces_seen(radiance: ArrayLike, emission: ArrayLike, reflectance: ArrayLike) -> Floats:
    """How many reflections a renderer makes whose picture of a closed box has this radiance: inverts `closed_box`.

    Parameters
    ----------
    radiance : array_like
        Measured radiance, at least 0, shape (..., C).
    emission : array_like
        What the walls emit, above 0, shape (..., C), in the unit of `radiance`.
    reflectance : array_like
        In (0, 1], shape (..., C): black walls show no bounces.

    Returns
    -------
    ndarray
        Bounces as a real number, shape (..., C): 0 where only emission is seen, -1 for darkness, infinity where the
        radiance is that of all bounces or more. A renderer that cuts its paths off has nearly the same whole number in
        every channel; different numbers speak for another cause, such as a wrong reflectance.

    Notes
    -----
    ``n = log(1 - L (1 - rho) / Le) / log rho - 1``; its error is that of the radiance divided by
    ``Le rho^(n+1) |log rho|/(1 - rho)``, large when hardly any light is missing.
    """
    seen, emitted, rho = together(
        radiance=light("radiance", radiance),
        emission=within("emission", emission, _TINY, np.inf, "without emission bounces leave no trace"),
        reflectance=within("reflectance", reflectance, _TINY, 1, "it must be in (0, 1]"),
    )
    ratio = seen / emitted
    part = ratio * (1 - rho)
    endless = part >= 1
    # Without loss every bounce adds as much as the last one, and no radiance is that of all of them.
    lossless = rho == 1
    counted = np.log1p(np.where(endless, 0.0, -part)) / np.where(lossless, -1.0, np.log(rho))
    result: Floats = np.where(endless, np.inf, np.where(lossless, ratio, counted) - 1)
    return result


def parallel_plates(emission: ArrayLike, reflectance: ArrayLike, bounces: int | None = None) -> Bounded:
    """Radiance (or radiosity) of each of two infinite parallel plates, as seen from the other.

    Parameters
    ----------
    emission : array_like
        Emission of the first and the second plate, at least 0, shape (2, C).
    reflectance : array_like
        Their reflectances in [0, 1], shape (2, C).
    bounces : int, optional
        Number of reflections; all of them if None.

    Returns
    -------
    Bounded
        In the unit of `emission`, shape (2, C).

    Raises
    ------
    InvalidArgument
        If both plates reflect everything and no number of bounces is given.

    Notes
    -----
    Each plate sees nothing but the other: ``L1 = Le1 + rho1 L2`` and the same with 1 and 2 exchanged, so that
    ``L1 = (Le1 + rho1 Le2) / (1 - rho1 rho2)`` [Hottel and Sarofim 1967]. Light that was reflected an even number of
    times began on the plate itself, other light on the other one.
    """
    emitted, rho = _surfaces(emission, reflectance, 2)
    other = emitted[::-1]
    # 1 - rho1 rho2 without cancellation.
    lost = (1 - rho[0]) + rho[0] * (1 - rho[1])
    if bounces is None:
        _demand_loss(lost)
        value = (emitted + rho * other) / lost
    else:
        even = _sum_of_powers(rho[0] * rho[1], lost, _count(bounces) // 2)
        odd = _sum_of_powers(rho[0] * rho[1], lost, (bounces - 1) // 2)
        value = emitted * even + rho * other * odd
    return Bounded(value, 16 * _EPSILON * value)


def concentric_spheres(
    inner_radius: float, outer_radius: float, exitance: ArrayLike, reflectance: ArrayLike, bounces: int | None = None
) -> Bounded:
    """Radiosity (or radiance) of the outside of a sphere and the inside of a larger one around it.

    Parameters
    ----------
    inner_radius, outer_radius : float
        Radii [m], 0 < inner < outer.
    exitance : array_like
        Emission of the inner and the outer sphere, at least 0, shape (2, C).
    reflectance : array_like
        Their reflectances in [0, 1], shape (2, C).
    bounces : int, optional
        Number of reflections; all of them if None.

    Returns
    -------
    Bounded
        In the unit of `exitance`, shape (2, C).

    Raises
    ------
    InvalidArgument
        If both spheres reflect everything and no number of bounces is given.

    Notes
    -----
    The inner sphere sees only the outer one, which by reciprocity sees it by ``F21 = (r/R)^2`` and itself by the rest
    [Howell's catalogue, concentric spheres]. The two equations of radiosity have the determinant
    ``(1 - rho2) + rho2 F21 (1 - rho1)``, written without a difference of large numbers.
    """
    small, large = length("inner_radius", inner_radius), length("outer_radius", outer_radius)
    if small >= large:
        raise InvalidArgument(f"inner_radius is {small}, it must be below outer_radius {large}")
    emitted, rho = _surfaces(exitance, reflectance, 2)
    seen = (small / large) ** 2
    if bounces is not None:
        rest = (large - small) * (large + small) / large**2
        return radiosity(np.array([[0.0, 1.0], [seen, rest]]), emitted, rho, bounces)
    lost = (1 - rho[1]) + rho[1] * seen * (1 - rho[0])
    _demand_loss(lost)
    outer = (emitted[1] + rho[1] * seen * emitted[0]) / lost
    value = np.stack([emitted[0] + rho[0] * outer, outer])
    return Bounded(value, 24 * _EPSILON * value)


def integrating_sphere(
    sphere: Sphere,
    source: Point | Area,
    directions: ArrayLike,
    reflectance: ArrayLike,
    bounces: int | None = None,
) -> Bounded:
    """Irradiance on the inside of a diffuse sphere with a source somewhere in it.

    Parameters
    ----------
    sphere : Sphere
        The wall.
    source : Point or Area
        Inside the sphere; it hides nothing and absorbs nothing. Intensity [W/sr] or radiance [W/(m^2 sr)], shape (C,).
    directions : array_like
        From the centre to the points of the wall, unit vectors, shape (..., 3).
    reflectance : array_like
        Of the wall, in [0, 1], shape (C,).
    bounces : int, optional
        Number of reflections before the light falls on the wall point; all of them if None, direct light alone if 0.

    Returns
    -------
    Bounded
        Irradiance [W/m^2], shape (..., C); times ``rho/pi`` it is the wall's radiance.

    Raises
    ------
    InvalidArgument
        If the source is not inside, or the wall reflects everything and no number of bounces is given.

    Notes
    -----
    Light reflected by any part of the wall falls equally on all of it, for chord and cosines cancel: whatever the
    direct light, the reflected part is ``Phi rho (1 + rho + ...) / A`` [Ulbricht 1900]. Only the mean over the wall is
    ``Phi / (A (1 - rho))``.
    """
    rho = _reflectance(reflectance)
    if rho.ndim != 1:
        raise InvalidArgument(f"reflectance has shape {rho.shape}, it must be (C,)")
    flux = _flux(source)
    if rho.shape not in ((1,), flux.shape):
        raise InvalidArgument(f"reflectance has {len(rho)} channels, source has {len(flux)}")
    _demand_inside(source, sphere)
    inward = -Receivers(np.zeros(3), np.asarray(directions)).normals
    direct = irradiance(source, Receivers(sphere.center - sphere.radius * inward, inward))
    reflected = np.zeros_like(flux)
    if bounces != 0:
        later = None if bounces is None else _count(bounces) - 1
        reflected = flux / sphere.area * rho * _geometric(rho, later)
    # The wall points are rounded: they move by some ulp of the largest coordinate.
    moved = 16 * _EPSILON * (np.abs(sphere.center).max() + sphere.radius) / _clearance(source, sphere)
    # Of what is seen edge-on more may come into sight than was seen.
    sight = np.pi * source.radiance if isinstance(source, Area) else 0.0
    error = 16 * _EPSILON * reflected + moved * (direct.value + sight)
    return direct + Bounded(np.broadcast_to(reflected, direct.value.shape), error)


def radiosity(
    view_factors: ArrayLike, exitance: ArrayLike, reflectance: ArrayLike, bounces: int | None = None
) -> Bounded:
    """Radiosity of diffuse patches with known view factors, each taken to be uniform.

    Parameters
    ----------
    view_factors : array_like
        ``view_factors[i, j]`` is the part of what leaves patch i that falls on patch j, at least 0, shape (N, N). Rows
        sum to 1 in a closed enclosure and to less in an open one.
    exitance : array_like
        Emission [W/m^2], at least 0, shape (N, C).
    reflectance : array_like
        In [0, 1], shape (N, C).
    bounces : int, optional
        Number of reflections; all of them if None.

    Returns
    -------
    Bounded
        Radiosity [W/m^2], shape (N, C).

    Raises
    ------
    InvalidArgument
        If a row sums to more than 1, or light never ends and no number of bounces is given.

    Notes
    -----
    ``B = M + rho F B`` [Goral, Torrance, Greenberg and Battaile 1984]. All inverses involved are non-negative, so that
    the residual of the solution, raised by the rounding errors of its own computation and solved for once more, bounds
    the error.
    """
    factors = light("view_factors", view_factors)
    if factors.ndim != 2 or factors.shape[0] != factors.shape[1] or not len(factors):
        raise InvalidArgument(f"view_factors has shape {factors.shape}, it must be (N, N)")
    within("the sum of view_factors", factors.sum(axis=1), 0, 1 + _SURPLUS, "more than leaves the patch")
    emitted, rho = _surfaces(exitance, reflectance, len(factors))
    roundings = (len(factors) + 4) * _EPSILON
    if bounces is not None:
        value, error = emitted, np.zeros_like(emitted)
        for _ in range(_count(bounces)):
            error = rho * (factors @ error) + roundings * value
            value = emitted + rho * (factors @ value)
            error = error + roundings * value
        return Bounded(value, error)

    # One matrix (N, N) for each channel.
    reflected = rho.T[:, :, None] * factors
    matrix = np.eye(len(factors)) - reflected
    try:
        # Light ends if and only if the inverse is non-negative.
        ends = bool((np.linalg.solve(matrix, np.ones((*rho.T.shape, 1))) > 0).all())
    except np.linalg.LinAlgError:
        ends = False
    if not ends:
        raise InvalidArgument("reflectance and view_factors lose nothing: light never ends")
    given = emitted.T[..., None]
    solution = np.linalg.solve(matrix, given)
    magnitude = given + np.abs(solution) + reflected @ np.abs(solution)
    residual = np.abs(given - matrix @ solution) + roundings * magnitude
    error = 2 * np.abs(np.linalg.solve(matrix, residual))
    return Bounded(np.maximum(solution[..., 0].T, 0), error[..., 0].T)


# ------------------------------------------------------------------------------------------------------ series


def _geometric(rho: Floats, bounces: int | None) -> Floats:
    """``1 + rho + ... + rho^bounces``, endless if `bounces` is None."""
    if bounces is None:
        _demand_loss(1 - rho)
        result: Floats = 1 / (1 - rho)
        return result
    return _sum_of_powers(rho, 1 - rho, _count(bounces))


def _sum_of_powers(ratio: Floats, complement: Floats, last: int) -> Floats:
    """``1 + ratio + ... + ratio^last``, 0 for ``last = -1``; `complement` is ``1 - ratio`` without cancellation."""
    special = (ratio == 0) | (complement == 0)
    small = np.minimum(complement, 0.5)
    logarithm = np.where(complement < 0.5, np.log1p(-small), np.log(np.where(special, 1.0, ratio)))
    total = -np.expm1((last + 1) * logarithm) / np.where(special, 1.0, complement)
    result: Floats = np.where(complement == 0, last + 1.0, np.where(ratio == 0, float(last >= 0), total))
    return result


# ----------------------------------------------------------------------------------------------------- sources


def _flux(source: Point | Area) -> Floats:
    """Flux [W] that a source sends out, shape (C,)."""
    match source:
        case Point():
            return 4 * np.pi * source.intensity
        case Area():
            return np.pi * source.shape.area * (2 if source.two_sided else 1) * source.radiance
    raise InvalidArgument(f"source is a {type(source).__name__}, neither Point nor Area")


def _clearance(source: Point | Area, sphere: Sphere) -> float:
    """Distance [m] between the wall and what of the source is nearest to it; negative outside."""
    c, r = sphere.center, sphere.radius
    if isinstance(source, Point):
        return float(r - np.linalg.norm(source.position - c))
    match source.shape:
        case Polygon() | Mesh():
            return float(r - np.linalg.norm(source.shape.vertices - c, axis=-1).max())
        case Rectangle():
            return float(r - np.linalg.norm(source.shape.polygon.vertices - c, axis=-1).max())
        case Sphere():
            return float(r - np.linalg.norm(source.shape.center - c) - source.shape.radius)
        case Disk():
            offset = source.shape.center - c
            height = offset @ source.shape.normal
            across = float(np.linalg.norm(offset - height * source.shape.normal))
            return float(r - np.hypot(height, across + source.shape.radius))


def _demand_inside(source: Point | Area, sphere: Sphere) -> None:
    clearance = _clearance(source, sphere)
    if clearance <= 0:
        raise InvalidArgument(f"source reaches {-clearance:g} m beyond the sphere, it must be inside")


# ------------------------------------------------------------------------------------------------------ checks


def _reflectance(value: ArrayLike) -> Floats:
    return within("reflectance", value, 0, 1, "it must be in [0, 1]")


def _surfaces(emission: ArrayLike, reflectance: ArrayLike, count: int) -> tuple[Floats, Floats]:
    """Emission and reflectance (N, C) of so many surfaces."""
    emitted, rho = together(emission=light("emission", emission), reflectance=_reflectance(reflectance))
    if emitted.ndim != 2 or len(emitted) != count:
        raise InvalidArgument(f"emission and reflectance have shape {emitted.shape}, it must be ({count}, C)")
    return emitted, rho


def _demand_loss(lost: Floats) -> None:
    """Refuse channels in which a round trip loses nothing."""
    if (lost == 0).any():
        where = [int(i) for i in np.argwhere(lost == 0)[0]]
        raise InvalidArgument(f"reflectance{where or ''} is 1, so that light never ends: give a number of bounces")


def _count(bounces: int) -> int:
    if isinstance(bounces, bool) or not isinstance(bounces, int | np.integer) or bounces < 0:
        raise InvalidArgument(f"bounces is {bounces!r}, it must be a whole number of at least 0, or None")
    return int(bounces)
