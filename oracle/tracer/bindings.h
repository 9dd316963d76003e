// The parts of the Python module.
#pragma once

#include <pybind11/pybind11.h>

namespace oracle {

void bind_ray_caster(pybind11::module_& module);
void bind_scene(pybind11::module_& module);

}  // namespace oracle
