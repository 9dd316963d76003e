// How surfaces scatter light. Directions are local: z is the shading normal, both point away from the surface, `to_eye`
// is where the radiance goes and `to_light` where it comes from.
#pragma once

#include <vector>

#include "texture.h"
#include "vec.h"

namespace oracle {

struct Material {
    enum class Kind {
        black,
        diffuse,
        mirror,
        dielectric,
        conductor,
        rough_conductor,
        rough_dielectric,
        phong,
        plastic,
        two_sided,
        mix,
    };
    Kind kind = Kind::black;
    ColorMap reflectance;
    Color eta{}, k{};       // complex index of a conductor
    float ior = 1;          // of a dielectric or a coat, behind the front divided by before it
    float alpha = 1;        // root mean square slope
    bool separable = false; // masking, see Ggx
    float exponent = 0;
    float inner = 0;        // part of diffuse light that a plastic's coat sends back to its base
    float weight = 0;       // of the second material in a mix
    int first = -1, second = -1;  // parts of a mix; front and back of a two-sided surface
};

struct BsdfSample {
    Vec3 to_light;
    Color weight;     // f |cos| / pdf; black if there is no direction
    float pdf = 0;    // per solid angle; meaningless if delta
    bool delta = false;
    float bent = 1;   // square of the relative index that was passed
};

// One material at one place of a surface.
struct Bsdf {
    const std::vector<Material>& materials;
    const std::vector<Texture>& textures;
    const Material& material;
    Vec2 uv;

    // Whether all of it is mirrors and smooth interfaces, so that `evaluate` is black.
    bool is_delta() const;
    bool has_delta() const;  // whether part of it is, so that `evaluate` is not everything
    bool transmits() const;

    // f |cos|. Diffuse surfaces are so frequent that they are treated here.
    Color evaluate(const Vec3& to_eye, const Vec3& to_light) const {
        if (material.kind != Material::Kind::diffuse) return evaluate_other(to_eye, to_light);
        if (to_eye.z <= 0 || to_light.z <= 0) return {};
        return to_light.z * inv_pi * material.reflectance.at(textures, uv);
    }

    float pdf(const Vec3& to_eye, const Vec3& to_light) const {
        if (material.kind != Material::Kind::diffuse) return pdf_other(to_eye, to_light);
        return to_eye.z > 0 && to_light.z > 0 ? to_light.z * inv_pi : 0;
    }

    // `u` and `choice` are uniform in [0, 1).
    BsdfSample sample(const Vec3& to_eye, const Vec2& u, float choice) const {
        if (material.kind != Material::Kind::diffuse) return sample_other(to_eye, u, choice);
        if (to_eye.z <= 0) return {};
        const Vec3 light = square_to_cosine_hemisphere(u);
        return {light, material.reflectance.at(textures, uv), light.z * inv_pi};
    }

    Color albedo() const;  // what the material's colour is called, for pictures

private:
    Color evaluate_other(const Vec3& to_eye, const Vec3& to_light) const;
    float pdf_other(const Vec3& to_eye, const Vec3& to_light) const;
    BsdfSample sample_other(const Vec3& to_eye, const Vec2& u, float choice) const;
    Bsdf part(int index) const { return {materials, textures, materials[size_t(index)], uv}; }
};

// Part of diffuse light within a coat of index `eta` that its surface sends back.
float internal_reflectance(float eta);

}  // namespace oracle
