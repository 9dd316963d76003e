"""What the reference tracer renders, as frozen data: objects, emitters, a medium and sensors, in SI units and radians.

Shapes and emitters are those of `oracle.shapes` and `oracle.emitters`; here they get materials. Three colour channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from oracle.arrays import Floats, InvalidArgument, direction, finite, length, light, replace, vector
from oracle.emitters import Constant, CosineSky, Directional, Equirectangular, Point, Spot
from oracle.media import Medium
from oracle.shapes import Disk, Mesh, Rectangle, Sphere

Environment: TypeAlias = Constant | CosineSky | Equirectangular


# ------------------------------------------------------------------------------------------------- textures


@dataclass(frozen=True, eq=False)
class Bitmap:
    """Texels of shape (H, W, 3), repeated over the plane; row 0 is at v = 1, as in image files.

    Between the centres of texels values are interpolated linearly, or taken from the nearest if not `smooth`.
    """

    texels: Floats
    smooth: bool = True

    def __post_init__(self) -> None:
        texels = light("texels", self.texels)
        if texels.ndim != 3 or texels.shape[2] != 3 or 0 in texels.shape:
            raise InvalidArgument(f"texels has shape {texels.shape}, a bitmap needs (H, W, 3)")
        replace(self, texels=texels)


@dataclass(frozen=True, eq=False)
class Checker:
    """Fields of two colours, `columns` and `rows` of them for u and v from 0 to 1; that at the origin is `even`."""

    even: Floats
    odd: Floats
    columns: float = 2
    rows: float = 2

    def __post_init__(self) -> None:
        replace(
            self,
            even=_rgb("even", self.even),
            odd=_rgb("odd", self.odd),
            columns=length("columns", self.columns),
            rows=length("rows", self.rows),
        )


Texture: TypeAlias = Bitmap | Checker


# ------------------------------------------------------------------------------------------------ materials


@dataclass(frozen=True, eq=False)
class Diffuse:
    """A Lambertian front, f = reflectance / pi, and a black back."""

    reflectance: Floats | Texture

    def __post_init__(self) -> None:
        replace(self, reflectance=_reflectance(self.reflectance))


@dataclass(frozen=True, eq=False)
class Mirror:
    """A perfect mirror on both sides."""

    reflectance: Floats | Texture = (1.0, 1.0, 1.0)  # type: ignore[assignment]  # becomes an array

    def __post_init__(self) -> None:
        replace(self, reflectance=_reflectance(self.reflectance))


@dataclass(frozen=True, eq=False)
class Dielectric:
    """A smooth interface; `eta` is the refractive index behind the front divided by that before it."""

    eta: float

    def __post_init__(self) -> None:
        replace(self, eta=length("eta", self.eta))


@dataclass(frozen=True, eq=False)
class Conductor:
    """A smooth metal with a black back; complex index ``eta + i k``, one for each channel."""

    eta: Floats
    k: Floats

    def __post_init__(self) -> None:
        replace(self, eta=_rgb("eta", self.eta), k=_rgb("k", self.k))


@dataclass(frozen=True, eq=False)
class RoughConductor:
    """A metal of GGX facets that scatter once; `alpha` is the width of the distribution of slopes [Walter et al. 2007].

    Smith's masking and shadowing are correlated by height [Heitz 2014], or multiplied if `separable`.
    """

    eta: Floats
    k: Floats
    alpha: float
    separable: bool = False

    def __post_init__(self) -> None:
        replace(self, eta=_rgb("eta", self.eta), k=_rgb("k", self.k), alpha=_alpha(self.alpha))


@dataclass(frozen=True, eq=False)
class RoughDielectric:
    """An interface of GGX facets that scatter once; `eta` as for `Dielectric`, the rest as for `RoughConductor`."""

    eta: float
    alpha: float
    separable: bool = False

    def __post_init__(self) -> None:
        replace(self, eta=length("eta", self.eta), alpha=_alpha(self.alpha))
        if self.eta == 1:
            raise InvalidArgument("eta is 1, which bends no light; leave the surface out")


@dataclass(frozen=True, eq=False)
class Phong:
    """The modified Phong lobe of Lafortune and Willems (1994) on a front, ``reflectance (n + 2)/(2 pi) cos(a)^n``.

    `a` is the angle to the mirror direction and n the `exponent`.
    """

    reflectance: Floats | Texture
    exponent: float

    def __post_init__(self) -> None:
        replace(self, reflectance=_reflectance(self.reflectance))
        exponent = float(finite("exponent", self.exponent))
        if not 0 <= exponent <= 10_000:
            raise InvalidArgument(f"exponent is {exponent}, it must be between 0 and 10,000")
        replace(self, exponent=exponent)


@dataclass(frozen=True, eq=False)
class Plastic:
    """A diffuse base under a smooth dielectric coat of index `eta`, with all reflections between the two."""

    reflectance: Floats | Texture
    eta: float

    def __post_init__(self) -> None:
        replace(self, reflectance=_reflectance(self.reflectance), eta=length("eta", self.eta))


@dataclass(frozen=True, eq=False)
class TwoSided:
    """One material on the front and one on the back, which is the same if not given. Neither lets light through."""

    front: Opaque
    back: Opaque | None = None

    def __post_init__(self) -> None:
        for name in ("front", "back"):
            value = getattr(self, name)
            parts = (value.first, value.second) if isinstance(value, Mix) else (value,)
            for part in parts:
                if part is not None and not isinstance(part, Opaque):
                    raise InvalidArgument(f"{name} is or holds a {type(part).__name__}, which has two sides already")


@dataclass(frozen=True, eq=False)
class Mix:
    """A blend, ``(1 - weight) first + weight second``; neither is itself a blend."""

    first: Unmixed
    second: Unmixed
    weight: float

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            if not isinstance(getattr(self, name), Unmixed):
                raise InvalidArgument(f"{name} is a {type(getattr(self, name)).__name__}, which cannot be mixed")
        weight = float(finite("weight", self.weight))
        if not 0 <= weight <= 1:
            raise InvalidArgument(f"weight is {weight}, it must be between 0 and 1")
        replace(self, weight=weight)


Unmixed: TypeAlias = Diffuse | Mirror | Dielectric | Conductor | RoughConductor | RoughDielectric | Phong | Plastic
Opaque: TypeAlias = Diffuse | Mirror | Conductor | RoughConductor | Phong | Plastic | Mix
Material: TypeAlias = Unmixed | TwoSided | Mix


# ---------------------------------------------------------------------------------------------------- scene


@dataclass(frozen=True, eq=False)
class Object:
    """A shape with a material, None for black, and the radiance [W/(m^2 sr)] that its front, or both sides, send out.

    Texture coordinates: those of a mesh; (a + 1)/2 and (b + 1)/2 on a rectangle ``center + a half_u + b half_v``. Disks
    and spheres have none and take no textures.
    """

    shape: Rectangle | Disk | Sphere | Mesh
    material: Material | None = None
    radiance: Floats | Texture | None = None
    two_sided: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Rectangle | Disk | Sphere | Mesh):
            raise InvalidArgument(f"shape is a {type(self.shape).__name__}, not a rectangle, disk, sphere or mesh")
        if self.material is not None and not isinstance(self.material, Material):
            raise InvalidArgument(f"material is a {type(self.material).__name__}, not one of oracle.tracer")
        if self.radiance is not None and not isinstance(self.radiance, Texture):
            replace(self, radiance=_rgb("radiance", self.radiance))


@dataclass(frozen=True, eq=False)
class Instances:
    """Copies of a mesh: affine maps of shape (N, 3, 4), ``x -> m[:, :3] x + m[:, 3]``, mirroring allowed."""

    mesh: Mesh
    material: Material | None
    transforms: Floats

    def __post_init__(self) -> None:
        transforms = finite("transforms", self.transforms, (3, 4))
        if transforms.ndim != 3 or not len(transforms):
            raise InvalidArgument(f"transforms has shape {transforms.shape}, it must be (N, 3, 4) with N >= 1")
        flat = np.flatnonzero(np.linalg.det(transforms[:, :, :3]) == 0)
        if flat.size:
            raise InvalidArgument(f"transforms[{flat[0]}] has no inverse")
        replace(self, transforms=transforms)


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that light meets: objects, emitters without a surface, at most one environment, and what fills space.

    Raises
    ------
    InvalidArgument
        If there are two environments, or one beside a medium that absorbs or scatters: no light would arrive.
    """

    objects: Sequence[Object | Instances] = ()
    emitters: Sequence[Point | Spot | Directional | Environment] = ()
    medium: Medium | None = None

    def __post_init__(self) -> None:
        replace(self, objects=tuple(self.objects), emitters=tuple(self.emitters))
        for index, one in enumerate(self.objects):
            if not isinstance(one, Object | Instances):
                raise InvalidArgument(f"objects[{index}] is a {type(one).__name__}, not an Object or Instances")
        for index, emitter in enumerate(self.emitters):
            if not isinstance(emitter, Point | Spot | Directional | Environment):
                raise InvalidArgument(f"emitters[{index}] is a {type(emitter).__name__}; shapes that shine are objects")
        distant = [type(one).__name__ for one in self.emitters if isinstance(one, Environment)]
        if len(distant) > 1:
            raise InvalidArgument(f"emitters: two environments, {distant[0]} and {distant[1]}; there can be one")
        if self.medium is not None and any(isinstance(one, Environment | Directional) for one in self.emitters):
            raise InvalidArgument("medium: infinitely distant light does not arrive through a medium without end")


