// Simulation without images: a rig moves through a room whose walls carry landmarks, and what its cameras would extract
// and bundle comes out directly, with the truth beside it. For tests of tracking and mapping.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/random.h"
#include "camera/rig.h"
#include "feature/keypoints.h"
#include "frame/bundled_frame.h"
#include "synthetic/trajectory.h"

namespace bslam::synthetic {

struct FeatureSimulatorOptions {
  std::uint64_t scene_seed = 1;  // landmarks
  std::uint64_t noise_seed = 1;  // detection, pixels, descriptors, outliers; the trajectory has a seed of its own

  Vector3d room_low = {-5, -4, 0}, room_high = {5, 4, 3};  // metres: landmarks lie on its walls, floor and ceiling
  double scatter = 0.3;                                    // metres they lie inside of these at most
  int landmarks = 8000;
  double nearest_base = 4.0, farthest_base = 14.0;  // metres: a landmark's distance at which it is found on level 0

  int max_keypoints = 1000;  // true keypoints of one camera; landmarks come in order of their strength
  double sigma_px = 0.7;     // standard deviation of a keypoint on its level
  int levels = 8;
  double scale_factor = 1.2;
  double detection_share = 0.85;  // of visible landmarks found
  double flipped_bits = 12.0;     // of a descriptor, in the mean, from one observation to the landmark's own
  double outlier_share = 0.05;    // keypoints anywhere with any descriptor, of the true ones
  double matched_share = 0.8;     // of landmarks found by several cameras that the Bundled table knows as matched
  std::vector<double> capture_offset_s;  // per camera: its image is taken that much after the frame's time; empty = 0

  static constexpr double kMinAngle = 1e-4;  // radians: rays closer to parallel give no triangulated point
};

struct SimulatedLandmark {
  Vector3d position;     // metres, world
  Vector3d tangent;      // unit, world: what keypoints take their angle from
  double base_distance;  // metres
  feature::Descriptor descriptor;
  feature::Patch patch;  // the same from everywhere
};

struct SimulatedFrame {
  frame::BundledFrame frame;
  geometry::SE3 T_world_body, T_world_rig;  // at the frame's time
  std::vector<std::vector<int>> landmark;   // [camera][keypoint]: index of the landmark, -1 = outlier
};

class FeatureSimulator {
 public:
  FeatureSimulator(camera::Rig rig, Trajectory trajectory, const FeatureSimulatorOptions& options);

  // What the rig sees at a time of the trajectory; the same for every call with these arguments. Cameras listed in
  // `missing` give no image.
  SimulatedFrame frame(FrameId id, double time_s, std::span<const int> missing = {}) const;

  // The landmark's pixel in a camera at a time, without noise, where it is inside the image and on a level that exists.
  struct View {
    Vector2d pixel;
    int level;
    double angle;  // radians
  };
  std::optional<View> view(std::size_t landmark, std::size_t camera, const geometry::SE3& T_world_cam) const;

  const std::vector<SimulatedLandmark>& landmarks() const { return landmarks_; }
  const camera::Rig& rig() const { return rig_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const FeatureSimulatorOptions& options() const { return options_; }

 private:
  // Fills one camera's detections and their landmarks.
  void observe(std::size_t camera, const geometry::SE3& T_world_cam, Random& random, feature::Detections& keypoints,
               std::vector<int>& landmark) const;
  void add_outliers(std::size_t camera, Random& random, feature::Detections& keypoints,
                    std::vector<int>& landmark) const;
  frame::Bundled bundle(const std::vector<frame::CameraFrame>& cameras, const std::vector<std::vector<int>>& landmark,
                        Random& random) const;
  std::optional<frame::BundledPoint> triangulate(const std::vector<frame::CameraFrame>& cameras,
                                                 const std::vector<frame::KeypointRef>& group) const;

  camera::Rig rig_;
  Trajectory trajectory_;
  FeatureSimulatorOptions options_;
  std::vector<SimulatedLandmark> landmarks_;
};

}  // namespace bslam::synthetic
