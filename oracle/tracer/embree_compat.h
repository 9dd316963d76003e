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

#if ORACLE_EMBREE_MAJOR >= 4

inline void closest_hit(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray); }

// Leaves -infinity in ray.tfar when something is hit.
inline void any_hit(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }

// The same for eight rays that run side by side; `valid` holds -1 for those that count and 0 for others.
inline void closest_hit8(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcIntersect8(valid, scene, &rays, &arguments);
}

inline void any_hit8(RTCScene scene, const int* valid, RTCRay8& rays) {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcOccluded8(valid, scene, &rays, &arguments);
}

#else

inline RTCIntersectContext make_context(RTCIntersectContextFlags flags) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    return context;
}

inline void closest_hit(RTCScene scene, RTCRayHit& ray) {
    RTCIntersectContext context = make_context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    rtcIntersect1(scene, &context, &ray);
}

// Leaves -infinity in ray.tfar when something is hit.
inline void any_hit(RTCScene scene, RTCRay& ray) {
    RTCIntersectContext context = make_context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    rtcOccluded1(scene, &context, &ray);
}

// The same for eight rays that run side by side; `valid` holds -1 for those that count and 0 for others.
inline void closest_hit8(RTCScene scene, const int* valid, RTCRayHit8& rays) {
    RTCIntersectContext context = make_context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    rtcIntersect8(valid, scene, &context, &rays);
}

inline void any_hit8(RTCScene scene, const int* valid, RTCRay8& rays) {
    RTCIntersectContext context = make_context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    rtcOccluded8(valid, scene, &context, &rays);
}

#endif

}  // namespace oracle
