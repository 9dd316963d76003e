#include "material.h"

#include "fresnel.h"
#include "microfacet.h"

namespace oracle {
namespace {

using Kind = Material::Kind;

Vec3 mirrored(const Vec3& w) { return {-w.x, -w.y, w.z}; }

// The index on the other side of `w`, divided by that on its own.
float relative_index(const Material& m, const Vec3& w) { return w.z > 0 ? m.ior : 1 / m.ior; }

// The facet that turns one direction into the other, its normal upwards, and their cosines at it.
struct Half {
    Vec3 m;
    float eye, light;
};

Half reflecting_half(const Vec3& a, const Vec3& b) {
    Vec3 m = normalize(a + b);
    if (m.z < 0) m = -m;
    return {m, dot(m, a), dot(m, b)};
}

Half refracting_half(const Vec3& eye, const Vec3& light, float eta) {
    Vec3 m = normalize(eye + eta * light);
    if (m.z < 0) m = -m;
    return {m, dot(m, eye), dot(m, light)};
}

// d(half)/d(light) of a refraction, with both cosines at the facet (Walter et al. 2007, eq. 17).
float refraction_jacobian(const Half& h, float eta) {
    return eta * eta * std::fabs(h.light) / squared(h.eye + eta * h.light);
}

Color evaluate_rough_conductor(const Material& m, const Vec3& eye, const Vec3& light) {
    if (eye.z <= 0 || light.z <= 0) return {};
    const Ggx ggx{m.alpha, m.separable};
    const Half h = reflecting_half(eye, light);
    const float scale = ggx.density(h.m) * ggx.g2(eye, light) / (4 * eye.z);
    return scale * conductor_reflectance(h.eye, m.eta, m.k);
}

float pdf_rough_conductor(const Material& m, const Vec3& eye, const Vec3& light) {
    if (eye.z <= 0 || light.z <= 0) return 0;
    const Half h = reflecting_half(eye, light);
    return Ggx{m.alpha, m.separable}.visible_density(eye, h.m) / (4 * h.eye);
}

BsdfSample sample_rough_conductor(const Material& m, const Vec3& eye, const Vec2& u) {
    if (eye.z <= 0) return {};
    const Ggx ggx{m.alpha, m.separable};
    const Vec3 facet = ggx.sample_visible(eye, u);
    const float cosine = dot(eye, facet);
    const Vec3 light = 2 * cosine * facet - eye;
    if (light.z <= 0 || cosine <= 0) return {};
    const float seen = ggx.g2(eye, light) / ggx.g1(eye);
    return {light, seen * conductor_reflectance(cosine, m.eta, m.k), ggx.visible_density(eye, facet) / (4 * cosine)};
}

Color evaluate_rough_dielectric(const Material& m, const Vec3& eye, const Vec3& light) {
    if (eye.z == 0 || light.z == 0) return {};
    const Ggx ggx{m.alpha, m.separable};
    const float eta = relative_index(m, eye);
    float refracted;
    if (eye.z * light.z > 0) {
        const Half h = reflecting_half(eye, light);
        const float f = dielectric_reflectance(std::fabs(h.eye), eta, refracted);
        return f * ggx.density(h.m) * ggx.g2(eye, light) / (4 * std::fabs(eye.z)) * white();
    }
    const Half h = refracting_half(eye, light, eta);
    // Light passes only where each direction is on the same side of facet and surface.
    if (h.eye * eye.z <= 0 || h.light * light.z <= 0) return {};
    const float f = dielectric_reflectance(std::fabs(h.eye), eta, refracted);
    const float passed = (1 - f) * ggx.density(h.m) * ggx.g2(eye, light) * std::fabs(h.eye / eye.z);
    // Radiance shrinks by the square of the index on the way out.
    return passed * refraction_jacobian(h, eta) / (eta * eta) * white();
}

float pdf_rough_dielectric(const Material& m, const Vec3& eye, const Vec3& light) {
    if (eye.z == 0 || light.z == 0) return 0;
    const Ggx ggx{m.alpha, m.separable};
    const float eta = relative_index(m, eye);
    float refracted;
    const bool reflects = eye.z * light.z > 0;
    const Half h = reflects ? reflecting_half(eye, light) : refracting_half(eye, light, eta);
    if (h.eye * eye.z <= 0 || h.light * light.z <= 0) return 0;
    const float seen = ggx.visible_density(eye, h.m);
    const float f = dielectric_reflectance(std::fabs(h.eye), eta, refracted);
    return reflects ? seen * f / (4 * std::fabs(h.eye)) : seen * (1 - f) * refraction_jacobian(h, eta);
}

BsdfSample sample_rough_dielectric(const Material& m, const Vec3& eye, const Vec2& u, float choice) {
    if (eye.z == 0) return {};
    const Ggx ggx{m.alpha, m.separable};
    const float side = eye.z > 0 ? 1.0f : -1.0f, eta = relative_index(m, eye);
    // Work on the upper side; turning by pi around x brings the lower one there.
    const Vec3 up{eye.x, side * eye.y, side * eye.z};
    const Vec3 facet = ggx.sample_visible(up, u);
    const float cosine = dot(up, facet);
    if (cosine <= 0) return {};
    float refracted;
    const float f = dielectric_reflectance(cosine, eta, refracted);
    const bool reflects = choice < f;
    Vec3 light = reflects ? 2 * cosine * facet - up : (cosine / eta - refracted) * facet - up / eta;
    if (reflects ? light.z <= 0 : light.z >= 0) return {};
    const float seen = ggx.g2(up, light) / ggx.g1(up);
    light = {light.x, side * light.y, side * light.z};
    const float density = ggx.visible_density(up, facet);
    if (reflects) return {light, seen * white(), density * f / (4 * cosine)};
    const Half h{facet, cosine, -refracted};
    return {light, seen / (eta * eta) * white(), density * (1 - f) * refraction_jacobian(h, eta), false, eta * eta};
}

float phong_pdf(const Material& m, const Vec3& eye, const Vec3& light) {
    const float cosine = dot(mirrored(eye), light);
    return cosine <= 0 ? 0 : (m.exponent + 1) / (2 * pi) * std::pow(cosine, m.exponent);
}

BsdfSample sample_phong(const Material& m, const Color& reflectance, const Vec3& eye, const Vec2& u) {
    if (eye.z <= 0) return {};
    const float cosine = std::pow(1 - u.x, 1 / (m.exponent + 1)), sine = safe_sqrt(1 - cosine * cosine);
    const float phi = 2 * pi * u.y;
    const Vec3 light = Frame(mirrored(eye)).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine});
    if (light.z <= 0) return {};
    const float weight = light.z * (m.exponent + 2) / (m.exponent + 1);
    return {light, weight * reflectance, phong_pdf(m, eye, light)};
}

