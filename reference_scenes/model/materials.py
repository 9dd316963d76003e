"""Materials: what becomes of light that meets a surface."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from reference_scenes.model.base import ABSENT, Flag, Model, Positive, Spectrum, requires_type, type_or
from reference_scenes.model.textures import Bitmap, Checker, Reflectance


class _Material(Model):
    model_config = ConfigDict(json_schema_extra=requires_type)


class Diffuse(Model):
    """A Lambertian surface, f = reflectance / pi."""

    type: Literal["diffuse"] = "diffuse"
    reflectance: Reflectance


class Mirror(_Material):
    """A perfect mirror, on both sides."""

    type: Literal["mirror"] = "mirror"
    reflectance: Reflectance = (1.0, 1.0, 1.0)


class Dielectric(_Material):
    """A smooth interface; ``eta`` is the refractive index behind the front divided by that before it."""

    type: Literal["dielectric"] = "dielectric"
    eta: Positive


class Conductor(_Material):
    """A smooth metal of complex refractive index ``eta + i k``."""

    type: Literal["conductor"] = "conductor"
    eta: Spectrum
    k: Spectrum


# Below, facets are a smooth surface in single precision; above, hardly a surface.
Alpha = Annotated[float, Field(strict=True, ge=1e-4, le=1)]


class RoughConductor(_Material):
    """A metal of GGX facets that scatter once; ``alpha`` is the width of the distribution of slopes [Walter 2007].

    Smith's masking and shadowing are correlated by height [Heitz 2014], or multiplied if ``separable``.
    """

    type: Literal["rough_conductor"] = "rough_conductor"
    eta: Spectrum
    k: Spectrum
    alpha: Alpha
    separable: Flag = False


def _require_bending(value: float) -> float:
    if value == 1:
        raise ValueError("bends no light; leave the surface out")
    return value


class RoughDielectric(_Material):
    """An interface of GGX facets that scatter once; ``eta`` as for a dielectric, the rest as for a rough conductor."""

    type: Literal["rough_dielectric"] = "rough_dielectric"
    eta: Annotated[Positive, AfterValidator(_require_bending)]
    alpha: Alpha
    separable: Flag = False


class Phong(_Material):
    """The modified Phong lobe, f = reflectance (n + 2)/(2 pi) cos(a)^n, a from the mirror direction, n the exponent."""

    type: Literal["phong"] = "phong"
    reflectance: Reflectance
    exponent: Annotated[float, Field(strict=True, ge=0, le=10_000)]


class Plastic(_Material):
    """A diffuse base under a smooth dielectric coat of index ``eta``, with all reflections between the two."""

    type: Literal["plastic"] = "plastic"
    reflectance: Reflectance
    eta: Positive


Unmixed = Annotated[
    Annotated[Diffuse, Tag("diffuse")]
    | Annotated[Mirror, Tag("mirror")]
    | Annotated[Dielectric, Tag("dielectric")]
    | Annotated[Conductor, Tag("conductor")]
    | Annotated[RoughConductor, Tag("rough_conductor")]
    | Annotated[RoughDielectric, Tag("rough_dielectric")]
    | Annotated[Phong, Tag("phong")]
    | Annotated[Plastic, Tag("plastic")],
    Discriminator(type_or("diffuse")),
]


class Mix(_Material):
    """A blend, ``(1 - weight) first + weight second``; neither is itself a blend."""

    type: Literal["mix"] = "mix"
    first: Unmixed
    second: Unmixed
    weight: Annotated[float, Field(strict=True, ge=0, le=1)]


Opaque = Annotated[
    Annotated[Diffuse, Tag("diffuse")]
    | Annotated[Mirror, Tag("mirror")]
    | Annotated[Conductor, Tag("conductor")]
    | Annotated[RoughConductor, Tag("rough_conductor")]
    | Annotated[Phong, Tag("phong")]
    | Annotated[Plastic, Tag("plastic")]
    | Annotated[Mix, Tag("mix")],
    Discriminator(type_or("diffuse")),
]


class TwoSided(_Material):
    """One material on the front and one on the back, which is the same if not given; neither lets light through."""

    type: Literal["two_sided"] = "two_sided"
    front: Opaque
    back: Opaque | None = ABSENT

    @model_validator(mode="after")
    def _no_light_passes(self) -> Self:
        for name, side in (("front", self.front), ("back", self.back)):
            if isinstance(side, Mix) and isinstance(side.first, Dielectric | RoughDielectric):
                raise ValueError(f"{name}/first lets light through; a surface with two sides must be opaque")
            if isinstance(side, Mix) and isinstance(side.second, Dielectric | RoughDielectric):
                raise ValueError(f"{name}/second lets light through; a surface with two sides must be opaque")
        return self


Material = Annotated[
    Annotated[Diffuse, Tag("diffuse")]
    | Annotated[Mirror, Tag("mirror")]
    | Annotated[Dielectric, Tag("dielectric")]
    | Annotated[Conductor, Tag("conductor")]
    | Annotated[RoughConductor, Tag("rough_conductor")]
    | Annotated[RoughDielectric, Tag("rough_dielectric")]
    | Annotated[Phong, Tag("phong")]
    | Annotated[Plastic, Tag("plastic")]
    | Annotated[TwoSided, Tag("two_sided")]
    | Annotated[Mix, Tag("mix")],
    Discriminator(type_or("diffuse")),
]


def texture_in(material: Material | None) -> str | None:
    """Where a material holds a texture, as a path below it; None if it holds none."""
    parts: dict[str, Material | None] = {}
    match material:
        case TwoSided():
            parts = {"front": material.front, "back": material.back}
        case Mix():
            parts = {"first": material.first, "second": material.second}
        case Diffuse() | Mirror() | Phong() | Plastic() if isinstance(material.reflectance, Bitmap | Checker):
            return "reflectance"
    found = {name: texture_in(part) for name, part in parts.items()}
    return next((f"{name}/{path}" for name, path in found.items() if path), None)
