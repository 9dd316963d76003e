"""The scene model: what is rendered, in SI units, as frozen and validated data.

Conventions, once and for all
-----------------------------
* World space is right-handed; lengths are metres, angles degrees.
* Radiance L is W/(m^2 sr), irradiance E is W/m^2, intensity I is W/sr, per RGB channel.
* A surface's front is where its geometric normal points: ``half_u x half_v`` for a rectangle, ``normal``
  for a disk, outwards for a sphere, counter-clockwise vertices for a triangle.
* Area emitters shine from their front only, unless they are two-sided, and reflect nothing. Diffuse surfaces reflect
  from their front only, as all opaque materials but the mirror do, unless they are wrapped as two-sided.
* The camera looks from ``origin`` to ``target``; image x grows to the camera's right, image y downwards.
  Pixel (0, 0) is the top left one and its centre lies at film position (0.5, 0.5).
  ``fov_x`` is the full horizontal angle between the left and the right edge of the film; pixels are square.
* Texture coordinates are (s + 1)/2 and (t + 1)/2 on a rectangle ``center + s half_u + t half_v`` and those of its
  vertices on a mesh. Textures repeat over the plane; row 0 of an image is at v = 1.
"""

from reference_scenes.model.base import (
    LARGEST,
    Albedo,
    Direction,
    Finite,
    Index,
    Model,
    Positive,
    Spectrum,
    Vector,
)
from reference_scenes.model.emitters import (
    AreaEmitter,
    ConstantEmitter,
    DirectionalEmitter,
    Emitter,
    ImageEmitter,
    PointEmitter,
    SkyEmitter,
    SpotEmitter,
)
from reference_scenes.model.materials import (
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    Mirror,
    Mix,
    Opaque,
    Phong,
    Plastic,
    RoughConductor,
    RoughDielectric,
    TwoSided,
    Unmixed,
)
from reference_scenes.model.scene import Medium, Object, Scene
from reference_scenes.model.sensors import (
    BoxFilter,
    Camera,
    Film,
    Filter,
    GaussianFilter,
    IrradianceMeter,
    OrthographicCamera,
    RadianceMeter,
    Sensor,
)
from reference_scenes.model.shapes import Disk, Instances, Mesh, Rectangle, Shape, Sphere
from reference_scenes.model.textures import Bitmap, Checker, Texels, Texture

__all__ = [
    "LARGEST",
    "Albedo",
    "AreaEmitter",
    "Bitmap",
    "BoxFilter",
    "Camera",
    "Checker",
    "Conductor",
    "ConstantEmitter",
    "Dielectric",
    "Diffuse",
    "Direction",
    "DirectionalEmitter",
    "Disk",
    "Emitter",
    "Film",
    "Filter",
    "Finite",
    "GaussianFilter",
    "ImageEmitter",
    "Index",
    "Instances",
    "IrradianceMeter",
    "Material",
    "Medium",
    "Mesh",
    "Mirror",
    "Mix",
    "Model",
    "Object",
    "Opaque",
    "OrthographicCamera",
    "Phong",
    "Plastic",
    "PointEmitter",
    "Positive",
    "RadianceMeter",
    "Rectangle",
    "RoughConductor",
    "RoughDielectric",
    "Scene",
    "Sensor",
    "Shape",
    "SkyEmitter",
    "Spectrum",
    "Sphere",
    "SpotEmitter",
    "Texels",
    "Texture",
    "TwoSided",
    "Unmixed",
    "Vector",
]
