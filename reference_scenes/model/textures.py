"""Textures: colours that vary over a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    ValidationInfo,
)
from pydantic_core import CoreSchema, core_schema

from oracle.arrays import Floats, light
from reference_scenes.model.base import LARGEST, Albedo, Model, Positive, Spectrum

# Of float64 these are 400 MB.
MOST_TEXELS = 4096 * 4096


@dataclass(frozen=True, eq=False)
class Texels:
    """A grid of linear RGB values, at least 0: an array of shape (H, W, 3), top row first.

    In a scene file it is a list of rows, or the name of an image file, which `load_scene` reads.
    """

    array: Floats

    def __post_init__(self) -> None:
        array = light("texels", self.array)
        if array.ndim != 3 or array.shape[2] != 3 or not array.size:
            raise ValueError(f"has shape {array.shape}, it must be (H, W, 3) with at least one texel")
        if array.shape[0] * array.shape[1] > MOST_TEXELS:
            raise ValueError(f"has {array.shape[1]} x {array.shape[0]} texels; {MOST_TEXELS} are the most")
        if array.max() > LARGEST:
            raise ValueError(f"has a value above {LARGEST:g}")
        object.__setattr__(self, "array", array)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Texels) and np.array_equal(self.array, other.array)

    def __hash__(self) -> int:
        return hash((self.array.shape, self.array.tobytes()))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        rows = handler.generate_schema(_Rows)
        written = core_schema.plain_serializer_function_ser_schema(
            lambda texels: texels.array.tolist(), when_used="json"
        )
        return core_schema.with_info_wrap_validator_function(_texels, rows, serialization=written)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"oneOf": [handler(schema["schema"]), {"type": "string"}]}


_Rows = Annotated[tuple[Annotated[tuple[Spectrum, ...], Field(min_length=1)], ...], Field(min_length=1)]


def _texels(value: Any, handler: core_schema.ValidatorFunctionWrapHandler, info: ValidationInfo) -> Texels:
    if isinstance(value, Texels):
        return value
    if isinstance(value, np.ndarray):
        return Texels(value)
    if isinstance(value, str):
        if not info.context:
            raise ValueError("is the name of a file, which only the loader of scene files reads; give the texels")
        return Texels(info.context["read_texels"](value))
    rows = handler(value)
    uneven = next((index for index, row in enumerate(rows) if len(row) != len(rows[0])), None)
    if uneven is not None:
        raise ValueError(
            f"row {uneven} has {len(rows[uneven])} texels and row 0 has {len(rows[0])}; all must be as long"
        )
    return Texels(np.array(rows))


class Bitmap(Model):
    """An image, repeated over the plane; its row 0 is at v = 1.

    Between the centres of texels values are interpolated linearly, or taken from the nearest if not ``smooth``.
    """

    type: Literal["bitmap"] = "bitmap"
    texels: Texels
    smooth: Annotated[bool, Field(strict=True)] = True


class Checker(Model):
    """Fields of two colours, ``columns`` x ``rows`` of them for u and v from 0 to 1; ``even`` is at the origin."""

    type: Literal["checker"] = "checker"
    even: Spectrum
    odd: Spectrum
    columns: Positive = 2.0
    rows: Positive = 2.0


Texture = Annotated[Bitmap | Checker, Field(discriminator="type")]


def _kind_of_colour(value: Any) -> str:
    return "texture" if isinstance(value, dict | Bitmap | Checker) else "colour"


def _require_albedo_everywhere(value: Any) -> Any:
    match value:
        case Bitmap():
            if value.texels.array.max() > 1:
                raise ValueError(
                    f"texels go up to {value.texels.array.max():g}; a surface reflects at most all light, 1"
                )
        case Checker():
            for name in ("even", "odd"):
                if max(getattr(value, name)) > 1:
                    raise ValueError(f"{name} has a component above 1; a surface reflects at most all light")
    return value


# A colour, or one that varies over the surface.
Reflectance = Annotated[
    Annotated[Albedo, Tag("colour")] | Annotated[Texture, Tag("texture")],
    Discriminator(_kind_of_colour),
    AfterValidator(_require_albedo_everywhere),
]
Radiance = Annotated[
    Annotated[Spectrum, Tag("colour")] | Annotated[Texture, Tag("texture")], Discriminator(_kind_of_colour)
]
