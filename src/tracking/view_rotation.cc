#include "tracking/view_rotation.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "geometry/so3.h"
#include "geometry/triangulation.h"

namespace bslam::tracking {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 0.01;  // rad

// One step of the least squares over rotations, with the weights of Geman and McClure at this scale (rad).
Vector3d step(std::span<const DirectionPair> pairs, const Eigen::Matrix3d& R, double scale) {
  Eigen::Matrix3d H = 1e-9 * Eigen::Matrix3d::Identity();
  Vector3d g = Vector3d::Zero();
  for (const DirectionPair& pair : pairs) {
    const Vector3d predicted = R * pair.predicted, error = pair.observed - predicted;
    const double ratio = error.norm() / scale, weight = 1.0 / std::pow(1 + ratio * ratio, 2);
    H += weight * (Eigen::Matrix3d::Identity() - predicted * predicted.transpose());
    g += weight * predicted.cross(error);
  }
  return H.ldlt().solve(g);
}

}  // namespace

ViewRotation view_rotation(std::span<const DirectionPair> pairs) {
  constexpr double kFirstScale = 0.07, kShrink = 0.7;  // rad, per step
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (double scale = kFirstScale; scale > 0.5 * kTolerance; scale *= kShrink)
    R = geometry::so3_exp(step(pairs, R, scale)).toRotationMatrix() * R;
  ViewRotation out{.angle = geometry::so3_log(Eigen::Quaterniond(R)).norm()};
  for (const DirectionPair& pair : pairs)
    out.agree += geometry::angle_between(R * pair.predicted, pair.observed) < kTolerance;
  return out;
}

bool rotated_view(const map::BundledMap& map, const frame::BundledFrame& frame, std::size_t c,
                  const geometry::SE3& T_rig_world, std::span<const Match> matches, const ConsensusOptions& options) {
  if (static_cast<int>(matches.size()) < options.min_expected) return false;
  const geometry::SE3 T_cam_world = frame::rig_of(map.rig(), frame).cam_from_rig(c) * T_rig_world;
  std::vector<DirectionPair> pairs;
  for (const Match& m : matches)
    pairs.push_back({(T_cam_world * map.landmark(m.landmark).position).normalized(),
                     frame.cameras[c].keypoints.bearing[m.keypoint.index()]});
  const ViewRotation found = view_rotation(pairs);
  return found.angle <= geometry::radians(options.max_calibration_error_deg) &&
         found.agree >= options.healthy_reobservation_ratio * static_cast<double>(pairs.size());
}

}  // namespace bslam::tracking
