#include "camera/camera_description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "base/max_image_side.h"
#include "base/number_text.h"
#include "base/timestamp.h"
#include "camera/model_table.h"

namespace bslam::camera {
namespace {

using geometry::Matrix3d;
using geometry::SE3;
using geometry::Vector3d;

constexpr double kMaxTranslation = 1e6;      // metres; a larger value is a unit mistake or a broken file
constexpr double kMaxTimeOffset = 1e6;       // seconds; keeps sums of nanoseconds far from overflow
constexpr double kMaxReadout = 1.0;          // seconds
constexpr double kRotationTolerance = 1e-3;  // calibration files round to four or more digits

// Returns the rotation nearest to R, with quaternion coefficients rounded to a grid. The grid is fine enough not to
// matter (4e-15) and coarse enough that a conversion to a matrix and back gives the same quaternion. The largest
// coefficient is computed from the other three; among nearly equal ones the first is used.
geometry::Quaterniond rounded_rotation(const Matrix3d& R) {
  constexpr double kGrid = 0x1p-48, kTie = 1e-9;
  const Eigen::JacobiSVD<Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector4d q = geometry::Quaterniond(Matrix3d(svd.matrixU() * svd.matrixV().transpose())).coeffs();
  const double largest_value = q.cwiseAbs().maxCoeff();
  Eigen::Index largest = 0;
  while (std::abs(q[largest]) < largest_value - kTie) ++largest;
  if (q[largest] < 0) q = -q;
  for (Eigen::Index i = 0; i < 4; ++i) q[i] = i == largest ? 0.0 : std::round(q[i] / kGrid) * kGrid + 0.0;  // no -0
  q[largest] = std::sqrt(1 - q.squaredNorm());
  return geometry::Quaterniond(q);
}

// Returns "4, 5 or 8 coefficients for pinhole-radtan" or "2, xi and alpha, for double-sphere".
std::string parameters_expected(const ModelRow& row) {
  if (row.parameters.empty()) return fmt::format("none for {}", row.name);
  if (row.parameters.size() <= 2) {
    std::string names(row.parameters[0].name);
    if (row.parameters.size() == 2) names += fmt::format(" and {}", row.parameters[1].name);
    return fmt::format("{}, {}, for {}", row.parameters.size(), names, row.name);
  }
  const auto last = row.counts.end() - 1;
  const std::string others = fmt::format("{}", fmt::join(row.counts.begin(), last, ", "));
  return fmt::format("{}{}{} coefficients for {}", others, others.empty() ? "" : " or ", *last, row.name);
}

Status check_ranges(const CameraDescription& d, const ModelRow& row, const DescriptionKeys& keys) {
  for (std::size_t i = 0; i < std::min(d.distortion.size(), row.parameters.size()); ++i) {
    const ModelParameter& parameter = row.parameters[i];
    if (parameter.allows(d.distortion[i])) continue;
    return Error{keys.file, keys.distortion, fmt::format("{} {}", parameter.name, d.distortion[i]),
                 fmt::format("{} in {}{}, {}]", parameter.name, parameter.low_is_excluded ? '(' : '[', parameter.low,
                             parameter.high)};
  }
  return {};
}

Status check_numbers(const CameraDescription& d, const DescriptionKeys& keys) {
  if (d.resolution.size() != 2) {
    return Error{keys.file, keys.resolution, fmt::format("{} numbers", d.resolution.size()), "width and height"};
  }
  for (const std::int64_t side : d.resolution) {
    if (side < 1 || side > kMaxImageSidePx) {
      return Error{keys.file, keys.resolution, std::to_string(side), fmt::format("pixels in [1, {}]", kMaxImageSidePx)};
    }
  }
  if (d.intrinsics.size() != 4) {
    return Error{keys.file, keys.intrinsics, fmt::format("{} numbers", d.intrinsics.size()), "four: fx fy cx cy"};
  }
  for (const double value : d.intrinsics) {
    if (!std::isfinite(value)) return Error{keys.file, keys.intrinsics, fmt::format("{}", value), "finite numbers"};
  }
  for (const double focal : {d.intrinsics[0], d.intrinsics[1]}) {
    if (!(focal > 0))
      return Error{keys.file, keys.intrinsics, fmt::format("focal length {}", focal), "a positive number"};
  }
  for (const double value : d.distortion) {
    if (!std::isfinite(value)) return Error{keys.file, keys.distortion, fmt::format("{}", value), "finite numbers"};
  }
  if (!(std::abs(d.time_offset_s) <= kMaxTimeOffset)) {
    return Error{keys.file, keys.time_offset, fmt::format("{}", d.time_offset_s), "at most 1e6 seconds"};
  }
  if (!(std::abs(d.readout_s) <= kMaxReadout)) {
    return Error{keys.file, keys.readout, fmt::format("{}", d.readout_s), "at most 1 second"};
  }
  return {};
}

}  // namespace

Result<SE3> rigid_transform(const std::vector<double>& m, const std::string& file, const std::string& key) {
  const auto error = [&](std::string found, std::string expected) {
    return Error{file, key, std::move(found), std::move(expected)};
  };
  if (m.size() != 16) return error(fmt::format("{} numbers", m.size()), "16 (rows of a 4x4 transform)");
  if (!std::all_of(m.begin(), m.end(), [](double v) { return std::isfinite(v); })) {
    return error("a number that is not finite", "a rigid transform");
  }
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) {
    return error(fmt::format("last row {} {} {} {}", m[12], m[13], m[14], m[15]), "0 0 0 1");
  }
  Matrix3d R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  const double deviation = (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation <= kRotationTolerance)) {
    return error(fmt::format("a 3x3 part that is not a rotation (R'R differs from I by {:.3g})", deviation),
                 "a rigid transform, with orthonormal axes");
  }
  if (R.determinant() < 0) {
    return error("a mirrored frame (determinant -1)", "a rotation with determinant +1: x right, y down, z forward");
  }
  const Vector3d translation(m[3], m[7], m[11]);
  if (!(translation.norm() <= kMaxTranslation)) {
    return error(fmt::format("a translation of {:.3g}", translation.norm()), "metres");
  }
  return SE3(rounded_rotation(R), translation);
}

