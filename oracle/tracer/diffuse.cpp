#include "diffuse.h"

#include <limits>

namespace oracle {
namespace {

// The emitters that were chosen, for each path its own.
struct Patches {
    Lanes3 p, u, v, n, radiance;
    float area[batch], extent[batch], other_side[batch];  // 1 if the back shines too

    Patch operator[](int i) const { return {p[i], u[i], v[i], n[i], area[i]}; }
};

struct Samples {
    float s[batch], t[batch], pdf[batch];

    void set(int i, const PatchSample& sample) { s[i] = sample.s, t[i] = sample.t, pdf[i] = sample.pdf; }
};

ORACLE_FOR_WIDE_VECTORS
void sample_rectangles(const Patches& patches, const Lanes3& from, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, sample_rectangle(patches[i], from[i], u[i], v[i]));
}

ORACLE_FOR_WIDE_VECTORS
void sample_triangles(const Patches& patches, const Lanes3& from, const float* u, const float* v, int count, Samples& samples) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) samples.set(i, sample_triangle(patches[i], from[i], u[i], v[i]));
}

// The importance of one emitter at all of the points, added to that of those before.
ORACLE_FOR_WIDE_VECTORS
void add_importance(const Light& light, const Lanes3& from, int count, const float* before, float* after) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) after[i] = before[i] + importance_of_patch(light, from[i]);
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
    Patches patches;
    bool triangle[batch], any[2] = {};
    const int count = padded(count_);
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const Light& l = scene.lights[size_t(chosen[i])];
        patches.p.set(i, l.p), patches.u.set(i, l.u), patches.v.set(i, l.v), patches.n.set(i, l.n);
        patches.radiance.set(i, l.radiance.constant);
        patches.area[i] = l.area, patches.extent[i] = l.extent, patches.other_side[i] = l.two_sided ? 1 : 0;
        triangle[i] = l.kind == Light::Kind::triangle;
        any[triangle[i]] = true;
    }
    Samples samples, others;
    if (any[true]) sample_triangles(patches, p_, light_u_, light_v_, count, samples);
    if (any[false]) sample_rectangles(patches, p_, light_u_, light_v_, count, any[true] ? others : samples);
    for (int i = 0; any[0] && any[1] && i < count; ++i)
        if (!triangle[i]) samples.set(i, {others.s[i], others.t[i], others.pdf[i]});

    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const Vec3 p = p_[i], n = patches.n[i];
        const Vec3 point = patches.p[i] + samples.s[i] * patches.u[i] + samples.t[i] * patches.v[i];
        const Vec3 there = point - p;
        const float d2 = length_squared(there), d = std::sqrt(d2), facing = -dot(there, n) / d;
        const float by_area = d2 / (std::fabs(facing) * patches.area[i]);
        const float density = (samples.pdf[i] > 0 ? samples.pdf[i] : by_area) * probability_[i];
        const float cosine = dot(shading_[i], there) / d;
        const bool shines = (d > 0) & ((facing > 0) | ((facing < 0) & (patches.other_side[i] > 0)));
        const bool reflects = (cosine > 0) & (dot(shading_[i], to_eye_[i]) > 0);
        const float weight = shines & reflects ? cosine * inv_pi / density : 0;
        light.set(i, weight * throughput[i] * patches.radiance[i]);

        // From beside the one surface to beside the other.
        const Vec3 start = off_surface(p, normal_[i], there, reach_[i]);
        const Vec3 end = off_surface(point, n, -there, larger(d, patches.extent[i]));
        const Vec3 way = end - start;
        // Between ends that coincide there is nothing.
        const float length_of_way = larger(length(way), std::numeric_limits<float>::min());
        from.set(i, start);
        to_light.set(i, way / length_of_way);
        distance[i] = length_of_way * (1 - 2e-7f);
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
