#include "estimators/pair_rotation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "geometry/so3.h"
#include "geometry/triangulation.h"

namespace bslam::estimators {
namespace {

struct PlaneMatch {
  Eigen::Vector3d normal, b;  // normal of the epipolar plane in camera b as calibrated; bearing in camera b
};

std::vector<PlaneMatch> plane_matches(const EpipolarPose& given, std::span<const BearingPair> pairs) {
  constexpr double kMinSine = 0.02;  // the plane of a point on the baseline is undefined
  std::vector<PlaneMatch> out;
  for (const BearingPair& pair : pairs) {
    const Eigen::Vector3d normal = given.t_b_a.normalized().cross(given.R_b_a * pair.a);
    if (normal.norm() > kMinSine) out.push_back({normal.normalized(), pair.b});
  }
  return out;
}

// Unknowns: the rotation of camera b, and the relative error of its focal length.
struct Estimate {
  Eigen::Matrix3d correction = Eigen::Matrix3d::Identity();
  double focal_error = 0;
};

// The derivative of a bearing of camera b with respect to the logarithm of a factor by which its image is enlarged.
Eigen::Vector3d outward(const Eigen::Vector3d& b) { return {b.x(), b.y(), 0}; }

// The bearing with the focal length that an estimate of its relative error gives, not of unit length.
Eigen::Vector3d refocused(const Eigen::Vector3d& b, double focal_error) { return b - focal_error * outward(b); }

// The axis of the rotation of camera b that changes mainly disparities.
Eigen::Vector3d disparity_axis(const EpipolarPose& given, std::span<const PlaneMatch> matches) {
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
  for (const PlaneMatch& m : matches) view += m.b;
  return view.cross(given.t_b_a).stableNormalized();
}

// One step of the least squares at a scale of the weights, rad. The rotation about the axis `fixed` stays as given.
void advance(std::span<const PlaneMatch> matches, double scale, const Eigen::Vector3d& fixed,
             const PairRotationOptions& options, Estimate& estimate) {
  constexpr double kFixed = 1e6;  // factor of the information
  const double information = 1.0 / (options.tolerance * options.tolerance);
  const Eigen::Vector4d of_prior(options.prior, options.prior, options.prior, options.focal_error);
  Eigen::Matrix4d prior = of_prior.cwiseAbs2().cwiseInverse().asDiagonal();
  prior.topLeftCorner<3, 3>() += kFixed * information * fixed * fixed.transpose();
  Eigen::Vector4d so_far;
  so_far << geometry::so3_log(Eigen::Quaterniond(estimate.correction)), estimate.focal_error;
  Eigen::Matrix4d H = prior;
  Eigen::Vector4d g = prior * so_far;
  for (const PlaneMatch& m : matches) {
    const Eigen::Vector3d normal = estimate.correction * m.normal, b = refocused(m.b, estimate.focal_error);
    const double distance = b.dot(normal);
    const double ratio = distance / scale, weight = information / std::pow(1 + ratio * ratio, 2);
    Eigen::Vector4d J;
    J << normal.cross(b), -outward(m.b).dot(normal);
    H += weight * J * J.transpose();
    g += weight * distance * J;
  }
  const Eigen::Vector4d step = -H.ldlt().solve(g);
  estimate.correction = geometry::so3_exp(step.head<3>()).toRotationMatrix() * estimate.correction;
  estimate.focal_error += step(3);
}

EpipolarPose corrected(const EpipolarPose& given, const Eigen::Matrix3d& correction) {
  return {correction * given.R_b_a, correction * given.t_b_a};
}

void count(const EpipolarPose& given, std::span<const BearingPair> pairs, const PairRotationOptions& options,
           PairRotation& out) {
  const EpipolarAgreement found = epipolar_agreement(corrected(given, out.correction), pairs, options.tolerance);
  out.agree = found.all;
  out.with_depth = found.with_depth;
}

// All members of the result except `brought_to_front`.
PairRotation solve(const EpipolarPose& given, std::span<const BearingPair> pairs, std::span<const PlaneMatch> matches,
                   const Eigen::Vector3d& fixed, const PairRotationOptions& options) {
  constexpr double kFirstScale = 0.07, kShrink = 0.7;  // rad, per step
  constexpr int kLastSteps = 5;
  Estimate estimate;
  for (double scale = kFirstScale; scale > options.tolerance; scale *= kShrink)
    advance(matches, scale, fixed, options, estimate);
  for (int i = 0; i < kLastSteps; ++i) advance(matches, options.tolerance, fixed, options, estimate);
  PairRotation out;
  out.correction = estimate.correction;
  out.focal_error = estimate.focal_error;
  count(given, pairs, options, out);
  return out;
}

// The rotation about the disparity axis, on the left of `correction`, that brings to infinity the matches that are on
// their epipolar planes but behind the cameras, i.e. beyond parallel; 0 if they are so few that they may be wrong
// matches, or so many that the cameras may be exchanged. The farthest angle is estimated from the tolerance, which
// those behind exceed, and their median: it is insensitive to wrong ones among them, as the largest angle is not. A
// wrong focal length brings matches behind the cameras as well, at one side of the image.
double rotation_to_front(const EpipolarPose& pose, std::span<const BearingPair> pairs, const Eigen::Vector3d& axis,
                         double focal_error, double tolerance) {
  constexpr double kFew = 0.05, kMany = 0.85;  // fractions of the matches on their planes
  std::size_t on_plane = 0;
  std::vector<double> behind;  // angles from the parallel of a to b, rad, negative behind the cameras
  for (const BearingPair& pair : pairs) {
    const BearingPair match{pair.a, refocused(pair.b, focal_error).normalized()};
    const Eigen::Vector3d parallel = pose.R_b_a * match.a;
    if (geometry::angle_between(parallel, match.b) >= tolerance && epipolar_angle(pose, match) >= tolerance) continue;
    const Eigen::Vector3d a = (parallel - axis.dot(parallel) * axis).stableNormalized();
    const Eigen::Vector3d b = (match.b - axis.dot(match.b) * axis).stableNormalized();
    const double angle = std::atan2(axis.dot(a.cross(b)), a.dot(b));
    ++on_plane;
    if (angle < -tolerance) behind.push_back(angle);
  }
  const double fraction = static_cast<double>(behind.size()) / static_cast<double>(std::max<std::size_t>(1, on_plane));
  return fraction > kFew && fraction < kMany ? 2.0 * median(std::move(behind)) + tolerance : 0.0;
}

}  // namespace

EpipolarAgreement epipolar_agreement(const EpipolarPose& pose, std::span<const BearingPair> pairs, double tolerance) {
  EpipolarAgreement out;
  for (const BearingPair& pair : pairs) {
    if (geometry::angle_between(pose.R_b_a * pair.a, pair.b) < tolerance) {
      ++out.all;  // too far away to have a depth
    } else if (epipolar_angle(pose, pair) < tolerance && in_front_of_both(pose, pair)) {
      ++out.all;
      ++out.with_depth;
    }
  }
  return out;
}

PairRotation pair_rotation(const EpipolarPose& given, std::span<const BearingPair> pairs,
                           const PairRotationOptions& options) {
  constexpr double kClearly = 1.15;  // factor of the number of matches
  const std::vector<PlaneMatch> matches = plane_matches(given, pairs);
  const Eigen::Vector3d axis = disparity_axis(given, matches);
  PairRotation kept = solve(given, pairs, matches, axis, options);
  const double angle =
      rotation_to_front(corrected(given, kept.correction), pairs, axis, kept.focal_error, options.tolerance);
  if (angle != 0.0) {
    kept.brought_to_front = true;
    kept.correction = geometry::so3_exp(angle * axis).toRotationMatrix() * kept.correction;
    count(given, pairs, options, kept);
  }
  const PairRotation free = solve(given, pairs, matches, Eigen::Vector3d::Zero(), options);
  return free.agree > kClearly * kept.agree ? free : kept;
}

}  // namespace bslam::estimators
