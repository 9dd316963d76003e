#include "integrator.h"

#include <limits>

namespace oracle {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// From this reflection on a path may end by chance; from the later one on even if it has lost nothing.
constexpr int roulette_from = 4, roulette_for_all_from = 128;

float balance(float a, float b) { return a / (a + b); }

Color transmittance(const Scene& scene, float distance) {
    if (!scene.has_medium) return white();
    const Color s = scene.absorption + scene.scattering;
    return {std::exp(-s.x * distance), std::exp(-s.y * distance), std::exp(-s.z * distance)};
}

// Henyey and Greenstein (1941); `cosine` is that of the angle by which light is turned.
float phase_function(float g, float cosine) {
    const float d = 1 + g * g - 2 * g * cosine;
    return inv_pi / 4 * (1 - g * g) / (d * std::sqrt(d));
}

Vec3 sample_phase(float g, const Vec3& forward, const Vec2& u) {
    float cosine = 1 - 2 * u.x;
    if (std::fabs(g) > 1e-3f) {
        const float s = (1 - g * g) / (1 + g - 2 * g * u.x);
        cosine = std::clamp((1 + g * g - s * s) / (2 * g), -1.0f, 1.0f);
    }
    const float sine = safe_sqrt(1 - cosine * cosine), phi = 2 * pi * u.y;
    return Frame(forward).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine});
}

// Where a path may turn: on a surface, inside the medium, or at an irradiance meter.
struct Vertex {
    enum class Kind { surface, medium, meter };
    Kind kind;
    Vec3 p, normal;
    float distance;  // that the ray came from, which tells how far rounding may have moved p
    Frame frame;     // shading frame; in a medium, z is where the path came from
    Bsdf bsdf;
    Vec3 to_eye;     // local

    Color evaluate(const Scene& scene, const Vec3& world) const {
        if (kind == Kind::medium) return phase_function(scene.asymmetry, -dot(frame.z, world)) * white();
        const Vec3 w = frame.to_local(world);
        if (kind == Kind::meter) return std::max(w.z, 0.0f) * white();
        return bsdf.evaluate(to_eye, w);
    }

    float pdf(const Scene& scene, const Vec3& world) const {
        if (kind == Kind::medium) return phase_function(scene.asymmetry, -dot(frame.z, world));
        const Vec3 w = frame.to_local(world);
        return kind == Kind::meter ? std::max(w.z, 0.0f) * inv_pi : bsdf.pdf(to_eye, w);
    }

    // The direction is in world space.
    BsdfSample sample(const Scene& scene, Strategy strategy, Sampler& sampler) const {
        BsdfSample s;
        if (kind == Kind::medium) {
            s.to_light = sample_phase(scene.asymmetry, -frame.z, sampler.next_2d());
            s.weight = white();
            s.pdf = phase_function(scene.asymmetry, -dot(frame.z, s.to_light));
            return s;
        }
        if (kind == Kind::meter) {
            s.to_light = square_to_cosine_hemisphere(sampler.next_2d());
            s.weight = pi * white();
            s.pdf = s.to_light.z * inv_pi;
        } else if (strategy == Strategy::hemisphere && !bsdf.has_delta()) {
            // Both hemispheres where light can come through.
            const bool through = bsdf.transmits();
            s.to_light = through ? square_to_sphere(sampler.next_2d()) : square_to_hemisphere(sampler.next_2d());
            s.pdf = through ? inv_pi / 4 : inv_pi / 2;
            s.weight = bsdf.evaluate(to_eye, s.to_light) / s.pdf;
        } else {
            s = bsdf.sample(to_eye, sampler);
        }
        s.to_light = frame.to_world(s.to_light);
        return s;
    }

    bool is_diffuse() const {
        return kind == Kind::meter || (kind == Kind::surface && bsdf.material.kind == Material::Kind::diffuse);
    }

    Vec3 leave(const Vec3& direction) const {
        return kind == Kind::medium ? p : off_surface(p, normal, direction, distance);
    }
};

