// Light from infinitely far away: constant, a sky, or a map of texels.
#pragma once

#include <vector>

#include "vec.h"

namespace oracle {

struct Environment {
    enum class Kind { none, constant, sky, map };
    Kind kind = Kind::none;
    Color horizon{}, zenith{};  // of a sky, linear in the sine of the elevation; `horizon` is the constant, too
    Vec3 up{0, 0, 1}, front{1, 0, 0}, left{0, 1, 0};
    int width = 0, height = 0;
    std::vector<Color> texels;

    Color radiance(const Vec3& direction) const;

    // Directions with a density that is proportional to the texels' power, or uniform; `u` becomes a direction.
    Vec3 sample(Vec2 u, float& pdf) const;
    float pdf(const Vec3& direction) const;

    // Whether BSDF sampling finds it so well that sampling it would only add noise.
    bool is_smooth() const { return kind != Kind::map; }
    Color mean_radiance() const;

    // Prepares `sample` of a map; to be called once the texels are there.
    void build();

private:
    size_t texel_at(const Vec3& direction) const;
    float texel_solid_angle(size_t row) const;
    std::vector<float> row_cdf_, column_cdf_;  // cumulated power, of the rows and within each of them
};

}  // namespace oracle
