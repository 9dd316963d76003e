"""View factors of coaxial disks."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats
from oracle.bounded import Bounded

_EPSILON = float(np.finfo(np.float64).eps)


def coaxial_disks(radius: Floats, target_radius: Floats, distance: Floats) -> Bounded:
    """View factor between parallel disks on a common axis that face each other at a positive distance [m].

    Notes
    -----
    ``F12 = 2 R2^2 / (R1^2 + R2^2 + h^2 + sqrt((h^2 + (R1 - R2)^2) (h^2 + (R1 + R2)^2)))``: the classical
    ``(X - sqrt(X^2 - 4 (R2/R1)^2)) / 2`` [Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-41],
    rationalised so that nothing cancels.
    """
    near = np.hypot(distance, radius - target_radius)
    far = np.hypot(distance, radius + target_radius)
    # R1^2 + R2^2 + h^2 = (near^2 + far^2) / 2, so that the denominator is half of a square.
    value = np.asarray((2 * target_radius / (near + far)) ** 2)
    return Bounded(value, 16 * _EPSILON * value)
