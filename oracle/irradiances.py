"""Irradiance at oriented points, in closed form, clipped at the receiver's horizon."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add

import numpy as np

from oracle.arrays import Floats, InvalidArgument
from oracle.bounded import Bounded
from oracle.chunks import chunks
from oracle.emitters import (
    Area,
    Constant,
    CosineSky,
    Directional,
    Emitter,
    Equirectangular,
    Line,
    Point,
    Receivers,
    Spot,
)
from oracle.kernels import disk, environment, line, point_like, polygon, sphere
from oracle.shapes import Disk, Mesh, Polygon, Rectangle, Shape, Sphere
from oracle.visibility import visible, visible_projected_solid_angle

__all__ = ["irradiance", "projected_solid_angle"]


def irradiance(emitter: Emitter | Sequence[Emitter], receivers: Receivers, occluders: Sequence[Shape] = ()) -> Bounded:
    """Irradiance of one emitter, or of several together, clipped at each receiver's horizon.

    Parameters
    ----------
    emitter : Emitter or sequence of Emitter
        All with the same number of channels C.
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3).
    occluders : sequence of Shape
        Opaque surfaces. Of points, spots and parallel light any shape hides; of flat area emitters only flat shapes
        may; other emitters take no occluders. What two of them hide counts once.

    Returns
    -------
    Bounded
        Irradiance [W/m^2] and a bound on its error, shape (..., C).

    Raises
    ------
    InvalidArgument
        If there is no emitter, one is of another type, their numbers of channels differ, no closed form is known for
        an emitter past these occluders, or a receiver is on a point, spot or line, where irradiance is infinite.

    Notes
    -----
    Light adds up [Lambert 1760]. The modules of `oracle.kernels` state formula and source for each kind of emitter,
    `oracle.visibility` for what is hidden.
    """
    together: list[Emitter] = list(emitter) if isinstance(emitter, Sequence) else [emitter]
    if not together:
        raise InvalidArgument("emitter is an empty sequence")
    for index, one in enumerate(together):
        if not isinstance(one, Emitter):
            raise InvalidArgument(f"emitter[{index}] is a {type(one).__name__}, not one of oracle.emitters")
    channels = [_channels(one) for one in together]
    for index, count in enumerate(channels):
        if count != channels[0]:
            raise InvalidArgument(f"emitter[{index}] has {count} channels, emitter[0] has {channels[0]}")
    if len(occluders):
        return reduce(add, (_past(one, receivers, occluders) for one in together))

    shape = (*receivers.shape, channels[0])
    result = Bounded(np.empty(shape), np.empty(shape))
    parts = [simple for one in together for simple in _parts(one)]
    for part in chunks(receivers.shape):
        points, normals = receivers.points[part].reshape(-1, 3), receivers.normals[part].reshape(-1, 3)
        try:
            here = reduce(add, (_of_one(one, points, normals) for one in parts))
        except point_like.OnEmitter as error:
            raise error.within(receivers.shape, part) from None
        result.value[part] = here.value.reshape(result.value[part].shape)
        result.error[part] = here.error.reshape(result.error[part].shape)
    return result


def projected_solid_angle(shape: Shape, receivers: Receivers, two_sided: bool = False) -> Bounded:
    """Solid angle of a shape weighted with the receiver's cosine: the irradiance of unit radiance.

    Parameters
    ----------
    shape : Shape
        Only its front counts, or both of its sides if `two_sided`.
    receivers : Receivers
        Points [m] and unit normals, shape (..., 3).

    Returns
    -------
    Bounded
        Projected solid angle [sr], shape (...); divided by pi it is the view factor from the receiver to the shape.
    """
    result = irradiance(Area(shape, np.ones(1), two_sided), receivers)
    return Bounded(result.value[..., 0], result.error[..., 0])


def _past(emitter: Emitter, receivers: Receivers, occluders: Sequence[Shape]) -> Bounded:
    """Irradiance of one emitter past occluders."""
    match emitter:
        case Point() | Spot() | Directional():
            seen = visible(emitter, receivers.points, occluders)[..., None]
            open_sky = irradiance(emitter, receivers)
            return Bounded(np.where(seen, open_sky.value, 0.0), np.where(seen, open_sky.error, 0.0))
        case Area(Polygon() | Rectangle() | Mesh() as shape):
            factor = visible_projected_solid_angle(shape, receivers, occluders, emitter.two_sided)
            return Bounded(factor.value[..., None], factor.error[..., None]) * emitter.radiance
        case _:
            kind = type(emitter.shape if isinstance(emitter, Area) else emitter).__name__
            raise InvalidArgument(
                f"occluders: no closed form for a {kind} past occluders; a point, spot, parallel light, polygon, "
                "rectangle or mesh has one"
            )


def _channels(emitter: Emitter) -> int:
    match emitter:
        case Point() | Spot():
            return len(emitter.intensity)
        case Directional():
            return len(emitter.irradiance)
        case Line():
            return len(emitter.intensity_per_length)
        case Area() | Constant():
            return len(emitter.radiance)
        case CosineSky():
            return len(emitter.zenith)
        case Equirectangular():
            return int(emitter.radiance.shape[2])


def _parts(emitter: Emitter) -> tuple[Emitter, ...]:
    """The emitter, its shape taken apart into those that have a kernel."""
    match emitter:
        case Area(Rectangle() as shape):
            return (Area(shape.polygon, emitter.radiance, emitter.two_sided),)
        case Area(Mesh() as shape):
            return tuple(Area(triangle, emitter.radiance, emitter.two_sided) for triangle in shape.polygons)
        case _:
            return (emitter,)


def _of_one(emitter: Emitter, points: Floats, normals: Floats) -> Bounded:
    """Irradiance (N, C) of one emitter at receivers (N, 3)."""
    match emitter:
        case Point():
            return _times(point_like.point(emitter, points, normals), emitter.intensity)
        case Spot():
            return _times(point_like.spot(emitter, points, normals), emitter.intensity)
        case Directional():
            return _times(point_like.directional(emitter, normals), emitter.irradiance)
        case Line():
            return _times(line.line(emitter, points, normals), emitter.intensity_per_length)
        case Area():
            return _times(_of_shape(emitter.shape, points, normals, emitter.two_sided), emitter.radiance)
        case Constant():
            return environment.constant(emitter, normals)
        case CosineSky():
            return environment.cosine_sky(emitter, normals)
        case Equirectangular():
            return environment.equirectangular(emitter, normals)


def _of_shape(shape: Shape, points: Floats, normals: Floats, two_sided: bool) -> Bounded:
    """Projected solid angle (N,) of a shape."""
    match shape:
        case Polygon():
            return polygon.polygon(shape, points, normals, two_sided)
        case Disk():
            return disk.disk(shape, points, normals, two_sided)
        case Sphere():
            return sphere.sphere(shape, points, normals, two_sided)
        case _:
            raise AssertionError("taken apart before")


def _times(factor: Bounded, spectrum: Floats) -> Bounded:
    """A geometric factor (N,) times a spectrum (C,): (N, C)."""
    return Bounded(factor.value[:, None], factor.error[:, None]) * spectrum
