"""What a right renderer shows: radiance per pixel, how well it is known, and where it comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracle.arrays import Booleans, Floats


@dataclass(frozen=True)
class Provenance:
    """Where an expectation comes from: the method, and the formulas with their sources."""

    method: str
    formulas: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Expectation:
    """The expected image of a case.

    Attributes
    ----------
    radiance : ndarray
        Radiance [W/(m^2 sr)] of each pixel, shape (height, width, channels).
    standard_error : ndarray
        Its standard error, same shape; 0 for a closed form.
    error_bound : ndarray
        The numerical error of the integral over the pixel's footprint, same shape and unit.
    valid : ndarray
        Which pixels may be judged, shape (height, width).
    provenance : Provenance
        How it was computed.
    largest : ndarray or None
        The contract: the largest contribution that one sample of a customary estimator can make to each pixel, same
        shape and unit as `radiance`; infinite where there is none, and None if there is none anywhere.
    """

    radiance: Floats
    standard_error: Floats
    error_bound: Floats
    valid: Booleans
    provenance: Provenance
    largest: Floats | None = None

    def __post_init__(self) -> None:
        shape = self.radiance.shape
        if len(shape) != 3 or self.standard_error.shape != shape or self.error_bound.shape != shape:
            raise ValueError("radiance, standard_error and error_bound must share one shape (height, width, channels)")
        if self.valid.shape != shape[:2]:
            raise ValueError(f"valid has shape {self.valid.shape}, it must be {shape[:2]}")
        for array in (self.radiance, self.standard_error, self.error_bound):
            if not np.isfinite(array).all() or (array < 0).any():
                raise ValueError("an expectation must be finite and at least 0 everywhere")
            array.flags.writeable = False
        self.valid.flags.writeable = False
