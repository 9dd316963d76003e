// How much light arrives along a path that begins at the sensor.
#pragma once

#include "sampler.h"
#include "scene.h"
#include "sensor.h"

namespace oracle {

// How the light that reaches a surface is looked for.
enum class Strategy {
    light,       // on the emitters
    bsdf,        // where the surface reflects; misses emitters without extent
    hemisphere,  // everywhere the same
    mis,         // on the emitters and where the surface reflects, weighed against each other (Veach 1997)
};

struct Method {
    Strategy strategy = Strategy::mis;
    int first_bounce = 0;  // light that was reflected fewer times is left out
    int bounces = 1 << 30;  // more reflections than this are not followed
};

// Radiance, or irradiance at a meter, of one sample of pixel (x, y).
Color measure(const Scene& scene, const Sensor& sensor, const Film& film, const Method& method, int x, int y,
              Sampler& sampler);

// The ray through a point of the film; not for an irradiance meter.
Ray sensor_ray(const Sensor& sensor, const Vec2& film_position);

}  // namespace oracle
