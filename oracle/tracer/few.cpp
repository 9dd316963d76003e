#include "few.h"

#include "clones.h"

namespace oracle {
namespace {

// Vectors of four, which GCC and Clang turn into whatever the processor has; `Stored` ones lie among other doubles.
using Four = double __attribute__((vector_size(32)));
using FourMasks = int64_t __attribute__((vector_size(32)));
using Stored = double __attribute__((vector_size(32), aligned(8), may_alias));

// Edges belong to both of their triangles, so that no ray slips between them.
constexpr double inclusive = 1e-13;

struct Double3 {
    double x, y, z;
};

Double3 to_double(const Vec3& v) { return {v.x, v.y, v.z}; }
Double3 operator-(const Double3& a, const Double3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Double3 cross(const Double3& a, const Double3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Double3& a, const Double3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The row that takes x to (x - p) . a / scale.
void set_row(double (*row)[4], size_t lane, const Double3& a, const Double3& p, double scale) {
    row[0][lane] = a.x / scale, row[1][lane] = a.y / scale, row[2][lane] = a.z / scale;
    row[3][lane] = -dot(a, p) / scale;
}

inline const Stored& four(const double* p) { return *reinterpret_cast<const Stored*>(p); }

ORACLE_FOR_WIDE_VECTORS
Few::Hit closest_in(const Few::Group* groups, size_t count, const Double3& o, const Double3& d, double limit) {
    const Four zero{}, low = zero - inclusive, high = zero + (1 + inclusive);
    Four best = zero + limit, best_u = zero, best_v = zero;
    FourMasks best_group = FourMasks{} - 1;
    for (size_t i = 0; i < count; ++i) {
        const Few::Group& g = groups[i];
        const Four nx = four(g.normal[0]), ny = four(g.normal[1]), nz = four(g.normal[2]);
        const Four t = -(nx * o.x + ny * o.y + nz * o.z + four(g.normal[3])) / (nx * d.x + ny * d.y + nz * d.z);
        const Four x = o.x + t * d.x, y = o.y + t * d.y, z = o.z + t * d.z;
        const Four u = four(g.to_u[0]) * x + four(g.to_u[1]) * y + four(g.to_u[2]) * z + four(g.to_u[3]);
        const Four v = four(g.to_v[0]) * x + four(g.to_v[1]) * y + four(g.to_v[2]) * z + four(g.to_v[3]);
        const Four reach = v + four(g.u_counts) * u;
        const FourMasks hit = (t > zero) & (t < best) & (u >= low) & (v >= low) & (u <= high) & (reach <= high);
        best = hit ? t : best;
        best_u = hit ? u : best_u;
        best_v = hit ? v : best_v;
        best_group = hit ? FourMasks{} + int64_t(i) : best_group;
    }
    Few::Hit result;
    for (int lane = 0; lane < 4; ++lane) {
        if (best_group[lane] < 0 || !(best[lane] < result.distance)) continue;
        result = {best[lane], int(best_group[lane]) * 4 + lane, float(best_u[lane]), float(best_v[lane])};
    }
    return result;
}

}  // namespace

void Few::add(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram) {
    const size_t lane = count_++ % 4;
    if (lane == 0) groups_.push_back({});
    Group& g = groups_.back();
    const Double3 p = to_double(a), u = to_double(b) - p, v = to_double(c) - p, n = cross(u, v);
    const double n2 = dot(n, n);
    // What has no area has no plane, and is never hit.
    if (!(n2 > 0)) return;
    set_row(g.normal, lane, n, p, std::sqrt(n2));
    set_row(g.to_u, lane, cross(v, n), p, n2);
    set_row(g.to_v, lane, cross(n, u), p, n2);
    g.u_counts[lane] = parallelogram ? 0 : 1;
}

Few::Hit Few::closest(const Vec3& origin, const Vec3& direction, double limit) const {
    return closest_in(groups_.data(), groups_.size(), to_double(origin), to_double(direction), limit);
}

}  // namespace oracle
