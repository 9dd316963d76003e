// A scene that is ready to be rendered: geometry in Embree, materials, lights. Frozen once committed.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "embree_compat.h"
#include "environment.h"
#include "few.h"
#include "light.h"
#include "material.h"

namespace oracle {

struct Triangle {
    uint32_t a, b, c;
};

using Affine = std::array<float, 12>;  // row by row, 3 x 4

struct Mesh {
    std::vector<Vec3> vertices, normals;  // normals may be empty
    std::vector<Vec2> uv;                 // may be empty
    std::vector<Triangle> triangles;
};

// What all surfaces of one geometry share.
struct Object {
    int material = -1;
    int first_light = -1;  // the light of its first triangle, or its only one
    bool emits = false, two_sided = false;
    ColorMap radiance;
};

struct Ray {
    Vec3 origin, direction;  // a unit vector
    int begin = Few::none;   // the surface on which it begins, as `Surface::few` names it
};

// Where a ray met a surface.
struct Surface {
    Vec3 p;
    Vec3 normal;   // geometric, of the front
    Vec3 shading;  // interpolated, of the front
    Vec2 uv;
    float distance;
    float extent;  // of the shape, as for a light
    uint32_t object, primitive;
    int material;  // -1 is black
    int few;       // its name among few surfaces, `Few::none` if it is not one of them
};

// Light that comes from somewhere if nothing is in between. Its ends are off their surfaces.
struct Connection {
    Vec3 from, direction;  // a unit vector
    float distance;
    Color light;
    int begin = Few::none, end = Few::none;  // the surfaces at its ends, as `Surface::few` names them
};

class Scene {
public:
    Scene();

    int add_texture(Texture texture);
    int add_material(const Material& material);
    int add_object(const Object& object);  // the index for one of the following, which takes it
    void add_mesh(int object, Mesh mesh);
    void add_rectangle(int object, const Vec3& corner, const Vec3& u, const Vec3& v);
    void add_disk(int object, const Vec3& center, const Vec3& normal, float radius);
    void add_sphere(int object, const Vec3& center, float radius);
    void add_instances(int object, Mesh mesh, const std::vector<Affine>& transforms);
    void add_light(const Light& light);
    void set_environment(Environment environment);
    void set_medium(const Color& absorption, const Color& scattering, float asymmetry);
    // Few surfaces are searched without Embree, unless `hierarchy` asks for it.
    void commit(bool hierarchy = false);

    // The nearest surface beyond the ray's origin; false if there is none.
    bool intersect(const Ray& ray, Surface& surface) const;
    // The same for many rays, eight at once if `together`.
    void intersect(const Ray* rays, int count, bool together, Surface* surfaces, bool* hits) const;
    // Which connections something blocks; those without light count as blocked.
    void blocked(const Connection* connections, int count, bool together, bool* result) const;

    Bsdf bsdf(const Surface& surface, int material) const {
        return {materials, textures, materials[size_t(material)], surface.uv};
    }
    Color emitted(const Surface& surface, const Vec3& towards) const;

    // A light in proportion to its importance at `from`, the probability of that, and the same for a given light. `u` in
    // [0, 1) becomes uniform anew.
    int select_light(const Vec3& from, float& u, float& probability) const;
    float light_probability(const Vec3& from, int light) const;
    // Whether a diffuse surface at `from` had better leave the light to being sampled: it would only gain noise.
    bool leave_to_sampling(const Light& light, const Vec3& from) const;
    bool leaves_all_to_sampling(const Vec3& from) const;
    // Whether all that is selected are a few emitters of constant radiance.
    bool has_few_lights() const;
    bool has_smooth_environment() const { return environment.kind != Environment::Kind::none && !samples_environment; }

    std::vector<Texture> textures;
    std::vector<Material> materials;
    std::vector<Object> objects;
    std::vector<Light> lights;
    Environment environment;
    Color absorption{}, scattering{};
    float asymmetry = 0;
    bool has_medium = false, scatters = false;
    bool needs_choices = false;        // whether a medium or a material decides between ways to go on
    bool samples_environment = false;  // whether the environment is one of the lights to be selected, the last one

    RTCScene embree() const { return scene_.get(); }

private:
    enum class Kind { mesh, rectangle, disk, sphere, instance };
    // What is known of each of Embree's geometries, by their number.
    struct Geometry {
        Kind kind;
        uint32_t object;
        int mesh = -1;  // whose normals and texture coordinates to look up
        Vec3 center{}, u{}, v{}, normal{};
        float radius = 0;
        float extent = 0;  // longest edge or radius
        Affine transform{};
    };
    friend struct UserGeometry;

    // What Embree tells of a hit, and this scene's own search among few surfaces.
    struct Hit {
        float distance, u, v;
        Vec3 normal;  // of any length; untransformed, if on an instance
        uint32_t geometry, primitive;
        int few;
    };
    bool complete(const Ray& ray, const Few::Hit& found, Hit& hit) const;
    bool is_blocked_by_round(const Connection& connection) const;
    void describe(const Ray& ray, const Hit& hit, Surface& surface) const;
    void add_flat(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram, uint32_t primitive);
    void attach(RTCGeometry geometry, const Geometry& description);
    Owned<RTCGeometry> make_mesh(const Mesh& mesh) const;
    void add_area_lights(int object, const Geometry& geometry, const Mesh* mesh);
    void check(const char* what) const;

    Owned<RTCDevice> device_;  // before the scene: members die in reverse order
    Owned<RTCScene> scene_;
    std::vector<Owned<RTCScene>> prototypes_;
    std::vector<Geometry> geometries_;
    std::vector<std::unique_ptr<Mesh>> meshes_;
    // If there are so few surfaces that they need no hierarchy: flat ones with the geometry and primitive that they are, and
    // the numbers of round ones.
    struct Flat {
        uint32_t geometry, primitive;
        Vec3 normal;
    };
    bool is_small_ = true;
    Few few_;
    std::vector<Flat> flat_;
    std::vector<uint32_t> round_;
    std::vector<float> light_cdf_;  // by power, where there are too many to look at each
    float environment_importance_ = 0;
};

// More than rounding can have moved a point that was computed from numbers as large as `reach`.
inline float rounding(const Vec3& p, float reach) { return 5e-7f * larger(largest(p), smaller(reach, 1e18f)); }

// Off a surface, to the side where `direction` points, by more than rounding can have moved the point.
inline Vec3 off_surface(const Vec3& p, const Vec3& normal, const Vec3& direction, float reach) {
    const float step = rounding(p, reach);
    return p + (dot(normal, direction) < 0 ? -step : step) * normal;
}

}  // namespace oracle
