// Python's door to the ray caster: NumPy arrays in and out.
#include <pybind11/stl.h>

#include "arguments.h"
#include "bindings.h"
#include "ray_caster.h"

namespace oracle {
namespace {

Vec3 checked_direction(const double* d, size_t ray) {
    const Vec3 direction = checked_point(d, "direction of ray", ray);
    if (direction.x == 0 && direction.y == 0 && direction.z == 0) {
        std::ostringstream message;
        message << "direction of ray " << ray << ": " << to_text(d) << " is zero in single precision";
        reject(message);
    }
    return direction;
}

RayCaster make_ray_caster(const py::object& vertices, const py::object& triangles) {
    const Mesh mesh = make_mesh(vertices, triangles);
    const py::gil_scoped_release release;
    return RayCaster(mesh.vertices.data(), mesh.vertices.size(), mesh.triangles.data(), mesh.triangles.size());
}

struct Rays {
    std::vector<Vec3> origins, directions;
    size_t size() const { return origins.size(); }
};

Rays make_rays(const py::object& origins_in, const py::object& directions_in) {
    const auto origins = to_array<Doubles>(origins_in, "origins", "fiu", "real numbers");
    const auto directions = to_array<Doubles>(directions_in, "directions", "fiu", "real numbers");
    const size_t count = rows_of_three(origins, "origins", 'R');
    if (const size_t other = rows_of_three(directions, "directions", 'R'); other != count) {
        std::ostringstream message;
        message << "origins has " << count << " rows, directions " << other << "; expected one of each per ray";
        reject(message);
    }
    Rays rays;
    rays.origins.reserve(count);
    rays.directions.reserve(count);
    for (size_t i = 0; i < count; ++i) {
        rays.origins.push_back(checked_point(origins.data() + 3 * i, "origin of ray", i));
        rays.directions.push_back(checked_direction(directions.data() + 3 * i, i));
    }
    return rays;
}

py::tuple closest_hits(const RayCaster& caster, const py::object& origins, const py::object& directions) {
    const Rays rays = make_rays(origins, directions);
    const auto count = static_cast<py::ssize_t>(rays.size());
    py::array_t<double> t(count);
    py::array_t<int64_t> triangle(count);
    py::array_t<float> uv({count, py::ssize_t{2}});
    double* t_out = t.mutable_data();
    int64_t* triangle_out = triangle.mutable_data();
    float* uv_out = uv.mutable_data();
    {
        const py::gil_scoped_release release;
        for (size_t i = 0; i < rays.size(); ++i) {
            const Hit hit = caster.closest_hit(rays.origins[i], rays.directions[i]);
            t_out[i] = hit.t;
            triangle_out[i] = hit.triangle;
            uv_out[2 * i] = hit.u;
            uv_out[2 * i + 1] = hit.v;
        }
    }
    return py::make_tuple(t, triangle, uv);
}

py::array_t<bool> all_occluded(const RayCaster& caster, const py::object& origins, const py::object& directions,
                           const py::object& t_far_in) {
    const Rays rays = make_rays(origins, directions);
    const auto count = static_cast<py::ssize_t>(rays.size());
    const auto t_far = to_array<Doubles>(t_far_in, "t_far", "fiu", "real numbers");
    const bool one_for_all = t_far.ndim() == 0;
    if (!one_for_all && (t_far.ndim() != 1 || t_far.shape(0) != count)) {
        std::ostringstream message;
        message << "t_far has shape " << std::string(py::str(t_far.attr("shape"))) << "; expected () or (" << count
                << ",)";
        reject(message);
    }
    for (py::ssize_t i = 0; i < t_far.size(); ++i) {
        if (t_far.data()[i] >= 0) continue;
        std::ostringstream message;
        message << "t_far" << (one_for_all ? "" : " of ray " + std::to_string(i)) << ": " << t_far.data()[i]
                << " is not a distance; it must be at least 0";
        reject(message);
    }
    py::array_t<bool> result(count);
    bool* out = result.mutable_data();
    const double* far_in = t_far.data();
    {
        const py::gil_scoped_release release;
        for (size_t i = 0; i < rays.size(); ++i)
            out[i] = caster.occluded(rays.origins[i], rays.directions[i], far_in[one_for_all ? 0 : i]);
    }
    return result;
}

}  // namespace

void bind_ray_caster(py::module_& module) {
    py::class_<RayCaster>(module, "RayCaster", R"doc(
A frozen set of triangles that rays are shot at.

Parameters
----------
vertices : array_like of float, shape (N, 3)
    Points [m], rounded to float32; finite and at most 1e18 in size.
triangles : array_like of int, shape (M, 3)
    Three rows of `vertices` each. M = 0 is allowed and hits nothing.

Raises
------
ValueError
    If a shape is wrong, a coordinate is not finite or too large, or an index is out of range;
    the message names the first vertex or triangle at fault.

Notes
-----
Both sides of a triangle are hit. A ray through a shared edge hits one of its triangles and never
slips between them. Queries release the GIL and may run on many threads at once.

Examples
--------
>>> from oracle.tracer import RayCaster
>>> caster = RayCaster([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
>>> t, triangle, uv = caster.closest_hit([[0.25, 0.5, 2.0]], [[0, 0, -1]])
>>> t.round(3), triangle, uv.round(3)
(array([2.]), array([0]), array([[0.25, 0.5 ]], dtype=float32))
)doc")
        .def(py::init(&make_ray_caster), py::arg("vertices"), py::arg("triangles"))
        .def("closest_hit", &closest_hits, py::arg("origins"), py::arg("directions"), R"doc(
Find the nearest hit of each ray.

Parameters
----------
origins : array_like of float, shape (R, 3)
    Points [m], rounded to float32.
directions : array_like of float, shape (R, 3)
    Not zero, of any length, rounded to float32.

Returns
-------
t : ndarray of float64, shape (R,)
    The hit is at ``origin + t * direction``, t >= 0; infinity for a miss. A ray that starts on a
    triangle hits it.
triangle : ndarray of int64, shape (R,)
    Index of the triangle, -1 for a miss.
uv : ndarray of float32, shape (R, 2)
    The hit is at ``(1 - u - v) * a + u * b + v * c`` for the triangle's vertices a, b, c;
    NaN for a miss.

Raises
------
ValueError
    If a shape is wrong or a ray is not finite or has no direction; the message names the first
    ray at fault.
)doc")
        .def("occluded", &all_occluded, py::arg("origins"), py::arg("directions"), py::arg("t_far"), R"doc(
Tell for each ray whether anything lies between its origin and `t_far`.

Parameters
----------
origins, directions : array_like of float, shape (R, 3)
    As for `closest_hit`.
t_far : float or array_like of float, shape (R,)
    Length of each ray in units of its direction, at least 0, infinity allowed.

Returns
-------
ndarray of bool, shape (R,)
    Whether there is a hit at ``0 <= t <= t_far``.

Raises
------
ValueError
    As for `closest_hit`, and if `t_far` is negative or NaN.
)doc");

    module.def("embree_version", &embree_version, R"doc(
Version of the Embree library in use.

Returns
-------
str
    Such as ``"4.3.3"``.
)doc");
}

}  // namespace oracle
