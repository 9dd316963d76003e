#include "scene.h"

#include <limits>
#include <new>
#include <stdexcept>

namespace oracle {
namespace {

constexpr size_t few_lights = 16;

// Normals go with the inverse of the map, transposed: but for a positive factor its cofactors, turned over by mirroring,
// so that a mirrored object keeps its front.
Vec3 transformed_normal(const Affine& m, const Vec3& n) {
    const Vec3 a{m[0], m[4], m[8]}, b{m[1], m[5], m[9]}, c{m[2], m[6], m[10]};
    const Vec3 turned = n.x * cross(b, c) + n.y * cross(c, a) + n.z * cross(a, b);
    return dot(a, cross(b, c)) < 0 ? -turned : turned;
}

// Reorders as RTCRayHit wants it.
RTCRay make_ray(const Vec3& o, const Vec3& d, float t_far) {
    RTCRay ray;
    ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z;
    ray.tnear = 0;
    ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z;
    ray.time = 0;
    ray.tfar = t_far;
    ray.mask = ~0u;
    ray.id = 0;
    ray.flags = 0;
    return ray;
}

// Bounds that hold after rounding to single precision.
void set_bounds(RTCBounds* bounds, const Vec3& center, const Vec3& extent) {
    const auto grown = [](float c, float e) { return e + 4e-7f * (std::fabs(c) + e); };
    const Vec3 e{grown(center.x, extent.x), grown(center.y, extent.y), grown(center.z, extent.z)};
    bounds->lower_x = center.x - e.x, bounds->upper_x = center.x + e.x;
    bounds->lower_y = center.y - e.y, bounds->upper_y = center.y + e.y;
    bounds->lower_z = center.z - e.z, bounds->upper_z = center.z + e.z;
}

}  // namespace

// Spheres and disks, exact and in double precision: Embree calls these for each ray near them.
struct UserGeometry {
    using Geometry = Scene::Geometry;

    static void bounds(const RTCBoundsFunctionArguments* args) {
        const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
        const auto across = [&](float n) { return g.radius * safe_sqrt(1 - n * n); };
        const bool round = g.kind == Scene::Kind::sphere;
        const Vec3 extent = round ? Vec3{g.radius, g.radius, g.radius}
                                  : Vec3{across(g.normal.x), across(g.normal.y), across(g.normal.z)};
        set_bounds(args->bounds_o, g.center, extent);
    }

    // The nearest distance within (near, far), or infinity.
    static float distance(const Geometry& g, const RTCRay& ray) {
        constexpr float none = std::numeric_limits<float>::infinity();
        const double ox = double(ray.org_x) - g.center.x, oy = double(ray.org_y) - g.center.y,
                     oz = double(ray.org_z) - g.center.z;
        const double dx = ray.dir_x, dy = ray.dir_y, dz = ray.dir_z;
        const double r2 = double(g.radius) * g.radius;
        const auto inside = [&](double t) { return t > ray.tnear && t < ray.tfar; };
        if (g.kind == Scene::Kind::disk) {
            const double facing = dx * g.normal.x + dy * g.normal.y + dz * g.normal.z;
            if (facing == 0) return none;
            const double t = -(ox * g.normal.x + oy * g.normal.y + oz * g.normal.z) / facing;
            const double x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
            return inside(t) && x * x + y * y + z * z <= r2 ? float(t) : none;
        }
        // From the point of the ray that is nearest to the center, half a chord back or forth.
        const double d2 = dx * dx + dy * dy + dz * dz;
        const double middle = -(ox * dx + oy * dy + oz * dz) / d2;
        const double x = ox + middle * dx, y = oy + middle * dy, z = oz + middle * dz;
        const double h2 = (r2 - (x * x + y * y + z * z)) / d2;
        if (h2 < 0) return none;
        const double half = std::sqrt(h2);
        if (inside(middle - half)) return float(middle - half);
        return inside(middle + half) ? float(middle + half) : none;
    }

    static void intersect(const RTCIntersectFunctionNArguments* args) {
        if (!args->valid[0]) return;
        const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
        auto& query = *reinterpret_cast<RTCRayHit*>(args->rayhit);  // one ray at a time
        const float t = distance(g, query.ray);
        if (!(t < query.ray.tfar)) return;
        query.ray.tfar = t;
        query.hit.geomID = args->geomID;
        query.hit.primID = 0;
        query.hit.instID[0] = args->context->instID[0];
        query.hit.u = query.hit.v = 0;
    }