// Light that one emitter, chosen at random, sends to the vertex and on along the path.
Color sample_direct(const Scene& scene, const Vertex& vertex, Strategy strategy, Sampler& sampler) {
    Vec2 u = sampler.next_2d();
    float probability;
    const bool sky = scene.environment.kind != Environment::Kind::none && !scene.samples_environment &&
                     strategy == Strategy::light;
    int chosen = scene.select_light(vertex.p, u.x, probability);
    bool environment = scene.samples_environment && chosen == int(scene.lights.size());
    if (sky) {
        // Without BSDF sampling a smooth environment has to be looked for as well: in half of the samples.
        const bool both = chosen >= 0;
        if (both) u.y = u.y < 0.5f ? 2 * u.y : (environment = true, 2 * u.y - 1);
        if (!both) environment = true, probability = 1;
        if (both && environment) probability = 0.5f;
        if (both && !environment) probability *= 0.5f;
    }
    if (chosen < 0 && !environment) return {};

    LightSample s{};
    bool delta = false;
    if (environment) {
        s.direction = scene.environment.sample(u, s.pdf);
        s.light = scene.environment.radiance(s.direction);
        s.distance = infinity;
    } else {
        const Light& light = scene.lights[size_t(chosen)];
        s = sample_light(light, scene.textures, vertex.p, u);
        delta = light.is_delta();
    }
    if (!(s.pdf > 0) || is_black(s.light)) return {};
    const Color f = vertex.evaluate(scene, s.direction);
    if (is_black(f)) return {};

    // From beside the one surface to beside the other.
    const Vec3 from = vertex.leave(s.direction);
    Vec3 direction = s.direction;
    float distance = s.distance;
    if (std::isfinite(distance)) {
        const bool has_surface = !delta;
        const Vec3 target = has_surface ? off_surface(s.point, s.normal, s.normal, s.distance) : s.point;
        const Vec3 d = target - from;
        distance = length(d);
        direction = d / distance;
        distance *= 1 - 2e-7f;
    }
    if (scene.blocked(from, direction, distance)) return {};

    const float pdf = s.pdf * probability;
    float weight = 1;
    const bool alone = delta || (!environment && vertex.is_diffuse() &&
                                 scene.leave_to_sampling(scene.lights[size_t(chosen)], vertex.p));
    if (strategy == Strategy::mis && !alone) weight = balance(pdf, vertex.pdf(scene, s.direction));
    Color result = weight / pdf * f * s.light;
    if (scene.has_medium) result *= transmittance(scene, s.distance);
    return result;
}

// The light's weight if a ray that was sampled with density `pdf` finds it: the other way would be to sample it.
float weight_of_hit(const Scene& scene, Strategy strategy, const Vec3& from, bool from_diffuse, const Ray& ray,
                    const Surface& s, float pdf) {
    if (strategy != Strategy::mis) return strategy == Strategy::light ? 0 : 1;
    const Object& object = scene.objects[s.object];
    const int index = object.first_light + int(s.primitive);
    const Light& light = scene.lights[size_t(index)];
    if (from_diffuse && scene.leave_to_sampling(light, from)) return 0;
    const float other = light_pdf(light, from, ray.direction, s.distance, s.normal) * scene.light_probability(from, index);
    return balance(pdf, other);
}

// Distance at which the ray is scattered, and its throughput up to there or to the surface at `limit` that it reaches.
bool sample_medium(const Scene& scene, float limit, Sampler& sampler, float& distance, Color& throughput) {
    const Color extinction = scene.absorption + scene.scattering;
    if (!scene.scatters) {
        throughput = transmittance(scene, limit);
        return false;
    }
    // By the extinction of one channel, chosen at random; the density is the mean of all of them.
    const Vec2 u = sampler.next_2d();
    const float chosen = u.x < 1.0f / 3 ? extinction.x : u.x < 2.0f / 3 ? extinction.y : extinction.z;
    distance = chosen > 0 ? -std::log(1 - u.y) / chosen : infinity;
    if (distance >= limit) {
        const Color t = transmittance(scene, limit);
        throughput = t / mean(t);
        return false;
    }
    const Color t = transmittance(scene, distance);
    throughput = t * scene.scattering / mean(extinction * t);
    return true;
}

}  // namespace

Ray sensor_ray(const Sensor& sensor, const Vec2& f) {
    switch (sensor.kind) {
        case Sensor::Kind::perspective:
            return {sensor.origin, normalize(sensor.forward + (f.x - 0.5f) * sensor.right + (f.y - 0.5f) * sensor.down)};
        case Sensor::Kind::orthographic: return {sensor.point({f.x - 0.5f, f.y - 0.5f}), sensor.forward};
        default: return {sensor.origin, sensor.forward};
    }
}

