#include "core/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace bslam_ros {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

using Matrix3 = std::array<double, 9>;  // row-major
using Matrix6 = std::array<double, 36>;

Matrix3 rotation_of(const Pose& pose) {
  const bslam::Matrix4 m = pose.matrix();
  return {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
}

template <std::size_t kSize>
std::array<double, kSize * kSize> multiply(const std::array<double, kSize * kSize>& a,
                                           const std::array<double, kSize * kSize>& b) {
  std::array<double, kSize* kSize> out = {};
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t k = 0; k < kSize; ++k) {
      for (std::size_t j = 0; j < kSize; ++j) out[i * kSize + j] += a[i * kSize + k] * b[k * kSize + j];
    }
  }
  return out;
}

Matrix6 transposed(const Matrix6& a) {
  Matrix6 out;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) out[6 * j + i] = a[6 * i + j];
  }
  return out;
}

void set_block(Matrix6& out, std::size_t row, std::size_t column, const Matrix3& block) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[6 * (row + i) + column + j] = block[3 * i + j];
  }
}

// Maps d of camera 0, rotation first, to the motion of the base, translation first, in the axes of the parent: the
// adjoint of T_base_cam0, then the rotation of the base in the parent.
Matrix6 motion_of_base(const Pose& T_base_cam0, const Pose& T_parent_base) {
  const auto& t = T_base_cam0.translation;
  const Matrix3 R = rotation_of(T_base_cam0);
  const Matrix3 skew = {0, -t[2], t[1], t[2], 0, -t[0], -t[1], t[0], 0};
  const Matrix3 R_parent_base = rotation_of(T_parent_base);
  const Matrix3 R_parent_cam0 = multiply<3>(R_parent_base, R);
  Matrix6 out = {};
  set_block(out, 0, 0, multiply<3>(R_parent_base, multiply<3>(skew, R)));
  set_block(out, 0, 3, R_parent_cam0);
  set_block(out, 3, 0, R_parent_cam0);
  return out;
}

}  // namespace

bslam::Result<std::int64_t> to_ns(std::int64_t sec, std::uint32_t nanosec) {
  if (nanosec >= kNsPerSecond) return bslam::Error{"stamp", "nanosec", std::to_string(nanosec), "less than 1000000000"};
  return sec * kNsPerSecond + nanosec;
}

Stamp to_stamp(std::int64_t time_ns, std::int64_t first_sec) {
  std::int64_t sec = time_ns / kNsPerSecond, rest = time_ns % kNsPerSecond;
  if (rest < 0) --sec, rest += kNsPerSecond;
  constexpr std::int64_t kLast = std::numeric_limits<std::int32_t>::max();
  if (sec < first_sec) return {static_cast<std::int32_t>(first_sec), 0};
  if (sec > kLast) return {static_cast<std::int32_t>(kLast), static_cast<std::uint32_t>(kNsPerSecond - 1)};
  return {static_cast<std::int32_t>(sec), static_cast<std::uint32_t>(rest)};
}

RosCovariance unknown_covariance() {
  RosCovariance out = {};
  for (std::size_t i = 0; i < 6; ++i) out[7 * i] = kUnknownVariance;
  return out;
}

RosCovariance to_ros_covariance(const bslam::Covariance6& of_cam0, const Pose& T_base_cam0, const Pose& T_parent_base) {
  const Matrix6 J = motion_of_base(T_base_cam0, T_parent_base);
  return multiply<6>(multiply<6>(J, of_cam0), transposed(J));
}

bslam::Result<bslam::Rig> with_base_as_body(const bslam::Rig& rig, const Pose& T_base_body) {
  std::vector<bslam::CameraCalibration> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back(rig.camera(c));
    cameras.back().T_body_cam = T_base_body * cameras.back().T_body_cam;
  }
  return bslam::Rig::make(cameras);
}

bool body_has_optical_axes(const bslam::Rig& rig) {
  const Matrix3 R = rotation_of(rig.camera(0).T_body_cam);
  constexpr double kCosineOf1Degree = 0.99985;
  return R[0] > kCosineOf1Degree && R[4] > kCosineOf1Degree && R[8] > kCosineOf1Degree;
}

}  // namespace bslam_ros
