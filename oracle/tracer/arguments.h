// Checks of what Python hands over, before anything else sees it. Errors are ValueErrors that name what is at fault.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "scene.h"

namespace oracle {

namespace py = pybind11;

// Embree skips geometry beyond 1.8e18 without a word, so nothing may lie beyond this.
constexpr float largest_coordinate = 1e18f;

// Numbers as Python gave them: a value that does not fit float32 must still be there to be named.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int64_t, py::array::c_style | py::array::forcecast>;

[[noreturn]] inline void reject(const std::ostringstream& message) { throw py::value_error(message.str()); }

// `input` as an array of the wanted type, if its dtype is one of `kinds` (NumPy's letters).
template <typename Array>
Array to_array(const py::object& input, const char* name, const std::string& kinds, const char* wanted) {
    const py::array array = py::array::ensure(input);
    if (!array || kinds.find(array.dtype().kind()) == std::string::npos) {
        std::ostringstream message;
        message << name << " must be an array of " << wanted;
        if (array) message << ", not of " << std::string(py::str(array.dtype()));
        reject(message);
    }
    const Array converted = Array::ensure(array);
    if (!converted) throw py::error_already_set();
    return converted;
}

// The number of rows of an (N, 3) array.
inline size_t rows_of_three(const py::array& array, const char* name, char symbol) {
    if (array.ndim() != 2 || array.shape(1) != 3) {
        std::ostringstream message;
        message << name << " has shape " << std::string(py::str(array.attr("shape"))) << "; expected (" << symbol
                << ", 3)";
        reject(message);
    }
    return static_cast<size_t>(array.shape(0));
}

inline std::string to_text(const double* v) {
    std::ostringstream text;
    text << "(" << v[0] << ", " << v[1] << ", " << v[2] << ")";
    return text.str();
}

// A point that Embree can represent; `what` and `index` say whose it is.
inline Vec3 checked_point(const double* p, const char* what, size_t index) {
    for (int axis = 0; axis < 3; ++axis) {
        if (std::isfinite(p[axis]) && std::fabs(p[axis]) <= largest_coordinate) continue;
        std::ostringstream message;
        message << what << " " << index << ": " << to_text(p);
        if (std::isfinite(p[axis]))
            message << " lies beyond " << largest_coordinate;
        else
            message << " is not finite";
        reject(message);
    }
    return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

// Points and triangles, all within range.
inline Mesh make_mesh(const py::object& vertices_in, const py::object& triangles_in) {
    const auto vertices = to_array<Doubles>(vertices_in, "vertices", "fiu", "real numbers");
    const auto triangles = to_array<Integers>(triangles_in, "triangles", "iu", "integers");
    const size_t vertex_count = rows_of_three(vertices, "vertices", 'N');
    const size_t triangle_count = rows_of_three(triangles, "triangles", 'M');

    Mesh mesh;
    mesh.vertices.resize(vertex_count);
    for (size_t i = 0; i < vertex_count; ++i) mesh.vertices[i] = checked_point(vertices.data() + 3 * i, "vertex", i);

    mesh.triangles.resize(triangle_count);
    for (size_t i = 0; i < triangle_count; ++i) {
        const int64_t* corner = triangles.data() + 3 * i;
        for (int k = 0; k < 3; ++k) {
            if (corner[k] >= 0 && static_cast<size_t>(corner[k]) < vertex_count) continue;
            std::ostringstream message;
            message << "triangle " << i << ": vertex index " << corner[k] << " is out of range; there are "
                    << vertex_count << " vertices";
            reject(message);
        }
        mesh.triangles[i] = {static_cast<uint32_t>(corner[0]), static_cast<uint32_t>(corner[1]),
                    static_cast<uint32_t>(corner[2])};
    }

    return mesh;
}

}  // namespace oracle
