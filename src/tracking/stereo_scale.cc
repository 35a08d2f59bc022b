#include "tracking/stereo_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {
namespace {

// Returns true if the landmark was created from images of this camera alone.
bool created_by(CameraIndex camera, LandmarkId l, const map::BundledMap& map) {
  const auto& reference = map.landmark(l).reference;
  const frame::Bundled& bundled = map.keyframe(reference.keyframe).frame->bundled;
  return reference.keypoint.camera == camera && !bundled.is_matched(bundled.feature(reference.keypoint));
}

}  // namespace

MedianRatio median_ratio(std::vector<double> ratios) {
  constexpr double kSigmaOfMedian = 1.4826;  // standard deviation per median absolute deviation of normal noise
  const double ratio = median(ratios);
  for (double& r : ratios) r = std::abs(std::log(r / ratio));
  return {ratio, kSigmaOfMedian * median(std::move(ratios))};
}

std::optional<frame::StereoScale> stereo_scale(const map::BundledMap& map, const frame::BundledFrame& frame,
                                               const FrameMatches& matches, const geometry::SE3& T_rig_world,
                                               const InitialisationOptions& options) {
  constexpr std::size_t kMinFeatures = 15;
  constexpr double kSigmas = 3.0, kMinChange = 0.1;
  if (map.scale() != map::Scale::kUnobservable) return std::nullopt;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<double> ratios;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const geometry::SE3& T_cam_rig = rig.cam_from_rig(c);
    for (const Match& m : matches[c]) {
      const auto& point = frame.bundled.point(frame.bundled.feature(CameraIndex(c), m.keypoint));
      if (!has_accurate_depth(point, options) || !created_by(CameraIndex(c), m.landmark, map)) continue;
      const double distance = (T_cam_rig * (T_rig_world * map.landmark(m.landmark).position)).norm();
      ratios.push_back((T_cam_rig * point->point_rig).norm() / distance);
    }
  }
  if (ratios.size() < kMinFeatures) return std::nullopt;
  const double features = static_cast<double>(ratios.size());
  const auto [ratio, deviation] = median_ratio(std::move(ratios));
  const double least = std::max(kSigmas * deviation / std::sqrt(features), kMinChange);
  if (std::abs(std::log(ratio)) <= least) return std::nullopt;
  return frame::StereoScale{ratio, map.gauge_epoch()};
}

}  // namespace bslam::tracking
