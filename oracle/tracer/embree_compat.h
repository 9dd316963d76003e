// What differs between Embree 3 and 4, and nothing else: headers and the calls that trace a ray.
#pragma once

#if ORACLE_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace oracle {

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
