// The paper's BundledKeyframe: a BundledFrame with a pose and its links in the map.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/id.h"
#include "frame/bundled_frame.h"
#include "geometry/pose_uncertainty.h"
#include "geometry/se3.h"
#include "map/cow_vector.h"

namespace bslam::map {

// A neighbour in the covisibility graph; weight = landmarks both keyframes observe.
struct Covisible {
  KeyframeId keyframe;
  int weight = 0;
};

// The correction of the capture time of one image of a keyframe (frame::CameraFrame).
struct CaptureTime {
  KeyframeId keyframe;
  CameraIndex camera;
  TimeNs correction_ns = 0;
};

// The root of a keyframe's submap as found when the map had seen a number of merges of submaps. Saves the way up the
// spanning tree, which is as long as the submap, in every frame.
struct KnownRoot {
  KeyframeId id;
  std::uint64_t num_merges = 0;
};

// `landmarks` and `covisible` are shared between versions separately from the other members, so that a change of the
// pose copies neither. Both can be read like a const std::vector.
struct BundledKeyframe {
  std::shared_ptr<const frame::BundledFrame> frame;  // null once removed
  geometry::SE3 T_rig_world;                         // while alive
  CowArray<LandmarkId> landmarks;                    // per FeatureId; invalid = none. Empty once removed
  CowArray<Covisible> covisible;                     // every keyframe with weight > 0, in order of id
  KeyframeId parent;                                 // spanning tree; invalid for the root
  KnownRoot root;                                    // use BundledMap::root_of()
  std::vector<KeyframeId> children;                  // in order of id
  geometry::SE3 T_rig_parent;                        // once removed: its pose relative to `parent`
  // Velocity of the rig during the capture, as BundledFrame::twist; lengths in map units.
  geometry::Vector6d twist = geometry::Vector6d::Zero();
  // Uncertainty of T_rig_world relative to the root of its submap (adjustment/pose_uncertainty.h), in radians and map
  // units. Zero for the root and in a loaded map.
  geometry::PoseUncertainty uncertainty = {};
  bool alive = false;
  // Product of all factors by which lengths near this keyframe have been scaled since it was added. A length stored
  // when this value was s must be multiplied by scale / s.
  double scale = 1.0;
};

}  // namespace bslam::map
