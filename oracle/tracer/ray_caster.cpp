#include "ray_caster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>

namespace oracle {
namespace {

// Raises what Embree recorded since the last check, if anything.
void check(RTCDevice device, const char* what) {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    throw std::runtime_error(std::string("Embree could not ") + what + " (error " + std::to_string(error) + ")");
}

RTCDevice new_device() {
    // One thread builds the hierarchy: its shape, and with it which of two triangles at the same
    // distance is reported, must not depend on the machine.
    RTCDevice device = rtcNewDevice("threads=1");
    if (!device) check(nullptr, "open a device");
    return device;
}

// A direction scaled by a power of two, exactly, to a length near 1. Embree's traversal breaks down
// for components below about 1e-18.
struct ScaledDirection {
    Vec3 direction;
    int exponent;

    explicit ScaledDirection(const Vec3& d) {
        const float largest = std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)});
        std::frexp(largest, &exponent);
        direction = {std::ldexp(d.x, -exponent), std::ldexp(d.y, -exponent), std::ldexp(d.z, -exponent)};
    }

    // Distances along the scaled direction from those along the given one, and back.
    double to_scaled(double t) const { return std::ldexp(t, exponent); }
    double from_scaled(double t) const { return std::ldexp(t, -exponent); }
};

RTCRay make_ray(const Vec3& origin, const Vec3& direction, float t_far) {
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tfar = t_far;
    ray.mask = ~0u;
    return ray;
}

}  // namespace

RayCaster::RayCaster(const Vec3* vertices, size_t vertex_count, const Triangle* triangles, size_t triangle_count)
    : device_(new_device()), scene_(rtcNewScene(device_.get())) {
    check(device_.get(), "create a scene");
    // Robust: a ray through a shared edge hits one of its triangles and never slips between them.
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);

    if (triangle_count > 0) {
        const Owned<RTCGeometry> mesh(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
        check(device_.get(), "create a mesh");
        // Embree owns both copies, padded as its vector loads need it.
        auto* points = static_cast<Vec3*>(rtcSetNewGeometryBuffer(
            mesh.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), vertex_count));
        auto* indices = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
            mesh.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), triangle_count));
        check(device_.get(), "store the mesh");
        std::copy_n(vertices, vertex_count, points);
        std::copy_n(triangles, triangle_count, indices);
        rtcCommitGeometry(mesh.get());
        rtcAttachGeometry(scene_.get(), mesh.get());
    }
    rtcCommitScene(scene_.get());
    check(device_.get(), "build the scene");
}

Hit RayCaster::closest_hit(const Vec3& origin, const Vec3& direction) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const ScaledDirection scaled(direction);
    RTCRayHit query{};
    query.ray = make_ray(origin, scaled.direction, infinity);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    oracle::closest_hit(scene_.get(), query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {infinity, -1, nan, nan};
    return {scaled.from_scaled(query.ray.tfar), query.hit.primID, query.hit.u, query.hit.v};
}

bool RayCaster::occluded(const Vec3& origin, const Vec3& direction, double t_far) const {
    const ScaledDirection scaled(direction);
    constexpr double largest = std::numeric_limits<float>::max();
    RTCRay ray = make_ray(origin, scaled.direction, static_cast<float>(std::min(scaled.to_scaled(t_far), largest)));
    any_hit(scene_.get(), ray);
    return ray.tfar < 0;
}

std::string embree_version() {
    RTCDevice device = new_device();
    const auto version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
    rtcReleaseDevice(device);
    return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
           std::to_string(version % 100);
}

}  // namespace oracle
