#include "matching/point_estimation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "geometry/triangulation.h"

namespace bslam::matching {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMaxSteps = 6;

struct NormalEquations {
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double worst_chi2 = 0;
  std::size_t worst = 0;
};

std::optional<NormalEquations> linearise(std::span<const PointObservation> observations, const Vector3d& point) {
  NormalEquations n;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const PointObservation& o = observations[i];
    const auto projection = o.camera->project_with_jacobian(o.T_cam_common * point);
    if (!projection) return std::nullopt;
    const Eigen::Matrix<double, 2, 3> J = projection->jacobian * o.T_cam_common.matrix3();
    const Eigen::Vector2d e = o.pixel - projection->pixel;
    const double weight = 1.0 / (o.sigma * o.sigma);
    n.H += weight * J.transpose() * J;
    n.b += weight * J.transpose() * e;
    const double chi2 = weight * e.squaredNorm();
    if (chi2 > n.worst_chi2) {
      n.worst_chi2 = chi2;
      n.worst = i;
    }
  }
  return n;
}

}  // namespace

std::optional<EstimatedPoint> estimate_point(std::span<const PointObservation> observations, double min_parallax) {
  std::vector<geometry::Ray> rays;
  rays.reserve(observations.size());
  for (const PointObservation& o : observations) {
    const geometry::SE3 T_common_cam = o.T_cam_common.inverse();
    rays.push_back({T_common_cam.translation(), T_common_cam.rotation() * o.bearing});
  }
  auto point = geometry::triangulate_midpoint(rays, min_parallax);
  if (!point) return std::nullopt;
  auto system = linearise(observations, *point);
  for (int step = 0; system && step < kMaxSteps; ++step) {
    const Vector3d delta = system->H.ldlt().solve(system->b);
    if (!delta.allFinite()) return std::nullopt;
    *point += delta;
    system = linearise(observations, *point);
    if (delta.squaredNorm() < 1e-12 * point->squaredNorm()) break;
  }
  if (!system || !point->allFinite()) return std::nullopt;
  EstimatedPoint out{
      .point = *point, .covariance = system->H.inverse(), .worst_chi2 = system->worst_chi2, .worst = system->worst};
  for (std::size_t i = 1; i < rays.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      out.parallax = std::max(out.parallax, geometry::angle_between(*point - rays[i].origin, *point - rays[j].origin));
    }
  }
  if (!out.covariance.allFinite() || !(out.parallax >= min_parallax)) return std::nullopt;
  return out;
}

}  // namespace bslam::matching
