#include "estimators/pair_rotation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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

// One step of the least squares at a scale of the weights, rad.
Eigen::Vector3d step(std::span<const PlaneMatch> matches, const Eigen::Matrix3d& correction, double scale,
                     const PairRotationOptions& options) {
  const double information = 1.0 / (options.tolerance * options.tolerance),
               of_prior = 1.0 / (options.prior * options.prior);
  const Eigen::Vector3d so_far = geometry::so3_log(Eigen::Quaterniond(correction));
  Eigen::Matrix3d H = of_prior * Eigen::Matrix3d::Identity();
  Eigen::Vector3d g = of_prior * so_far;
  for (const PlaneMatch& m : matches) {
    const Eigen::Vector3d normal = correction * m.normal;
    const double distance = m.b.dot(normal);
    const double ratio = distance / scale, weight = information / std::pow(1 + ratio * ratio, 2);
    const Eigen::Vector3d J = normal.cross(m.b);
    H += weight * J * J.transpose();
    g += weight * distance * J;
  }
  return -H.ldlt().solve(g);
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
  constexpr double kFirstScale = 0.07, kShrink = 0.7;  // rad, per step
  constexpr int kLastSteps = 5;
  const std::vector<PlaneMatch> matches = plane_matches(given, pairs);
  PairRotation out;
  const auto advance = [&](double scale) {
    const Eigen::Vector3d omega = step(matches, out.correction, scale, options);
    out.correction = geometry::so3_exp(omega).toRotationMatrix() * out.correction;
  };
  for (double scale = kFirstScale; scale > options.tolerance; scale *= kShrink) advance(scale);
  for (int i = 0; i < kLastSteps; ++i) advance(options.tolerance);
  out.agreed = epipolar_agreement(given, pairs, options.tolerance).all;
  const EpipolarAgreement found =
      epipolar_agreement({out.correction * given.R_b_a, out.correction * given.t_b_a}, pairs, options.tolerance);
  out.agree = found.all;
  out.with_depth = found.with_depth;
  return out;
}

}  // namespace bslam::estimators
