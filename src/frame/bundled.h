// Feature table of a frame: groups the keypoints of all cameras that show the same point into one feature.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "base/id.h"
#include "base/shared_array.h"

namespace bslam::frame {

// A keypoint of one camera of the frame.
struct KeypointRef {
  CameraIndex camera;
  KeypointIndex keypoint;
  friend auto operator<=>(const KeypointRef&, const KeypointRef&) = default;
};

// Triangulated point of a matched feature.
struct BundledPoint {
  Eigen::Vector3d point_rig;   // metres, camera 0
  Eigen::Matrix3d covariance;  // metres^2
};

// The Bundled table. Every keypoint of the frame belongs to exactly one unique feature; a feature has at most one
// keypoint per camera. A feature is matched if it has two or more keypoints, else monocular. Stored as a compressed
// table from FeatureId to keypoints, and its inverse. Matched features come first, each with its keypoints in order of
// camera; monocular ones follow in order of camera and keypoint. Immutable; copies share the table.
class Bundled {
 public:
  Bundled() = default;

  // `keypoint_counts`: keypoints per camera. `matched`: features of two or more keypoints in order of distinct cameras;
  // no keypoint may occur twice. `points`: one entry per matched feature. All other keypoints become monocular
  // features.
  Bundled(std::span<const std::size_t> keypoint_counts, std::span<const std::vector<KeypointRef>> matched,
          std::span<const std::optional<BundledPoint>> points);

  // The table as arrays, such as a file contains.
  struct Arrays {
    SharedArray<KeypointRef> refs;     // keypoints of all features, in order
    SharedArray<std::uint32_t> begin;  // per feature + 1, indices into refs; empty for a table without cameras
    SharedArray<FeatureId> feature;    // per keypoint, camera by camera
  };
  const Arrays& arrays() const { return arrays_; }
  // Returns nullopt unless the arrays are valid, that is, the constructor above could have created them. All its
  // conditions are checked.
  static std::optional<Bundled> from_arrays(std::span<const std::size_t> keypoint_counts, std::size_t num_matched,
                                            Arrays arrays, std::span<const std::optional<BundledPoint>> points);
  // The same table without the points.
  Bundled without_points() const;

  std::size_t size() const { return arrays_.begin.empty() ? 0 : arrays_.begin.size() - 1; }  // unique features
  std::size_t num_matched() const { return num_matched_; }
  std::size_t num_monocular() const { return size() - num_matched_; }
  bool is_matched(FeatureId f) const { return f.index() < num_matched_; }

  std::span<const KeypointRef> keypoints(FeatureId f) const {
    return {arrays_.refs.data() + arrays_.begin[f.index()], arrays_.refs.data() + arrays_.begin[f.index() + 1]};
  }
  FeatureId feature(CameraIndex c, KeypointIndex k) const {
    return arrays_.feature[camera_begin_[c.index()] + k.index()];
  }
  FeatureId feature(KeypointRef r) const { return feature(r.camera, r.keypoint); }

  // Nullopt for monocular features, for matched ones without a valid triangulated point, and if points are not kept.
  const std::optional<BundledPoint>& point(FeatureId f) const {
    return is_matched(f) && !points_.empty() ? points_[f.index()] : kNone;
  }
  bool has_points() const { return !points_.empty(); }

  // Memory of the arrays that were not counted before.
  std::size_t memory_bytes(MemoryCount& count) const;

 private:
  static inline const std::optional<BundledPoint> kNone;
  Arrays arrays_;
  SharedArray<std::size_t> camera_begin_;            // per camera + 1
  SharedArray<std::optional<BundledPoint>> points_;  // per matched feature, or none
  std::size_t num_matched_ = 0;
};

}  // namespace bslam::frame
