#include "scene.h"

#include <limits>
#include <new>
#include <stdexcept>

namespace oracle {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

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

float longest_edge(const Mesh& mesh) {
    float longest2 = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t.a], &b = mesh.vertices[t.b], &c = mesh.vertices[t.c];
        longest2 = std::max({longest2, length_squared(b - a), length_squared(c - b), length_squared(a - c)});
    }
    return std::sqrt(longest2);
}

// By how much the map lengthens edges, at most.
float stretch(const Affine& m) {
    return std::sqrt(squared(m[0]) + squared(m[1]) + squared(m[2]) + squared(m[4]) + squared(m[5]) + squared(m[6]) +
                     squared(m[8]) + squared(m[9]) + squared(m[10]));
}

// The k-th of eight rays.
template <typename Rays>
void set_ray(Rays& rays, int k, const Vec3& o, const Vec3& d, float t_far) {
    rays.org_x[k] = o.x, rays.org_y[k] = o.y, rays.org_z[k] = o.z;
    rays.tnear[k] = 0;
    rays.dir_x[k] = d.x, rays.dir_y[k] = d.y, rays.dir_z[k] = d.z;
    rays.time[k] = 0;
    rays.tfar[k] = t_far;
    rays.mask[k] = ~0u;
    rays.id[k] = rays.flags[k] = 0;
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

    // The nearest distance above 0 and below `limit`, or infinity.
    static float distance(const Geometry& g, const Vec3& origin, const Vec3& direction, float limit) {
        const double ox = double(origin.x) - g.center.x, oy = double(origin.y) - g.center.y, oz = double(origin.z) - g.center.z;
        const double dx = direction.x, dy = direction.y, dz = direction.z;
        const double r2 = double(g.radius) * g.radius;
        const auto inside = [&](double t) { return t > 0 && t < limit; };
        if (g.kind == Scene::Kind::disk) {
            const double facing = dx * g.normal.x + dy * g.normal.y + dz * g.normal.z;
            if (facing == 0) return infinity;
            const double t = -(ox * g.normal.x + oy * g.normal.y + oz * g.normal.z) / facing;
            const double x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
            return inside(t) && x * x + y * y + z * z <= r2 ? float(t) : infinity;
        }
        // From the point of the ray that is nearest to the center, half a chord back or forth.
        const double per_length2 = 1 / (dx * dx + dy * dy + dz * dz);
        const double middle = -(ox * dx + oy * dy + oz * dz) * per_length2;
        const double x = ox + middle * dx, y = oy + middle * dy, z = oz + middle * dz;
        const double h2 = (r2 - (x * x + y * y + z * z)) * per_length2;
        if (h2 < 0) return infinity;
        const double half = std::sqrt(h2);
        if (inside(middle - half)) return float(middle - half);
        return inside(middle + half) ? float(middle + half) : infinity;
    }

    static float distance(const Geometry& g, const RTCRay& ray) {
        return distance(g, {ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tfar);
    }

    static void intersect(const RTCIntersectFunctionNArguments* args) {
        const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
        RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
        RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
        for (unsigned i = 0; i < args->N; ++i) {
            if (!args->valid[i]) continue;
            const RTCRay ray = rtcGetRayFromRayN(rays, args->N, i);
            const float t = distance(g, ray);
            if (!(t < ray.tfar)) continue;
            RTCRayN_tfar(rays, args->N, i) = t;
            RTCHitN_geomID(hits, args->N, i) = args->geomID;
            RTCHitN_primID(hits, args->N, i) = 0;
            RTCHitN_instID(hits, args->N, i, 0) = args->context->instID[0];
            RTCHitN_u(hits, args->N, i) = RTCHitN_v(hits, args->N, i) = 0;
            RTCHitN_Ng_x(hits, args->N, i) = RTCHitN_Ng_y(hits, args->N, i) = RTCHitN_Ng_z(hits, args->N, i) = 0;
        }
    }

    static void occluded(const RTCOccludedFunctionNArguments* args) {
        const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
        for (unsigned i = 0; i < args->N; ++i) {
            if (!args->valid[i]) continue;
            const RTCRay ray = rtcGetRayFromRayN(args->ray, args->N, i);
            if (distance(g, ray) < ray.tfar) RTCRayN_tfar(args->ray, args->N, i) = -infinity;
        }
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
    is_small_ &= mesh.triangles.size() + few_.size() <= Few::most;
    for (uint32_t i = 0; is_small_ && i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        add_flat(mesh.vertices[t.a], mesh.vertices[t.b], mesh.vertices[t.c], false, i);
    }
    Geometry description{Kind::mesh, uint32_t(object)};
    description.extent = longest_edge(mesh);
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
    description.extent = std::max(length(u), length(v));
    add_area_lights(object, description, nullptr);
    is_small_ &= few_.size() < Few::most;
    if (is_small_) add_flat(corners[0], corners[1], corners[3], true, 0);
    attach(geometry.get(), description);
}

// To be called before the geometry is attached.
void Scene::add_flat(const Vec3& a, const Vec3& b, const Vec3& c, bool parallelogram, uint32_t primitive) {
    few_.add(a, b, c, parallelogram);
    flat_.push_back({uint32_t(geometries_.size()), primitive, normalize(cross(b - a, c - a))});
}

void Scene::add_disk(int object, const Vec3& center, const Vec3& normal, float radius) {
    Geometry description{Kind::disk, uint32_t(object)};
    description.center = center, description.normal = normalize(normal);
    description.radius = description.extent = radius;
    add_area_lights(object, description, nullptr);
    attach(Owned<RTCGeometry>(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_USER)).get(), description);
}

void Scene::add_sphere(int object, const Vec3& center, float radius) {
    Geometry description{Kind::sphere, uint32_t(object)};
    description.center = center, description.radius = description.extent = radius;
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
    const float longest = longest_edge(mesh);
    if (!mesh.normals.empty() || !mesh.uv.empty()) {
        mesh.vertices = {};
        meshes_.push_back(std::make_unique<Mesh>(std::move(mesh)));
        description.mesh = int(meshes_.size()) - 1;
    }
    is_small_ = false;
    for (const Affine& transform : transforms) {
        const Owned<RTCGeometry> instance(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(instance.get(), prototype);
        rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
        description.transform = transform;
        description.extent = longest * stretch(transform);
        attach(instance.get(), description);
    }
}

void Scene::add_area_lights(int object, const Geometry& g, const Mesh* mesh) {
    Object& owner = objects[size_t(object)];
    if (!owner.emits) return;
    owner.first_light = int(lights.size());
    Light light{};
    light.radiance = owner.radiance;
    light.extent = g.extent;
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
                light.center = light.p + (1.0f / 3) * (light.u + light.v);
                add_light(light);
            }
            return;
        case Kind::rectangle:
            light.kind = Light::Kind::rectangle;
            light.p = g.center, light.u = g.u, light.v = g.v, light.n = g.normal;
            light.area = length(cross(g.u, g.v));
            light.center = g.center + 0.5f * (g.u + g.v);
            light.uv[1] = {1, 0}, light.uv[2] = {0, 1};
            break;
        case Kind::disk: {
            const Frame frame(g.normal);
            light.kind = Light::Kind::disk;
            light.p = g.center, light.u = g.radius * frame.x, light.v = g.radius * frame.y, light.n = g.normal;
            light.radius = g.radius, light.area = pi * squared(g.radius);
            light.center = g.center;
            break;
        }
        default:
            light.kind = Light::Kind::sphere;
            light.p = light.center = g.center, light.radius = g.radius, light.area = 4 * pi * squared(g.radius);
    }
    add_light(light);
}

