#include "integrator.h"

#include <limits>

#include "diffuse.h"

namespace oracle {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// From this reflection on a path may end by chance; from the later one on even if it has lost nothing, but so rarely that
// the variance stays finite wherever a reflection loses more than 0.05 %.
constexpr int roulette_from = 4, roulette_for_all_from = 1024;
constexpr float longest_survival = 0.999f;

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
    float reach;     // of the numbers behind p, which tells how far rounding may have moved it
    Frame frame;     // shading frame; in a medium, z is where the path came from
    Bsdf bsdf;
    Vec3 to_eye;     // local
    int few;         // the surface, as `Surface::few` names it

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
    BsdfSample sample(const Scene& scene, Strategy strategy, const Vec2& u, float choice) const {
        BsdfSample s;
        if (kind == Kind::medium) {
            s.to_light = sample_phase(scene.asymmetry, -frame.z, u);
            s.weight = white();
            s.pdf = phase_function(scene.asymmetry, -dot(frame.z, s.to_light));
            return s;
        }
        if (kind == Kind::meter) {
            s.to_light = square_to_cosine_hemisphere(u);
            s.weight = pi * white();
            s.pdf = s.to_light.z * inv_pi;
        } else if (strategy == Strategy::hemisphere && !bsdf.has_delta()) {
            // Both hemispheres where light can come through.
            const bool through = bsdf.transmits();
            s.to_light = through ? square_to_sphere(u) : square_to_hemisphere(u);
            s.pdf = through ? inv_pi / 4 : inv_pi / 2;
            s.weight = bsdf.evaluate(to_eye, s.to_light) / s.pdf;
        } else {
            s = bsdf.sample(to_eye, u, choice);
        }
        s.to_light = frame.to_world(s.to_light);
        return s;
    }

    bool is_diffuse() const {
        return kind == Kind::meter || (kind == Kind::surface && bsdf.material.kind == Material::Kind::diffuse);
    }

    Vec3 leave(const Vec3& direction) const {
        return kind == Kind::medium ? p : off_surface(p, normal, direction, reach);
    }
};

// Light that one emitter, chosen at random, sends to the vertex and on along the path, unless something is in between.
Connection sample_direct(const Scene& scene, const Vertex& vertex, Strategy strategy, Vec2 u) {
    float probability = 1;
    const int chosen = scene.select_light(vertex.p, u.x, probability);
    bool environment = scene.samples_environment && chosen == int(scene.lights.size());
    if (strategy == Strategy::light && scene.has_smooth_environment()) {
        // Without BSDF sampling it has to be looked for here: in half of the samples, if there is anything else.
        if (chosen < 0) {
            environment = true;
        } else {
            environment = u.y < 0.5f;
            u.y = environment ? 2 * u.y : 2 * u.y - 1;
            probability = environment ? 0.5f : 0.5f * probability;
        }
    }
    if (chosen < 0 && !environment) return {};

    LightSample s{};
    bool alone = false;  // whether nothing else finds this light
    if (environment) {
        s.direction = scene.environment.sample(u, s.pdf);
        s.light = scene.environment.radiance(s.direction);
        s.distance = infinity;
    } else {
        const Light& light = scene.lights[size_t(chosen)];
        s = sample_light(light, scene.textures, vertex.p, u);
        alone = light.is_delta() || (vertex.is_diffuse() && scene.leave_to_sampling(light, vertex.p));
    }
    if (!(s.pdf > 0) || is_black(s.light)) return {};
    const Color f = vertex.evaluate(scene, s.direction);
    if (is_black(f)) return {};

    const float pdf = s.pdf * probability;
    const float weight = strategy == Strategy::mis && !alone ? balance(pdf, vertex.pdf(scene, s.direction)) : 1;
    Connection result{vertex.leave(s.direction), s.direction, s.distance, weight / pdf * f * s.light, vertex.few};
    if (!environment) result.end = scene.lights[size_t(chosen)].few;
    if (scene.has_medium) result.light *= transmittance(scene, s.distance);
    // From beside the one surface to beside the other.
    if (std::isfinite(s.distance)) {
        const float reach = std::max(s.distance, scene.lights[size_t(chosen)].extent);
        const Vec3 d = off_surface(s.point, s.normal, s.normal, reach) - result.from;
        // Between ends that coincide there is nothing.
        const float distance = std::max(length(d), std::numeric_limits<float>::min());
        result.direction = d / distance;
        result.distance = distance * (1 - 2e-7f);
    }
    return result;
}

