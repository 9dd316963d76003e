// A handful of triangles and parallelograms, tested one after the other: for so few that is faster than any hierarchy.
// Double precision decides. Eight rays at a time are screened in single precision first, with a bound of its rounding
// errors, which leaves one surface to be looked at, or in rare cases all of them.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "clones.h"
#include "vec.h"

namespace oracle {

class Few {
public:
    static constexpr size_t most = 64;
    static constexpr int side_by_side = 8, none = -1;

    struct Hit {
        double distance = std::numeric_limits<double>::infinity();
        int index = none;  // in the order in which they were added
        float u, v;        // the hit is at a + u (b - a) + v (c - a)
    };

    // Rays side by side. The surfaces where they begin and end, if they are among these, have no say.
    struct Rays {
        float ox[side_by_side], oy[side_by_side], oz[side_by_side];
        float dx[side_by_side], dy[side_by_side], dz[side_by_side];
        float limit[side_by_side];
        int32_t begin[side_by_side], end[side_by_side];

        void set(int k, const Vec3& origin, const Vec3& direction, float far, int from, int to);
        Vec3 origin(int k) const { return {ox[k], oy[k], oz[k]}; }
        Vec3 direction(int k) const { return {dx[k], dy[k], dz[k]}; }
    };

    // A triangle, or the parallelogram whose fourth corner is b + c - a.
    void add(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram);
    size_t size() const { return exact_.size(); }
    // What stands for a surface in `Rays`; two triangles may share it.
    int screen_of(int index) const { return exact_[size_t(index)].screen; }

    // The nearest one with 0 < distance < `limit`.
    Hit closest(const Vec3& origin, const Vec3& direction, double limit) const;
    // The same for eight rays, whatever their limits, and whether there is any within them.
    void closest(const Rays& rays, Hit* hits) const;
    void blocked(const Rays& rays, bool* results) const;

private:
    // The plane, and rows that take a point to its coordinates u and v.
    struct Rows {
        double normal[4], to_u[4], to_v[4];
    };
    struct Exact {
        Rows rows{};
        bool parallelogram;
        int screen;

        bool meets(const Vec3& origin, const Vec3& direction, double limit, int index, Hit& hit) const;
    };
    // A triangle, a parallelogram, or two triangles that are one.
    struct Screen {
        Vec3 a, b, c;
        bool parallelogram;
        int first, second;  // the surfaces; `second` may be none
        float normal[4], to_u[4], to_v[4];
        float change;       // of u or v per metre
    };
    struct Screening;

    static bool rows_of(const Vec3& a, const Vec3& b, const Vec3& c, Rows& rows);
    bool completes_last_screen(const Vec3* corners);
    ORACLE_FOR_WIDE_VECTORS void scan_closest(const Rays& rays, int32_t* nearest_screens, int32_t* alone) const;
    ORACLE_FOR_WIDE_VECTORS void scan_blocked(const Rays& rays, int32_t* sure, int32_t* perhaps) const;

    std::vector<Exact> exact_;
    std::vector<Screen> screens_;
    float extent_ = 0;  // sum of the coordinates of the corner that is furthest away
};

}  // namespace oracle