void Scene::add_light(const Light& light) {
    lights.push_back(light);
    Light& added = lights.back();
    added.brightness = mean(light.light);
    // Surfaces give no more than the hemisphere would. Parallel light is the same everywhere.
    const bool is_sphere = light.kind == Light::Kind::sphere;
    added.shown = light.kind == Light::Kind::directional ? infinity : light.is_delta() ? 1 : is_sphere ? light.area / 4 : light.area;
    added.most = light.kind == Light::Kind::directional ? 1 : light.is_delta() ? infinity : pi;
    added.behind = light.is_delta() || is_sphere || light.two_sided ? 1 : 0;
}

void Scene::set_environment(Environment e) {
    environment = std::move(e);
    environment.build();
}

void Scene::set_medium(const Color& absorption_in, const Color& scattering_in, float asymmetry_in) {
    absorption = absorption_in, scattering = scattering_in, asymmetry = asymmetry_in;
    has_medium = true;
    scatters = !is_black(scattering);
}

void Scene::commit(bool hierarchy) {
    is_small_ &= !hierarchy;
    // Only now do the descriptions of user geometries stay where they are.
    for (size_t i = 0; i < geometries_.size(); ++i) {
        if (geometries_[i].kind != Kind::disk && geometries_[i].kind != Kind::sphere) continue;
        round_.push_back(uint32_t(i));
        is_small_ &= round_.size() <= Few::most / 4;
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

    for (size_t i = 0; is_small_ && i < flat_.size(); ++i) {
        const Object& owner = objects[geometries_[flat_[i].geometry].object];
        if (owner.emits) lights[size_t(owner.first_light) + flat_[i].primitive].few = few_.screen_of(int(i));
    }

    needs_choices = has_medium || std::any_of(materials.begin(), materials.end(), [](const Material& m) {
                        using Kind = Material::Kind;
                        return m.kind == Kind::dielectric || m.kind == Kind::rough_dielectric || m.kind == Kind::plastic ||
                               m.kind == Kind::mix;
                    });
    samples_environment = !environment.is_smooth();
    environment_importance_ = pi * mean(environment.mean_radiance()) + 1e-30f;
    double sum = 0;
    std::vector<double> cumulated;
    for (const Light& l : lights) cumulated.push_back(sum += std::max(l.brightness * (l.is_delta() ? 1 : l.area), 1e-30f));
    // A fifth of the samples, whatever the sizes in the scene.
    if (samples_environment) cumulated.push_back(sum += std::max(0.25 * sum, 1e-30));
    for (const double c : cumulated) light_cdf_.push_back(float(c / sum));
    if (!light_cdf_.empty()) light_cdf_.back() = 1;
}

// What a search among the few flat surfaces has found, unless a round one is nearer.
bool Scene::complete(const Ray& ray, const Few::Hit& found, Hit& hit) const {
    hit.distance = float(found.distance), hit.u = found.u, hit.v = found.v;
    hit.few = Few::none;
    if (found.index != Few::none) {
        const Flat& flat = flat_[size_t(found.index)];
        hit.normal = flat.normal, hit.geometry = flat.geometry, hit.primitive = flat.primitive;
        hit.few = few_.screen_of(found.index);
    }
    bool any = found.index != Few::none;
    for (const uint32_t i : round_) {
        const float t = UserGeometry::distance(geometries_[i], ray.origin, ray.direction, hit.distance);
        if (!(t < hit.distance)) continue;
        hit.distance = t, hit.geometry = i, hit.primitive = 0, hit.few = Few::none;
        any = true;
    }
    return any;
}

bool Scene::is_blocked_by_round(const Connection& c) const {
    return std::any_of(round_.begin(), round_.end(), [&](uint32_t i) {
        return UserGeometry::distance(geometries_[i], c.from, c.direction, c.distance) < c.distance;
    });
}

bool Scene::intersect(const Ray& ray, Surface& s) const {
    Hit hit;
    if (is_small_) {
        if (!complete(ray, few_.closest(ray.origin, ray.direction, infinity), hit)) return false;
        describe(ray, hit, s);
        return true;
    }
    RTCRayHit query;
    query.ray = make_ray(ray.origin, ray.direction, infinity);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    closest_hit(scene_.get(), query);
    const RTCHit& h = query.hit;
    if (h.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    const uint32_t geometry = h.instID[0] == RTC_INVALID_GEOMETRY_ID ? h.geomID : h.instID[0];
    describe(ray, {query.ray.tfar, h.u, h.v, {h.Ng_x, h.Ng_y, h.Ng_z}, geometry, h.primID, Few::none}, s);
    return true;
}

void Scene::intersect(const Ray* rays, int count, bool together, Surface* surfaces, bool* hits) const {
    for (int first = 0; is_small_ && first < count; first += Few::side_by_side) {
        Few::Rays eight;
        Few::Hit found[Few::side_by_side];
        for (int k = 0; k < Few::side_by_side; ++k) {
            const Ray& ray = rays[std::min(first + k, count - 1)];
            eight.set(k, ray.origin, ray.direction, infinity, ray.begin, Few::none);
        }
        few_.closest(eight, found);
        for (int k = 0; k < Few::side_by_side && first + k < count; ++k) {
            const int i = first + k;
            Hit hit;
            hits[i] = complete(rays[i], found[k], hit);
            if (hits[i]) describe(rays[i], hit, surfaces[i]);
        }
    }
    for (int i = 0; !is_small_ && !together && i < count; ++i) hits[i] = intersect(rays[i], surfaces[i]);
    for (int first = 0; !is_small_ && together && first < count; first += 8) {
        alignas(32) int valid[8];
        RTCRayHit8 query;
        for (int k = 0; k < 8; ++k) {
            const int i = first + k;
            valid[k] = i < count ? -1 : 0;
            set_ray(query.ray, k, rays[valid[k] ? i : first].origin, rays[valid[k] ? i : first].direction, infinity);
            query.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
            query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        }
        closest_hit8(scene_.get(), valid, query);
        for (int k = 0; k < 8; ++k) {
            if (!valid[k]) continue;
            const int i = first + k;
            hits[i] = query.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
            if (!hits[i]) continue;
            const auto& h = query.hit;
            const uint32_t instance = h.instID[0][k], geometry = instance == RTC_INVALID_GEOMETRY_ID ? h.geomID[k] : instance;
            const Vec3 normal{h.Ng_x[k], h.Ng_y[k], h.Ng_z[k]};
            describe(rays[i], {query.ray.tfar[k], h.u[k], h.v[k], normal, geometry, h.primID[k], Few::none}, surfaces[i]);
        }
    }
}

void Scene::describe(const Ray& ray, const Hit& hit, Surface& s) const {
    const Geometry& g = geometries_[hit.geometry];
    s.distance = hit.distance;
    s.p = ray.origin + s.distance * ray.direction;
    s.object = g.object;
    s.extent = g.extent;
    s.primitive = hit.primitive;
    s.material = objects[g.object].material;
    s.few = hit.few;
    switch (g.kind) {
        case Kind::disk:
            s.normal = s.shading = g.normal;
            s.p = s.p - dot(s.p - g.center, g.normal) * g.normal;
            return;
        case Kind::sphere:
            s.normal = s.shading = normalize(s.p - g.center);
            s.p = g.center + g.radius * s.normal;
            return;
        case Kind::rectangle:
            s.normal = s.shading = g.normal;
            s.uv = {hit.u, hit.v};
            return;
        case Kind::mesh:
        case Kind::instance: break;
    }
    const bool is_instance = g.kind == Kind::instance;
    const Vec3 normal = is_instance ? transformed_normal(g.transform, hit.normal) : hit.normal;
    s.normal = s.shading = hit.few == Few::none ? normalize(normal) : normal;
    if (g.mesh < 0) return;
    const Mesh& mesh = *meshes_[size_t(g.mesh)];
    const Triangle& t = mesh.triangles[s.primitive];
    const float b = hit.u, c = hit.v, a = 1 - b - c;
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
}

void Scene::blocked(const Connection* connections, int count, bool together, bool* result) const {
    if (is_small_) {
        int chosen[Few::side_by_side], waiting = 0;
        for (int i = 0; i < count; ++i) {
            result[i] = is_black(connections[i].light) || is_blocked_by_round(connections[i]);
            if (!result[i]) chosen[waiting++] = i;
            if (waiting == 0 || (waiting < Few::side_by_side && i + 1 < count)) continue;
            Few::Rays eight;
            bool found[Few::side_by_side];
            for (int k = 0; k < Few::side_by_side; ++k) {
                const Connection& c = connections[chosen[std::min(k, waiting - 1)]];
                eight.set(k, c.from, c.direction, c.distance, c.begin, c.end);
            }
            few_.blocked(eight, found);
            for (int k = 0; k < waiting; ++k) result[chosen[k]] = found[k];
            waiting = 0;
        }
        return;
    }
    for (int i = 0; !together && i < count; ++i) {
        const Connection& c = connections[i];
        result[i] = is_black(c.light);
        if (result[i]) continue;
        RTCRay ray = make_ray(c.from, c.direction, c.distance);
        any_hit(scene_.get(), ray);
        result[i] = ray.tfar < 0;
    }
    for (int first = 0; together && first < count; first += 8) {
        alignas(32) int valid[8];
        RTCRay8 query;
        bool any = false;
        for (int k = 0; k < 8; ++k) {
            const int i = first + k;
            valid[k] = i < count && !is_black(connections[i].light) ? -1 : 0;
            any |= valid[k] != 0;
            const Connection nothing{};
            const Connection& c = valid[k] ? connections[i] : nothing;
            set_ray(query, k, c.from, c.direction, c.distance);
        }
        if (any) any_hit8(scene_.get(), valid, query);
        for (int k = 0; k < 8 && first + k < count; ++k) result[first + k] = !valid[k] || query.tfar[k] < 0;
    }
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
    float cumulated[few_lights];
    const float* cdf = light_cdf_.data();
    float sum = 1;
    if (count <= few_lights) {
        sum = 0;
        for (size_t i = 0; i < lights.size(); ++i) cumulated[i] = sum += importance(lights[i], from);
        if (samples_environment) cumulated[count - 1] = sum += environment_importance_;
        cdf = cumulated;
    }
    const float at = u * sum;
    const size_t i = std::min<size_t>(size_t(std::upper_bound(cdf, cdf + count, at) - cdf), count - 1);
    const float before = i ? cdf[i - 1] : 0, width = cdf[i] - before;
    probability = width / sum;
    u = std::clamp((at - before) / width, 0.0f, 0x1.fffffep-1f);
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
    return (until - before) / sum;
}

bool Scene::leave_to_sampling(const Light& light, const Vec3& from) const {
    return light_cdf_.size() <= few_lights && is_sampled_evenly(light, from);
}

bool Scene::has_few_lights() const {
    return !lights.empty() && lights.size() <= few_lights && !samples_environment &&
           std::all_of(lights.begin(), lights.end(), [](const Light& l) { return l.radiance.texture < 0; });
}

bool Scene::leaves_all_to_sampling(const Vec3& from) const {
    return environment.kind == Environment::Kind::none && light_cdf_.size() <= few_lights &&
           std::all_of(lights.begin(), lights.end(), [&](const Light& l) { return is_sampled_evenly(l, from); });
}

}  // namespace oracle
