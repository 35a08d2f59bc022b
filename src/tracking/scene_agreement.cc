#include "tracking/scene_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/median.h"
#include "feature/descriptor_matching.h"
#include "tracking/image_cells.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

constexpr double kMinCosine = 0.95;     // minimum cosine of the angle between the bearings of a match: 18 degrees
constexpr double kDeviations = 1.5;     // maximum difference of two positions in standard deviations
constexpr double kNearest = 0.1;        // minimum distance of a point as a fraction of the median distance
constexpr double kMostOfMatches = 0.5;  // fraction of the matches of a cell that must agree

// Distance from a bearing to the epipolar arc on which its point can be seen, from `infinite` to `nearest`, in the
// tangent plane of the unit sphere at the bearing. Infinite if the bearing is on another side. If the nearest point is
// behind the camera, the rig would have passed it since the keyframe. The distance is then that to `infinite`, because
// the arc would be so long that wrong motions agree with it easily.
double distance_to_arc(const Eigen::Vector3d& bearing, const Eigen::Vector3d& infinite,
                       const Eigen::Vector3d& nearest) {
  const double i = infinite.dot(bearing), n = nearest.dot(bearing);
  if (i <= 0.0) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d from = infinite / i - bearing;
  const Eigen::Vector3d along = i * nearest - n * infinite;  // times 1 / (i n): from one end to the other
  const double length2 = along.squaredNorm();
  if (length2 == 0.0) return from.norm();
  if (n <= 0.0) return from.norm();
  const double end = 1.0 / (i * n);
  return (from + std::clamp(-from.dot(along) / length2, 0.0, end) * along).norm();
}

double median_distance(std::span<const solver::PoseObservation> observations, const SE3& T_rig_world) {
  std::vector<double> distances;
  for (const solver::PoseObservation& o : observations) distances.push_back((T_rig_world * o.point_world).norm());
  return distances.empty() ? 0.0 : median(distances);
}

}  // namespace

SceneMatches::SceneMatches(const TrackInput& input, const frame::BundledFrame& frame,
                           std::span<const solver::PoseObservation> observations, const SE3& T_rig_world)
    : nearest_(kNearest * median_distance(observations, T_rig_world)) {
  const KeyframeId reference = input.map.nearest_alive_ancestor(input.state.anchored.reference);
  if (!reference.valid()) return;
  T_world_keyframe_ = input.map.resolved_pose(reference).inverse();
  const frame::BundledFrame& before = *input.map.keyframe(reference).frame;
  const camera::Rig rig_before = input.map.rig_of(reference), rig = frame::rig_of(input.map.rig(), frame);
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const std::vector<CameraConsensusState>& cameras = input.state.cameras;
    const bool excluded = c < cameras.size() && cameras[c].excluded;
    const feature::Keypoints &a = before.cameras[c].keypoints, &b = frame.cameras[c].keypoints;
    const camera::Camera& camera = rig.camera(c);
    T_rig_camera_before_.push_back(rig_before.rig_from_cam(c));
    T_camera_rig_.push_back(rig.cam_from_rig(c));
    if (excluded) continue;
    for (const feature::DescriptorMatch& m : feature::mutual_matches(
             a.descriptor, b.descriptor,
             [&](std::size_t i, std::size_t j) { return a.bearing[i].dot(b.bearing[j]) > kMinCosine; })) {
      const std::size_t i = m.a.index(), j = m.b.index();
      const double sigma = std::hypot(input.features.sigma(a.level[i]), input.features.sigma(b.level[j]));
      pairs_.push_back({c,
                        cell_of(b.pixel[j].cast<double>(), camera),
                        {a.bearing[i], b.bearing[j]},
                        kDeviations * sigma * camera.radians_per_pixel()});
    }
  }
}

int SceneMatches::agreeing_cells(const SE3& T_rig_world) const {
  struct Counts {
    int all = 0, agree = 0;
  };
  std::vector<std::array<Counts, kCells * kCells>> cells(T_camera_rig_.size());
  std::vector<SE3> T_now_before;  // motion of each camera between the keyframe and the frame
  for (std::size_t c = 0; c < cells.size(); ++c)
    T_now_before.push_back(T_camera_rig_[c] * T_rig_world * T_world_keyframe_ * T_rig_camera_before_[c]);
  for (const Pair& pair : pairs_) {
    const SE3& T = T_now_before[pair.camera];
    const Eigen::Vector3d infinite = T.rotation() * pair.bearings.a;
    const Eigen::Vector3d nearest = (nearest_ * infinite + T.translation()).normalized();
    Counts& cell = cells[pair.camera][pair.cell];
    ++cell.all;
    cell.agree += distance_to_arc(pair.bearings.b, infinite, nearest) <= pair.tolerance;
  }
  int agreeing = 0;
  for (const auto& camera : cells)
    agreeing += static_cast<int>(std::ranges::count_if(
        camera, [](const Counts& cell) { return cell.all > 0 && cell.agree > kMostOfMatches * cell.all; }));
  return agreeing;
}

}  // namespace bslam::tracking
