// The camera models that project through a sphere. All share a last stage: a point at height `k` above the centre of
// a sphere and at distance `d` from it is mapped to m = (x, y) / (alpha d + (1 - alpha) k). The extended unified model
// has d = sqrt(beta (x^2 + y^2) + z^2) in place of the distance. Equations: docs/math.md, section 8.
#include <cmath>

#include "base/assert.h"
#include "camera/camera_model.h"

namespace bslam::camera {
namespace {

Vector2d from_pixel(const Intrinsics& k, const Vector2d& u) { return {(u.x() - k.cx) / k.fx, (u.y() - k.cy) / k.fy}; }

// Returns alpha d + (1 - alpha) k in the domain k > -w d, in which the last stage is one-to-one: for alpha <= 1/2 the
// directions with a positive divisor, for larger alpha those up to the angle at which the image radius starts to
// decrease.
std::optional<double> divisor(double alpha, double k, double d) {
  const double w = alpha > 0.5 ? (1 - alpha) / alpha : alpha / (1 - alpha);
  if (!(k > -w * d)) return std::nullopt;
  const double n = alpha * d + (1 - alpha) * k;
  return n > 0 ? std::optional(n) : std::nullopt;
}

// Returns the height h such that the last stage maps the direction (m_x, m_y, h) to the point m. `r2`: |m|^2, or
// beta |m|^2 for the extended unified model.
std::optional<double> height(double alpha, double r2) {
  const double root2 = 1 - (2 * alpha - 1) * r2;
  if (!(root2 > 0)) return std::nullopt;
  return (1 - alpha * alpha * r2) / (alpha * std::sqrt(root2) + 1 - alpha);
}

std::optional<Vector2d> divided(const Intrinsics& intrinsics, const Vector3d& p, const std::optional<double>& n) {
  if (!n) return std::nullopt;
  const Vector2d pixel(intrinsics.fx * (p.x() / *n) + intrinsics.cx, intrinsics.fy * (p.y() / *n) + intrinsics.cy);
  return pixel.allFinite() ? std::optional(pixel) : std::nullopt;
}

// As above, with the Jacobian; `dn` is the derivative of the divisor `n`.
std::optional<Projection> divided(const Intrinsics& intrinsics, const Vector3d& p, const std::optional<double>& n,
                                  const Eigen::RowVector3d& dn) {
  const auto pixel = divided(intrinsics, p, n);
  if (!pixel) return std::nullopt;
  Projection out{*pixel, {}};
  out.jacobian.row(0) = intrinsics.fx / *n * (Eigen::RowVector3d::UnitX() - p.x() / *n * dn);
  out.jacobian.row(1) = intrinsics.fy / *n * (Eigen::RowVector3d::UnitY() - p.y() / *n * dn);
  return out;
}

double ellipsoid_norm(const Vector3d& p, double beta) {
  return std::sqrt(beta * p.head<2>().squaredNorm() + p.z() * p.z());
}

std::optional<Vector2d> project_ellipsoid(const Intrinsics& k, double alpha, double beta, const Vector3d& p) {
  return divided(k, p, divisor(alpha, p.z(), ellipsoid_norm(p, beta)));
}

std::optional<Projection> project_ellipsoid_with_jacobian(const Intrinsics& k, double alpha, double beta,
                                                          const Vector3d& p) {
  const double d = ellipsoid_norm(p, beta);
  const Eigen::RowVector3d dd(beta * p.x() / d, beta * p.y() / d, p.z() / d);
  return divided(k, p, divisor(alpha, p.z(), d), alpha * dd + (1 - alpha) * Eigen::RowVector3d::UnitZ());
}

std::optional<Vector3d> unproject_ellipsoid(const Intrinsics& k, double alpha, double beta, const Vector2d& pixel) {
  if (!pixel.allFinite()) return std::nullopt;
  const Vector2d m = from_pixel(k, pixel);
  const auto z = height(alpha, beta * m.squaredNorm());
  if (!z) return std::nullopt;
  return Vector3d(m.x(), m.y(), *z).normalized();
}

}  // namespace

Unified::Unified(const Intrinsics& k, double alpha) : k_(k), alpha_(alpha) {
  BSLAM_ASSERT(alpha >= 0 && alpha <= 1, "alpha must be in [0, 1]");
}

std::optional<Vector2d> Unified::project(const Vector3d& point) const {
  return project_ellipsoid(k_, alpha_, 1.0, point);
}
std::optional<Projection> Unified::project_with_jacobian(const Vector3d& point) const {
  return project_ellipsoid_with_jacobian(k_, alpha_, 1.0, point);
}
std::optional<Vector3d> Unified::unproject(const Vector2d& pixel) const {
  return unproject_ellipsoid(k_, alpha_, 1.0, pixel);
}

ExtendedUnified::ExtendedUnified(const Intrinsics& k, double alpha, double beta) : k_(k), alpha_(alpha), beta_(beta) {
  BSLAM_ASSERT(alpha >= 0 && alpha <= 1 && beta > 0, "alpha must be in [0, 1] and beta positive");
}

std::optional<Vector2d> ExtendedUnified::project(const Vector3d& point) const {
  return project_ellipsoid(k_, alpha_, beta_, point);
}
std::optional<Projection> ExtendedUnified::project_with_jacobian(const Vector3d& point) const {
  return project_ellipsoid_with_jacobian(k_, alpha_, beta_, point);
}
std::optional<Vector3d> ExtendedUnified::unproject(const Vector2d& pixel) const {
  return unproject_ellipsoid(k_, alpha_, beta_, pixel);
}

// The point on the normalised image plane is (x, y) / n; its derivative with respect to a parameter is -(x, y) / n^2
// times that of n.
void Unified::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const double d = point.norm(), n = alpha_ * d + (1 - alpha_) * point.z();
  J.col(0) = -(d - point.z()) / (n * n) * point.head<2>();
}