// The base of a plastic, seen through its coat: light enters, is reflected any number of times, and leaves.
Color plastic_base(const Material& m, const Color& reflectance, float eye_cosine, float light_cosine) {
    float refracted;
    const float enters = 1 - dielectric_reflectance(light_cosine, m.ior, refracted);
    const float leaves = 1 - dielectric_reflectance(eye_cosine, m.ior, refracted);
    const float scale = enters * leaves / (m.ior * m.ior);
    const auto channel = [&](float rho) { return scale * rho / (1 - rho * m.inner); };
    return {channel(reflectance.x), channel(reflectance.y), channel(reflectance.z)};
}

// How often a plastic's sample is its coat's reflection.
float coat_probability(const Material& m, const Color& reflectance, float eye_cosine) {
    float refracted;
    const float f = dielectric_reflectance(eye_cosine, m.ior, refracted);
    return f / (f + (1 - f) * mean(reflectance));
}

BsdfSample sample_plastic(const Material& m, const Color& reflectance, const Vec3& eye, const Vec2& u, float choice) {
    if (eye.z <= 0) return {};
    float refracted;
    const float coat = coat_probability(m, reflectance, eye.z);
    if (choice < coat)
        return {mirrored(eye), dielectric_reflectance(eye.z, m.ior, refracted) / coat * white(), 0, true};
    const Vec3 light = square_to_cosine_hemisphere(u);
    if (light.z <= 0) return {};
    return {light, plastic_base(m, reflectance, eye.z, light.z) / (1 - coat), (1 - coat) * light.z * inv_pi};
}

BsdfSample sample_dielectric(const Material& m, const Vec3& eye, float choice) {
    if (eye.z == 0) return {};
    const float eta = relative_index(m, eye);
    float refracted;
    const float f = dielectric_reflectance(std::fabs(eye.z), eta, refracted);
    if (choice < f) return {mirrored(eye), white(), 0, true};
    const Vec3 light{-eye.x / eta, -eye.y / eta, eye.z > 0 ? -refracted : refracted};
    return {light, white() / (eta * eta), 0, true, eta * eta};
}

}  // namespace

bool Bsdf::is_delta() const {
    switch (material.kind) {
        case Kind::black:
        case Kind::mirror:
        case Kind::dielectric:
        case Kind::conductor: return true;
        case Kind::mix: return part(material.first).is_delta() && part(material.second).is_delta();
        default: return false;
    }
}

bool Bsdf::has_delta() const {
    if (material.kind == Kind::mix) return part(material.first).has_delta() || part(material.second).has_delta();
    return material.kind == Kind::plastic || is_delta();
}

