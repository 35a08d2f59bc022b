#include "evaluation/trajectory_alignment.h"

#include <Eigen/SVD>
#include <cmath>

#include "base/assert.h"

namespace bslam::evaluation {

namespace {

using geometry::Matrix3d;
using geometry::Quaterniond;
using geometry::Vector3d;

// relative to the largest possible covariance of the two paths; smaller values are rounding errors
constexpr double kNoExtent = 1e-12;

Vector3d mean_of(std::span<const Vector3d> points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

std::optional<geometry::Sim3> align_positions(std::span<const Vector3d> src, std::span<const Vector3d> dst,
                                              geometry::ScaleMode scale) {
  BSLAM_ASSERT(src.size() == dst.size() && !src.empty(), "the spans must have equal size and must not be empty");
  if (auto determined = geometry::align_points(src, dst, scale)) return determined;
  const Vector3d mean_src = mean_of(src), mean_dst = mean_of(dst);
  Matrix3d covariance = Matrix3d::Zero();
  double spread_src = 0.0, spread_dst = 0.0;
  for (std::size_t i = 0; i < src.size(); ++i) {
    covariance += (dst[i] - mean_dst) * (src[i] - mean_src).transpose();
    spread_src += (src[i] - mean_src).squaredNorm();
    spread_dst += (dst[i] - mean_dst).squaredNorm();
  }
  // The covariance has at most rank one: every rotation that maps its only direction in src to its direction in dst
  // is a minimum.
  const Eigen::JacobiSVD<Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double strength = svd.singularValues().x();
  const bool has_direction = strength > kNoExtent * std::sqrt(spread_src * spread_dst);
  if (!has_direction && scale == geometry::ScaleMode::kFree) return std::nullopt;
  const Quaterniond rotation =
      has_direction ? Quaterniond::FromTwoVectors(svd.matrixV().col(0), svd.matrixU().col(0)) : Quaterniond::Identity();
  const double factor = scale == geometry::ScaleMode::kFree ? strength / spread_src : 1.0;
  return geometry::Sim3(factor, rotation, mean_dst - factor * (rotation * mean_src));
}

}  // namespace bslam::evaluation
