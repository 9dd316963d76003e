#include "light.h"

#include <limits>

namespace oracle {
namespace {

using Kind = Light::Kind;

// Above this ratio of area to squared distance from the center, the solid angle is sampled instead of the area.
constexpr float near = 0.1f;

bool is_near(const Light& l, const Vec3& from) {
    return l.area > near * length_squared(l.center - from);
}

// A rectangle as seen from a point, in the coordinates of its edges (Ureña, Fajardo and King 2013).
struct SphericalRectangle {
    float x0, y0, x1, y1, z;  // corners; z > 0 is the distance of the plane
    float b0, b1, k, solid_angle;

    SphericalRectangle(const Light& l, const Vec3& from) {
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
            const float r = std::atan2(a.y, a.x);
            return r < 0 ? r + 2 * pi : r;
        };
        const Vec2 right = sum(angle(x1, y0, u1, v0, 1), angle(x1, y1, u1, v1, -1));
        const Vec2 left = sum(angle(x0, y1, u0, v1, 1), angle(x0, y0, u0, v0, -1));
        b0 = -y0 * v0, b1 = y1 * v1;
        k = 2 * pi - radians(left);
        solid_angle = radians(sum(right, left));
    }

    // As fractions of the edges.
    Vec2 sample(const Vec2& u) const {
        const float au = u.x * solid_angle + k;
        const float fu = (std::cos(au) * b0 - b1) / std::sin(au);
        const float cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + b0 * b0), fu), -1.0f, 1.0f);
        const float x = std::clamp(cu * z / safe_sqrt(1 - cu * cu), x0, x1);
        const float d2 = x * x + z * z;
        const float h0 = y0 / std::sqrt(d2 + y0 * y0), h1 = y1 / std::sqrt(d2 + y1 * y1);
        const float h = h0 + u.y * (h1 - h0);
        const float y = h * h < 1 - 1e-6f ? std::clamp(h * std::sqrt(d2) / std::sqrt(1 - h * h), y0, y1) : y1;
        return {(x - x0) / (x1 - x0), (y - y0) / (y1 - y0)};
    }
};

// A triangle as seen from a point (Arvo 1995, "Stratified Sampling of Spherical Triangles").
struct SphericalTriangle {
    Vec3 a, b, c;
    float solid_angle, alpha;

    SphericalTriangle(const Light& l, const Vec3& from) {
        const Vec3 d = l.p - from, e = d + l.u, f = d + l.v;
        const float da = length(d), db = length(e), dc = length(f);
        a = d / da, b = e / db, c = f / dc;
        // van Oosterom and Strackee 1983; the triple product by the distance of the plane, which does not cancel.
        const float triple = 2 * l.area * std::fabs(dot(d, l.n)) / (da * db * dc);
        solid_angle = 2 * std::atan2(triple, 1 + dot(a, b) + dot(b, c) + dot(c, a));
        const Vec3 ab = cross(a, b), ac = cross(a, c);
        alpha = std::atan2(triple, dot(ab, ac));
    }

    Vec3 sample(const Vec2& u) const {
        const float area = u.x * solid_angle;
        const float s = std::sin(area - alpha), t = std::cos(area - alpha);
        const float cos_alpha = std::cos(alpha), sin_alpha = std::sin(alpha), cos_c = dot(a, b);
        const float p = t - cos_alpha, q = s + sin_alpha * cos_c;
        const float numerator = (q * t - p * s) * cos_alpha - q, denominator = (q * s + p * t) * sin_alpha;
        const float cos_b = denominator == 0 ? 1 : std::clamp(numerator / denominator, -1.0f, 1.0f);
        const Vec3 towards = c - dot(c, a) * a;
        const Vec3 moved = cos_b * a + safe_sqrt(1 - cos_b * cos_b) * normalize(towards);
        const float z = 1 - u.y * (1 - dot(moved, b));
        const Vec3 across = moved - dot(moved, b) * b;
        const float l = length(across);
        return l == 0 ? b : z * b + safe_sqrt(1 - z * z) / l * across;
    }
};

