#include "dataset/camera_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "camera/camera_description.h"

namespace bslam::dataset {
namespace {

using containers::CameraInfo;

struct Distortion {
  std::string model;
  std::vector<double> coefficients;
};

// At most `most` coefficients; the others must be zero.
bool rest_is_zero(const std::vector<double>& values, std::size_t most) {
  return std::all_of(values.begin() + static_cast<std::ptrdiff_t>(std::min(most, values.size())), values.end(),
                     [](double value) { return value == 0; });
}

// The coefficients in the order of ROS are those of OpenCV: k1 k2 p1 p2 k3 k4 k5 k6, or k1 k2 k3 k4 of a fisheye lens.
Result<Distortion> distortion_of(const CameraInfo& info, const std::string& source) {
  std::vector<double> values = info.distortion;
  const std::string& name = info.distortion_model;
  const bool fisheye = name == "equidistant" || name == "fisheye" || name == "kannala_brandt";
  const bool radtan = name.empty() || name == "plumb_bob" || name == "rational_polynomial";
  if (!fisheye && !radtan)
    return Error{source, "distortion_model", name, "plumb_bob, rational_polynomial, equidistant or fisheye"};
  const std::size_t most = fisheye ? 4 : name == "rational_polynomial" ? 8 : 5;
  if (!rest_is_zero(values, most))
    return Error{source, "D", fmt::format("{} coefficients", values.size()),
                 fmt::format("at most {} of {}", most, name)};
  if (radtan && rest_is_zero(values, 0)) return Distortion{"pinhole", {}};
  // Missing coefficients are zero.
  const std::size_t full = fisheye || values.size() <= 4 ? 4 : values.size() <= 5 ? 5 : 8;
  values.resize(full, 0.0);
  return Distortion{fisheye ? "kannala-brandt" : "pinhole-radtan", std::move(values)};
}

std::optional<geometry::Matrix3d> rotation_of(const std::array<double, 9>& R) {
  geometry::Matrix3d out;
  for (int k = 0; k < 9; ++k) out(k / 3, k % 3) = R[static_cast<std::size_t>(k)];
  const bool rotation = (out * out.transpose() - geometry::Matrix3d::Identity()).norm() < 1e-4 && out.determinant() > 0;
  return rotation ? std::optional(out) : std::nullopt;
}

}  // namespace

Result<camera::RigCamera> camera_of(const CameraInfo& info, const std::string& name, const std::string& source) {
  if (info.K[0] == 0) return Error{source, "K", "zero, which means that the camera is not calibrated", "a calibration"};
  if (info.binning_x > 1 || info.binning_y > 1)
    return Error{source, "binning", fmt::format("{}x{}", info.binning_x, info.binning_y), "images without binning"};
  const bool part = info.roi_x != 0 || info.roi_y != 0 || (info.roi_width != 0 && info.roi_width != info.width) ||
                    (info.roi_height != 0 && info.roi_height != info.height);
  if (part) return Error{source, "roi", "a part of the sensor", "images of the whole sensor"};
  const auto distortion = distortion_of(info, source);
  if (!distortion) return distortion.error();
  const camera::CameraDescription description{.name = name,
                                              .model = distortion->model,
                                              .resolution = {info.width, info.height},
                                              .intrinsics = {info.K[0], info.K[4], info.K[2], info.K[5]},
                                              .distortion = distortion->coefficients,
                                              .T_body_cam = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                              .mask_file = {}};
  return camera::make_camera(description, {.file = source,
                                           .model = "distortion_model",
                                           .resolution = "width, height",
                                           .intrinsics = "K",
                                           .distortion = "D",
                                           .T_body_cam = "",
                                           .time_offset = ""});
}

std::optional<geometry::SE3> stereo_extrinsics(const CameraInfo& first, const CameraInfo& second) {
  // P = [K' | K' t] with the baseline t of a camera in the rectified frame, which both cameras have in common.
  const auto baseline = [](const CameraInfo& info) -> std::optional<geometry::Vector3d> {
    const double fx = info.P[0], fy = info.P[5];
    if (!(fx > 0 && fy > 0) || info.P[11] != 0) return std::nullopt;
    return geometry::Vector3d(info.P[3] / fx, info.P[7] / fy, 0.0);
  };
  const auto a = baseline(first), b = baseline(second);
  const auto Ra = rotation_of(first.R), Rb = rotation_of(second.R);
  if (!a || !b || !Ra || !Rb) return std::nullopt;
  const double length = (*b - *a).norm();
  if ((a->norm() > 0) == (b->norm() > 0) || !(length > 1e-4 && length < 1e3)) return std::nullopt;
  // P projects points of the common rectified frame, R_a X_a = X + t_a and R_b X_b = X + t_b.
  return geometry::SE3(*Ra, -*a).inverse() * geometry::SE3(*Rb, -*b);
}

}  // namespace bslam::dataset
