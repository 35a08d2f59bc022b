// Results of tracking as evidence against the pose of a frame, and against a map that was initialised recently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "camera/rig.h"
#include "map/bundled_map.h"
#include "tracking/frame_record.h"

namespace bslam::tracking {

// Returns true if hardly any of the landmarks in view of a camera, or significantly less than half of many, are found
// where the pose of the frame predicts them. This indicates images under the names of other cameras, or another rig. A
// run would detect it in the following frames; it is for frames that are localised alone.
bool contradicts_pose(const CameraCounts& camera);

// Decides whether the map of a run was initialised wrongly: tracking is lost in it although its scale is arbitrary, or
// most of its points are on a moving object. Only a new map is discarded; one that has agreed with the images for some
// time is right. A run in a loaded map needs no such decision.
class MapDoubt {
 public:
  // `rig`: the cameras of the run.
  explicit MapDoubt(const camera::Rig& rig);

  // Considers the record of the next frame, which was tracked in the version `seen` of the map. Returns true if the map
  // is to be discarded; the following frames then belong to another map. `calibration_compared`: the calibration agrees
  // with the images, or was refined. Before, poses may be undecided because it is wrong: landmarks at wrong distances
  // look like things that move.
  bool update(const FrameRecord& record, const map::BundledMap& seen, bool calibration_compared);

 private:
  bool is_new(TimeNs time_ns, const map::BundledMap& seen, std::size_t max_keyframes) const;
  bool disowned(const TrackResult& result, const map::BundledMap& seen) const;
  bool observed_by_cameras_of(const TrackResult& result, const map::BundledMap& seen) const;
  bool contradicted(const TrackResult& result, const map::BundledMap& seen, bool undecided) const;
  bool scale_contradicted(const TrackResult& result) const;

  std::vector<std::uint8_t> overlapping_;  // per camera, whether it overlaps with any other
  std::optional<TimeNs> started_ns_;       // time of the first pose in the map; nullopt: it is not initialised
  std::size_t first_keyframe_ = 0;         // number of keyframe slots before it was initialised
  std::deque<TimeNs> undecided_ns_;        // times of its latest poses that were undecided
  int contradictions_ = 0;                 // number of maps discarded because they were contradicted
};

}  // namespace bslam::tracking
