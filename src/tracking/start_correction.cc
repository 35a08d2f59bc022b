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

// Returns true if most matches are explained by identical images of both cameras, by exchanged cameras, or by an
// inverted transform. A small corrected rotation must not hide such mistakes.
bool other_mistake(const camera::Camera& of_i, const camera::Camera& of_j, const geometry::SE3& T_j_i,
                   std::span<const PixelPair> matches, double tolerance) {
  constexpr double kSamePx = 0.5;
  const auto needed = static_cast<int>(kMinAgreeing * static_cast<double>(matches.size()));
  const auto same = std::ranges::count_if(matches, [](const PixelPair& m) { return (m.a - m.b).norm() < kSamePx; });
  const geometry::SE3 inverse = T_j_i.inverse();
  const estimators::EpipolarPose pose{inverse.matrix3(), inverse.translation().normalized()};
  return same > needed ||
         estimators::epipolar_agreement(pose, bearing_pairs(matches, of_j, of_i), tolerance).all > needed ||
         estimators::epipolar_agreement(pose, bearing_pairs(matches, of_i, of_j), tolerance).all > needed;
}

// T_j_i with the rotation of camera j that agrees with most matches: as given, or corrected; nullopt if none does.
std::optional<geometry::SE3> agreeing_pose(const camera::Rig& rig, std::size_t i, std::size_t j,
                                           const geometry::SE3& T_j_i, const frame::BundledFrame& frame) {
  const frame::CameraFrame &a = frame.cameras[i], &b = frame.cameras[j];
  if (std::min(a.keypoints.size(), b.keypoints.size()) < kMinMatches) return std::nullopt;
  if (std::abs(a.time_ns - b.time_ns) > frame::kTogetherNs || T_j_i.translation().norm() < kMinBaseline)
    return std::nullopt;
  const std::vector<PixelPair> matches = matches_of(a, b);
  if (matches.size() < kMinMatches) return std::nullopt;
  const double tolerance =
      kTolerancePx * std::max(rig.camera(i).radians_per_pixel(), rig.camera(j).radians_per_pixel());
  // Either camera may be the one that is rotated about its own centre.
  const geometry::SE3 T_i_j = T_j_i.inverse();
  const auto rotation = [&](const geometry::SE3& T, const std::vector<estimators::BearingPair>& pairs) {
    return estimators::pair_rotation({T.matrix3(), T.translation().normalized()}, pairs, {.tolerance = tolerance});
  };
  const std::vector<estimators::BearingPair> pairs = bearing_pairs(matches, rig.camera(i), rig.camera(j));
  std::vector<estimators::BearingPair> swapped = pairs;
  for (estimators::BearingPair& pair : swapped) std::swap(pair.a, pair.b);
  const estimators::PairRotation of_j = rotation(T_j_i, pairs), of_i = rotation(T_i_j, swapped);
  const bool second = of_j.agree >= of_i.agree;
  const estimators::PairRotation& found = second ? of_j : of_i;
  if (found.agree < kMinAgreeing * static_cast<double>(matches.size())) return std::nullopt;
  if (found.agree < (found.brought_to_front ? kSome : kClearly) * found.agreed) return T_j_i;
  if (found.with_depth < kMinWithDepth || other_mistake(rig.camera(i), rig.camera(j), T_j_i, matches, tolerance))
    return std::nullopt;
  const geometry::SE3 correction(Eigen::Quaterniond(found.correction), Eigen::Vector3d::Zero());
  return second ? correction * T_j_i : (correction * T_i_j).inverse();
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

std::optional<camera::Rig> with_corrected_rotations(const camera::Rig& rig, const camera::Rig& given,
                                                    const frame::BundledFrame& frame) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  bool any = false;
  for (std::size_t j = 1; j < rig.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      if (!rig.share_view(i, j)) continue;
      const geometry::SE3 T_j_i = rig.cam_from_rig(j) * rig.rig_from_cam(i);
      const auto agreeing = agreeing_pose(rig, i, j, T_j_i, frame);
      if (!agreeing) continue;
      any |= !(agreeing->rotation().coeffs() == T_j_i.rotation().coeffs());
      cameras[j].T_body_cam = cameras[i].T_body_cam * agreeing->inverse();
      break;
    }
  }
  if (!any) return std::nullopt;
  camera::Rig corrected(std::move(cameras), rig.cam_from_rig(0));
  return rearranged(corrected, given) ? std::nullopt : std::optional(std::move(corrected));
}

}  // namespace bslam::tracking
