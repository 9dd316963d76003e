"""The canonical families, in the order of the lecture."""

from __future__ import annotations

from typing import Any

from reference_scenes.families.extended import DISK, FURNACE, RECTANGLE_HORIZON, RECTANGLE_OVERHEAD, SPHERE, TWO_LIGHTS
from reference_scenes.families.family import Family
from reference_scenes.families.point_like import DIRECTIONAL, HARD_SHADOW, POINT_ANGLE, POINT_DISTANCE

FAMILIES: dict[str, Family[Any]] = {
    family.name: family
    for family in (
        POINT_DISTANCE,
        POINT_ANGLE,
        DIRECTIONAL,
        RECTANGLE_OVERHEAD,
        RECTANGLE_HORIZON,
        DISK,
        SPHERE,
        TWO_LIGHTS,
        HARD_SHADOW,
        FURNACE,
    )
}
