// Poses of the frames between the two keyframes of a monocular initialisation, estimated once the map exists.
#pragma once

#include <optional>

#include "tracking/track.h"

namespace bslam::tracking {

struct BetweenKeyframes {
  std::shared_ptr<const frame::BundledFrame> frame;
  KeyframeId before, after;                // ids of the commit; either keyframe may have been culled since
  TimeNs before_ns = 0, after_ns = 0;      // times of their frames
  std::shared_ptr<const camera::Rig> rig;  // the calibration of `frame`
};

// Returns nullopt if no pose of the frame has enough inliers in the map, or the submap of a keyframe was removed.
std::optional<TrackResult> pose_between(const map::BundledMap& map, const BetweenKeyframes& early,
                                        const feature::FeatureModel& features, const TrackingOptions& options,
                                        ThreadPool& pool);

}  // namespace bslam::tracking