// 1 - cos of the half angle of the cone that a sphere fills, without cancellation.
float one_minus_cosine(const Light& l, float distance_squared) {
    const float sine2 = l.radius * l.radius / distance_squared;
    return sine2 / (1 + safe_sqrt(1 - sine2));
}

Color emitted(const Light& l, const std::vector<Texture>& textures, float s, float t) {
    if (l.radiance.texture < 0) return l.radiance.constant;
    const float r = 1 - s - t;
    const Vec2 uv{r * l.uv[0].x + s * l.uv[1].x + t * l.uv[2].x, r * l.uv[0].y + s * l.uv[1].y + t * l.uv[2].y};
    return l.radiance.at(textures, uv);
}

// Completes a sample at `point` that was chosen by area, or by solid angle if a density is given.
LightSample towards(const Light& l, const Vec3& from, const Vec3& point, const Vec3& normal, const Color& radiance,
                    float pdf_by_solid_angle = 0) {
    const Vec3 d = point - from;
    const float distance = length(d);
    const float cosine = -dot(d, normal) / distance;
    const bool behind = cosine <= 0;
    if (!(distance > 0) || cosine == 0 || (behind && !l.two_sided)) return {};
    const float pdf = pdf_by_solid_angle ? pdf_by_solid_angle : distance * distance / (std::fabs(cosine) * l.area);
    return {d / distance, distance, point, behind ? -normal : normal, radiance, pdf};
}

LightSample sample_sphere(const Light& l, const Vec3& from, const Vec2& u) {
    const Vec3 to_center = l.p - from;
    const float d2 = length_squared(to_center), r2 = l.radius * l.radius;
    if (d2 <= r2 * 1.000001f) {
        // From within, or all but touching.
        const Vec3 n = square_to_sphere(u);
        return towards(l, from, l.p + l.radius * n, n, l.radiance.constant);
    }
    const float part = one_minus_cosine(l, d2);
    const float gap = u.x * part;  // 1 - cosine of the sample's angle
    const float sine2 = gap * (2 - gap), cosine = 1 - gap;
    const float distance = std::sqrt(d2);
    // Where the ray meets the sphere first, as its angle at the center (pbrt, 4th edition, section 6.2.4).
    const float along = distance * cosine - safe_sqrt(r2 - d2 * sine2);
    const float sine = safe_sqrt(sine2), phi = 2 * pi * u.y;
    const Frame frame(to_center / distance);
    const Vec3 w = frame.to_world({sine * std::cos(phi), sine * std::sin(phi), cosine});
    const Vec3 n = normalize(along * w - to_center);
    // At the rim the ray grazes: the side is not decided by rounding.
    const Vec3 point = l.p + l.radius * n;
    return {w, along, point, n, l.radiance.constant, 1 / (2 * pi * part)};
}

float spot_falloff(const Light& l, float cosine) {
    const float angle = std::acos(std::clamp(cosine, -1.0f, 1.0f));
    return std::clamp((l.cutoff - angle) / (l.cutoff - l.full), 0.0f, 1.0f);
}

}  // namespace