// The light's weight if a ray finds it; the other way would have been to sample it.
float weight_of_hit(const Scene& scene, Strategy strategy, const Path& path, const Surface& s) {
    if (path.delta) return 1;
    if (strategy != Strategy::mis) return strategy == Strategy::light ? 0 : 1;
    const Object& object = scene.objects[s.object];
    const int index = object.first_light + int(s.primitive);
    const Light& light = scene.lights[size_t(index)];
    if (path.diffuse && scene.leave_to_sampling(light, path.from)) return 0;
    const float other = light_pdf(light, path.from, path.ray.direction, s.distance, s.normal) *
                        scene.light_probability(path.from, index);
    return balance(path.pdf, other);
}

float weight_of_environment(const Scene& scene, Strategy strategy, const Path& path) {
    if (path.delta) return 1;
    if (strategy == Strategy::light) return 0;
    if (strategy != Strategy::mis || !scene.samples_environment) return 1;
    const float chosen = scene.light_probability(path.from, int(scene.lights.size()));
    return balance(path.pdf, scene.environment.pdf(path.ray.direction) * chosen);
}

// Distance at which the ray is scattered, and its throughput up to there or to the surface at `limit` that it reaches.
bool sample_medium(const Scene& scene, float limit, const Vec2& u, float& distance, Color& throughput) {
    const Color extinction = scene.absorption + scene.scattering;
    if (!scene.scatters) {
        throughput = transmittance(scene, limit);
        return false;
    }
    // By the extinction of one channel, chosen at random; the density is the mean of all of them.
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

// The numbers of one step of a path.
struct Draw {
    Vec2 light, direction, medium;
    float choice, roulette;
};

// The numbers of the same step of all paths of a batch: three blocks of the sampler, the later ones if they are needed.
struct Draws {
    Block first, second;
    float roulette[batch];

    void draw(const Scene& scene, const Sampler& sampler, uint32_t step) {
        sampler.draw(3 * step + 1, first);
        if (scene.needs_choices) sampler.draw(3 * step + 2, second);
        if (int(step) + 1 >= roulette_from) sampler.draw_alone(3 * step + 3, roulette);
    }

    Draw of(int i) const {
        return {{first.a[i], first.b[i]}, {first.c[i], first.d[i]}, {second.c[i], second.d[i]}, second.a[i], roulette[i]};
    }
};

// The next step from a vertex: a connection to a light and the ray on; false if the path ends.
bool scatter(const Scene& scene, const Method& method, Path& path, const Vertex& vertex, const Draw& draw,
             Connection& connection) {
    const bool samples_lights = method.strategy == Strategy::light || method.strategy == Strategy::mis;
    const bool smooth = vertex.kind == Vertex::Kind::surface && vertex.bsdf.is_delta();
    if (samples_lights && !smooth && path.bounce + 1 >= method.first_bounce) {
        connection = sample_direct(scene, vertex, method.strategy, draw.light);
        connection.light *= path.throughput;
    }
    path.diffuse = vertex.is_diffuse();
    // The last ray would find nothing that was not sampled.
    const bool mirrors = vertex.kind == Vertex::Kind::surface && vertex.bsdf.has_delta();
    if (path.bounce + 1 == method.bounces && !mirrors &&
        (method.strategy == Strategy::light ||
         (method.strategy == Strategy::mis && path.diffuse && scene.leaves_all_to_sampling(vertex.p))))
        return false;

    const BsdfSample next = vertex.sample(scene, method.strategy, draw.direction, draw.choice);
    path.throughput *= next.weight;
    if (is_black(path.throughput)) return false;
    path.delta = next.delta, path.pdf = next.pdf, path.bent *= next.bent;
    ++path.bounce;
    if (path.bounce >= roulette_from) {
        // What refraction did to the radiance on the way in it undoes on the way out, so that counts for nothing here.
        float survives = std::min(max_component(path.throughput) * path.bent, 1.0f);
        if (path.bounce >= roulette_for_all_from) survives = std::min(survives, longest_survival);
        if (survives < 1) {
            if (draw.roulette >= survives) return false;
            path.throughput *= 1 / survives;
        }
    }
    path.from = vertex.p;
    path.ray = {vertex.leave(next.to_light), next.to_light, vertex.few};
    return true;
}

// What the path finds where its ray leads: `s`, or nothing if not `hit`. False if it ends there, or is left to be followed
// with the other `diffuse` vertices, if there are any.
bool arrive(const Scene& scene, const Method& method, Path& path, bool hit, Surface& s, const Draw& draw,
            Connection& connection, DiffuseVertices* diffuse) {
    const Vec3 back = -path.ray.direction;
    if (scene.has_medium) {
        float distance;
        Color passed;
        const bool scattered = sample_medium(scene, hit ? s.distance : infinity, draw.medium, distance, passed);
        path.throughput *= passed;
        if (scattered) {
            if (path.bounce >= method.bounces) return false;
            const Vec3 p = path.ray.origin + distance * path.ray.direction;
            const Vertex vertex{Vertex::Kind::medium, p, {}, distance, Frame(back), scene.bsdf(s, 0), {0, 0, 1}, Few::none};
            return scatter(scene, method, path, vertex, draw, connection);
        }
    }
    const bool counts = path.bounce >= method.first_bounce;
    if (!hit) {
        if (counts && scene.environment.kind != Environment::Kind::none)
            path.result += weight_of_environment(scene, method.strategy, path) * path.throughput *
                           scene.environment.radiance(path.ray.direction);
        return false;
    }
    if (counts && scene.objects[s.object].emits) {
        const Color light = scene.emitted(s, back);
        if (!is_black(light)) path.result += weight_of_hit(scene, method.strategy, path, s) * path.throughput * light;
    }
    if (s.material < 0 || path.bounce >= method.bounces) return false;

    // The material of the side that the ray met, in a frame in which that side is up.
    int material = s.material;
    if (const Material& sides = scene.materials[size_t(material)]; sides.kind == Material::Kind::two_sided) {
        const bool front = dot(s.shading, back) > 0;
        material = front ? sides.first : sides.second;
        if (!front) s.shading = -s.shading;
    }
    const Bsdf bsdf = scene.bsdf(s, material);
    const float reach = std::max(s.distance, s.extent);
    // Rounding may have put the point behind another surface where two meet, but back along the ray there is none. Light
    // that is let through needs it where it is.
    const Vec3 before = s.p + rounding(s.p, s.distance) * back;
    if (diffuse && bsdf.material.kind == Material::Kind::diffuse) {
        const Color throughput = path.throughput * bsdf.material.reflectance.at(scene.textures, s.uv);
        diffuse->add({before, s.normal, s.shading, back, reach, throughput, path.bent, draw.light, draw.direction, draw.roulette});
        return false;
    }
    const Vec3 p = bsdf.transmits() ? s.p : before;
    const Frame frame(s.shading);
    const Vertex vertex{Vertex::Kind::surface, p, s.normal, reach, frame, bsdf, frame.to_local(back), s.few};
    return scatter(scene, method, path, vertex, draw, connection);
}

// The same for many diffuse vertices. The k-th one is at the surface `slots[k]`, whose path is `owners[slots[k]]`.
void scatter(const Scene& scene, const Method& method, DiffuseVertices& vertices, const int* slots, const int* owners,
             Path* paths, const Surface* surfaces, Connection* connections, int* alive, int& living) {
    const int bounce = paths[owners[slots[0]]].bounce + 1;
    if (bounce >= method.first_bounce) {
        vertices.connect(scene);
        for (int k = 0; k < vertices.size(); ++k) {
            Connection& c = connections[slots[k]];
            c = vertices.connection(k);
            c.begin = surfaces[slots[k]].few, c.end = scene.lights[size_t(vertices.chosen[k])].few;
        }
    }
    // The last ray would find nothing that was not sampled.
    const bool is_last = bounce == method.bounces;
    if (is_last && std::all_of(slots, slots + vertices.size(), [&](int k) { return scene.leaves_all_to_sampling(surfaces[k].p); }))
        return;
    vertices.reflect(bounce >= roulette_from, bounce >= roulette_for_all_from ? longest_survival : 1);
    for (int k = 0; k < vertices.size(); ++k) {
        Path& path = paths[owners[slots[k]]];
        path.throughput = vertices.throughput[k];
        if (is_black(path.throughput)) continue;
        path.ray = {vertices.origin[k], vertices.outgoing[k], surfaces[slots[k]].few};
        path.from = vertices.position(k);
        path.pdf = vertices.pdf[k], path.delta = false, path.diffuse = true;
        path.bounce = bounce;
        alive[living++] = owners[slots[k]];
    }
}

// An irradiance meter is a first vertex, at which light is reflected once more than is counted.
bool begin_at_meter(const Scene& scene, const Method& method, const Sensor& sensor, const Vec2& position, Path& path,
                    const Draw& draw, Connection& connection) {
    path.bounce = -1;
    const Vec3 p = sensor.point(position);
    const Surface nothing{};
    const Vertex vertex{Vertex::Kind::meter, p, sensor.forward, 0, Frame(sensor.forward), scene.bsdf(nothing, 0), {}, Few::none};
    return scatter(scene, method, path, vertex, draw, connection);
}

}  // namespace

