#include "adjustment/bundle_problem.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "adjustment/landmark_keypoints.h"

namespace bslam::adjustment {
namespace {

// Adds the observations of one landmark, unless fewer than two keyframes of the problem observe it: such a landmark
// does not constrain the poses. `pose_index`: as index_by_keyframe. `keypoints`: memory for those of the landmark.
void add_landmark(const map::BundledMap& map, LandmarkId id, const std::vector<int>& pose_index,
                  const feature::FeatureModel& features, std::vector<LandmarkKeypoint>& keypoints,
                  BundleProblem& selected) {
  const auto observations = map.observations(id);
  const auto seen = std::count_if(observations.begin(), observations.end(),
                                  [&](const map::Observation& o) { return pose_index[o.keyframe.index()] >= 0; });
  if (seen < 2) return;
  const int point = static_cast<int>(selected.landmarks.size());
  const auto wanted = [&](KeyframeId k) { return pose_index[k.index()] >= 0; };
  landmark_keypoints(map, id, wanted, features, keypoints);
  for (const LandmarkKeypoint& k : keypoints) {
    selected.problem.observations.push_back(
        {pose_index[k.keyframe.index()], point, k.keypoint.camera, k.pixel, k.sigma});
    selected.sources.push_back({id, k.keyframe});
  }
  selected.landmarks.push_back(id);
  selected.problem.points.push_back(map.landmark(id).position);
}

// The motions with the moves of cameras. A move, T_after_initial T_cam_rig, is the motion
// T_cam_rig^-1 T_after_initial T_cam_rig of the rig as this camera sees it.
std::vector<geometry::SE3> motions(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<geometry::SE3> out = motions_without_moves(map, keyframes);
  const camera::Rig& rig = map.rig();
  if (rig.moves().empty()) return out;
  out.resize(keyframes.size() * rig.size());  // without motions, they are the identity
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::size_t c = i % rig.size();
    const TimeNs time_ns = map.keyframe(keyframes[i / rig.size()]).frame->time_ns;
    out[i] = rig.rig_from_cam(c) * rig.cam_from_rig_at(c, time_ns) * out[i];
  }
  return out;
}

// Velocities of the keyframes; empty if no camera has a rolling shutter.
std::vector<geometry::Vector6d> twists(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<geometry::Vector6d> out;
  bool rolling = false;
  for (std::size_t c = 0; c < map.rig().size(); ++c) rolling |= map.rig().camera(c).readout_s != 0;
  for (std::size_t i = 0; rolling && i < keyframes.size(); ++i) out.push_back(map.keyframe(keyframes[i]).twist);
  return out;
}

}  // namespace

std::vector<int> index_by_keyframe(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<int> out(map.keyframe_slots(), -1);
  for (std::size_t i = 0; i < keyframes.size(); ++i) out[keyframes[i].index()] = static_cast<int>(i);
  return out;
}

std::vector<geometry::SE3> motions_without_moves(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<geometry::SE3> out;
  bool any = false;
  for (const KeyframeId k : keyframes) {
    for (std::size_t c = 0; c < map.rig().size(); ++c) {
      any |= map.keyframe(k).frame->delay_s(c) != 0.0;
      out.push_back(map.motion_until(k, CameraIndex(c)));
    }
  }
  if (!any) out.clear();
  return out;
}

BundleProblem build_problem(const map::BundledMap& map, const Selection& selection,
                            const feature::FeatureModel& features) {
  BundleProblem selected;
  selected.problem.rig = &map.rig();
  selected.keyframes = selection.free_keyframes;
  selected.keyframes.insert(selected.keyframes.end(), selection.fixed_keyframes.begin(),
                            selection.fixed_keyframes.end());
  std::sort(selected.keyframes.begin(), selected.keyframes.end());
  for (const KeyframeId k : selected.keyframes) {
    selected.problem.T_rig_world.push_back(map.keyframe(k).T_rig_world);
    selected.problem.pose_free.push_back(
        std::binary_search(selection.free_keyframes.begin(), selection.free_keyframes.end(), k));
  }
  selected.problem.motion = motions(map, selected.keyframes);
  selected.problem.twist = twists(map, selected.keyframes);
  const std::vector<int> pose_index = index_by_keyframe(map, selected.keyframes);
  std::vector<LandmarkKeypoint> keypoints;
  for (const LandmarkId l : selection.landmarks) add_landmark(map, l, pose_index, features, keypoints, selected);
  return selected;
}

void sort_observations(BundleProblem& problem) {
  using Sourced = std::pair<solver::ReprojectionProblem::Observation, ObservationSource>;
  std::vector<Sourced> all;
  for (std::size_t i = 0; i < problem.sources.size(); ++i)
    all.emplace_back(problem.problem.observations[i], problem.sources[i]);
  std::ranges::stable_sort(all, {},
                           [](const Sourced& o) { return std::tuple(o.first.point, o.first.pose, o.first.camera); });
  for (std::size_t i = 0; i < all.size(); ++i) std::tie(problem.problem.observations[i], problem.sources[i]) = all[i];
}

}  // namespace bslam::adjustment
