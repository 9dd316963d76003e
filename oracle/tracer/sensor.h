// Where the measured light arrives: cameras and meters.
#pragma once

#include "vec.h"

namespace oracle {

struct Film {
    int width, height;
    float gaussian;  // standard deviation [pixels] of the pixel filter, 0 for a box
};

struct Sensor {
    enum class Kind { perspective, orthographic, irradiance_meter, radiance_meter };
    Kind kind;
    Vec3 origin;   // of the rays; for an irradiance meter the upper left corner of its surface
    Vec3 forward;  // unit vector along the middle ray, or the surface's normal
    Vec3 right, down;  // from one edge of the film to the other, at distance 1 for a perspective

    // A point of the film in [0, 1]^2 (beyond it for wide filters), from the upper left corner.
    Vec3 point(const Vec2& f) const { return origin + f.x * right + f.y * down; }
};

// Where on the film a sample of pixel (x, y) lies: distributed as the pixel's filter, so that all samples weigh the same.
inline Vec2 film_position(const Film& film, int x, int y, Vec2 u) {
    float dx = u.x, dy = u.y;
    if (film.gaussian > 0) {
        // Box and Muller (1958), cut off where the radius is 4 standard deviations.
        constexpr float cut = 3.3546263e-4f;  // exp(-4^2 / 2)
        const float radius = film.gaussian * std::sqrt(-2 * std::log(1 - u.x * (1 - cut)));
        dx = 0.5f + radius * std::cos(2 * pi * u.y);
        dy = 0.5f + radius * std::sin(2 * pi * u.y);
    }
    return {(float(x) + dx) / float(film.width), (float(y) + dy) / float(film.height)};
}

}  // namespace oracle
