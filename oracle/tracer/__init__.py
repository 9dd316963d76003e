"""The reference tracer: a C++ extension on Embree.

`import oracle` leaves this package alone, so that closed forms and statistics work where Embree is not installed.
"""

try:
    from oracle.tracer._core import RayCaster, embree_version
except ModuleNotFoundError as error:
    raise ImportError("oracle.tracer is not built here; run `make setup` in the checkout") from error
except ImportError as error:
    # The dynamic loader's message names the library it missed.
    raise ImportError(
        f"oracle.tracer needs the Embree library ({error}); install it with "
        "`apt-get install libembree-dev`, `dnf install embree-devel` or `brew install embree`, "
        "and reinstall render-oracle if the version of Embree has changed"
    ) from error

__all__ = ["RayCaster", "embree_version"]
