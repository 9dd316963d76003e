#include "few.h"

// How vectors are passed between files does not matter: they are not.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace oracle {
namespace {

// Vectors of eight, which GCC and Clang turn into whatever the processor has.
using Wide = float __attribute__((vector_size(32)));
using WideMasks = int32_t __attribute__((vector_size(32)));
using Stored = float __attribute__((vector_size(32), aligned(4), may_alias));
using StoredMasks = int32_t __attribute__((vector_size(32), aligned(4), may_alias));

// Edges belong to both of their triangles, so that no ray slips between them.
constexpr double inclusive = 1e-13;
// Rounding errors of the screening in units of the numbers it works with; 2^-24 each, and there are fewer than 16.
constexpr float rounding_errors = 1e-6f;

inline Wide load(const float* p) { return *reinterpret_cast<const Stored*>(p); }
inline WideMasks load(const int32_t* p) { return *reinterpret_cast<const StoredMasks*>(p); }
inline void store(int32_t* p, const WideMasks& x) { *reinterpret_cast<StoredMasks*>(p) = x; }
inline Wide absolute(const Wide& x) { return x < 0 ? -x : x; }
inline Wide smaller(const Wide& x, const Wide& y) { return x < y ? x : y; }

float sum_of(const Vec3& v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

}  // namespace

void Few::Rays::set(int k, const Vec3& o, const Vec3& d, float far, int from, int to) {
    ox[k] = o.x, oy[k] = o.y, oz[k] = o.z;
    dx[k] = d.x, dy[k] = d.y, dz[k] = d.z;
    limit[k] = far;
    begin[k] = from, end[k] = to;
}

// Of a triangle that has an area; what has none has no plane, and is never met.
bool Few::rows_of(const Vec3& a, const Vec3& b, const Vec3& c, Rows& rows) {
    struct Double3 {
        double x, y, z;
    };
    const auto edge = [&](const Vec3& end) {
        return Double3{double(end.x) - a.x, double(end.y) - a.y, double(end.z) - a.z};
    };
    const auto cross = [](const Double3& p, const Double3& q) {
        return Double3{p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
    };
    // The row that takes x to (x - a) . direction / scale.
    const auto set = [&](double* row, const Double3& direction, double scale) {
        row[0] = direction.x / scale, row[1] = direction.y / scale, row[2] = direction.z / scale;
        row[3] = -(direction.x * a.x + direction.y * a.y + direction.z * a.z) / scale;
    };
    const Double3 u = edge(b), v = edge(c), n = cross(u, v);
    const double n2 = n.x * n.x + n.y * n.y + n.z * n.z;
    if (!(n2 > 0)) return false;
    set(rows.normal, n, std::sqrt(n2));
    set(rows.to_u, cross(v, n), n2);
    set(rows.to_v, cross(n, u), n2);
    return true;
}

void Few::add(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram) {
    const int index = int(exact_.size());
    exact_.push_back({{}, parallelogram, none});
    Exact& exact = exact_.back();
    if (!rows_of(a, b, c, exact.rows)) return;
    const Vec3 corners[] = {a, b, c};
    for (const Vec3& corner : corners) extent_ = std::max(extent_, sum_of(corner));
    if (!parallelogram && completes_last_screen(corners)) {
        screens_.back().second = index;
    } else {
        screens_.push_back({a, b, c, parallelogram, index, none, {}, {}, {}, 0});
    }
    exact.screen = int(screens_.size()) - 1;
    Screen& screen = screens_.back();
    Rows rows{};
    rows_of(screen.a, screen.b, screen.c, rows);
    double change2 = 0;
    for (int i = 0; i < 4; ++i)
        screen.normal[i] = float(rows.normal[i]), screen.to_u[i] = float(rows.to_u[i]), screen.to_v[i] = float(rows.to_v[i]);
    for (const double* row : {rows.to_u, rows.to_v})
        change2 = std::max(change2, row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
    screen.change = float(2 * std::sqrt(change2));
}

// Quads are often cut into two triangles. If this one is the other half of the last one, the latter becomes the whole.
bool Few::completes_last_screen(const Vec3* mine) {
    if (screens_.empty()) return false;
    Screen& last = screens_.back();
    if (last.parallelogram || last.first + 2 != int(exact_.size())) return false;
    const Vec3 theirs[] = {last.a, last.b, last.c};
    const auto apart = [](const Vec3& p, const Vec3& q) { return largest(p - q); };
    for (int i = 0; i < 3; ++i) {
        const Vec3 &a = theirs[i], &b = theirs[(i + 1) % 3], &c = theirs[(i + 2) % 3];
        for (int j = 0; j < 3; ++j) {
            if (apart(b, mine[(j + 2) % 3]) > 0 || apart(c, mine[(j + 1) % 3]) > 0) continue;
            if (apart(b + (c - a), mine[j]) > 0.1f * rounding_errors * extent_) continue;
            last.a = a, last.b = b, last.c = c;
            last.parallelogram = true;
            return true;
        }
    }
    return false;
}

bool Few::Exact::meets(const Vec3& o, const Vec3& d, double limit, int index, Hit& hit) const {
    const auto along = [](const double* row, double x, double y, double z) { return row[0] * x + row[1] * y + row[2] * z; };
    const double t = -(along(rows.normal, o.x, o.y, o.z) + rows.normal[3]) / along(rows.normal, d.x, d.y, d.z);
    if (!(t > 0 && t < limit)) return false;
    const double x = o.x + t * d.x, y = o.y + t * d.y, z = o.z + t * d.z;
    const double u = along(rows.to_u, x, y, z) + rows.to_u[3], v = along(rows.to_v, x, y, z) + rows.to_v[3];
    if (!(u >= -inclusive && v >= -inclusive && u <= 1 + inclusive)) return false;
    if (!((parallelogram ? v : u + v) <= 1 + inclusive)) return false;
    hit.distance = t, hit.index = index, hit.u = float(u), hit.v = float(v);
    return true;
}

Few::Hit Few::closest(const Vec3& origin, const Vec3& direction, double limit) const {
    Hit hit;
    hit.distance = limit;
    for (size_t i = 0; i < exact_.size(); ++i) exact_[i].meets(origin, direction, hit.distance, int(i), hit);
    if (hit.index == none) hit.distance = std::numeric_limits<double>::infinity();
    return hit;
}

// Eight rays in vectors.
struct Few::Screening {
    Wide ox, oy, oz, dx, dy, dz, reach;

    [[gnu::always_inline]] Screening(const Rays& r, float extent)
        : ox(load(r.ox)), oy(load(r.oy)), oz(load(r.oz)), dx(load(r.dx)), dy(load(r.dy)), dz(load(r.dz)),
          reach(absolute(ox) + absolute(oy) + absolute(oz) + extent) {}

    // Distances, how far the points there are from the outline, and how far both may be wrong: infinitely, or NaN, where
    // rays are parallel to the plane.
    [[gnu::always_inline]] void meet(const Screen& s, Wide& t, Wide& error, Wide& within, Wide& beside) const {
        const Wide facing = 1 / (s.normal[0] * dx + s.normal[1] * dy + s.normal[2] * dz);
        t = -(s.normal[0] * ox + s.normal[1] * oy + s.normal[2] * oz + s.normal[3]) * facing;
        const Wide x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
        const Wide u = s.to_u[0] * x + s.to_u[1] * y + s.to_u[2] * z + s.to_u[3];
        const Wide v = s.to_v[0] * x + s.to_v[1] * y + s.to_v[2] * z + s.to_v[3];
        within = smaller(smaller(u, v), s.parallelogram ? smaller(1 - u, 1 - v) : 1 - (u + v));
        error = (reach + absolute(t)) * (absolute(facing) * rounding_errors + rounding_errors);
        beside = s.change * error;
    }
};

// The screens that may be nearest, and whether all others are further away. Comparisons are negated where a NaN is to count.
void Few::scan_closest(const Rays& rays, int32_t* nearest_screens, int32_t* alone) const {
    const Screening eight(rays, extent_);
    const WideMasks begin = load(rays.begin), end = load(rays.end);
    const Wide far = Wide{} + std::numeric_limits<float>::infinity();
    // Of the nearest one its distance within bounds, and the least distance at which any other one may be.
    Wide nearest = far, upper = far, lower = far, other = far;
    WideMasks screen = WideMasks{} - 1;
    for (int i = 0; i < int(screens_.size()); ++i) {
        Wide t, error, within, beside;
        eight.meet(screens_[size_t(i)], t, error, within, beside);
        const Wide high = t + error, difference = t - error, low = difference > -far ? difference : -far;
        const WideMasks perhaps = (begin != i) & (end != i) & ~((within < -beside) | (high < 0));
        const WideMasks nearer = perhaps & ~(t >= nearest);
        other = smaller(nearer ? lower : (perhaps ? low : far), other);
        nearest = nearer ? t : nearest;
        lower = nearer ? low : lower;
        upper = nearer ? high : upper;
        screen = nearer ? WideMasks{} + i : screen;
    }
    store(nearest_screens, screen);
    store(alone, upper < other);
}

// Which rays meet anything within their limits for sure, and which ones perhaps.
void Few::scan_blocked(const Rays& rays, int32_t* sure, int32_t* perhaps) const {
    const Screening eight(rays, extent_);
    const WideMasks begin = load(rays.begin), end = load(rays.end);
    const Wide limit = load(rays.limit);
    WideMasks blocked{}, doubtful{};
    for (int i = 0; i < int(screens_.size()); ++i) {
        Wide t, error, within, beside;
        eight.meet(screens_[size_t(i)], t, error, within, beside);
        const WideMasks others = (begin != i) & (end != i);
        blocked |= others & (within > beside) & (t > error) & (t + error < limit);
        doubtful |= others & ~((within < -beside) | (t + error < 0) | (t - error > limit));
    }
    store(sure, blocked);
    store(perhaps, doubtful);
}

void Few::closest(const Rays& rays, Hit* hits) const {
    int32_t screens[side_by_side], alone[side_by_side];
    scan_closest(rays, screens, alone);
    for (int k = 0; k < side_by_side; ++k) {
        hits[k].distance = std::numeric_limits<double>::infinity(), hits[k].index = none;
        if (screens[k] == none) continue;
        const Vec3 o = rays.origin(k), d = rays.direction(k);
        if (alone[k]) {
            const Screen& s = screens_[size_t(screens[k])];
            if (exact_[size_t(s.first)].meets(o, d, hits[k].distance, s.first, hits[k])) continue;
            if (s.second != none && exact_[size_t(s.second)].meets(o, d, hits[k].distance, s.second, hits[k])) continue;
        }
        hits[k] = closest(o, d, hits[k].distance);
    }
}

void Few::blocked(const Rays& rays, bool* results) const {
    int32_t sure[side_by_side], perhaps[side_by_side];
    scan_blocked(rays, sure, perhaps);
    for (int k = 0; k < side_by_side; ++k)
        results[k] = sure[k] || (perhaps[k] && closest(rays.origin(k), rays.direction(k), rays.limit[k]).index != none);
}

}  // namespace oracle
