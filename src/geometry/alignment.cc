#include "geometry/alignment.h"

#include <Eigen/SVD>

#include "base/assert.h"

namespace bslam::geometry {

std::optional<Sim3> align_points(std::span<const Vector3d> src, std::span<const Vector3d> dst, ScaleMode scale) {
  BSLAM_ASSERT(src.size() == dst.size(), "the point sets must have equal size");
  if (src.size() < 3) return std::nullopt;
  Vector3d mean_src = Vector3d::Zero(), mean_dst = Vector3d::Zero();
  for (std::size_t i = 0; i < src.size(); ++i) {
    mean_src += src[i];
    mean_dst += dst[i];
  }
  const double n = static_cast<double>(src.size());
  mean_src /= n;
  mean_dst /= n;
  Matrix3d covariance = Matrix3d::Zero();
  double variance_src = 0.0;
  for (std::size_t i = 0; i < src.size(); ++i) {
    covariance += (dst[i] - mean_dst) * (src[i] - mean_src).transpose() / n;
    variance_src += (src[i] - mean_src).squaredNorm() / n;
  }
  const Eigen::JacobiSVD<Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3d s = svd.singularValues();
  if (!(s.x() > 0.0) || s.y() < 1e-12 * s.x()) return std::nullopt;
  Vector3d sign = Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1.0;
  const Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const double factor = scale == ScaleMode::kFree ? s.dot(sign) / variance_src : 1.0;
  return Sim3(factor, Quaterniond(R), mean_dst - factor * (R * mean_src));
}

}  // namespace bslam::geometry