std::vector<double> rows_of(const SE3& T) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T.matrix();
  return {m.data(), m.data() + m.size()};
}

Result<SE3> rigid_transform(const geometry::Quaterniond& rotation, const Vector3d& translation, const std::string& file,
                            const std::string& key) {
  // A unit quaternion that was written with all digits keeps its exact bits.
  constexpr double kUnit = 1e-14;
  const double norm2 = rotation.squaredNorm();
  if (!(std::abs(std::sqrt(norm2) - 1) <= kRotationTolerance)) {
    return Error{file, key, fmt::format("a quaternion of norm {:.4g}", std::sqrt(norm2)), "a unit quaternion"};
  }
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = Eigen::Matrix4d::Identity();
  const bool unit = std::abs(norm2 - 1) <= kUnit;
  m.topLeftCorner<3, 3>() = (unit ? rotation : rotation.normalized()).toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return rigid_transform(std::vector<double>(m.data(), m.data() + m.size()), file, key);
}

Result<std::vector<std::int64_t>> whole_pixels(const std::vector<double>& sides, const std::string& file,
                                               const std::string& key) {
  std::vector<std::int64_t> whole;
  for (const double side : sides) {
    whole.push_back(static_cast<std::int64_t>(std::clamp(side, -1.0, 1e9)));
    if (static_cast<double>(whole.back()) != side) return Error{file, key, format_double(side), "whole pixels"};
  }
  return whole;
}

Result<RigCamera> make_camera(const CameraDescription& d, const DescriptionKeys& keys) {
  const ModelRow* row = find_model(d.model);
  if (row == nullptr) {
    return Error{keys.file, keys.model, d.model, fmt::format("one of: {}", fmt::join(model_names(), ", "))};
  }
  if (const Status status = check_numbers(d, keys); !status) return status.error();
  if (const Status status = check_ranges(d, *row, keys); !status) return status.error();
  if (!row->takes(d.distortion.size())) {
    return Error{keys.file, keys.distortion, fmt::format("{} numbers", d.distortion.size()), parameters_expected(*row)};
  }
  const auto T_body_cam = rigid_transform(d.T_body_cam, keys.file, keys.T_body_cam);
  if (!T_body_cam) return T_body_cam.error();
  const Camera camera{d.name,
                      row->make({d.intrinsics[0], d.intrinsics[1], d.intrinsics[2], d.intrinsics[3]}, d.distortion),
                      static_cast<int>(d.resolution[0]),
                      static_cast<int>(d.resolution[1]),
                      from_seconds(d.time_offset_s),
                      d.mask_file,
                      d.readout_s};
  if (!camera.unproject({d.intrinsics[2], d.intrinsics[3]})) {
    return Error{keys.file, keys.distortion, "coefficients for which the model projects no point",
                 "coefficients of a lens"};
  }
  return RigCamera{camera, *T_body_cam};
}

}  // namespace bslam::camera
