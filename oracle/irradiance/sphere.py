"""Projected solid angle of spheres."""

from __future__ import annotations

import numpy as np

from oracle.arrays import Floats, dot
from oracle.bounded import Bounded
from oracle.shapes import Sphere


def sphere(shape: Sphere, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Irradiance of a uniform diffuse sphere, clipped at each receiver's horizon.

    Parameters
    ----------
    emitter : Sphere
        Center [m], radius [m] and radiance [W/(m^2 sr)], shape (C,).
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3). Inside the sphere, which shines outwards, the result is 0.

    Returns
    -------
    ndarray
        Irradiance [W/m^2], shape (..., C). Its error is below 1e-14 of the radiance; while the whole sphere is above
        the horizon also below 1e-15 of the value.

    Notes
    -----
    ``E = pi L (R/d)^2 cos(theta)`` when wholly above the horizon; else the cap that the horizon cuts
    [Snyder 1996; Lagarde and de Rousiers 2014, listing 7].
    """
    towards = shape.center - points
    distance = np.linalg.norm(towards, axis=-1)
    inside = distance < shape.radius
    distance = np.where(inside, shape.radius, distance)
    cosine = np.clip(dot(normals, towards) / distance, -1, 1)
    sine = np.linalg.norm(np.cross(normals, towards), axis=-1) / distance
    sine2_sigma = (shape.radius / distance) ** 2
    cos_sigma = np.sqrt(np.clip(1 - sine2_sigma, 0, 1))
    sin_sigma = np.sqrt(sine2_sigma)

    above = cosine >= sin_sigma
    below = cosine <= -sin_sigma
    # The cut cap; cot(sigma) is 0 only in contact with the sphere.
    cot_sigma = cos_sigma / sin_sigma
    y = np.clip(-cot_sigma * cosine / np.where(sine == 0, 1.0, sine), -1, 1)
    root = sine * np.sqrt(1 - y**2)
    cut = (cosine * np.arccos(y) - cot_sigma * root) * sine2_sigma + np.arctan2(root, cot_sigma)
    factor = np.where(above, np.pi * cosine * sine2_sigma, np.maximum(cut, 0.0))
    factor = np.where(below | inside, np.where(two_sided & inside, np.pi, 0.0), factor)
    return Bounded(factor, np.full_like(factor, 1e-14))
