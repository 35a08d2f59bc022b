#include "camera/camera_model.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/assert.h"

namespace bslam::camera {
namespace {

using image_plane::kMinDepth;
using image_plane::to_pixel;
Vector2d from_pixel(const Intrinsics& k, const Vector2d& u) { return {(u.x() - k.cx) / k.fx, (u.y() - k.cy) / k.fy}; }

}  // namespace

std::optional<Vector3d> Pinhole::unproject(const Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  return from_pixel(k_, pixel).homogeneous().normalized();
}

PinholeRadTan::PinholeRadTan(const Intrinsics& k, const std::vector<double>& distortion) : k_(k) {
  BSLAM_ASSERT(distortion.size() == 4 || distortion.size() == 5 || distortion.size() == 8,
               "radial-tangential distortion has 4, 5 or 8 coefficients");
  count_ = static_cast<int>(distortion.size());
  std::copy(distortion.begin(), distortion.end(), d_.begin());
  // The distorted radius r f(r) increases from 0; find where it stops doing so. No practical lens exceeds tan(89
  // degrees).
  max_radius_ = std::numeric_limits<double>::infinity();
  constexpr double kStep = 0.002, kLast = 57.0;
  for (double r = kStep, last = 0.0; r < kLast; r += kStep) {
    const double r2 = r * r;
    const double denominator = 1 + r2 * (d_[5] + r2 * (d_[6] + r2 * d_[7]));
    const double value = r * (1 + r2 * (d_[0] + r2 * (d_[1] + r2 * d_[4]))) / denominator;
    if (!(denominator > 0) || !(value > last)) {
      max_radius_ = r - kStep;
      break;
    }
    last = value;
  }
}

void PinholeRadTan::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const Vector2d m = point.head<2>() / point.z();
  const double x = m.x(), y = m.y(), r2 = m.squaredNorm();
  const double a = 1 + r2 * (d_[0] + r2 * (d_[1] + r2 * d_[4])), b = 1 + r2 * (d_[5] + r2 * (d_[6] + r2 * d_[7]));
  const double numerator = r2 / b, denominator = -r2 * a / (b * b);  // d (a / b) / d k1, and / d k4
  J.col(0) = numerator * m;
  J.col(1) = r2 * numerator * m;
  J.col(2) << 2 * x * y, r2 + 2 * y * y;
  J.col(3) << r2 + 2 * x * x, 2 * x * y;
  if (count_ > 4) J.col(4) = r2 * r2 * numerator * m;
  if (count_ == 4 || count_ == 5) return;
  for (int i = 0; i < 3; ++i) J.col(5 + i) = std::pow(r2, i) * denominator * m;
}

std::optional<Vector3d> PinholeRadTan::unproject(const Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Vector2d target = from_pixel(k_, pixel);
  Vector2d m = target;
  if (!(m.norm() < max_radius_)) m *= 0.9 * max_radius_ / m.norm();
  for (int i = 0; i < 30; ++i) {  // Newton's method, restricted to the domain
    const Distorted d = distort(m);
    const Vector2d residual = d.point - target;
    if (residual.squaredNorm() < 1e-26) break;
    Vector2d step = d.jacobian.inverse() * residual;
    if (!step.allFinite()) return std::nullopt;
    double share = 1.0;
    while (share > 1e-3 && !((m - share * step).norm() < max_radius_)) share *= 0.5;
    m -= share * step;
  }
  if (!(m.norm() < max_radius_) || !((distort(m).point - target).norm() < 1e-9)) return std::nullopt;
  return m.homogeneous().normalized();
}

KannalaBrandt::KannalaBrandt(const Intrinsics& k, const std::array<double, 4>& distortion) : k_(k), d_(distortion) {
  max_theta_ = std::numbers::pi;
  constexpr double kStep = 0.001;
  for (double theta = kStep; theta < std::numbers::pi; theta += kStep) {
    const double t2 = theta * theta;
    const double slope = 1 + t2 * (3 * d_[0] + t2 * (5 * d_[1] + t2 * (7 * d_[2] + t2 * 9 * d_[3])));
    if (!(slope > 0)) {
      max_theta_ = theta - kStep;
      break;
    }
  }
  const double t2 = max_theta_ * max_theta_;
  max_r_ = max_theta_ * (1 + t2 * (d_[0] + t2 * (d_[1] + t2 * (d_[2] + t2 * d_[3]))));
}

