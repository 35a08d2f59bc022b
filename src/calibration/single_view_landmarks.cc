#include "calibration/single_view_landmarks.h"

#include <vector>

#include "matching/point_estimation.h"

namespace bslam::calibration {
namespace {

// minimum angle between rays, in radians, for a position to be better than the previous one
constexpr double kMinParallax = 1e-3;

std::vector<matching::PointObservation> observations_of(const map::BundledMap& map, map::Observation observation) {
  std::vector<matching::PointObservation> out;
  for (const frame::KeypointRef ref :
       map.keyframe(observation.keyframe).frame->bundled.keypoints(observation.feature)) {
    const feature::Keypoints& keypoints = map.keypoints(observation.keyframe, ref.camera);
    const std::size_t i = ref.keypoint.index();
    out.push_back({&map.rig().camera(ref.camera), map.cam_from_world(observation.keyframe, ref),
                   keypoints.pixel[i].cast<double>(), keypoints.bearing[i], keypoints.sigma[i]});
  }
  return out;
}

}  // namespace

void triangulate_single_views(map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  map::SetPoses poses{.keyframes = {}, .landmarks = {}, .correction = true};
  for (const LandmarkId l : map.landmark_ids()) {
    const auto& observations = map.observations(l);
    if (observations.size() != 1) continue;
    if (const auto found = matching::estimate_point(observations_of(map, observations.front()), kMinParallax))
      poses.landmarks.emplace_back(l, found->point);
  }
  draft.set_poses(std::move(poses));
}

}  // namespace bslam::calibration
