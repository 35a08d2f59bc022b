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

// The record of a frame, or the end. `records` are in order of frames.
template <class Records>
auto find_record(Records& records, FrameId frame) {
  const auto at =
      std::ranges::lower_bound(records, frame, {}, [](const tracking::FrameRecord& r) { return r.result.frame; });
  return at != records.end() && at->result.frame == frame ? at : records.end();
}

// Pose of a frame in `map`. Returns nullopt if the frame has none or its submap was removed from `map`.
std::optional<geometry::SE3> T_rig_world_of(const tracking::FrameRecord& record, const map::BundledMap& map);

// Poses of all frames of a run in which the rig was calibrated. Frames between two keyframes were tracked with another
// calibration than that of the final map, so that their motion relative to one keyframe does not fit the other. The
// difference is distributed over the frames between them in proportion to time. Where the calibration changed between
// two keyframes, only those before the change have the larger difference: the first frame after it keeps its pose like
// a keyframe. `first`: the first keyframe of the run.
std::vector<std::optional<geometry::SE3>> poses_between_keyframes(const map::BundledMap& map, KeyframeId first,
                                                                  std::span<const tracking::FrameRecord> frames);

// Motion of the rig during the capture of keyframes, by constant acceleration through the previous frame, the keyframe
// and the next frame, which was not available during tracking. Contains the keyframes with ids from `first` on that
// have late cameras, if both adjacent frames have a pose, are within tracking::kMaxPrediction_s and connected without
// relocalisation. `frames`: all frames of the run, in order.
std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists_from_neighbours(
    const map::BundledMap& map, KeyframeId first, std::span<const tracking::FrameRecord> frames);

}  // namespace bslam::system
