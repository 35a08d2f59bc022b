// The keypoints that observe a landmark, with the standard deviations that adjustments use.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "feature/feature_model.h"
#include "map/bundled_map.h"

namespace bslam::adjustment {

struct LandmarkKeypoint {
  KeyframeId keyframe;
  frame::KeypointRef keypoint;
  Eigen::Vector2f pixel;
  float sigma = 0;  // px, per axis
};

// The keypoints that observe a landmark in the keyframes that are `wanted`, in the order of its observations. A
// keypoint that is not aligned to the landmark's reference patch has the standard deviation of the detector, which
// `features` determines. The reference keypoint defines the landmark, so that its detection error is not an error of
// the observation: it gets the smallest sigma of the keypoints aligned to it, if that is smaller than its own. `out` is
// replaced.
template <class Wanted>
void landmark_keypoints(const map::BundledMap& map, LandmarkId landmark, const Wanted& wanted,
                        const feature::FeatureModel& features, std::vector<LandmarkKeypoint>& out) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  out.clear();
  std::size_t reference = kNone;
  float min_sigma = std::numeric_limits<float>::infinity();  // among keypoints aligned to the reference patch
  for (const map::Observation& o : map.observations(landmark)) {
    if (!wanted(o.keyframe)) continue;
    const frame::BundledFrame& frame = *map.keyframe(o.keyframe).frame;
    for (const frame::KeypointRef r : frame.bundled.keypoints(o.feature)) {
      const feature::Keypoints& keypoints = frame.keypoints(r.camera);
      const std::size_t k = r.keypoint.index();
      const double detected = features.sigma(keypoints.level[k]);
      const float sigma = o.aligned ? keypoints.sigma[k] : static_cast<float>(detected);
      if (o.aligned && map.landmark(landmark).reference == map::LandmarkReference{o.keyframe, r}) {
        reference = out.size();
      } else if (o.aligned) {
        min_sigma = std::min(min_sigma, sigma);
      }
      out.push_back({o.keyframe, r, keypoints.pixel[k], sigma});
    }
  }
  if (reference != kNone) out[reference].sigma = std::min(out[reference].sigma, min_sigma);
}

}  // namespace bslam::adjustment