std::optional<Vector2d> KannalaBrandt::project(const Vector3d& point) const {
  const double rho = point.head<2>().norm();
  const double theta = std::atan2(rho, point.z());
  if (!(theta < max_theta_) || !(point.squaredNorm() > kMinDepth * kMinDepth)) return std::nullopt;
  const double t2 = theta * theta;
  const double r = theta * (1 + t2 * (d_[0] + t2 * (d_[1] + t2 * (d_[2] + t2 * d_[3]))));
  const double scale = rho > 1e-12 ? r / rho : 1.0 / point.z();
  return to_pixel(k_, scale * point.head<2>());
}

std::optional<Projection> KannalaBrandt::project_with_jacobian(const Vector3d& point) const {
  const double rho = point.head<2>().norm(), z = point.z();
  const double theta = std::atan2(rho, z), norm2 = point.squaredNorm();
  if (!(theta < max_theta_) || !(norm2 > kMinDepth * kMinDepth)) return std::nullopt;
  if (rho < 1e-9 * std::sqrt(norm2)) {  // on the optical axis the model equals a pinhole
    return Pinhole(k_).project_with_jacobian(point);
  }
  const double t2 = theta * theta;
  const double r = theta * (1 + t2 * (d_[0] + t2 * (d_[1] + t2 * (d_[2] + t2 * d_[3]))));
  const double slope = 1 + t2 * (3 * d_[0] + t2 * (5 * d_[1] + t2 * (7 * d_[2] + t2 * 9 * d_[3])));  // dr / dtheta
  const double ux = point.x() / rho, uy = point.y() / rho;
  const Eigen::RowVector3d dtheta(ux * z / norm2, uy * z / norm2, -rho / norm2);
  const double s = r / rho;
  Projection out;
  out.pixel = to_pixel(k_, Vector2d(r * ux, r * uy));
  out.jacobian.row(0) = ux * slope * dtheta + s * Eigen::RowVector3d(uy * uy, -ux * uy, 0);
  out.jacobian.row(1) = uy * slope * dtheta + s * Eigen::RowVector3d(-ux * uy, ux * ux, 0);
  out.jacobian.row(0) *= k_.fx;
  out.jacobian.row(1) *= k_.fy;
  return out;
}

void KannalaBrandt::distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const {
  const double rho = point.head<2>().norm(), theta = std::atan2(rho, point.z());
  const Vector2d u = rho > 0 ? Vector2d(point.head<2>() / rho) : Vector2d(Vector2d::Zero());
  double power = theta;
  for (int i = 0; i < 4; ++i) {
    power *= theta * theta;
    J.col(i) = power * u;
  }
}

std::optional<Vector3d> KannalaBrandt::unproject(const Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Vector2d m = from_pixel(k_, pixel);
  const double r = m.norm();
  if (!(r < max_r_)) return std::nullopt;
  double low = 0.0, high = max_theta_, theta = std::min(r, 0.5 * max_theta_);
  for (int i = 0; i < 60; ++i) {  // Newton's method safeguarded by bisection; r(theta) is monotonic on the domain
    const double t2 = theta * theta;
    const double value = theta * (1 + t2 * (d_[0] + t2 * (d_[1] + t2 * (d_[2] + t2 * d_[3])))) - r;
    if (std::abs(value) < 1e-14) break;
    (value > 0 ? high : low) = theta;
    const double slope = 1 + t2 * (3 * d_[0] + t2 * (5 * d_[1] + t2 * (7 * d_[2] + t2 * 9 * d_[3])));
    double next = theta - value / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - theta) < 1e-16) break;
    theta = next;
  }
  if (r < 1e-12) return Vector3d::UnitZ();
  return Vector3d(std::sin(theta) * m.x() / r, std::sin(theta) * m.y() / r, std::cos(theta));
}

std::string_view model_name(const CameraModel& model) {
  return std::visit([](const auto& m) { return m.kName; }, model);
}

const Intrinsics& intrinsics(const CameraModel& model) {
  return std::visit([](const auto& m) -> const Intrinsics& { return m.intrinsics(); }, model);
}

std::vector<double> distortion(const CameraModel& model) {
  return std::visit([](const auto& m) { return m.distortion(); }, model);
}

}  // namespace bslam::camera
