#include "light.h"

#include <limits>

namespace oracle {
namespace {

using Kind = Light::Kind;

bool is_near(const Light& l, const Vec3& from) { return is_near(l.area, l.center, from); }

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
        case Kind::sphere: {
            const EmitterSample at = sample_sphere(l.p, l.radius, from, u.x, u.y);
            if (!(at.pdf > 0)) return towards(l, from, at.point, at.normal, l.radiance.constant);
            // At the rim the ray grazes: the side is not decided by rounding.
            const Vec3 d = at.point - from;
            const float distance = length(d);
            return {d / distance, distance, at.point, at.normal, l.radiance.constant, at.pdf};
        }
        case Kind::point:
        case Kind::spot: {
            const Vec3 d = l.p - from;
            const float d2 = length_squared(d);
            if (!(d2 > 0)) return {};
            const float distance = std::sqrt(d2);
            const Vec3 w = d / distance;
            const float part = l.kind == Kind::spot ? spot_falloff(l.full, l.cutoff, length(cross(w, l.n)), -dot(w, l.n)) : 1;
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
        if (is_outside(d2, l.radius)) return 1 / (2 * pi * one_minus_cosine(d2, l.radius));
    }
    return distance * distance / (std::fabs(dot(direction, normal)) * l.area);
}

bool is_sampled_evenly(const Light& l, const Vec3& from) {
    switch (l.kind) {
        case Kind::rectangle:
        case Kind::triangle: return true;
        case Kind::sphere: return is_outside(length_squared(l.p - from), l.radius);
        // Sampled by area, whose density per solid angle rises slowly as long as the disk is no nearer than wide.
        default: return is_far(l.area, length_squared(l.p - from));
    }
}

}  // namespace oracle
