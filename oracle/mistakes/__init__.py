"""The laws of light with one mistake in each, so that one can tell from a number which bug made it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from oracle.arrays import InvalidArgument
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import Area, Emitter, Receivers
from oracle.mistakes.catalogue import MISTAKES, Mistake
from oracle.radiometry.emission import reflectance_of

__all__ = ["MISTAKES", "Mistake", "applies", "mistaken_irradiance"]

# Each receiver may need hundreds of evaluations.
_AT_ONCE = 1024


def applies(mistake: Mistake, emitter: Emitter) -> bool:
    """Whether an emitter is of a kind that can show a mistake; it may still change nothing for some receivers."""
    if isinstance(emitter, Area) and not isinstance(emitter.shape, mistake.shapes):
        return False
    return isinstance(emitter, mistake.emitters)


def mistaken_irradiance(
    mistake: Mistake, emitter: Emitter, receivers: Receivers, reflectance: ArrayLike | None = None
) -> Bounded:
    """Irradiance that someone would find who made one mistake.

    Mistakes of reflection count as one of irradiance: the value is pi/rho times the wrong radiance. Where a mistake
    says nothing about the horizon or the light's back, both stay dark. Nothing stands between light and receiver.

    Parameters
    ----------
    mistake : Mistake
        One of `MISTAKES`, which maps names to mistakes.
    emitter : Emitter
        With C channels.
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3), not on the emitter.
    reflectance : array_like, optional
        Reflectance in [0, 1] of the receivers, shape (C,) or (); only "reflectance twice" needs it.

    Returns
    -------
    Bounded
        Irradiance [W/m^2], or what the mistake makes of this unit, shape (..., C). The bound is that of
        `oracle.irradiances` where the mistake leaves the integral alone. For other integrands it is an estimate, the
        difference of two quadratures as in `oracle.adaptive` and no proof: near 1e-8 of the value, and 1e-6 for
        receivers very near the light.

    Raises
    ------
    InvalidArgument
        If the mistake cannot be made with this emitter, or lacks its reflectance.
    """
    if not applies(mistake, emitter):
        kind = type(emitter.shape if isinstance(emitter, Area) else emitter).__name__
        raise InvalidArgument(f"mistake {mistake.name!r} cannot be made with a {kind}")
    if mistake.needs_reflectance and reflectance is None:
        raise InvalidArgument(f"reflectance is missing, which {mistake.name!r} needs")
    rho = reflectance_of(1.0 if reflectance is None else reflectance)
    if rho.ndim > 1:
        raise InvalidArgument(f"reflectance has shape {rho.shape}, it must be (C,) or ()")
    points, normals = receivers.points.reshape(-1, 3), receivers.normals.reshape(-1, 3)
    parts = [
        mistake.effect(emitter, Receivers(points[part], normals[part]), rho)
        for part in chunks((len(points),), _AT_ONCE)
    ]
    value, error = np.concatenate([one.value for one in parts]), np.concatenate([one.error for one in parts])
    shape = (*receivers.shape, value.shape[-1])
    return Bounded(value.reshape(shape), error.reshape(shape))
