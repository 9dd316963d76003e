#include "light.h"

#include <limits>

namespace oracle {
namespace {

using Kind = Light::Kind;

bool is_near(const Light& l, const Vec3& from) { return is_near(l.area, l.center, from); }

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
        case Kind::rectangle:
        case Kind::triangle: {
            // From behind there is nothing to compute.
            if (!l.two_sided && dot(from - l.p, l.n) <= 0) return {};
            const PatchSample at = l.kind == Kind::rectangle ? sample_rectangle(l, from, u.x, u.y) : sample_triangle(l, from, u.x, u.y);
            return towards(l, from, l.p + at.s * l.u + at.t * l.v, l.n, emitted(l, textures, at.s, at.t), at.pdf);
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
    return importance_of_patch(l, from);
}

}  // namespace oracle
