// Sampling of emitters as they are seen from a point. Nothing here branches, so that compilers make vectors of it.
#pragma once

#include "vec.h"

namespace oracle {

// A triangle with the corners p, p + u and p + v, or a rectangle.
struct Patch {
    Vec3 p, u, v;
    Vec3 n;  // unit normal of the front
    float area;
};

// Above this ratio of area to squared distance from the center, the solid angle is sampled instead of the area.
constexpr float near = 0.1f;

inline bool is_near(float area, const Vec3& center, const Vec3& from) {
    return area > near * length_squared(center - from);
}

inline Vec3 center_of_triangle(const Patch& l) { return l.p + (1.0f / 3) * (l.u + l.v); }
inline Vec3 center_of_rectangle(const Patch& l) { return l.p + 0.5f * (l.u + l.v); }

// A point as fractions of the edges, and its density per solid angle, or 0 if it was chosen by area.
struct PatchSample {
    float s, t, pdf;
};

// A rectangle as seen from a point, in the coordinates of its edges (Ureña, Fajardo and King 2013).
struct SphericalRectangle {
    float x0, y0, x1, y1, z;  // corners; z > 0 is the distance of the plane
    float b0, b1, k, solid_angle;

    [[gnu::always_inline]] SphericalRectangle(const Patch& l, const Vec3& from) {
        const float width = length(l.u), height = length(l.v);
        const Vec3 d = l.p - from;
        x0 = dot(d, l.u) / width, y0 = dot(d, l.v) / height, z = std::fabs(dot(d, l.n));
        x1 = x0 + width, y1 = y0 + height;
        // The planes through the eye and each edge enclose these angles. Their sines come from the corners' distances, for
        // an arc cosine would lose the digits of angles near 0 and pi, which is what they are near the rectangle's plane.
        const auto over = [&](float a) { return 1 / std::sqrt(a * a + z * z); };
        const float u0 = over(x0), u1 = over(x1), v0 = over(y0), v1 = over(y1);
        const auto angle = [&](float x, float y, float u, float v, float sign) {
            return Vec2{sign * (x * u) * (y * v), z * u * v * std::sqrt(x * x + y * y + z * z)};
        };
        const auto sum = [](const Vec2& a, const Vec2& b) { return Vec2{a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; };
        const auto radians = [](const Vec2& a) {
            const float r = arc_tangent(a.y, a.x);
            return r < 0 ? r + 2 * pi : r;
        };
        const Vec2 right = sum(angle(x1, y0, u1, v0, 1), angle(x1, y1, u1, v1, -1));
        const Vec2 left = sum(angle(x0, y1, u0, v1, 1), angle(x0, y0, u0, v0, -1));
        b0 = -y0 * v0, b1 = y1 * v1;
        k = 2 * pi - radians(left);
        solid_angle = radians(sum(right, left));
    }

    [[gnu::always_inline]] PatchSample sample(float u, float v) const {
        float sine, cosine;
        sine_cosine(u * solid_angle + k, sine, cosine);
        const float fu = (cosine * b0 - b1) / sine;
        const float cu = smaller(larger(std::copysign(1 / std::sqrt(fu * fu + b0 * b0), fu), -1.0f), 1.0f);
        const float x = smaller(larger(cu * z / safe_sqrt(1 - cu * cu), x0), x1);
        const float d2 = x * x + z * z;
        const float h0 = y0 / std::sqrt(d2 + y0 * y0), h1 = y1 / std::sqrt(d2 + y1 * y1);
        const float h = h0 + v * (h1 - h0), rest = 1 - h * h;
        const float y = smaller(larger(h * std::sqrt(d2) / std::sqrt(larger(rest, 1e-12f)), y0), y1);
        return {(x - x0) / (x1 - x0), ((rest > 1e-6f ? y : y1) - y0) / (y1 - y0), 1 / solid_angle};
    }
};

// A triangle as seen from a point (Arvo 1995, "Stratified Sampling of Spherical Triangles").
struct SphericalTriangle {
    Vec3 a, b, c;
    float solid_angle, alpha, cos_alpha, sin_alpha;

    [[gnu::always_inline]] SphericalTriangle(const Patch& l, const Vec3& from) {
        const Vec3 d = l.p - from, e = d + l.u, f = d + l.v;
        const float da = length(d), db = length(e), dc = length(f);
        a = d / da, b = e / db, c = f / dc;
        // van Oosterom and Strackee 1983; the triple product by the distance of the plane, which does not cancel.
        const float triple = 2 * l.area * std::fabs(dot(d, l.n)) / (da * db * dc);
        solid_angle = 2 * arc_tangent(triple, 1 + dot(a, b) + dot(b, c) + dot(c, a));
        const float flat = dot(cross(a, b), cross(a, c));
        alpha = arc_tangent(triple, flat);
        const float scale = 1 / std::sqrt(triple * triple + flat * flat);
        cos_alpha = flat * scale, sin_alpha = triple * scale;
    }

