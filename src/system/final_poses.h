// Where the rig was, as the finished map has it.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "map/bundled_map.h"
#include "tracking/frame_record.h"

namespace bslam::system {

// Pose of a frame in `map`. Empty where the frame has none or `map` no longer holds the submap it was tracked in.
std::optional<geometry::SE3> T_rig_world_of(const tracking::FrameRecord& record, const map::BundledMap& map);

// How the rig moved while the cameras of a keyframe fired one after the other: by constant acceleration from the frame
// before through the keyframe to the frame after it, which tracking could not know. Keyframes in slots from `first` on
// that have late cameras and a frame with a pose on either side, no farther than tracking::kMaxPrediction_s and not by
// relocalisation. `frames`: of the run, in order.
std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists_from_neighbours(
    const map::BundledMap& map, KeyframeId first, std::span<const tracking::FrameRecord> frames);

}  // namespace bslam::system
