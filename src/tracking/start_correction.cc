#include "tracking/start_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimators/pair_rotation.h"
#include "feature/descriptor_matching.h"
#include "frame/capture_times.h"
#include "geometry/so3.h"

namespace bslam::tracking {
namespace {

constexpr std::size_t kMinMatches = 60;
constexpr double kMinAgreeing = 0.6;  // minimum fraction of the matches that agree with the correction
constexpr int kMinWithDepth = 25;     // minimum number of these that are in front of both cameras
constexpr double kClearly = 1.5;      // minimum factor by which the correction increases their number
constexpr double kSome = 1.04;        // the same, if it brings matches in front of the cameras
constexpr double kTolerancePx = 2.0;
constexpr double kMaxAngle = 0.1;      // rad; a larger one is another arrangement of the cameras
constexpr double kMinBaseline = 1e-3;  // m
constexpr double kKnownFocal = 0.02;   // relative standard deviation of focal lengths that are not corrected

using estimators::bearing_pairs;
using estimators::PixelPair;

std::vector<PixelPair> matches_of(const frame::CameraFrame& a, const frame::CameraFrame& b) {
  std::vector<PixelPair> out;
  for (const feature::DescriptorMatch& m : feature::mutual_matches(a.keypoints.descriptor, b.keypoints.descriptor,
                                                                   [](std::size_t, std::size_t) { return true; })) {
    out.push_back({a.keypoints.pixel[m.a.index()].cast<double>(), b.keypoints.pixel[m.b.index()].cast<double>()});
  }
  return out;
}

estimators::EpipolarPose epipolar_pose(const geometry::SE3& T_b_a) {
  return {T_b_a.matrix3(), T_b_a.translation().normalized()};
}

// Returns true if most matches are explained by identical images of both cameras, by exchanged cameras, or by an
// inverted transform. A small corrected rotation must not hide such mistakes.
bool other_mistake(const camera::Camera& of_i, const camera::Camera& of_j, const geometry::SE3& T_j_i,
                   std::span<const PixelPair> matches, double tolerance) {
  constexpr double kSamePx = 0.5;
  const auto needed = static_cast<int>(kMinAgreeing * static_cast<double>(matches.size()));
  const auto same = std::ranges::count_if(matches, [](const PixelPair& m) { return (m.a - m.b).norm() < kSamePx; });
  const estimators::EpipolarPose pose = epipolar_pose(T_j_i.inverse());
  return same > needed ||
         estimators::epipolar_agreement(pose, bearing_pairs(matches, of_j, of_i), tolerance).all > needed ||
         estimators::epipolar_agreement(pose, bearing_pairs(matches, of_i, of_j), tolerance).all > needed;
}

struct Pair {
  camera::RigCamera i, j;
};

geometry::SE3 relative_pose(const Pair& pair) { return pair.j.T_body_cam.inverse() * pair.i.T_body_cam; }

double tolerance_of(const Pair& pair) {
  return kTolerancePx * std::max(pair.i.camera.radians_per_pixel(), pair.j.camera.radians_per_pixel());
}

bool has_other_focal(const camera::Camera& a, const camera::Camera& b) {
  return camera::intrinsics(a.model).fx != camera::intrinsics(b.model).fx;
}

// Camera j with the focal length, relative to that of camera i, with which clearly more matches are on their epipolar
// planes, or as given if there is none.
camera::Camera with_focal_of_pair(const Pair& pair, double sigma_focal, std::span<const PixelPair> matches) {
  constexpr double kStep = 0.05;         // of the logarithm
  constexpr double kDeviations = 2.0;    // the farthest
  constexpr double kClearlyMore = 1.15;  // factor of the number of matches
  const estimators::EpipolarPose pose = epipolar_pose(relative_pose(pair));
  const auto found_with = [&](double log_factor) {
    const camera::Camera camera = camera::zoomed(pair.j.camera, std::exp(log_factor));
    return estimators::pair_rotation(pose, bearing_pairs(matches, pair.i.camera, camera),
                                     {.tolerance = tolerance_of(pair)});
  };
  const estimators::PairRotation as_given = found_with(0.0);
  estimators::PairRotation found = as_given;
  double best = 0.0;
  const auto consider = [&](double log_factor) {
    const estimators::PairRotation other = found_with(log_factor);
    if (other.agree <= found.agree) return;
    found = other;
    best = log_factor;
  };
  const double farthest = kDeviations * std::sqrt(2.0) * sigma_focal;  // of the ratio
  for (double step = kStep; step <= farthest; step += kStep) {
    for (const double sign : {-1.0, 1.0}) consider(sign * step);
  }
  consider(best + found.focal_error);
  return found.agree > kClearlyMore * as_given.agree ? camera::zoomed(pair.j.camera, std::exp(best)) : pair.j.camera;
}

// Camera j of a pair as most matches show it: as given, or corrected; nullopt if they do not show it.
std::optional<camera::RigCamera> agreeing_camera(const Pair& pair, double sigma_focal, const frame::CameraFrame& a,
                                                 const frame::CameraFrame& b) {
  if (std::min(a.keypoints.size(), b.keypoints.size()) < kMinMatches) return std::nullopt;
  const geometry::SE3 T_j_i = relative_pose(pair);
  if (std::abs(a.time_ns - b.time_ns) > frame::kTogetherNs || T_j_i.translation().norm() < kMinBaseline)
    return std::nullopt;
  const std::vector<PixelPair> matches = matches_of(a, b);
  if (matches.size() < kMinMatches) return std::nullopt;
  const double tolerance = tolerance_of(pair);
  camera::RigCamera corrected = pair.j;
  if (sigma_focal > kKnownFocal) corrected.camera = with_focal_of_pair(pair, sigma_focal, matches);
  const bool other_focal = has_other_focal(corrected.camera, pair.j.camera);
  // Either camera may be the one that is rotated about its own centre.
  const geometry::SE3 T_i_j = T_j_i.inverse();
  const auto rotation = [&](const geometry::SE3& T, const std::vector<estimators::BearingPair>& pairs) {
    return estimators::pair_rotation(epipolar_pose(T), pairs, {.tolerance = tolerance});
  };
  const std::vector<estimators::BearingPair> pairs = bearing_pairs(matches, pair.i.camera, corrected.camera);
  std::vector<estimators::BearingPair> swapped = pairs;
  for (estimators::BearingPair& match : swapped) std::swap(match.a, match.b);
  const estimators::PairRotation of_j = rotation(T_j_i, pairs), of_i = rotation(T_i_j, swapped);
  const bool second = of_j.agree >= of_i.agree;
  const estimators::PairRotation& found = second ? of_j : of_i;
  const auto as_given = bearing_pairs(matches, pair.i.camera, pair.j.camera);
  const int agreed = estimators::epipolar_agreement(epipolar_pose(T_j_i), as_given, tolerance).all;
  if (found.agree < kMinAgreeing * static_cast<double>(matches.size())) return std::nullopt;
  const bool some_suffice = found.brought_to_front && !other_focal;
  if (found.agree < (some_suffice ? kSome : kClearly) * agreed) return pair.j;
  if (found.with_depth < kMinWithDepth || other_mistake(pair.i.camera, corrected.camera, T_j_i, matches, tolerance))
    return std::nullopt;
  const geometry::SE3 correction(Eigen::Quaterniond(found.correction), Eigen::Vector3d::Zero());
  const geometry::SE3 T = second ? correction * T_j_i : (correction * T_i_j).inverse();
  corrected.T_body_cam = pair.i.T_body_cam * T.inverse();
  return corrected;
}

// Returns true if some camera is rotated too far for a camera that was bumped: the arrangement of the cameras is
// another one.
bool rearranged(const camera::Rig& rig, const camera::Rig& given) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3 difference = rig.cam_from_rig(c) * given.rig_from_cam(c);
    if (geometry::so3_log(difference.rotation()).norm() > kMaxAngle) return true;
  }
  return false;
}

}  // namespace