Color measure(const Scene& scene, const Sensor& sensor, const Film& film, const Method& method, int x, int y,
              Sampler& sampler) {
    const Vec2 position = film_position(film, x, y, sampler.next_2d());
    const Strategy strategy = method.strategy;
    Color result{}, throughput = white();
    const bool meter = sensor.kind == Sensor::Kind::irradiance_meter;
    Ray ray = meter ? Ray{sensor.point(position), -sensor.forward} : sensor_ray(sensor, position);
    Vec3 from = ray.origin;  // the vertex before
    float pdf = 0;           // with which it chose the ray
    bool delta = true;       // ... if it had a choice
    bool diffuse = false;    // whether it scattered evenly
    float bent = 1;
    // An irradiance meter is a first vertex at which light is reflected once more than is counted.
    int bounce = meter ? -1 : 0;

    for (bool at_meter = meter;; at_meter = false) {
        Surface s{};
        Vertex::Kind kind = Vertex::Kind::meter;
        float distance = 0;
        if (at_meter) {
            s.p = from, s.normal = s.shading = sensor.forward, s.material = -1;
        } else {
            kind = Vertex::Kind::surface;
            const bool hit = scene.intersect(ray, s);
            if (scene.has_medium) {
                Color passed;
                if (sample_medium(scene, hit ? s.distance : infinity, sampler, distance, passed)) kind = Vertex::Kind::medium;
                throughput *= passed;
            }
            if (kind == Vertex::Kind::medium) {
                s.p = ray.origin + distance * ray.direction;
                s.material = -1;
            } else {
                distance = s.distance;
                if (!hit) {
                    if (scene.environment.kind == Environment::Kind::none || bounce < method.first_bounce) return result;
                    float weight = 1;
                    if (!delta && strategy == Strategy::light) weight = 0;
                    if (!delta && strategy == Strategy::mis && scene.samples_environment)
                        weight = balance(pdf, scene.environment.pdf(ray.direction) *
                                                  scene.light_probability(from, int(scene.lights.size())));
                    return result + weight * throughput * scene.environment.radiance(ray.direction);
                }
                if (scene.objects[s.object].emits && bounce >= method.first_bounce) {
                    const Color light = scene.emitted(s, -ray.direction);
                    if (!is_black(light)) {
                        const float weight = delta ? 1 : weight_of_hit(scene, strategy, from, diffuse, ray, s, pdf);
                        result += weight * throughput * light;
                    }
                }
                if (s.material < 0) return result;
            }
            if (bounce >= method.bounces) return result;
        }
        if (is_black(throughput)) return result;

        // The material of the side that the ray met, in a frame in which that side is up.
        const Vec3 back = -ray.direction;
        int material = std::max(s.material, 0);
        if (kind == Vertex::Kind::surface && scene.materials[size_t(material)].kind == Material::Kind::two_sided) {
            const Material& sides = scene.materials[size_t(material)];
            const bool front = dot(s.shading, back) > 0;
            material = front ? sides.first : sides.second;
            if (!front) s.shading = -s.shading;
        }
        const Vec3& z = kind == Vertex::Kind::medium ? back : s.shading;
        const Frame frame(z);
        const Vertex vertex{kind, s.p, s.normal, distance, frame, scene.bsdf(s, material), frame.to_local(back)};

        const bool sampled = kind != Vertex::Kind::surface || !vertex.bsdf.is_delta();
        if (sampled && (strategy == Strategy::light || strategy == Strategy::mis) && bounce + 1 >= method.first_bounce)
            result += throughput * sample_direct(scene, vertex, strategy, sampler);

        const BsdfSample next = vertex.sample(scene, strategy, sampler);
        throughput *= next.weight;
        if (is_black(throughput)) return result;
        delta = next.delta, pdf = next.pdf, bent *= next.bent, diffuse = vertex.is_diffuse();
        ++bounce;
        // What refraction did to the radiance on the way in it undoes on the way out, so that counts for nothing here.
        if (bounce >= roulette_from) {
            float survives = std::min(max_component(throughput) * bent, 1.0f);
            if (bounce >= roulette_for_all_from) survives = std::min(survives, 0.95f);
            if (survives < 1) {
                if (sampler.next_1d() >= survives) return result;
                throughput *= 1 / survives;
            }
        }
        from = s.p;
        ray = {vertex.leave(next.to_light), next.to_light};
    }
}

}  // namespace oracle
