#include "diffuse.h"

#include <iterator>
#include <limits>

namespace oracle {
namespace {

// The emitters that were chosen, for each path its own.
struct Emitters {
    Lanes3 p, u, v, n, radiance;
    float area[batch], radius[batch], full[batch], cutoff[batch], extent[batch];
    int kind[batch], two_sided[batch];

    void set(int i, const Light& l) {
        p.set(i, l.p), u.set(i, l.u), v.set(i, l.v), n.set(i, l.n);
        radiance.set(i, l.is_delta() ? l.light : l.radiance.constant);
        area[i] = l.area, radius[i] = l.radius, full[i] = l.full, cutoff[i] = l.cutoff, extent[i] = l.extent;
        kind[i] = int(l.kind), two_sided[i] = l.two_sided;
    }
    Patch patch(int i) const { return {p[i], u[i], v[i], n[i], area[i]}; }
};

// Points on them, as of `EmitterSample`.
struct Samples {
    Lanes3 point, normal;
    float pdf[batch];

    void set(int i, const EmitterSample& s) { point.set(i, s.point), normal.set(i, s.normal), pdf[i] = s.pdf; }
    void copy(int i, const Samples& s) { point.set(i, s.point[i]), normal.set(i, s.normal[i]), pdf[i] = s.pdf[i]; }
};

// Samples of one kind, for all paths; those of other kinds are meaningless.
using Sample = void (*)(const Emitters&, const Lanes3& from, const float* u, const float* v, int count, Samples&);

EmitterSample on_patch(const Patch& patch, const PatchSample& at) {
    return {patch.p + at.s * patch.u + at.t * patch.v, patch.n, at.pdf};
}

ORACLE_FOR_WIDE_VECTORS
void sample_rectangles(const Emitters& e, const Lanes3& from, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, on_patch(e.patch(i), sample_rectangle(e.patch(i), from[i], u[i], v[i])));
}

ORACLE_FOR_WIDE_VECTORS
void sample_triangles(const Emitters& e, const Lanes3& from, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, on_patch(e.patch(i), sample_triangle(e.patch(i), from[i], u[i], v[i])));
}

ORACLE_FOR_WIDE_VECTORS
void sample_disks(const Emitters& e, const Lanes3&, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const Vec2 at = square_to_disk({u[i], v[i]});
        samples.set(i, on_patch(e.patch(i), {at.x, at.y, 0}));
    }
}

ORACLE_FOR_WIDE_VECTORS
void sample_spheres(const Emitters& e, const Lanes3& from, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, sample_sphere(e.p[i], e.radius[i], from[i], u[i], v[i]));
}

// The density makes up for what their intensity gives at that distance and angle.
ORACLE_FOR_WIDE_VECTORS
void sample_points(const Emitters& e, const Lanes3& from, const float*, const float*, int count, Samples& samples) {
    constexpr int spot = int(Light::Kind::spot);
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const Vec3 d = from[i] - e.p[i], n = e.n[i];
        const float falloff = spot_falloff(e.full[i], e.cutoff[i], length(cross(d, n)), dot(d, n));
        const float part = e.kind[i] == spot ? falloff : 1;
        samples.set(i, {e.p[i], {0, 0, 0}, length_squared(d) / part});
    }
}

// As points at distance 1.
ORACLE_FOR_WIDE_VECTORS
void sample_directional(const Emitters& e, const Lanes3& from, const float*, const float*, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, {from[i] - e.n[i], {0, 0, 0}, 1});
}

// In the order of `Light::Kind`.
constexpr Sample sample_kind[] = {sample_triangles, sample_rectangles, sample_disks,      sample_spheres,
                                  sample_points,    sample_points,     sample_directional};
constexpr int kinds = int(std::size(sample_kind));

// The importance of one emitter at all of the points, added to that of those before.
ORACLE_FOR_WIDE_VECTORS
void add_importance(const Light& light, const Lanes3& from, int count, const float* before, float* after) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) after[i] = before[i] + importance(light, from[i]);
}

// Turns numbers in [0, 1) into the emitters at such parts of the sums, and into where in between they lie.
ORACLE_FOR_WIDE_VECTORS
void select(const float (*sums)[batch], int lights, int count, float* u, int* chosen, float* probability) {
    float at[batch], below[batch], above[batch];
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        at[i] = u[i] * sums[lights][i];
        below[i] = 0, above[i] = sums[lights][i], chosen[i] = lights - 1;
    }
    for (int k = lights - 1; k > 0; --k)
        ORACLE_INDEPENDENT
        for (int i = 0; i < count; ++i) {
            const bool before = at[i] < sums[k][i];
            above[i] = before ? sums[k][i] : above[i];
            chosen[i] = before ? k - 1 : chosen[i];
        }
    for (int k = 1; k < lights; ++k)
        ORACLE_INDEPENDENT
        for (int i = 0; i < count; ++i) below[i] = at[i] < sums[k][i] ? below[i] : sums[k][i];
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const float width = above[i] - below[i];
        probability[i] = width / sums[lights][i];
        u[i] = smaller(larger((at[i] - below[i]) / width, 0.0f), 0x1.fffffep-1f);
    }
}

}  // namespace

