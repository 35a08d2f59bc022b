// Ray queries of Embree 3 and Embree 4 with one interface. The versions differ only in how options are passed.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace bslam::simulator {

#if RTC_VERSION_MAJOR >= 4

inline void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray, nullptr); }
inline void intersect(RTCScene scene, RTCRayHit& query) { rtcIntersect1(scene, &query, nullptr); }
// Intersects eight rays with similar origins and directions. `valid` is -1 for active rays, else 0.
inline void intersect_coherent(const int* valid, RTCScene scene, RTCRayHit8& query) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &query, &arguments);
}

#else

inline void occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
inline void intersect(RTCScene scene, RTCRayHit& query) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &query);
}
// Intersects eight rays with similar origins and directions. `valid` is -1 for active rays, else 0.
inline void intersect_coherent(const int* valid, RTCScene scene, RTCRayHit8& query) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, &query);
}

#endif

}  // namespace bslam::simulator
