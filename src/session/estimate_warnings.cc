#include "session/estimate_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "camera/model_parameters.h"
#include "session/warning_list.h"

namespace bslam::session {
namespace {

// `advise`: the estimate applies to other recordings, and no other warning says what to do with it.
void warn_of_extrinsics(const CameraRecord& camera, bool advise, Warnings& warnings) {
  const auto& e = camera.extrinsics;
  if (!e || !e->suspect) return;
  warn(warnings, "{}: estimated extrinsics differ from the calibration by {:.2f} deg and {:.1f} mm{}", camera.name,
       e->change_deg, e->change_mm,
       advise && !e->refined ? "; use the estimate with --set calibration.refine=true" : "");
}

// Warns if focal lengths or principal points changed by much more than their standard deviations and usual calibration
// errors.
void warn_of_intrinsics(const camera::Camera& camera, const calibration::CameraRefinement& estimate,
                        Warnings& warnings) {
  constexpr double kSigmas = 5, kFocal = 0.02, kCentre = 0.01;  // relative to the focal length and the image width
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::string shown;
  for (const calibration::ParameterRefinement& p : estimate.intrinsics) {
    const bool focal = p.name == "fx" || p.name == "fy", centre = p.name == "cx" || p.name == "cy";
    const double least = focal ? kFocal * (p.name == "fx" ? k.fx : k.fy) : kCentre * camera.width;
    if ((!focal && !centre) || std::abs(p.change) < std::max(least, kSigmas * p.std)) continue;
    shown += fmt::format("{}{} by {:+.1f} px (std {:.1f})", shown.empty() ? "" : ", ", p.name, p.change, p.std);
  }
  if (!shown.empty()) warn(warnings, "{}: estimated intrinsics differ from the calibration: {}", camera.name, shown);
}

// Warns if a focal length changed by more than a run can estimate reliably.
void warn_of_wrong_focal_length(const camera::Camera& camera, const calibration::CameraRefinement& estimate,
                                Warnings& warnings) {
  constexpr double kFar = 0.05;  // relative
  const double given = camera::intrinsics(camera.model).fx;
  for (const calibration::ParameterRefinement& p : estimate.intrinsics) {
    if (p.name != "fx" || std::abs(p.change) < kFar * given) continue;
    warn(warnings,
         "{}: the focal length seems to be wrong by {:.0f} % or more; poses, their scale and the estimated calibration "
         "may be wrong as well: check that it belongs to images of this size, or start from bslam rig calibrate",
         camera.name, 100 * std::abs(p.change) / given);
  }
}

// The distance by which the change of the distortion or shape parameters alone moves the pixels at the corners of the
// images, at most.
double change_of_distortion_px(const camera::Camera& camera, const calibration::CameraRefinement& estimate) {
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
void warn_of_distortion(const camera::Camera& camera, const calibration::CameraRefinement& estimate,
                        Warnings& warnings) {
  constexpr double kFar = 0.08;  // relative to the image width
  const double change_px = change_of_distortion_px(camera, estimate);
  if (change_px < kFar * camera.width) return;
  warn(
      warnings,
      "{}: the estimated distortion differs from the calibration by {:.0f} px in the corners of the images: check that "
      "the calibration belongs to these images, which may have been undistorted or rectified",
      camera.name, change_px);
}

// Warns if the images contradict the times of a camera.
void warn_of_timing(const std::string& name, const calibration::CameraRefinement& camera, Warnings& warnings) {
  if (camera.time_offset.refined) {
    warn(warnings, "{}: its images show the scene {:.2f} ms {} than its time stamps say (time_offset_s)", name,
         std::abs(camera.time_offset.change_ms), camera.time_offset.change_ms > 0 ? "later" : "earlier");
  }
  if (camera.readout.refined) {
    warn(warnings,
         "{}: its images show a rolling shutter whose readout differs from the calibration by {:.2f} ms "
         "(rolling_shutter_readout_s)",
         name, camera.readout.change_ms);
  }
}

// Warns of cameras that were moved during the run. Of two cameras, it is not known which one was moved.
void warn_of_moves(const RunRecord& record, Warnings& warnings) {
  for (const CameraMoveRecord& move : record.calibration.moves) {
    if (move.camera >= record.cameras.size()) continue;
    warn(warnings,
         "{}: moved relative to {} at about {:.1f} s, by {:.2f} deg (std {:.2f}) and {:.1f} mm (std {:.1f}); {}",
         record.cameras[move.camera].name, record.cameras.size() == 2 ? record.cameras[0].name : "the other cameras",
         move.at_s, move.change_deg, move.std_deg, move.change_mm, move.std_mm,
         !record.calibration.moves_in_map ? "the map does not take this into account"
         : record.calibration.refined     ? "the map takes this into account, and rig_refined.yaml is the rig after it"
                                          : "the map takes this into account");
  }
}

std::string what_became_of_estimate(const RunRecord& record) {
  const CalibrationRecord& calibration = record.calibration;
  if (calibration.refined) return "it was refined: see calibration in summary.json, and rig_refined.yaml";
  if (!record.complete) return "the estimate of a run that was interrupted is not used";
  if (calibration.applies) return "refine it with --set calibration.refine=auto";
  if (const auto& late = calibration.late) {
    return fmt::format(
        "the estimate is not written to rig_refined.yaml, because it was made with images of {} that were taken at "
        "other times than those of the other cameras",
        record.cameras[late->camera].name);
  }
  return "the estimate cannot be used for other recordings, because the images of some cameras disagree as a whole: "
         "their time stamps or extrinsics may be far off";
}

}  // namespace

std::string contradiction_text(const RunRecord& record) {
  return fmt::format(
      "the images contradict the calibration, which multiplies their squared reprojection error by {:.1f}",
      1 + record.calibration.estimate.excess_error);
}

std::vector<std::string> estimate_warnings(const RunRecord& record, const camera::Rig& rig) {
  const CalibrationRecord& calibration = record.calibration;
  if (calibration.foreign_images()) return {};
  Warnings warnings;
  const bool contradicted = calibration.estimate.verdict == calibration::Verdict::kInconsistent;
  warn_of_moves(record, warnings);
  for (const CameraRecord& camera : record.cameras)
    warn_of_extrinsics(camera, calibration.applies && !contradicted, warnings);
  for (std::size_t c = 0; c < std::min(calibration.estimate.cameras.size(), record.cameras.size()); ++c) {
    if (contradicted) {
      warn_of_intrinsics(rig.camera(c), calibration.estimate.cameras[c], warnings);
      warn_of_wrong_focal_length(rig.camera(c), calibration.estimate.cameras[c], warnings);
      warn_of_distortion(rig.camera(c), calibration.estimate.cameras[c], warnings);
    }
    warn_of_timing(record.cameras[c].name, calibration.estimate.cameras[c], warnings);
  }
  if (contradicted) warn(warnings, "{}; {}", contradiction_text(record), what_became_of_estimate(record));
  return warnings;
}

}  // namespace bslam::session
