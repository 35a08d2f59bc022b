#include "session/estimate_warnings.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/estimate_warnings.h"
#include "session/warning_list.h"

namespace bslam::session {
namespace {

// `advise`: the estimate applies to other recordings, and no other warning says what to do with it.
void warn_of_extrinsics(const CameraRecord& camera, bool advise, Warnings& warnings) {
  const auto& e = camera.extrinsics;
  if (!e || !e->suspect) return;
  warn(warnings, "{}{}", calibration::extrinsics_text(camera.name, e->change_deg, e->change_mm),
       advise && !e->refined ? "; use the estimate with --set calibration.refine=true" : "");
}

bool is_late(const CalibrationRecord& calibration, std::size_t camera) {
  return calibration.late && calibration.late->camera == camera;
}

// Returns true if the images of a camera are late, or its time stamps changed during the run.
bool has_wrong_times(const CalibrationRecord& calibration, std::size_t camera) {
  return is_late(calibration, camera) || (calibration.estimate.jump && calibration.estimate.jump->camera == camera);
}

// Returns true if no calibration of a camera explains its images, for a reason that is known.
bool has_other_cause(const CalibrationRecord& calibration, std::size_t camera) {
  return has_wrong_times(calibration, camera) || calibration.estimate.unsteady == camera;
}

// Returns true if what is said about a camera explains what looks like wrong extrinsics of it.
bool is_explained(const CalibrationRecord& calibration, std::size_t camera) {
  return has_other_cause(calibration, camera) || std::ranges::count(calibration.unexplained, camera) > 0;
}

// Warns of cameras that were moved during the run. Of two cameras, it is not known which one was moved. What looks like
// moves of a camera whose images are late, for example, is not said.
void warn_of_moves(const RunRecord& record, Warnings& warnings) {
  for (const CameraMoveRecord& move : record.calibration.moves) {
    if (move.camera >= record.cameras.size() || is_explained(record.calibration, move.camera)) continue;
    warn(warnings,
         "{}: moved relative to {} at about {:.1f} s, by {:.2f} deg (std {:.2f}) and {:.1f} mm (std {:.1f}); {}",
         record.cameras[move.camera].name, record.cameras.size() == 2 ? record.cameras[0].name : "the other cameras",
         move.at_s, move.change_deg, move.std_deg, move.change_mm, move.std_mm,
         !record.calibration.moves_in_map ? "the map does not take this into account"
         : record.calibration.refined     ? "the map takes this into account, and rig_refined.yaml is the rig after it"
                                          : "the map takes this into account");
  }
}

// Warns of a camera whose time stamps changed during the run, unless another warning says by how much.
void warn_of_time_jump(const RunRecord& record, Warnings& warnings) {
  const auto& jump = record.calibration.estimate.jump;
  if (!jump || jump->camera >= record.cameras.size() || is_late(record.calibration, jump->camera)) return;
  warnings.push_back(calibration::time_jump_text(record.cameras[jump->camera].name, *jump,
                                                 fmt::format("{:.1f} s", record.calibration.jump_at_s)));
}

void warn_of_unsteady(const RunRecord& record, Warnings& warnings) {
  const auto& camera = record.calibration.estimate.unsteady;
  if (!camera || *camera >= record.cameras.size() || has_wrong_times(record.calibration, *camera)) return;
  warnings.push_back(calibration::unsteady_text(record.cameras[*camera].name));
}

// Warns of cameras whose images are not explained, unless another warning names them.
void warn_of_unexplained(const RunRecord& record, Warnings& warnings) {
  const CalibrationRecord& calibration = record.calibration;
  for (const std::size_t c : calibration.unexplained) {
    if (has_other_cause(calibration, c) || std::ranges::count(calibration.disagreeing, c) > 0) continue;
    warn(warnings,
         "{}: its reprojection error of {:.2f} px is more than twice that of the other cameras, and fewer of its "
         "matches are inliers ({:.0f} %): its intrinsics, its extrinsics or its time stamps are wrong, or it is out of "
         "focus",
         record.cameras[c].name, record.cameras[c].residuals.rms_px, 100 * inlier_share(record, c).value_or(0));
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
  if (calibration.estimate.jump) return "the estimate is not used, since the time stamps of a camera changed";
  if (calibration.estimate.unsteady)
    return "the estimate is not used, since the images of a camera contradict each other";
  return "the estimate cannot be used for other recordings, because the images of some cameras disagree as a whole: "
         "their time stamps or extrinsics may be far off";
}

}  // namespace

std::string contradiction_text(const RunRecord& record) {
  return calibration::contradiction_text(record.calibration.estimate);
}

std::vector<std::string> estimate_warnings(const RunRecord& record, const camera::Rig& rig) {
  const CalibrationRecord& calibration = record.calibration;
  if (calibration.foreign_images()) return {};
  Warnings warnings;
  const bool contradicted = calibration.estimate.verdict == calibration::Verdict::kInconsistent;
  warn_of_moves(record, warnings);
  warn_of_time_jump(record, warnings);
  warn_of_unsteady(record, warnings);
  warn_of_unexplained(record, warnings);
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    if (!is_explained(calibration, c))
      warn_of_extrinsics(record.cameras[c], calibration.applies && !contradicted, warnings);
  }
  const std::vector<std::string> deviations = calibration::deviation_warnings(rig, calibration.estimate);
  warnings.insert(warnings.end(), deviations.begin(), deviations.end());
  if (contradicted) warn(warnings, "{}; {}", contradiction_text(record), what_became_of_estimate(record));
  return warnings;
}

}  // namespace bslam::session
