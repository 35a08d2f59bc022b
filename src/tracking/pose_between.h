// Poses of the frames between the two keyframes of a monocular initialisation, estimated once the map exists.
#pragma once

#include <optional>

#include "tracking/track.h"

namespace bslam::tracking {

struct BetweenKeyframes {
  std::shared_ptr<const frame::BundledFrame> frame;
  KeyframeId before, after;            // as committed: either may have been culled since
  TimeNs before_ns = 0, after_ns = 0;  // of their frames
};

// Empty where the map does not support a pose of the frame, or a keyframe's part is gone.
std::optional<TrackResult> pose_between(const map::BundledMap& map, const BetweenKeyframes& early,
                                        const feature::FeatureModel& features, const TrackingOptions& options,
                                        ThreadPool& pool);

}  // namespace bslam::tracking