std::optional<camera::Rig> with_corrected_pairs(const camera::Rig& rig, const camera::Rig& given, double sigma_focal,
                                                const frame::BundledFrame& frame) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  bool any = false;
  for (std::size_t j = 1; j < rig.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      if (!rig.share_view(i, j)) continue;
      // The pose of camera j relative to camera i as given, which may have been corrected.
      const geometry::SE3 T_i_j = rig.cam_from_rig(i) * rig.rig_from_cam(j);
      const camera::RigCamera as_given{rig.camera(j), cameras[i].T_body_cam * T_i_j};
      // A focal length is corrected once.
      const double sigma = has_other_focal(rig.camera(j), given.camera(j)) ? 0.0 : sigma_focal;
      auto agreeing = agreeing_camera({cameras[i], as_given}, sigma, frame.cameras[i], frame.cameras[j]);
      if (!agreeing) continue;
      any |= agreeing->T_body_cam.rotation().coeffs() != as_given.T_body_cam.rotation().coeffs();
      cameras[j] = *std::move(agreeing);
      break;
    }
  }
  if (!any) return std::nullopt;
  camera::Rig corrected(std::move(cameras), rig.cam_from_rig(0));
  return rearranged(corrected, given) ? std::nullopt : std::optional(std::move(corrected));
}

}  // namespace bslam::tracking