# -------------------------------------------------------------------------------------------------- sensors


@dataclass(frozen=True, eq=False)
class Perspective:
    """A pinhole camera; `fov_x` is the full horizontal angle [rad]. Images grow to its right and downwards."""

    origin: Floats
    target: Floats
    up: Floats
    fov_x: float

    def __post_init__(self) -> None:
        _look(self, self.origin, self.target, self.up)
        if not 0 < self.fov_x < np.pi:
            raise InvalidArgument(f"fov_x is {self.fov_x}, it must be between 0 and pi")


@dataclass(frozen=True, eq=False)
class Orthographic:
    """Parallel rays along ``target - origin``; the image is `width` metres wide and centred on `origin`."""

    origin: Floats
    target: Floats
    up: Floats
    width: float

    def __post_init__(self) -> None:
        _look(self, self.origin, self.target, self.up)
        replace(self, width=length("width", self.width))


@dataclass(frozen=True, eq=False)
class IrradianceMeter:
    """Irradiance [W/m^2] on the front of a rectangle, averaged over each of the pixels that divide it.

    Pixel columns go along `half_u`, rows against `half_v`. The rectangle itself is not part of the scene.
    """

    surface: Rectangle


@dataclass(frozen=True, eq=False)
class RadianceMeter:
    """Radiance along a single ray, in every pixel: it arrives at `origin` from `direction` on."""

    origin: Floats
    direction: Floats

    def __post_init__(self) -> None:
        replace(
            self,
            origin=vector("origin", self.origin),
            direction=direction("direction", vector("direction", self.direction)),
        )


