"""Numbers, vectors and colours of the scene model, and what all of its parts have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, WithJsonSchema

# Whatever is larger overflows in renderers of single precision, if not itself then its square.
LARGEST = 1e18

# Strict: neither text nor true and false are taken for numbers.
Finite = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST, allow_inf_nan=False)]
Index = Annotated[int, Field(strict=True)]
Vector = tuple[Finite, Finite, Finite]


def _require_non_negative(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if min(value) < 0:
        raise ValueError("has a negative component; light is at least 0 in every channel")
    return value


def _require_albedo(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if min(value) < 0 or max(value) > 1:
        raise ValueError("has a component outside [0, 1]; a surface reflects between none and all of the light")
    return value


def _require_direction(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if float(np.linalg.norm(value)) < 1e-12:
        raise ValueError("has no length; a direction needs at least one component that is not 0")
    return value


def _three_numbers(minimum: float, maximum: float) -> WithJsonSchema:
    """What the JSON Schema says of a vector whose validator it cannot know."""
    number = {"type": "number", "minimum": minimum, "maximum": maximum}
    return WithJsonSchema({"type": "array", "prefixItems": [number] * 3, "minItems": 3, "maxItems": 3})


Direction = Annotated[Vector, AfterValidator(_require_direction)]
Spectrum = Annotated[Vector, AfterValidator(_require_non_negative), _three_numbers(0, LARGEST)]
Albedo = Annotated[Vector, AfterValidator(_require_albedo), _three_numbers(0, 1)]


class Model(BaseModel):
    """Frozen data that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


# What came later than the first scene files is written only where it says something, so that those stay as they were.
ABSENT = Field(default=None, exclude_if=lambda value: value is None)
Flag = Annotated[bool, Field(strict=True, exclude_if=lambda value: value is False)]


def requires_type(schema: dict[str, Any]) -> None:
    """Say in a JSON Schema that `type` must be given, for members of unions in which one member may leave it out."""
    schema["required"] = ["type", *schema.get("required", [])]


def type_or(default: str) -> Callable[[Any], str | None]:
    """What tells members of a union apart: their `type`, or `default` for one that does not say; None for others."""

    def of(value: Any) -> str | None:
        if isinstance(value, dict):
            kind = value.get("type", default)
            return kind if isinstance(kind, str) else None
        return getattr(value, "type", None)

    return of