bool Bsdf::transmits() const {
    if (material.kind == Kind::mix) return part(material.first).transmits() || part(material.second).transmits();
    return material.kind == Kind::dielectric || material.kind == Kind::rough_dielectric;
}

Color Bsdf::evaluate_other(const Vec3& eye, const Vec3& light) const {
    switch (material.kind) {
        case Kind::rough_conductor: return evaluate_rough_conductor(material, eye, light);
        case Kind::rough_dielectric: return evaluate_rough_dielectric(material, eye, light);
        case Kind::phong: {
            if (eye.z <= 0 || light.z <= 0) return {};
            const float scale = (material.exponent + 2) / (material.exponent + 1) * light.z;
            return scale * phong_pdf(material, eye, light) * material.reflectance.at(textures, uv);
        }
        case Kind::plastic:
            if (eye.z <= 0 || light.z <= 0) return {};
            return light.z * inv_pi * plastic_base(material, material.reflectance.at(textures, uv), eye.z, light.z);
        case Kind::mix:
            return (1 - material.weight) * part(material.first).evaluate(eye, light) +
                   material.weight * part(material.second).evaluate(eye, light);
        default: return {};
    }
}

float Bsdf::pdf_other(const Vec3& eye, const Vec3& light) const {
    switch (material.kind) {
        case Kind::rough_conductor: return pdf_rough_conductor(material, eye, light);
        case Kind::rough_dielectric: return pdf_rough_dielectric(material, eye, light);
        case Kind::phong: return eye.z > 0 && light.z > 0 ? phong_pdf(material, eye, light) : 0;
        case Kind::plastic:
            if (eye.z <= 0 || light.z <= 0) return 0;
            return (1 - coat_probability(material, material.reflectance.at(textures, uv), eye.z)) * light.z * inv_pi;
        case Kind::mix:
            return (1 - material.weight) * part(material.first).pdf(eye, light) +
                   material.weight * part(material.second).pdf(eye, light);
        default: return 0;
    }
}

BsdfSample Bsdf::sample_other(const Vec3& eye, const Vec2& u, float choice) const {
    switch (material.kind) {
        case Kind::diffuse: {
            if (eye.z <= 0) return {};
            const Vec3 light = square_to_cosine_hemisphere(u);
            return {light, material.reflectance.at(textures, uv), light.z * inv_pi};
        }
        case Kind::mirror: return {mirrored(eye), material.reflectance.at(textures, uv), 0, true};
        case Kind::dielectric: return sample_dielectric(material, eye, choice);
        case Kind::conductor:
            if (eye.z <= 0) return {};
            return {mirrored(eye), conductor_reflectance(eye.z, material.eta, material.k), 0, true};
        case Kind::rough_conductor: return sample_rough_conductor(material, eye, u);
        case Kind::rough_dielectric: return sample_rough_dielectric(material, eye, u, choice);
        case Kind::phong: return sample_phong(material, material.reflectance.at(textures, uv), eye, u);
        case Kind::plastic: return sample_plastic(material, material.reflectance.at(textures, uv), eye, u, choice);
        case Kind::mix: {
            // A direction from one of the parts; where both can give it, their densities add up.
            const bool second = choice < material.weight;
            const float rest = second ? choice / material.weight : (choice - material.weight) / (1 - material.weight);
            BsdfSample s = part(second ? material.second : material.first).sample(eye, u, rest);
            if (s.delta || is_black(s.weight)) return s;
            s.pdf = pdf(eye, s.to_light);
            s.weight = evaluate(eye, s.to_light) / s.pdf;
            return s;
        }
        default: return {};
    }
}

Color Bsdf::albedo() const {
    switch (material.kind) {
        case Kind::diffuse:
        case Kind::mirror:
        case Kind::phong:
        case Kind::plastic: return material.reflectance.at(textures, uv);
        case Kind::conductor:
        case Kind::rough_conductor: return conductor_reflectance(1, material.eta, material.k);
        case Kind::dielectric:
        case Kind::rough_dielectric: return white();
        case Kind::mix:
            return (1 - material.weight) * part(material.first).albedo() + material.weight * part(material.second).albedo();
        default: return {};
    }
}

float internal_reflectance(float eta) {
    // Midpoint rule over u = cos^2, which makes the weight of diffuse light constant.
    constexpr int count = 20000;
    double sum = 0;
    for (int i = 0; i < count; ++i) {
        const double c = std::sqrt((i + 0.5) / count), s2 = (1 - c * c) / (double(eta) * eta);
        if (s2 >= 1) {
            sum += 1;
            continue;
        }
        const double t = std::sqrt(1 - s2), s = (c - eta * t) / (c + eta * t), p = (eta * c - t) / (eta * c + t);
        sum += 0.5 * (s * s + p * p);
    }
    return static_cast<float>(1 - (1 - sum / count) / (double(eta) * eta));
}

}  // namespace oracle
