#include "calibration/lost_observations.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "map/search_points.h"
#include "matching/projection_search.h"
#include "solver/reprojection.h"

namespace bslam::calibration {
namespace {

using Observation = solver::ReprojectionProblem::Observation;

constexpr double kRadius = 0.012;            // rad, search radius around the projection
constexpr double kMaxRecoveredChi2 = 100.0;  // of observations that are added: ten standard deviations
constexpr int kMaxHamming = 50;              // bits
constexpr double kRatio = 0.8;               // maximum ratio of best to second best descriptor distance

bool pixel_before(const Observation& a, const Observation& b) {
  return std::pair(a.pixel.x(), a.pixel.y()) < std::pair(b.pixel.x(), b.pixel.y());
}

// Keypoints of one image that belong to a landmark of the map or to an observation of the problem (`seen`).
std::vector<std::uint8_t> taken_keypoints(const map::BundledMap& map, KeyframeId k, CameraIndex camera,
                                          std::vector<Observation> seen) {
  std::sort(seen.begin(), seen.end(), pixel_before);
  const frame::BundledFrame& frame = *map.keyframe(k).frame;
  std::vector<std::uint8_t> taken(frame.keypoints(camera).size());
  Observation here{};
  for (std::size_t i = 0; i < taken.size(); ++i) {
    here.pixel = frame.keypoints(camera).pixel[i];
    taken[i] = map.landmark_of(k, frame.bundled.feature(camera, KeypointIndex(i))).valid() ||
               std::binary_search(seen.begin(), seen.end(), here, pixel_before);
  }
  return taken;
}

// Observations of the problem per image (pose, camera).
std::vector<std::vector<Observation>> observations_by_image(const solver::ReprojectionProblem& problem,
                                                            std::size_t cameras) {
  std::vector<std::vector<Observation>> out(problem.T_rig_world.size() * cameras);
  for (const Observation& o : problem.observations)
    out[static_cast<std::size_t>(o.pose) * cameras + o.camera.index()].push_back(o);
  return out;
}

// The group of each point of the problem: that of the first pose that observes it. A point without observations belongs
// to none.
std::vector<std::optional<std::size_t>> groups_of_points(const RigProblem& problem) {
  const solver::ReprojectionProblem& bundle = problem.selected.problem;
  std::vector<std::optional<std::size_t>> out(bundle.points.size());
  for (const Observation& o : bundle.observations) {
    auto& group = out[static_cast<std::size_t>(o.point)];
    if (!group) group = problem.group[static_cast<std::size_t>(o.pose)];
  }
  return out;
}

// Keypoints and points that are excluded from the search in the images of one keyframe. `elsewhere`: flags of the
// points of other groups.
std::vector<matching::SearchExclusions> known_in(const map::BundledMap& map, KeyframeId keyframe,
                                                 std::span<const std::vector<Observation>> seen,
                                                 const std::vector<std::uint8_t>& elsewhere) {
  std::vector<matching::SearchExclusions> out(seen.size());
  for (std::size_t c = 0; c < seen.size(); ++c) {
    out[c].keypoints = taken_keypoints(map, keyframe, CameraIndex(c), seen[c]);
    out[c].points = elsewhere;
    for (const Observation& o : seen[c]) out[c].points[static_cast<std::size_t>(o.point)] = 1;
  }
  return out;
}

// The poses of the cameras of a keyframe when the middle rows of their images were exposed: the capture times with the
// offsets of `rig`, while the problem has those with the offsets of `of_map`.
std::vector<geometry::SE3> poses_at_exposure(const camera::Rig& rig, const camera::Rig& of_map,
                                             const solver::ReprojectionProblem& problem, std::size_t pose) {
  std::vector<geometry::SE3> out(rig.size());
  for (std::size_t c = 0; c < rig.size(); ++c) {
    geometry::SE3 T_rig_world = problem.T_rig_world[pose];
    const double later_s = to_seconds(rig.camera(c).time_offset_ns - of_map.camera(c).time_offset_ns);
    if (later_s != 0 && !problem.twist.empty())
      T_rig_world = geometry::SE3::exp(later_s * problem.twist[pose]) * T_rig_world;
    if (!problem.motion.empty()) T_rig_world = problem.motion[pose * rig.size() + c] * T_rig_world;
    out[c] = rig.cam_from_rig(c) * T_rig_world;
  }
  return out;
}

// Adds the observations of `points` in the images of one keyframe; `T_cam_world`: poses of its cameras.
void search_keyframe(const map::BundledMap& map, const camera::Rig& rig, std::size_t pose,
                     std::span<const geometry::SE3> T_cam_world, std::span<const matching::SearchPoint> points,
                     std::span<const std::vector<Observation>> seen, const std::vector<std::uint8_t>& elsewhere,
                     const feature::FeatureModel& features, adjustment::BundleProblem& selected) {
  const KeyframeId keyframe = selected.keyframes[pose];
  const frame::BundledFrame& frame = *map.keyframe(keyframe).frame;
  const geometry::Vector6d& twist =
      selected.problem.twist.empty() ? map.keyframe(keyframe).twist : selected.problem.twist[pose];
  const camera::Rig moving = frame::rig_of(rig, frame, twist);
  const matching::ProjectionSearchOptions options{
      .radius = kRadius, .max_hamming = kMaxHamming, .ratio = kRatio, .scale_factor = features.pyramid.scale_factor};
  const auto results =
      matching::search_cameras(moving, frame, T_cam_world, points, known_in(map, keyframe, seen, elsewhere), options);
  for (std::size_t c = 0; c < results.size(); ++c) {
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    for (const matching::ProjectionMatch& m : results[c].matches) {
      const Eigen::Vector2f pixel = keypoints.pixel[m.keypoint.index()];
      const auto error = solver::residual_error(rig.camera(c).model, moving.shutter(c),
                                                T_cam_world[c] * points[m.point].position, pixel.cast<double>());
      const double sigma = features.sigma(keypoints.level[m.keypoint.index()]);
      if (!error || error->squaredNorm() > kMaxRecoveredChi2 * sigma * sigma) continue;
      selected.problem.observations.push_back(
          {static_cast<int>(pose), static_cast<int>(m.point), CameraIndex(c), pixel, static_cast<float>(sigma)});
      selected.sources.push_back({selected.landmarks[m.point], keyframe});
    }
  }
}

}  // namespace

int recover_observations(const map::BundledMap& map, const camera::Rig& rig, const feature::FeatureModel& features,
                         RigProblem& problem) {
  adjustment::BundleProblem& selected = problem.selected;
  const std::size_t cameras = rig.size(), before = selected.problem.observations.size();
  const auto seen = observations_by_image(selected.problem, cameras);
  const auto group_of = groups_of_points(problem);
  std::vector<matching::SearchPoint> points = map::search_points(map, selected.landmarks);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].position = selected.problem.points[i];
  std::vector<std::uint8_t> elsewhere(points.size());
  for (std::size_t pose = 0; pose < selected.keyframes.size(); ++pose) {
    for (std::size_t i = 0; i < points.size(); ++i) elsewhere[i] = group_of[i] != problem.group[pose];
    search_keyframe(map, rig, pose, poses_at_exposure(rig, map.rig(), selected.problem, pose), points,
                    std::span(seen).subspan(pose * cameras, cameras), elsewhere, features, selected);
  }
  adjustment::sort_observations(selected);
  return static_cast<int>(selected.problem.observations.size() - before);
}

}  // namespace bslam::calibration
