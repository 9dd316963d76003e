// Emitters of finite extent or power: how much light they send to a point, and how to choose a point on them.
#pragma once

#include "light_sampling.h"
#include "texture.h"
#include "vec.h"

namespace oracle {

// What is not flat has a center or a position p, and n is where a spot or parallel light shines; a disk's u and v are radii.
struct Light : Patch {
    enum class Kind { triangle, rectangle, disk, sphere, point, spot, directional };
    Kind kind;

    float radius = 0;  // of a disk or sphere
    float extent = 0;  // longest edge or radius, by whose rounding points on it are off
    Vec3 center{};     // of whatever has a surface
    float brightness = 0;  // mean of `light` over the channels
    // At a distance d it illuminates as much as `shown` / d^2, at most `most`, of its brightness; from behind `behind` of that.
    float shown = 1, most = 1, behind = 1;
    float full = 0, cutoff = 0;  // half angles of a spot
    Color light{};     // radiance, intensity or irradiance; the mean of a textured radiance
    ColorMap radiance; // of an area light
    Vec2 uv[3] = {};   // texture coordinates of the three corners p, p + u, p + v
    bool two_sided = false;
    int few = -1;  // its surface among few, as `Surface::few` names it

    bool is_delta() const { return kind >= Kind::point; }
};

struct LightSample {
    Vec3 direction;  // from the receiver, a unit vector
    float distance;  // infinity for parallel light
    Vec3 point;      // on the light, if it has a surface
    Vec3 normal;     // there, towards the receiver; zero if there is no surface
    Color light;     // radiance; for lights without extent the irradiance of a surface that faces them
    float pdf = 0;   // per solid angle, 1 without extent, 0 if there is no light
};

// A point on the light as seen from `from`. Rectangles and triangles that look large, and spheres, are sampled by solid
// angle, others by area.
LightSample sample_light(const Light& light, const std::vector<Texture>& textures, const Vec3& from, const Vec2& u);

// The density of the same choice, for a ray from `from` that met the light at `distance` along `direction`, where the
// light's unit normal is `normal`.
float light_pdf(const Light& light, const Vec3& from, const Vec3& direction, float distance, const Vec3& normal);

// Whether `sample_light` spreads its samples about evenly over the light as it looks from `from`: what a diffuse surface
// then makes of them is bounded.
bool is_sampled_evenly(const Light& light, const Vec3& from);

// Where there are no more lights than this, each of them is looked at to choose one.
constexpr size_t few_lights = 16;

// About the irradiance that the light gives to a surface at `from` that faces it, with nothing in between; positive.
inline float importance(const Light& light, const Vec3& from) {
    const float d2 = length_squared(light.center - from) + 1e-30f;
    const float side = dot(from - light.p, light.n) > 0 ? 1 : light.behind;
    return light.brightness * smaller(light.shown / d2, light.most) * side + 1e-30f;
}

}  // namespace oracle
