// Functions of tracking/track.h that use the tracker state only.
#include "tracking/track.h"

namespace bslam::tracking {

std::string_view describe(LostReason reason) {
  switch (reason) {
    case LostReason::kNone:
      return "";
    case LostReason::kNotStarted:
      return "not started";
    case LostReason::kNoImages:
      return "no usable image";
    case LostReason::kFewFeatures:
      return "too few features";
    case LostReason::kFewMatches:
      return "too few matches";
    case LostReason::kFewInliers:
      return "too few matches agree";
    case LostReason::kUnstablePose:
      return "pose not supported";
    case LostReason::kNotFound:
      return "place not found in the map";
  }
  return "";
}

std::vector<std::uint8_t> excluded(const TrackerState& state, std::size_t cameras) {
  std::vector<std::uint8_t> out(cameras, 0);
  for (std::size_t c = 0; c < state.cameras.size(); ++c) out[c] = state.cameras[c].excluded;
  return out;
}

void apply_scale_change(const map::BundledMap& map, TrackerState& state) {
  if (state.twist) state.twist = geometry::scaled(*state.twist, state.anchored.scale_change(map));
  state.anchored.rescale(map);
}

TrackerState state_at_keyframe(const TrackerState& before, TimeNs time_ns, const map::BundledMap& map,
                               KeyframeId keyframe, std::vector<LandmarkId> landmarks) {
  TrackerState state = before;
  state.status = TrackStatus::kTracking;
  state.time_ns = time_ns;
  state.anchored = {.reference = keyframe, .T_rig_reference = geometry::SE3()};
  state.landmarks = std::move(landmarks);
  refer_to(keyframe, *map.keyframe(keyframe).frame, state.references);
  state.direct = {};
  state.visibility_counts.clear();
  return state;
}

}  // namespace bslam::tracking
