"""The types of the fields of cases: checked strictly, as a typing slip must not become a truth."""

from __future__ import annotations

import math
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, WithJsonSchema

from oracle.arrays import BRIGHTEST, LARGEST, SMALLEST


class Model(BaseModel):
    """Frozen data that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def require_unit(value: tuple[float, float, float]) -> tuple[float, float, float]:
    """Refuse a direction whose length differs from 1 by more than rounding to seven digits does."""
    length = math.hypot(*value)
    if abs(length - 1) > 1e-6:
        raise ValueError(f"has length {length:.7g}; it must be a unit vector")
    return value


def _require_not_tiny(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"is below {SMALLEST:g}")
    return value


def _light(value: Any) -> float | tuple[float, ...]:
    """Light is a number, or a list with one number for each channel."""
    if isinstance(value, list | tuple):
        if not value:
            raise ValueError("is empty; light has at least one channel")
        return tuple(_amount(one) for one in value)
    return _amount(value)


def _amount(value: Any) -> float:
    if type(value) not in (int, float):
        raise ValueError("is neither a number nor a list of numbers, one for each channel")
    if not -BRIGHTEST <= value <= BRIGHTEST:
        raise ValueError(f"is not finite or above {BRIGHTEST:g}")
    if value < 0:
        raise ValueError("is negative; light is at least 0 in every channel")
    return float(value)


def _reflectance(value: Any) -> float | tuple[float, ...]:
    """A fraction is a number, or a list with one number for each channel."""
    fraction = _light(value)
    if max(fraction) > 1 if isinstance(fraction, tuple) else fraction > 1:
        raise ValueError("is above 1; no surface reflects more than falls on it")
    return fraction


def _number_or_list(maximum: float) -> WithJsonSchema:
    """What the JSON Schema says of a value whose validator it cannot know."""
    number = {"type": "number", "minimum": 0, "maximum": maximum}
    return WithJsonSchema({"anyOf": [number, {"type": "array", "items": number, "minItems": 1}]})


# Strict: neither text nor true and false are taken for numbers.
Number: TypeAlias = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
NonNegative: TypeAlias = Annotated[float, Field(strict=True, ge=0, le=LARGEST, allow_inf_nan=False)]
Fraction: TypeAlias = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Cosine: TypeAlias = Annotated[float, Field(strict=True, ge=-1, le=1, allow_inf_nan=False)]
Index: TypeAlias = Annotated[int, Field(strict=True, ge=0)]
TwoSided: TypeAlias = Annotated[bool, Field(strict=True, description="whether the back shines or counts as well")]
Light: TypeAlias = Annotated[float | tuple[float, ...], PlainValidator(_light), _number_or_list(BRIGHTEST)]
Reflectance: TypeAlias = Annotated[float | tuple[float, ...], PlainValidator(_reflectance), _number_or_list(1)]

# With units, which the schema and the command line's help show.
Length: TypeAlias = Annotated[
    float,
    Field(strict=True, gt=0, le=LARGEST, allow_inf_nan=False, description="m"),
    AfterValidator(_require_not_tiny),
]
Angle: TypeAlias = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False, description="rad")]
Vector: TypeAlias = Annotated[tuple[Number, Number, Number], Field(description="m")]
UnitVector: TypeAlias = Annotated[
    tuple[Number, Number, Number], AfterValidator(require_unit), Field(description="unit vector")
]
Vertices: TypeAlias = Annotated[tuple[Vector, ...], Field(min_length=3, description="m")]
Radiance: TypeAlias = Annotated[Light, Field(description="W/(m^2 sr)")]
Intensity: TypeAlias = Annotated[Light, Field(description="W/sr")]
