// Rays against triangles: the geometry below the path tracer. Knows Embree, knows nothing of Python.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "embree_compat.h"
#include "scene.h"

namespace oracle {

struct Hit {
    double t;          // in units of the direction's length; infinity for a miss
    int64_t triangle;  // -1 for a miss
    float u, v;        // the hit is (1 - u - v) a + u b + v c
};

// A frozen set of triangles. Queries are const and may run on any number of threads at once.
class RayCaster {
public:
    // Indices must be below `vertex_count`, coordinates finite and at most `largest_coordinate`.
    RayCaster(const Vec3* vertices, size_t vertex_count, const Triangle* triangles, size_t triangle_count);

    // The nearest hit with t >= 0: a ray that starts on a triangle hits it. The direction is finite
    // and not zero, of any length.
    Hit closest_hit(const Vec3& origin, const Vec3& direction) const;

    // Whether anything is hit with 0 <= t <= t_far.
    bool occluded(const Vec3& origin, const Vec3& direction, double t_far) const;

private:
    Owned<RTCDevice> device_;  // before the scene: members die in reverse order
    Owned<RTCScene> scene_;
};

// The version of the Embree library that is loaded, such as "4.3.3".
std::string embree_version();

}  // namespace oracle
