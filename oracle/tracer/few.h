// A handful of triangles and parallelograms, tested one after the other, four at a time and in double precision: for so
// few that is faster than any hierarchy.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "vec.h"

namespace oracle {

class Few {
public:
    static constexpr size_t most = 48;

    struct Hit {
        double distance = std::numeric_limits<double>::infinity();
        int index = -1;  // in the order in which they were added
        float u, v;      // the hit is at a + u (b - a) + v (c - a)
    };

    // Four of them. The plane's normal and offset, and rows that take a point to its coordinates u and v.
    struct Group {
        double normal[4][4], to_u[4][4], to_v[4][4];  // x, y, z and constant of each
        double u_counts[4];                           // 1 if u + v is limited, 0 if only each of them is
    };

    // A triangle, or the parallelogram whose fourth corner is b + c - a.
    void add(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram);
    size_t size() const { return count_; }

    // The nearest one with 0 < distance < `limit`.
    Hit closest(const Vec3& origin, const Vec3& direction, double limit) const;

private:
    std::vector<Group> groups_;
    size_t count_ = 0;
};

}  // namespace oracle