void ExtendedUnified::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const double d = ellipsoid_norm(point, beta_), n = alpha_ * d + (1 - alpha_) * point.z();
  J.col(0) = -(d - point.z()) / (n * n) * point.head<2>();
  J.col(1) = -alpha_ * point.head<2>().squaredNorm() / (2 * d * n * n) * point.head<2>();
}

DoubleSphere::DoubleSphere(const Intrinsics& k, double xi, double alpha) : k_(k), xi_(xi), alpha_(alpha) {
  BSLAM_ASSERT(xi > -1 && xi <= 1 && alpha >= 0 && alpha <= 1, "xi must be in (-1, 1] and alpha in [0, 1]");
}

std::optional<Vector2d> DoubleSphere::project(const Vector3d& point) const {
  const double k = xi_ * point.norm() + point.z();
  const double d = std::sqrt(point.head<2>().squaredNorm() + k * k);
  return divided(k_, point, divisor(alpha_, k, d));
}

std::optional<Projection> DoubleSphere::project_with_jacobian(const Vector3d& point) const {
  const double norm = point.norm(), k = xi_ * norm + point.z();
  const double d = std::sqrt(point.head<2>().squaredNorm() + k * k);
  const Eigen::RowVector3d dk = xi_ / norm * point.transpose() + Eigen::RowVector3d::UnitZ();
  const Eigen::RowVector3d dd = (Eigen::RowVector3d(point.x(), point.y(), 0) + k * dk) / d;
  return divided(k_, point, divisor(alpha_, k, d), alpha_ * dd + (1 - alpha_) * dk);
}

void DoubleSphere::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const double norm = point.norm(), k = xi_ * norm + point.z();
  const double d = std::sqrt(point.head<2>().squaredNorm() + k * k), n = alpha_ * d + (1 - alpha_) * k;
  J.col(0) = -norm * (alpha_ * k / d + 1 - alpha_) / (n * n) * point.head<2>();
  J.col(1) = -(d - k) / (n * n) * point.head<2>();
}

std::optional<Vector3d> DoubleSphere::unproject(const Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Vector2d m = from_pixel(k_, pixel);
  const double r2 = m.squaredNorm();
  const auto z = height(alpha_, r2);
  if (!z) return std::nullopt;
  // Go from the second sphere along (m, z) back to the first sphere, whose centre is xi further along the axis.
  const double scale = (*z * xi_ + std::sqrt(*z * *z + (1 - xi_ * xi_) * r2)) / (*z * *z + r2);
  return Vector3d(scale * m.x(), scale * m.y(), scale * *z - xi_).normalized();
}

}  // namespace bslam::camera
