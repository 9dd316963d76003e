// Embree: what differs between versions 3 and 4, namely headers and the calls that trace a ray, and ownership.
#pragma once

#include <memory>
#include <type_traits>

#if ORACLE_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace oracle {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <typename Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

inline void closest_hit(RTCScene scene, RTCRayHit& ray) {
#if ORACLE_EMBREE_MAJOR >= 4
    rtcIntersect1(scene, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray);
#endif
}

// Leaves -infinity in ray.tfar when something is hit.
inline void any_hit(RTCScene scene, RTCRay& ray) {
#if ORACLE_EMBREE_MAJOR >= 4
    rtcOccluded1(scene, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &ray);
#endif
}

}  // namespace oracle
