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

// What is known of a path: where it is, and the light found so far.
struct Path {
    Color result{}, throughput{1, 1, 1};
    Ray ray{};
    int bounce = 0;
    Vec3 from{};           // the vertex before, where the ray was chosen
    float pdf = 0;         // with which it was
    bool delta = true;     // if there was no choice
    bool diffuse = false;  // whether that vertex scatters evenly
    float bent = 1;        // product of the squared relative indices that were passed
};

// The radiance, or the irradiance at a meter, of the first `count` samples of a batch of pixel (x, y).
void measure(const Scene& scene, const Sensor& sensor, const Film& film, const Method& method, int x, int y,
             const Sampler& sampler, int count, Color* results);

// The ray through a point of the film; not for an irradiance meter.
inline Ray sensor_ray(const Sensor& sensor, const Vec2& f) {
    switch (sensor.kind) {
        case Sensor::Kind::perspective:
            return {sensor.origin, normalize(sensor.forward + (f.x - 0.5f) * sensor.right + (f.y - 0.5f) * sensor.down)};
        case Sensor::Kind::orthographic: return {sensor.point({f.x - 0.5f, f.y - 0.5f}), sensor.forward};
        default: return {sensor.origin, sensor.forward};
    }
}

}  // namespace oracle
