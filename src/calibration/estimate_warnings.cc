#include "calibration/estimate_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "camera/model_parameters.h"

namespace bslam::calibration {
namespace {

// Warns if focal lengths or principal points changed by much more than their standard deviations and usual calibration
// errors.
void warn_of_intrinsics(const camera::Camera& camera, const CameraRefinement& estimate,
                        std::vector<std::string>& warnings) {
  constexpr double kSigmas = 5, kFocal = 0.02, kCentre = 0.01;  // relative to the focal length and the image width
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::string shown;
  for (const ParameterRefinement& p : estimate.intrinsics) {
    const bool focal = p.name == "fx" || p.name == "fy", centre = p.name == "cx" || p.name == "cy";
    const double least = focal ? kFocal * (p.name == "fx" ? k.fx : k.fy) : kCentre * camera.width;
    if ((!focal && !centre) || std::abs(p.change) < std::max(least, kSigmas * p.std)) continue;
    shown += fmt::format("{}{} by {:+.1f} px (std {:.1f})", shown.empty() ? "" : ", ", p.name, p.change, p.std);
  }
  if (!shown.empty())
    warnings.push_back(fmt::format("{}: estimated intrinsics differ from the calibration: {}", camera.name, shown));
}

// Warns if a focal length changed by more than a run can estimate reliably.
void warn_of_wrong_focal_length(const camera::Camera& camera, const CameraRefinement& estimate,
                                std::vector<std::string>& warnings) {
  constexpr double kFar = 0.05;  // relative
  const double given = camera::intrinsics(camera.model).fx;
  for (const ParameterRefinement& p : estimate.intrinsics) {
    if (p.name != "fx" || std::abs(p.change) < kFar * given) continue;
    warnings.push_back(fmt::format(
        "{}: the focal length seems to be wrong by {:.0f} % or more; poses, their scale and the estimated calibration "
        "may be wrong as well: check that it belongs to images of this size, or start from bslam rig calibrate",
        camera.name, 100 * std::abs(p.change) / given));
  }
}

// The distance by which the change of the distortion or shape parameters alone moves the pixels at the corners of the
// images, at most.
double change_of_distortion_px(const camera::Camera& camera, const CameraRefinement& estimate) {
  camera::ModelParameters changed = camera::parameters(camera.model);
  if (estimate.intrinsics.size() != static_cast<std::size_t>(changed.size())) return 0;
  for (Eigen::Index k = 4; k < changed.size(); ++k)
    changed(k) += estimate.intrinsics[static_cast<std::size_t>(k)].change;
  camera::Camera other = camera;
  other.model = camera::with_parameters(camera.model, changed);
  double farthest = 0;
  for (const double x : {0.0, camera.width - 1.0}) {
    for (const double y : {0.0, camera.height - 1.0}) {
      const auto ray = camera.unproject({x, y});
      const auto moved = ray ? other.project(*ray) : std::nullopt;
      if (moved) farthest = std::max(farthest, (*moved - Eigen::Vector2d(x, y)).norm());
    }
  }
  return farthest;
}

// Warns if the distortion changed by much more than errors of usual calibrations, as if the images had been
// undistorted.
void warn_of_distortion(const camera::Camera& camera, const CameraRefinement& estimate,
                        std::vector<std::string>& warnings) {
  constexpr double kFar = 0.08;  // relative to the image width
  const double change_px = change_of_distortion_px(camera, estimate);
  if (change_px < kFar * camera.width) return;
  warnings.push_back(fmt::format(
      "{}: the estimated distortion differs from the calibration by {:.0f} px in the corners of the images: check that "
      "the calibration belongs to these images, which may have been undistorted or rectified",
      camera.name, change_px));
}

// Warns if the images contradict the times of a camera.
void warn_of_timing(const std::string& name, const CameraRefinement& camera, std::vector<std::string>& warnings) {
  if (camera.time_offset.refined) {
    warnings.push_back(
        fmt::format("{}: its images show the scene {:.2f} ms {} than its time stamps say (time_offset_s)", name,
                    std::abs(camera.time_offset.change_ms), camera.time_offset.change_ms > 0 ? "later" : "earlier"));
  }
  if (camera.readout.refined) {
    warnings.push_back(
        fmt::format("{}: its images show a rolling shutter whose readout differs from the calibration by {:.2f} ms "
                    "(rolling_shutter_readout_s)",
                    name, camera.readout.change_ms));
  }
}

}  // namespace

std::vector<std::string> deviation_warnings(const camera::Rig& rig, const RigRefinement& estimate) {
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < std::min(estimate.cameras.size(), rig.size()); ++c) {
    const camera::Camera& camera = rig.camera(c);
    if ((estimate.jump && estimate.jump->camera == c) || estimate.unsteady == c) continue;
    if (estimate.verdict == Verdict::kInconsistent) {
      warn_of_intrinsics(camera, estimate.cameras[c], warnings);
      warn_of_wrong_focal_length(camera, estimate.cameras[c], warnings);
      warn_of_distortion(camera, estimate.cameras[c], warnings);
    }
    warn_of_timing(camera.name, estimate.cameras[c], warnings);
  }
  return warnings;
}

std::string time_jump_text(const std::string& camera, const TimeJump& jump, const std::string& when) {
  return fmt::format(
      "{}: from about {} on, its images seem to have been taken {} than their time stamps say, compared with those "
      "before: check the time stamps of its images, and whether it lost or repeated some",
      camera, when, jump.shift_s > 0 ? "later" : "earlier");
}

std::string unsteady_text(const std::string& camera) {
  return fmt::format(
      "{}: its images contradict each other, whatever its calibration: its focus or zoom changes, its images are "
      "stabilised electronically, its mount is loose, or its time stamps are wrong",
      camera);
}

std::string extrinsics_text(const std::string& camera, double change_deg, double change_mm) {
  return fmt::format("{}: estimated extrinsics differ from the calibration by {:.2f} deg and {:.1f} mm", camera,
                     change_deg, change_mm);
}

std::string contradiction_text(const RigRefinement& estimate) {
  return fmt::format(
      "the images contradict the calibration, which multiplies their squared reprojection error by {:.1f}",
      1 + estimate.excess_error);
}

}  // namespace bslam::calibration
