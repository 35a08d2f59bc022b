// A map, to be read.
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
struct Access;  // how the library itself reads what these classes hide
}

// An immutable version of a map. Taking and copying one costs next to nothing and never waits for the mapping; all its
// functions may be called from any thread. It keeps its version alive and does not change while the System goes on.
// Functions that return a vector make it anew at each call, in time proportional to its size.
class BSLAM_EXPORT MapView {
 public:
  struct Keyframe {
    int id = -1;               // never used again for another one within a run
    std::int64_t time_ns = 0;  // of its frame
    Pose T_world_cam0;         // in the world of its submap
    int parent = -1;           // id of its parent in the submap's spanning tree; -1 for the root
    int submap = -1;           // id of that root
  };
  struct Landmark {
    int id = -1;
    std::array<double, 3> position = {0, 0, 0};  // in the world of its submap
    int observations = 0;                        // keyframes that see it
    int submap = -1;
  };
  struct CovisibilityEdge {
    int first = -1, second = -1;  // ids of keyframes, first < second
    int landmarks = 0;            // that both see
  };
  // A part of the map that was not yet linked to another by a place seen from both; it has a world of its own.
  struct Submap {
    int root = -1;  // id of its root keyframe, which names it
    std::size_t keyframes = 0;
  };

  MapView(const MapView& other) = default;  // a move copies as well, so that a MapView always has a map
  MapView& operator=(const MapView& other) = default;

  // A map of System::save_map or `bslam run --save-map`. Errors name file and section: not readable, no map, damaged,
  // of another format version.
  static Result<MapView> load(const std::filesystem::path& file);

  int version() const;  // grows by one with every change of the map; 0 for a map that was loaded
  Scale scale() const;
  std::size_t num_keyframes() const;
  std::size_t num_landmarks() const;
  std::size_t num_observations() const;
  Rig rig() const;  // that made it; without masks

  std::vector<Keyframe> keyframes() const;  // in order of id
  std::vector<Landmark> landmarks() const;  // in order of id
  // Pairs of keyframes that see at least `min_landmarks` (not below 1) in common, in order of their ids.
  std::vector<CovisibilityEdge> covisibility(int min_landmarks = 15) const;
  std::vector<Submap> submaps() const;  // in order of their roots

 private:
  friend struct api::Access;
  struct Impl;
  explicit MapView(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;  // never null
};

}  // namespace bslam
