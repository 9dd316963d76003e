from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

class RayCaster:
    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None: ...
    def closest_hit(
        self, origins: ArrayLike, directions: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float32]]: ...
    def occluded(self, origins: ArrayLike, directions: ArrayLike, t_far: ArrayLike) -> NDArray[np.bool_]: ...

def embree_version() -> str: ...

_Triple = tuple[float, float, float]

class Sensor:
    def __init__(self, kind: str, origin: _Triple, forward: _Triple, right: _Triple, down: _Triple) -> None: ...

class Film:
    def __init__(self, width: int, height: int, gaussian: float) -> None: ...

class Pass:
    def __init__(
        self,
        strategy: str,
        first_bounce: int,
        bounces: int,
        sampler: str,
        seed: int,
        first_sample: int,
        samples: int,
        replicates: int,
        exponent: int,
    ) -> None: ...

class Stage:
    def __init__(self) -> None: ...
    def add_bitmap(self, texels: ArrayLike, smooth: bool) -> int: ...
    def add_checker(self, even: _Triple, odd: _Triple, columns: float, rows: float) -> int: ...
    def add_material(
        self,
        kind: str,
        *,
        reflectance: _Triple | int = ...,
        eta: _Triple = ...,
        k: _Triple = ...,
        ior: float = ...,
        alpha: float = ...,
        separable: bool = ...,
        exponent: float = ...,
        weight: float = ...,
        first: int = ...,
        second: int = ...,
    ) -> int: ...
    def add_object(self, material: int, radiance: _Triple | int | None, two_sided: bool) -> int: ...
    def add_mesh(
        self,
        object: int,
        vertices: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None,
        uv: ArrayLike | None,
    ) -> None: ...
    def add_instances(
        self,
        object: int,
        vertices: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None,
        uv: ArrayLike | None,
        transforms: ArrayLike,
    ) -> None: ...
    def add_rectangle(self, object: int, center: _Triple, half_u: _Triple, half_v: _Triple) -> None: ...
    def add_disk(self, object: int, center: _Triple, normal: _Triple, radius: float) -> None: ...
    def add_sphere(self, object: int, center: _Triple, radius: float) -> None: ...
    def add_point(self, position: _Triple, intensity: _Triple) -> None: ...
    def add_spot(
        self, position: _Triple, direction: _Triple, intensity: _Triple, beam_width: float, cutoff_angle: float
    ) -> None: ...
    def add_directional(self, direction: _Triple, irradiance: _Triple) -> None: ...
    def set_constant(self, radiance: _Triple) -> None: ...
    def set_sky(self, up: _Triple, horizon: _Triple, zenith: _Triple) -> None: ...
    def set_map(self, radiance: ArrayLike, up: _Triple, front: _Triple) -> None: ...
    def set_medium(self, absorption: _Triple, scattering: _Triple, asymmetry: float) -> None: ...
    def commit(self, hierarchy: bool = ...) -> None: ...
    def render_pass(
        self,
        sensor: Sensor,
        film: Film,
        render_pass: Pass,
        threads: int,
        sums: NDArray[np.uint64],
        squares: NDArray[np.uint64],
        watch: Callable[[float], None],
    ) -> None: ...
    def first_hits(
        self, sensor: Sensor, film: Film
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]
    ]: ...