LightSample sample_light(const Light& l, const std::vector<Texture>& textures, const Vec3& from, const Vec2& u) {
    switch (l.kind) {
        case Kind::rectangle: {
            // From behind there is nothing to compute.
            if (!l.two_sided && dot(from - l.p, l.n) <= 0) return {};
            if (is_near(l, from)) {
                const SphericalRectangle seen(l, from);
                if (!(seen.solid_angle > 0)) return {};
                const Vec2 at = seen.sample(u);
                return towards(l, from, l.p + at.x * l.u + at.y * l.v, l.n, emitted(l, textures, at.x, at.y), 1 / seen.solid_angle);
            }
            return towards(l, from, l.p + u.x * l.u + u.y * l.v, l.n, emitted(l, textures, u.x, u.y));
        }
        case Kind::triangle: {
            if (!l.two_sided && dot(from - l.p, l.n) <= 0) return {};
            if (is_near(l, from)) {
                const SphericalTriangle seen(l, from);
                if (!(seen.solid_angle > 0)) return {};
                const Vec3 w = seen.sample(u);
                const float cosine = dot(w, l.n);
                const float t = cosine == 0 ? 0 : dot(l.p - from, l.n) / cosine;
                if (!(t > 0)) return {};
                // By its fractions of the edges, so that rounding does not move it off the plane.
                const Vec3 d = from + t * w - l.p, c = cross(l.u, l.v);
                const float s = dot(cross(d, l.v), c) / dot(c, c), q = dot(cross(l.u, d), c) / dot(c, c);
                return towards(l, from, l.p + s * l.u + q * l.v, l.n, emitted(l, textures, s, q), 1 / seen.solid_angle);
            }
            // Uniform in the triangle (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
            float s, t;
            if (u.y > u.x)
                s = u.x / 2, t = u.y - s;
            else
                t = u.y / 2, s = u.x - t;
            return towards(l, from, l.p + s * l.u + t * l.v, l.n, emitted(l, textures, s, t));
        }
        case Kind::disk: {
            if (!l.two_sided && dot(from - l.p, l.n) <= 0) return {};
            const Vec2 d = square_to_disk(u);
            return towards(l, from, l.p + d.x * l.u + d.y * l.v, l.n, l.radiance.constant);
        }
        case Kind::sphere: return sample_sphere(l, from, u);
        case Kind::point:
        case Kind::spot: {
            const Vec3 d = l.p - from;
            const float d2 = length_squared(d);
            if (!(d2 > 0)) return {};
            const float distance = std::sqrt(d2);
            const Vec3 w = d / distance;
            const float part = l.kind == Kind::spot ? spot_falloff(l, -dot(w, l.n)) : 1;
            if (part == 0) return {};
            return {w, distance, l.p, {}, part / d2 * l.light, 1};
        }
        case Kind::directional: return {-l.n, std::numeric_limits<float>::infinity(), {}, {}, l.light, 1};
    }
    return {};
}

float light_pdf(const Light& l, const Vec3& from, const Vec3& direction, float distance, const Vec3& normal) {
    if (l.kind == Kind::rectangle && is_near(l, from)) return 1 / SphericalRectangle(l, from).solid_angle;
    if (l.kind == Kind::triangle && is_near(l, from)) return 1 / SphericalTriangle(l, from).solid_angle;
    if (l.kind == Kind::sphere) {
        const float d2 = length_squared(l.p - from);
        if (d2 > squared(l.radius) * 1.000001f) return 1 / (2 * pi * one_minus_cosine(l, d2));
    }
    return distance * distance / (std::fabs(dot(direction, normal)) * l.area);
}

bool is_sampled_evenly(const Light& l, const Vec3& from) {
    switch (l.kind) {
        case Kind::rectangle:
        case Kind::triangle: return true;
        case Kind::sphere: return length_squared(l.p - from) > squared(l.radius) * 1.000001f;
        // Sampled by area, whose density per solid angle rises slowly as long as the disk is no nearer than wide.
        default: return l.area < length_squared(l.p - from);
    }
}

float importance(const Light& l, const Vec3& from) {
    constexpr float least = 1e-30f;
    if (l.kind == Kind::directional) return l.brightness + least;
    const float d2 = length_squared(l.center - from) + least;
    if (l.is_delta()) return l.brightness / d2 + least;
    if (l.kind == Kind::sphere) return l.brightness * pi * squared(l.radius) / std::max(d2, squared(l.radius)) + least;
    // Behind a one-sided light there is none, and never more than from the whole hemisphere.
    if (!l.two_sided && dot(from - l.p, l.n) <= 0) return least;
    return l.brightness * std::min(l.area / d2, pi) + least;
}

}  // namespace oracle
