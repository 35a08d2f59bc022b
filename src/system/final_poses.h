// Poses and motions of all frames in the final map.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "map/bundled_map.h"
#include "tracking/frame_record.h"

namespace bslam::system {

// Returns an iterator to the record of a frame, or the end iterator. `records` must be in order of frame ids.
template <class Records>
auto find_record(Records& records, FrameId frame) {
  const auto at =
      std::ranges::lower_bound(records, frame, {}, [](const tracking::FrameRecord& r) { return r.result.frame; });
  return at != records.end() && at->result.frame == frame ? at : records.end();
}

// Pose of a frame in `map`. Returns nullopt if the frame has none or its submap was removed from `map`.
std::optional<geometry::SE3> T_rig_world_of(const tracking::FrameRecord& record, const map::BundledMap& map);

// Poses of all frames of a run whose calibration was refined. Frames between two keyframes were tracked with an earlier
// calibration than that of the final map, so that their motion relative to the first keyframe does not end at the
// second one. This difference is distributed over the frames in proportion to time. Their motion is rescaled if the
// scale of the map has changed since. The first frame after a change of the calibration keeps its pose, as keyframes
// do. `first`: the first keyframe of the run.
std::vector<std::optional<geometry::SE3>> poses_between_keyframes(const map::BundledMap& map, KeyframeId first,
                                                                  std::span<const tracking::FrameRecord> frames);

// Twist of the rig during the capture of each keyframe, assuming constant acceleration from the previous frame to the
// next one. Tracking did not know the next frame. Returned for keyframes with ids from `first` on whose cameras have
// different capture times, if both adjacent frames have a pose, are at most tracking::kMaxPrediction_s away and were
// reached without relocalisation. `frames`: all frames of the run, in order.
std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists_from_neighbours(
    const map::BundledMap& map, KeyframeId first, std::span<const tracking::FrameRecord> frames);

}  // namespace bslam::system
