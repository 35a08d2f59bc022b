// Read access to a map.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"
#include "bslam/result.h"
#include "bslam/rig.h"

namespace bslam {

enum class Scale {
  kMetric,       // lengths are metres
  kUpToScale,    // the cameras do not determine the scale, for example one camera: the unit of length is arbitrary
  kUnobservable  // the rig can determine the scale, but its motion has not allowed it so far
};
BSLAM_EXPORT std::string_view to_string(Scale scale);  // "metric", "up-to-scale", "unobservable"

// An immutable version of a map. Obtaining and copying a view is cheap and never waits for mapping; all functions may
// be called from any thread. A view keeps its version alive and does not change while the System continues. Functions
// that return a vector create it at each call, in time proportional to its size.
class BSLAM_EXPORT MapView {
 public:
  struct Keyframe {
    int id = -1;               // unique within a run, also after removal
    std::int64_t time_ns = 0;  // time of its frame
    Pose T_world_cam0;         // in the world frame of its submap
    int parent = -1;           // id of its parent in the submap's spanning tree; -1 for the root
    int submap = -1;           // id of the root keyframe of its submap
  };
  struct Landmark {
    int id = -1;
    std::array<double, 3> position = {0, 0, 0};  // in the world frame of its submap
    int observations = 0;                        // number of keyframes that observe it
    int submap = -1;
  };
  struct CovisibilityEdge {
    int first = -1, second = -1;  // ids of keyframes, first < second
    int landmarks = 0;            // number of landmarks observed by both
  };
  // A connected part of the map with its own world frame; no common place has linked it to another submap yet.
  struct Submap {
    int root = -1;  // id of its root keyframe, which identifies the submap
    std::size_t keyframes = 0;
  };

  // Loads a map saved by System::save_map or `bslam run --save-map`. Errors name file and section: a file that cannot
  // be read, is not a map, is damaged, or has another format version.
  static Result<MapView> load(const std::filesystem::path& file);

  int version() const;  // incremented by every change of the map; 0 for a loaded map
  Scale scale() const;
  std::size_t num_keyframes() const;
  std::size_t num_landmarks() const;
  std::size_t num_observations() const;
  Rig rig() const;  // rig of the map, without masks

  std::vector<Keyframe> keyframes() const;  // in order of id
  std::vector<Landmark> landmarks() const;  // in order of id
  // Returns the pairs of keyframes with at least `min_landmarks` common landmarks, in order of their ids.
  // `min_landmarks` must be 1 or more.
  std::vector<CovisibilityEdge> covisibility(int min_landmarks = 15) const;
  std::vector<Submap> submaps() const;  // in order of root id

  struct Impl;  // implementation
  explicit MapView(std::shared_ptr<const Impl> impl);
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace bslam