    static void occluded(const RTCOccludedFunctionNArguments* args) {
        if (!args->valid[0]) return;
        const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
        auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
        if (distance(g, ray) < ray.tfar) ray.tfar = -std::numeric_limits<float>::infinity();
    }
};

// One thread builds the hierarchy: its shape, and with it which of two triangles at the same distance is reported, must
// not depend on the machine.
Scene::Scene() : device_(rtcNewDevice("threads=1")) {
    if (!device_) throw std::runtime_error("Embree could not open a device");
    scene_.reset(rtcNewScene(device_.get()));
    check("create a scene");
    // Robust: a ray through a shared edge hits one of its triangles and never slips between them.
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    materials.emplace_back();  // black, for what has no material
}

void Scene::check(const char* what) const {
    const RTCError error = rtcGetDeviceError(device_.get());
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    throw std::runtime_error(std::string("Embree could not ") + what + " (error " + std::to_string(error) + ")");
}

int Scene::add_texture(Texture texture) {
    textures.push_back(std::move(texture));
    return int(textures.size()) - 1;
}

int Scene::add_material(const Material& material) {
    materials.push_back(material);
    if (material.kind == Material::Kind::plastic) materials.back().inner = internal_reflectance(material.ior);
    return int(materials.size()) - 1;
}

int Scene::add_object(const Object& object) {
    objects.push_back(object);
    return int(objects.size()) - 1;
}

void Scene::attach(RTCGeometry geometry, const Geometry& description) {
    geometries_.push_back(description);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_.get(), geometry, unsigned(geometries_.size()) - 1);
    check("add a shape");
}

Owned<RTCGeometry> Scene::make_mesh(const Mesh& mesh) const {
    Owned<RTCGeometry> geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    // Embree owns both copies, padded as its vector loads need it.
    auto* points = static_cast<Vec3*>(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                              sizeof(Vec3), mesh.vertices.size()));
    auto* indices = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh.triangles.size()));
    check("store a mesh");
    std::copy(mesh.vertices.begin(), mesh.vertices.end(), points);
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
    return geometry;
}

void Scene::add_mesh(int object, Mesh mesh) {
    const auto geometry = make_mesh(mesh);
    Geometry description{Kind::mesh, uint32_t(object)};
    add_area_lights(object, description, &mesh);
    // Corners are Embree's business; what is kept is looked up at hits.
    if (!mesh.normals.empty() || !mesh.uv.empty()) {
        mesh.vertices = {};
        meshes_.push_back(std::make_unique<Mesh>(std::move(mesh)));
        description.mesh = int(meshes_.size()) - 1;
    }
    attach(geometry.get(), description);
}

void Scene::add_rectangle(int object, const Vec3& corner, const Vec3& u, const Vec3& v) {
    const Owned<RTCGeometry> geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_QUAD));
    auto* points = static_cast<Vec3*>(
        rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), 4));
    auto* indices = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), 1));
    check("store a rectangle");
    const Vec3 corners[] = {corner, corner + u, corner + u + v, corner + v};
    std::copy(corners, corners + 4, points);
    for (uint32_t i = 0; i < 4; ++i) indices[i] = i;
    Geometry description{Kind::rectangle, uint32_t(object)};
    description.center = corner, description.u = u, description.v = v, description.normal = normalize(cross(u, v));
    add_area_lights(object, description, nullptr);
    attach(geometry.get(), description);
}

void Scene::add_disk(int object, const Vec3& center, const Vec3& normal, float radius) {
    Geometry description{Kind::disk, uint32_t(object)};
    description.center = center, description.normal = normalize(normal), description.radius = radius;
    add_area_lights(object, description, nullptr);
    attach(Owned<RTCGeometry>(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER)).get(), description);
}

void Scene::add_sphere(int object, const Vec3& center, float radius) {
    Geometry description{Kind::sphere, uint32_t(object)};
    description.center = center, description.radius = radius;
    add_area_lights(object, description, nullptr);
    attach(Owned<RTCGeometry>(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER)).get(), description);
}

