// Reflection by diffuse surfaces under a few emitters, for the paths of a batch at once: what scenes mostly consist of.
// It is what the integrator does for one path at any surface, as loops that compilers make vectors of.
#pragma once

#include "clones.h"
#include "sampler.h"
#include "scene.h"

namespace oracle {

// Vectors of many paths, component by component.
struct Lanes3 {
    float x[batch], y[batch], z[batch];

    Vec3 operator[](int i) const { return {x[i], y[i], z[i]}; }
    void set(int i, const Vec3& v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

class DiffuseVertices {
public:
    struct Vertex {
        Vec3 p, normal, shading, to_eye;
        float reach;       // of the numbers behind p
        Color throughput;  // with what the surface reflects
        float bent;        // as of the path
        Vec2 light, direction;
        float roulette;
    };

    int size() const { return count_; }
    void clear() { count_ = 0; }
    void add(const Vertex& vertex);

    // Makes connections to emitters.
    ORACLE_FOR_WIDE_VECTORS void connect(const Scene& scene);
    // Chooses where the paths go on. Where they may end, they survive with at most the probability `longest`.
    ORACLE_FOR_WIDE_VECTORS void reflect(bool may_end, float longest);

    Vec3 position(int i) const { return p_[i]; }
    Connection connection(int i) const { return {from[i], to_light[i], distance[i], light[i]}; }

    // What `connect` finds: `chosen` is the emitter, `light` is black if there is none.
    Lanes3 from, to_light, light;
    float distance[batch];
    int chosen[batch];
    // What `reflect` finds: black if the path ends.
    Lanes3 origin, outgoing, throughput;
    float pdf[batch];

private:
    void choose(const std::vector<Light>& lights);

    int count_ = 0;
    Lanes3 p_, normal_, shading_, to_eye_;
    float reach_[batch], bent_[batch], light_u_[batch], light_v_[batch], u_[batch], v_[batch], roulette_[batch];
    float probability_[batch];
};

}  // namespace oracle
