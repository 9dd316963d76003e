"""The reference tracer: a C++ extension on Embree.

`import oracle` leaves this package alone, so that closed forms and statistics work where Embree is not installed.
"""

try:
    from oracle.tracer._core import RayCaster, embree_version
    from oracle.tracer.rendering import (
        FirstHits,
        Goal,
        Job,
        Method,
        Progress,
        Range,
        Rendering,
        first_hits,
        merge,
        render,
    )
    from oracle.tracer.scene import (
        Bitmap,
        Checker,
        Conductor,
        Dielectric,
        Diffuse,
        Film,
        Instances,
        IrradianceMeter,
        Mirror,
        Mix,
        Object,
        Orthographic,
        Perspective,
        Phong,
        Plastic,
        RadianceMeter,
        RoughConductor,
        RoughDielectric,
        Scene,
        TwoSided,
    )
except ModuleNotFoundError as error:
    raise ImportError("oracle.tracer is not built here; run `make setup` in the checkout") from error
except ImportError as error:
    # The dynamic loader's message names the library it missed.
    raise ImportError(
        f"oracle.tracer needs the Embree library ({error}); install it with "
        "`apt-get install libembree-dev`, `dnf install embree-devel` or `brew install embree`, "
        "and reinstall render-oracle if the version of Embree has changed"
    ) from error

__all__ = [
    "Bitmap",
    "Checker",
    "Conductor",
    "Dielectric",
    "Diffuse",
    "Film",
    "FirstHits",
    "Goal",
    "Instances",
    "IrradianceMeter",
    "Job",
    "Method",
    "Mirror",
    "Mix",
    "Object",
    "Orthographic",
    "Perspective",
    "Phong",
    "Plastic",
    "Progress",
    "RadianceMeter",
    "Range",
    "RayCaster",
    "Rendering",
    "RoughConductor",
    "RoughDielectric",
    "Scene",
    "TwoSided",
    "embree_version",
    "first_hits",
    "merge",
    "render",
]