void DiffuseVertices::add(const Vertex& vertex) {
    const int i = count_++;
    p_.set(i, vertex.p), normal_.set(i, vertex.normal), shading_.set(i, vertex.shading), to_eye_.set(i, vertex.to_eye);
    throughput.set(i, vertex.throughput);
    reach_[i] = vertex.reach, bent_[i] = vertex.bent;
    light_u_[i] = vertex.light.x, light_v_[i] = vertex.light.y, u_[i] = vertex.direction.x, v_[i] = vertex.direction.y;
    roulette_[i] = vertex.roulette;
}

void DiffuseVertices::choose(const std::vector<Light>& lights) {
    float sums[few_lights + 1][batch] = {};
    const int count = int(lights.size());
    for (int k = 0; k < count; ++k) add_importance(lights[size_t(k)], p_, padded(count_), sums[k], sums[k + 1]);
    select(sums, count, padded(count_), light_u_, chosen, probability_);
}

void DiffuseVertices::connect(const Scene& scene) {
    choose(scene.lights);
    const int count = padded(count_);
    Emitters emitters;
    bool any[kinds] = {};
    for (int i = 0; i < count; ++i) {
        emitters.set(i, scene.lights[size_t(chosen[i])]);
        any[emitters.kind[i]] = true;
    }
    Samples samples, others;
    bool first = true;
    for (int kind = 0; kind < kinds; ++kind) {
        if (!any[kind]) continue;
        sample_kind[kind](emitters, p_, light_u_, light_v_, count, first ? samples : others);
        for (int i = 0; !first && i < count; ++i)
            if (emitters.kind[i] == kind) samples.copy(i, others);
        first = false;
    }

    constexpr int disk = int(Light::Kind::disk), sphere = int(Light::Kind::sphere), directional = int(Light::Kind::directional);
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const int kind = emitters.kind[i];
        const Vec3 p = p_[i], point = samples.point[i], n = samples.normal[i], there = point - p;
        const float d2 = length_squared(there), d = std::sqrt(d2), facing = -dot(there, n) / d;
        const float cosine = dot(shading_[i], there) / d;
        const bool by_area = !(samples.pdf[i] > 0), has_sides = (kind <= disk) | by_area;
        const bool shines = (d > 0) & (!has_sides | (facing > 0) | ((facing < 0) & (emitters.two_sided[i] != 0)));
        const float density = probability_[i] * (by_area ? d2 / (std::fabs(facing) * emitters.area[i]) : samples.pdf[i]);
        // The density of what was chosen by area varies: unless it is far away, reflection finds a share of its light.
        const bool is_near = (kind == disk) & !is_far(emitters.area[i], length_squared(emitters.p[i] - p));
        const bool shared = is_near | ((kind == sphere) & by_area);
        const bool reflects = (cosine > 0) & (dot(shading_[i], to_eye_[i]) > 0);
        const float weight = cosine * inv_pi / (density + (shared ? cosine * inv_pi : 0));
        light.set(i, (shines & reflects ? weight : 0) * throughput[i] * emitters.radiance[i]);

        // From beside the one surface to beside the other.
        const Vec3 start = off_surface(p, normal_[i], there, reach_[i]);
        const Vec3 end = off_surface(point, n, -there, larger(d, emitters.extent[i]));
        const Vec3 way = end - start;
        // Between ends that coincide there is nothing.
        const float length_of_way = larger(length(way), std::numeric_limits<float>::min());
        const bool is_distant = kind == directional;
        const Vec3 towards = way / length_of_way;
        from.set(i, start);
        to_light.set(i, {is_distant ? there.x : towards.x, is_distant ? there.y : towards.y, is_distant ? there.z : towards.z});
        distance[i] = is_distant ? std::numeric_limits<float>::infinity() : length_of_way * (1 - 2e-7f);
    }
}

void DiffuseVertices::reflect(bool may_end, float longest) {
    const int count = padded(count_);
    const float at_least = may_end ? 0 : 1;
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const Vec3 local = square_to_cosine_hemisphere({u_[i], v_[i]});
        const Frame frame(shading_[i]);
        const Vec3 w = frame.to_world(local);
        outgoing.set(i, w);
        origin.set(i, off_surface(p_[i], normal_[i], w, reach_[i]));
        pdf[i] = local.z * inv_pi;
        const float survives = larger(smaller(max_component(throughput[i]) * bent_[i], longest), at_least);
        const bool goes_on = (roulette_[i] < survives) & (dot(shading_[i], to_eye_[i]) > 0);
        throughput.set(i, (goes_on ? 1 / survives : 0) * throughput[i]);
    }
}

}  // namespace oracle