void Scene::add_instances(int object, Mesh mesh, const std::vector<Affine>& transforms) {
    prototypes_.emplace_back(rtcNewScene(device_.get()));
    RTCScene prototype = prototypes_.back().get();
    rtcSetSceneFlags(prototype, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(prototype, RTC_BUILD_QUALITY_HIGH);
    const auto geometry = make_mesh(mesh);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(prototype, geometry.get());
    rtcCommitScene(prototype);
    check("build an instanced mesh");
    Geometry description{Kind::instance, uint32_t(object)};
    if (!mesh.normals.empty() || !mesh.uv.empty()) {
        mesh.vertices = {};
        meshes_.push_back(std::make_unique<Mesh>(std::move(mesh)));
        description.mesh = int(meshes_.size()) - 1;
    }
    for (const Affine& transform : transforms) {
        const Owned<RTCGeometry> instance(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(instance.get(), prototype);
        rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
        description.transform = transform;
        attach(instance.get(), description);
    }
}

void Scene::add_area_lights(int object, const Geometry& g, const Mesh* mesh) {
    Object& owner = objects[size_t(object)];
    if (!owner.emits) return;
    owner.first_light = int(lights.size());
    Light light{};
    light.radiance = owner.radiance;
    light.light = owner.radiance.texture < 0 ? owner.radiance.constant : textures[size_t(owner.radiance.texture)].average();
    light.two_sided = owner.two_sided;
    switch (g.kind) {
        case Kind::mesh:
            light.kind = Light::Kind::triangle;
            for (const Triangle& t : mesh->triangles) {
                light.p = mesh->vertices[t.a], light.u = mesh->vertices[t.b] - light.p, light.v = mesh->vertices[t.c] - light.p;
                const Vec3 normal = cross(light.u, light.v);
                light.area = 0.5f * length(normal);
                light.n = light.area > 0 ? normalize(normal) : Vec3{0, 0, 1};
                if (!mesh->uv.empty()) light.uv[0] = mesh->uv[t.a], light.uv[1] = mesh->uv[t.b], light.uv[2] = mesh->uv[t.c];
                lights.push_back(light);
            }
            return;
        case Kind::rectangle:
            light.kind = Light::Kind::rectangle;
            light.p = g.center, light.u = g.u, light.v = g.v, light.n = g.normal;
            light.area = length(cross(g.u, g.v));
            light.uv[1] = {1, 0}, light.uv[2] = {0, 1};
            break;
        case Kind::disk: {
            const Frame frame(g.normal);
            light.kind = Light::Kind::disk;
            light.p = g.center, light.u = g.radius * frame.x, light.v = g.radius * frame.y, light.n = g.normal;
            light.radius = g.radius, light.area = pi * squared(g.radius);
            break;
        }
        default:
            light.kind = Light::Kind::sphere;
            light.p = g.center, light.radius = g.radius, light.area = 4 * pi * squared(g.radius);
    }
    lights.push_back(light);
}

void Scene::add_light(const Light& light) { lights.push_back(light); }

void Scene::set_environment(Environment e) {
    environment = std::move(e);
    environment.build();
}

void Scene::set_medium(const Color& absorption_in, const Color& scattering_in, float asymmetry_in) {
    absorption = absorption_in, scattering = scattering_in, asymmetry = asymmetry_in;
    has_medium = true;
    scatters = !is_black(scattering);
}

void Scene::commit() {
    // Only now do the descriptions of user geometries stay where they are.
    for (size_t i = 0; i < geometries_.size(); ++i) {
        if (geometries_[i].kind != Kind::disk && geometries_[i].kind != Kind::sphere) continue;
        RTCGeometry geometry = rtcGetGeometry(scene_.get(), unsigned(i));
        rtcSetGeometryUserPrimitiveCount(geometry, 1);
        rtcSetGeometryUserData(geometry, &geometries_[i]);
        rtcSetGeometryBoundsFunction(geometry, UserGeometry::bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry, UserGeometry::intersect);
        rtcSetGeometryOccludedFunction(geometry, UserGeometry::occluded);
        rtcCommitGeometry(geometry);
    }
    rtcCommitScene(scene_.get());
    check("build the scene");

    samples_environment = !environment.is_smooth();
    environment_importance_ = pi * mean(environment.mean_radiance()) + 1e-30f;
    double sum = 0;
    std::vector<double> cumulated;
    for (const Light& l : lights) cumulated.push_back(sum += std::max(mean(l.light) * (l.is_delta() ? 1 : l.area), 1e-30f));
    // A fifth of the samples, whatever the sizes in the scene.
    if (samples_environment) cumulated.push_back(sum += std::max(0.25 * sum, 1e-30));
    for (const double c : cumulated) light_cdf_.push_back(float(c / sum));
    if (!light_cdf_.empty()) light_cdf_.back() = 1;
}

bool Scene::intersect(const Ray& ray, Surface& s) const {
    RTCRayHit query;
    query.ray = make_ray(ray.origin, ray.direction, std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    closest_hit(scene_.get(), query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;

    const bool is_instance = query.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
    const Geometry& g = geometries_[is_instance ? query.hit.instID[0] : query.hit.geomID];
    s.distance = query.ray.tfar;
    s.p = ray.origin + s.distance * ray.direction;
    s.object = g.object;
    s.primitive = query.hit.primID;
    s.material = objects[g.object].material;
    switch (g.kind) {
        case Kind::disk:
            s.normal = s.shading = g.normal;
            s.p = s.p - dot(s.p - g.center, g.normal) * g.normal;
            return true;
        case Kind::sphere:
            s.normal = s.shading = normalize(s.p - g.center);
            s.p = g.center + g.radius * s.normal;
            return true;
        case Kind::rectangle:
            s.normal = s.shading = g.normal;
            s.uv = {query.hit.u, query.hit.v};
            return true;
        case Kind::mesh:
        case Kind::instance: break;
    }
    Vec3 normal{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
    if (is_instance) normal = transformed_normal(g.transform, normal);
    s.normal = s.shading = normalize(normal);
    if (g.mesh < 0) return true;
    const Mesh& mesh = *meshes_[size_t(g.mesh)];
    const Triangle& t = mesh.triangles[s.primitive];
    const float b = query.hit.u, c = query.hit.v, a = 1 - b - c;
    if (!mesh.uv.empty()) {
        const Vec2 &p = mesh.uv[t.a], &q = mesh.uv[t.b], &r = mesh.uv[t.c];
        s.uv = {a * p.x + b * q.x + c * r.x, a * p.y + b * q.y + c * r.y};
    }
    if (!mesh.normals.empty()) {
        Vec3 n = a * mesh.normals[t.a] + b * mesh.normals[t.b] + c * mesh.normals[t.c];
        if (is_instance) n = transformed_normal(g.transform, n);
        const float l = length(n);
        if (l > 0) s.shading = n / l;
    }
    return true;
}

bool Scene::blocked(const Vec3& from, const Vec3& direction, float distance) const {
    RTCRay ray = make_ray(from, direction, distance);
    any_hit(scene_.get(), ray);
    return ray.tfar < 0;
}

Color Scene::emitted(const Surface& s, const Vec3& towards) const {
    const Object& object = objects[s.object];
    if (!object.emits || (!object.two_sided && dot(s.normal, towards) <= 0)) return {};
    return object.radiance.at(textures, s.uv);
}

int Scene::select_light(const Vec3& from, float& u, float& probability) const {
    const size_t count = light_cdf_.size();
    if (count == 0) return -1;
    probability = 1;
    if (count == 1) return 0;
    float weights[few_lights];
    const float* cdf = light_cdf_.data();
    if (count <= few_lights) {
        float sum = 0;
        for (size_t i = 0; i < lights.size(); ++i) weights[i] = sum += importance(lights[i], from);
        if (samples_environment) weights[count - 1] = sum += environment_importance_;
        for (size_t i = 0; i < count; ++i) weights[i] /= sum;
        cdf = weights;
    }
    const size_t i = std::min<size_t>(size_t(std::upper_bound(cdf, cdf + count, u) - cdf), count - 1);
    const float before = i ? cdf[i - 1] : 0;
    probability = cdf[i] - before;
    u = std::clamp((u - before) / probability, 0.0f, 0x1.fffffep-1f);
    return int(i);
}

float Scene::light_probability(const Vec3& from, int light) const {
    const size_t count = light_cdf_.size();
    if (count <= 1) return 1;
    const auto i = size_t(light);
    if (count > few_lights) return light_cdf_[i] - (i ? light_cdf_[i - 1] : 0);
    float sum = 0, before = 0, until = 0;
    for (size_t k = 0; k < count; ++k) {
        const bool distant = samples_environment && k == count - 1;
        sum += distant ? environment_importance_ : importance(lights[k], from);
        if (k + 1 == i) before = sum;
        if (k == i) until = sum;
    }
    return until / sum - before / sum;
}

bool Scene::leave_to_sampling(const Light& light, const Vec3& from) const {
    return light_cdf_.size() <= few_lights && is_sampled_evenly(light, from);
}

}  // namespace oracle