void measure(const Scene& scene, const Sensor& sensor, const Film& film, const Method& method, int x, int y,
             const Sampler& sampler, int count, Color* results) {
    Path paths[batch];
    Surface surfaces[batch];
    Connection connections[batch];
    const bool at_meter = sensor.kind == Sensor::Kind::irradiance_meter;
    // The paths that go on.
    int alive[batch], living = 0;
    bool blocked[batch];

    // Diffuse surfaces are left for the end of each step, if that serves them.
    const bool is_plain = method.strategy == Strategy::mis && !scene.has_medium && scene.has_few_lights();
    DiffuseVertices diffuse;
    int diffuse_slots[batch];

    Block film_block;
    sampler.draw(0, film_block);
    uint32_t step = 0;
    Draws draws{};
    if (at_meter) {
        draws.draw(scene, sampler, step++);
        for (int i = 0; i < count; ++i) {
            connections[i].light = {};
            const Vec2 position = film_position(film, x, y, {film_block.a[i], film_block.b[i]});
            if (begin_at_meter(scene, method, sensor, position, paths[i], draws.of(i), connections[i])) alive[living++] = i;
        }
        scene.blocked(connections, count, true, blocked);
        for (int i = 0; i < count; ++i)
            if (!blocked[i]) paths[i].result += connections[i].light;
    } else {
        for (int i = 0; i < count; ++i) {
            paths[i].ray = sensor_ray(sensor, film_position(film, x, y, {film_block.a[i], film_block.b[i]}));
            alive[living++] = i;
        }
    }
    // Rays of a pixel, and those from where they arrive to a light, are close together; later ones are not.
    for (bool together = !at_meter; living > 0; together = false) {
        Ray rays[batch];
        bool hits[batch];
        for (int k = 0; k < living; ++k) rays[k] = paths[alive[k]].ray;
        scene.intersect(rays, living, together, surfaces, hits);
        // Paths that leave the scene need no numbers.
        if (scene.has_medium || std::any_of(hits, hits + living, [](bool hit) { return hit; })) draws.draw(scene, sampler, step);
        ++step;
        const int arrived = living;
        int owners[batch];
        living = 0;
        diffuse.clear();
        for (int k = 0; k < arrived; ++k) {
            const int i = owners[k] = alive[k], before = diffuse.size();
            connections[k].light = {};
            if (arrive(scene, method, paths[i], hits[k], surfaces[k], draws.of(i), connections[k], is_plain ? &diffuse : nullptr))
                alive[living++] = i;
            if (diffuse.size() > before) diffuse_slots[before] = k;
        }
        if (diffuse.size() > 0) scatter(scene, method, diffuse, diffuse_slots, owners, paths, surfaces, connections, alive, living);
        scene.blocked(connections, arrived, together, blocked);
        for (int k = 0; k < arrived; ++k)
            if (!blocked[k]) paths[owners[k]].result += connections[k].light;
    }
    for (int i = 0; i < count; ++i) results[i] = paths[i].result;
}

}  // namespace oracle