Sensor: TypeAlias = Perspective | Orthographic | IrradianceMeter | RadianceMeter


@dataclass(frozen=True)
class Film:
    """The pixel grid. Pixels are box averages, or Gaussian ones of this standard deviation [pixels], cut off at 4."""

    width: int
    height: int
    gaussian: float = 0.0

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            if not 1 <= getattr(self, name) <= 16384:
                raise InvalidArgument(f"{name} is {getattr(self, name)}, it must be between 1 and 16384")
        if not 0 <= self.gaussian <= 2:
            raise InvalidArgument(f"gaussian is {self.gaussian}, it must be between 0 and 2")


# --------------------------------------------------------------------------------------------------- checks


def _rgb(name: str, value: Floats) -> Floats:
    array = light(name, value)
    if array.shape != (3,):
        raise InvalidArgument(f"{name} has shape {array.shape}, it must be (3,)")
    return array


def _reflectance(value: Floats | Texture) -> Floats | Texture:
    colours = value.texels if isinstance(value, Bitmap) else value if not isinstance(value, Checker) else None
    for name, part in (
        [("reflectance", colours)] if colours is not None else [("even", value.even), ("odd", value.odd)]  # type: ignore[union-attr]
    ):
        array = light(name, part)
        if array.max(initial=0) > 1:
            raise InvalidArgument(f"{name} is {array.max()} somewhere; a surface reflects at most all light, 1")
    return value if isinstance(value, Texture) else _rgb("reflectance", value)


def _alpha(value: float) -> float:
    alpha = length("alpha", value)
    if not 1e-4 <= alpha <= 1:
        raise InvalidArgument(f"alpha is {alpha}, it must be between 1e-4 and 1; smooth surfaces have their own type")
    return alpha


def _look(instance: Perspective | Orthographic, origin: Floats, target: Floats, up: Floats) -> None:
    values = {"origin": vector("origin", origin), "target": vector("target", target), "up": vector("up", up)}
    forward = values["target"] - values["origin"]
    if not np.linalg.norm(np.cross(forward, values["up"])) > 1e-9 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise InvalidArgument("origin, target and up span no plane; the sensor needs a direction and an up beside it")
    replace(instance, **values)