    [[gnu::always_inline]] Vec3 sample(float u, float v) const {
        float s, t;
        sine_cosine(u * solid_angle - alpha, s, t);
        const float cos_c = dot(a, b);
        const float p = t - cos_alpha, q = s + sin_alpha * cos_c;
        const float numerator = (q * t - p * s) * cos_alpha - q, denominator = (q * s + p * t) * sin_alpha;
        const float ratio = numerator / (denominator == 0 ? 1 : denominator);
        const float cos_b = denominator == 0 ? 1 : smaller(larger(ratio, -1.0f), 1.0f);
        const Vec3 towards = c - dot(c, a) * a;
        const Vec3 moved = cos_b * a + (safe_sqrt(1 - cos_b * cos_b) / length(towards)) * towards;
        const float z = 1 - v * (1 - dot(moved, b));
        const Vec3 across = moved - dot(moved, b) * b;
        const float l = length(across);
        const float along = l == 0 ? 1 : z, aside = l == 0 ? 0 : safe_sqrt(1 - z * z) / (l == 0 ? 1 : l);
        return along * b + aside * across;
    }
};

[[gnu::always_inline]] inline PatchSample sample_rectangle(const Patch& l, const Vec3& from, float u, float v) {
    const SphericalRectangle seen(l, from);
    const PatchSample found = seen.sample(u, v);
    const bool by_angle = is_near(l.area, center_of_rectangle(l), from) & (seen.solid_angle > 0);
    return {by_angle ? found.s : u, by_angle ? found.t : v, by_angle ? found.pdf : 0};
}

[[gnu::always_inline]] inline PatchSample sample_triangle(const Patch& l, const Vec3& from, float u, float v) {
    const SphericalTriangle seen(l, from);
    const Vec3 w = seen.sample(u, v);
    const float cosine = dot(w, l.n);
    const float distance = dot(l.p - from, l.n) / (cosine == 0 ? 1 : cosine);
    // By its fractions of the edges, so that rounding does not move it off the plane.
    const Vec3 d = from + distance * w - l.p, c = cross(l.u, l.v);
    const float scale = 1 / dot(c, c);
    const float s = dot(cross(d, l.v), c) * scale, t = dot(cross(l.u, d), c) * scale;
    const bool by_angle = is_near(l.area, center_of_triangle(l), from) & (seen.solid_angle > 0) & (distance > 0);
    // Otherwise uniform in the triangle (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
    const float least = smaller(u, v) / 2;
    const float x = v > u ? least : u - least, y = v > u ? v - least : least;
    return {by_angle ? s : x, by_angle ? t : y, by_angle ? 1 / seen.solid_angle : 0};
}

// A point on an emitter, its normal (zero if there is none), and its density per solid angle, or 0 if it was chosen by area
// and tells by its side whether it shines.
struct EmitterSample {
    Vec3 point, normal;
    float pdf;
};

// Whether a sphere is seen from outside, and not all but touching.
inline bool is_outside(float distance_squared, float radius) { return distance_squared > radius * radius * 1.000001f; }

// 1 - cos of the half angle of the cone that a sphere fills, without cancellation.
inline float one_minus_cosine(float distance_squared, float radius) {
    const float sine2 = radius * radius / distance_squared;
    return sine2 / (1 + safe_sqrt(1 - sine2));
}

inline EmitterSample sample_sphere(const Vec3& center, float radius, const Vec3& from, float u, float v) {
    const Vec3 to_center = center - from;
    const float d2 = length_squared(to_center), distance = std::sqrt(d2), r2 = radius * radius;
    const bool outside = is_outside(d2, radius);
    const float part = outside ? one_minus_cosine(d2, radius) : 2;
    const float gap = u * part;  // 1 - cosine of the sample's angle
    const float sine2 = gap * (2 - gap), cosine = 1 - gap, sine = safe_sqrt(sine2);
    // Where the ray meets the sphere first, as its angle at the center (pbrt, 4th edition, section 6.2.4).
    const float along = distance * cosine - safe_sqrt(r2 - d2 * sine2);
    float s, c;
    sine_cosine(2 * pi * v, s, c);
    const Frame frame(to_center / (distance > 0 ? distance : 1));
    const Vec3 w = frame.to_world({sine * c, sine * s, cosine});
    const Vec3 seen = along * w - to_center;
    // From within, or all but touching: anywhere on the sphere.
    const Vec3 anywhere{sine * c, sine * s, cosine};
    const float scale = 1 / length(seen);
    const Vec3 n{outside ? scale * seen.x : anywhere.x, outside ? scale * seen.y : anywhere.y,
                 outside ? scale * seen.z : anywhere.z};
    return {center + radius * n, n, outside ? 1 / (2 * pi * part) : 0};
}

// Whether a disk is so far away that sampling its area samples about evenly what is seen of it.
inline bool is_far(float area, float distance_squared) { return area < distance_squared; }

// What a spot sends where the angle to its axis has this cosine and sine.
inline float spot_falloff(float full, float cutoff, float sine, float cosine) {
    const float part = (cutoff - arc_tangent(sine, cosine)) / (cutoff - full);
    return smaller(larger(part, 0), 1);
}

}  // namespace oracle
