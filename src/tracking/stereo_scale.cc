#include "tracking/stereo_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/median.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {
namespace {

// Returns true if the landmark was created from images of this camera alone.
bool created_by(CameraIndex camera, LandmarkId l, const map::BundledMap& map) {
  const auto& reference = map.landmark(l).reference;
  const frame::Bundled& bundled = map.keyframe(reference.keyframe).frame->bundled;
  return reference.keypoint.camera == camera && bundled.feature(reference.keypoint).index() >= bundled.num_matched();
}

}  // namespace

std::optional<frame::StereoScale> stereo_scale(const map::BundledMap& map, const frame::BundledFrame& frame,
                                               const FrameMatches& matches, const geometry::SE3& T_rig_world,
                                               const InitialisationOptions& options) {
  constexpr std::size_t kMinFeatures = 15;
  constexpr double kSigmaOfMedian = 1.4826;  // standard deviation per median absolute deviation of normal noise
  constexpr double kSigmas = 3.0, kMinChange = 0.1;
  if (map.scale() != map::Scale::kUnobservable) return std::nullopt;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<double> logs;  // of the ratios
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      const FeatureId f = frame.bundled.feature(CameraIndex(c), m.keypoint);
      if (f.index() >= frame.bundled.num_matched() || !created_by(CameraIndex(c), m.landmark, map)) continue;
      const auto& point = frame.bundled.point(f);
      if (!has_accurate_depth(point, options)) continue;
      const geometry::SE3& T_cam_rig = rig.cam_from_rig(c);
      const double distance = (T_cam_rig * (T_rig_world * map.landmark(m.landmark).position)).norm();
      logs.push_back(std::log((T_cam_rig * point->point_rig).norm() / distance));
    }
  }
  if (logs.size() < kMinFeatures) return std::nullopt;
  const double change = median(logs);
  for (double& l : logs) l = std::abs(l - change);
  const double sigma = kSigmaOfMedian * median(logs) / std::sqrt(static_cast<double>(logs.size()));
  if (std::abs(change) <= std::max(kSigmas * sigma, kMinChange)) return std::nullopt;
  return frame::StereoScale{std::exp(change), map.gauge_epoch()};
}

}  // namespace bslam::tracking
