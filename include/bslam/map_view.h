// Read access to a map.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"
#include "bslam/result.h"
#include "bslam/rig.h"

namespace bslam {

namespace api {
struct Access;  // access of the library to the implementations
}

// An immutable version of a map. Obtaining and copying a view is cheap and never waits for mapping; all functions may
// be called from any thread. A view keeps its version alive and does not change while the System continues. Functions
// that return a vector create it at each call, in time proportional to its size.
class BSLAM_EXPORT MapView {
 public:
  struct Keyframe {
    int id = -1;               // unique within a run, also after removal
    std::int64_t time_ns = 0;  // time of its frame, by the clock of the recording
    // Pose of camera 0 of the rig that recorded it, in the world frame of its submap; metres if scale() is metric. It
    // is the camera of rig(), by which landmarks project into the images. After a refinement of the calibration it may
    // be rotated against RigFrame::kCamera0, to which FrameResult::T_world_cam0 and trajectories refer.
    Pose T_world_cam0;
    int parent = -1;  // id of its parent in the submap's spanning tree; -1 for the root
    int submap = -1;  // id of the root keyframe of its submap
    // Of the body frame; T_world_body * rig().camera(i).T_body_cam is the pose of its camera i, unless this camera was
    // moved on the body during the recording.
    Pose T_world_body;
  };
  struct Landmark {
    int id = -1;
    std::array<double, 3> position = {0, 0, 0};  // in the world frame of its submap; metres if scale() is metric
    int observations = 0;                        // number of keyframes that observe it
    int submap = -1;                             // id of the root keyframe of its submap
  };
  struct CovisibilityEdge {
    int first = -1, second = -1;  // ids of keyframes, first < second
    int landmarks = 0;            // number of landmarks observed by both
  };
  // A connected part of the map with its own world frame. No place that it shares with another submap has been
  // recognised yet.
  struct Submap {
    int root = -1;  // id of its root keyframe, which identifies the submap
    std::size_t keyframes = 0;
  };

  MapView(const MapView& other) = default;  // a move copies as well, so that a MapView always has a map
  MapView& operator=(const MapView& other) = default;

  // Loads a map saved by System::save_map or `bslam run --save-map`. Errors name the file, and the section of the
  // format that is damaged: a file that cannot be read, is not a map, is damaged, or has another format version.
  static Result<MapView> load(const std::filesystem::path& file);

  int version() const;  // incremented by every change of the map; 0 for a loaded map
  Scale scale() const;
  std::size_t num_keyframes() const;
  std::size_t num_landmarks() const;
  // The number of observations of landmarks by keypoints: a feature that several cameras see counts once for each.
  std::size_t num_observations() const;
  // All cameras of the map, without masks: those of the first run, then those of other rigs that have continued the
  // map. Calibrations that were refined are those after the refinement; the extrinsics of a camera that was moved
  // during the recording are those before the move.
  Rig rig() const;

  std::vector<Keyframe> keyframes() const;  // in order of id
  std::vector<Landmark> landmarks() const;  // in order of id
  // One entry per keyframe in order of id: the distinct visual words of its keypoints, ascending. The entries are empty
  // if the map was saved without words.
  std::vector<std::vector<std::int32_t>> words() const;
  // Returns the pairs of keyframes with at least `min_landmarks` common landmarks, in order of their ids.
  // Values below 1 have the effect of 1.
  std::vector<CovisibilityEdge> covisibility(int min_landmarks = 15) const;
  std::vector<Submap> submaps() const;  // in order of root id

 private:
  friend struct api::Access;
  struct Impl;
  explicit MapView(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;  // never null
};

}  // namespace bslam
