#include "bindings.h"

PYBIND11_MODULE(_core, module) {
    module.doc() = "The reference tracer on Embree.";
    oracle::bind_ray_caster(module);
    oracle::bind_scene(module);
}
