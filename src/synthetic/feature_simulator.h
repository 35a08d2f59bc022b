// Feature-level simulation without images: a rig moves through a room with landmarks on its walls, and the simulator
// directly returns the bundled features of a frame together with the ground truth. Used by tests of tracking and
// mapping.
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
  std::uint64_t scene_seed = 1;  // seed of the landmarks
  // seed of detection, pixel noise, descriptors and outliers; the trajectory has a separate seed
  std::uint64_t noise_seed = 1;

  // metres; landmarks lie near the walls, floor and ceiling of this box
  Vector3d room_low = {-5, -4, 0}, room_high = {5, 4, 3};
  double scatter = 0.3;  // metres; maximum distance of a landmark from its wall, towards the inside
  int landmarks = 8000;
  double nearest_base = 4.0, farthest_base = 14.0;  // metres: distance at which a landmark is detected on level 0

  // maximum number of inlier keypoints per camera; those of the first landmarks by index are kept
  int max_keypoints = 1000;
  double sigma_px = 0.7;  // standard deviation of a keypoint, in pixels of its level
  int levels = 8;
  double scale_factor = 1.2;
  double detection_share = 0.85;  // fraction of visible landmarks that are detected
  // mean Hamming distance between the descriptor of an observation and the descriptor of the landmark
  double flipped_bits = 12.0;
  // outliers at random positions with random descriptors, relative to the number of inliers
  double outlier_share = 0.05;
  // fraction of landmarks detected by several cameras that the Bundled table contains as matched
  double matched_share = 0.8;
  // Capture time of each camera's image relative to the frame's time, in seconds; 0 for all cameras if empty.
  std::vector<double> capture_offset_s;

  static constexpr double kMinAngle = 1e-4;  // radians: minimum angle between rays for which a point is triangulated
};

struct SimulatedLandmark {
  Vector3d position;     // metres, world
  Vector3d tangent;      // unit vector, world: defines the orientation of keypoints
  double base_distance;  // metres, distance at which camera 0 sees it on level 0
  feature::Descriptor descriptor;
  feature::Patch patch;  // identical from all viewpoints
};

struct SimulatedFrame {
  frame::BundledFrame frame;
  geometry::SE3 T_world_body, T_world_rig;  // at the frame's time
  std::vector<std::vector<int>> landmark;   // [camera][keypoint]: index of the landmark, -1 for outliers
};

class FeatureSimulator {
 public:
  FeatureSimulator(camera::Rig rig, Trajectory trajectory, const FeatureSimulatorOptions& options);

  // Returns the features observed at a time of the trajectory, deterministically. Cameras listed in `missing` have no
  // image.
  SimulatedFrame frame(FrameId id, double time_s, std::span<const int> missing = {}) const;

  // Returns the noise-free pixel, level and angle of a landmark in a camera; nullopt if it is outside the image or the
  // pyramid.
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
  // Adds one camera's detections and the landmark indices they belong to.
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
