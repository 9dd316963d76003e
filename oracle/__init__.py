"""What is true: closed forms of light, the statistics of judging, ray casting.

The names below are the ones most used; the rest is in the modules. Nothing is loaded before it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from oracle.arrays import InvalidArgument
    from oracle.bounded import Bounded
    from oracle.emitters import (
        Area,
        Constant,
        CosineSky,
        Directional,
        Equirectangular,
        Line,
        Point,
        Receivers,
        Spot,
    )
    from oracle.irradiances import irradiance, projected_solid_angle
    from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Sphere
    from oracle.solid_angles import solid_angle
    from oracle.vector_irradiances import vector_irradiance
    from oracle.view_factors import view_factor
    from oracle.visibility import visible

__all__ = [
    "Area",
    "Bounded",
    "Constant",
    "CosineSky",
    "Directional",
    "Disk",
    "Equirectangular",
    "InvalidArgument",
    "Line",
    "Mesh",
    "Point",
    "Polygon",
    "Receivers",
    "Rectangle",
    "Sphere",
    "Spot",
    "irradiance",
    "projected_solid_angle",
    "solid_angle",
    "vector_irradiance",
    "view_factor",
    "visible",
]

_HOMES = {
    "arrays": ["InvalidArgument"],
    "bounded": ["Bounded"],
    "emitters": [
        "Area",
        "Constant",
        "CosineSky",
        "Directional",
        "Equirectangular",
        "Line",
        "Point",
        "Receivers",
        "Spot",
    ],
    "irradiances": ["irradiance", "projected_solid_angle"],
    "shapes": ["Disk", "Mesh", "Polygon", "Rectangle", "Sphere"],
    "solid_angles": ["solid_angle"],
    "vector_irradiances": ["vector_irradiance"],
    "view_factors": ["view_factor"],
    "visibility": ["visible"],
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'oracle' has no attribute {name!r}")
    return getattr(import_module(f"oracle.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
