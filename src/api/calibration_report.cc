#include "api/calibration_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/camera_pairs.h"
#include "calibration/estimate_warnings.h"

namespace bslam::api {
namespace {

using calibration::CameraPair;
using calibration::RigRefinement;

std::string text_of(const CameraPair& pair, const camera::Rig& rig) {
  const std::string &first = rig.camera(pair.first).name, &second = rig.camera(pair.second).name;
  if (!pair.contradicted) return calibration::describe_hardly_matched(pair, first, second);
  return fmt::format(
      "the images do not belong to the calibration, so poses, scale and map are wrong: of cameras {} and {}, {}", first,
      second, calibration::describe_pair(*pair.evidence));
}

void warn_of_extrinsics(const camera::Rig& rig, const RigRefinement& estimate, std::vector<std::string>& warnings) {
  for (std::size_t c = 1; c < std::min(estimate.cameras.size(), rig.size()); ++c) {
    const calibration::CameraRefinement& camera = estimate.cameras[c];
    if (!camera.suspect) continue;
    warnings.push_back(calibration::extrinsics_text(rig.camera(c).name, camera.change_deg, camera.change_mm));
  }
}

CalibrationVerdict to_verdict(calibration::Verdict verdict) {
  switch (verdict) {
    case calibration::Verdict::kConsistent:
      return CalibrationVerdict::kConsistent;
    case calibration::Verdict::kInconsistent:
      return CalibrationVerdict::kInconsistent;
    case calibration::Verdict::kUnknown:
      break;
  }
  return CalibrationVerdict::kUnknown;
}

}  // namespace

CalibrationReport report_calibration(const system::System& system, const camera::Rig& given) {
  CalibrationReport report;
  const RigRefinement& estimate = system.calibration();
  const std::vector<CameraPair> pairs =
      calibration::disagreeing_pairs(*system.snapshot(), system.first_keyframe(), system.first_camera(), given,
                                     system.rig(), estimate.verdict == calibration::Verdict::kInconsistent);
  for (const CameraPair& pair : pairs) {
    report.warnings.push_back(text_of(pair, given));
    if (pair.contradicted && report.doubt.empty()) report.doubt = report.warnings.back();
  }
  if (!report.doubt.empty()) return report;  // the estimate is meaningless
  const bool doubtful = (estimate.jump || estimate.unsteady) && estimate.verdict == calibration::Verdict::kConsistent;
  if (pairs.empty() && !doubtful) report.verdict = to_verdict(estimate.verdict);
  if (estimate.jump) {
    report.warnings.push_back(
        calibration::time_jump_text(given.camera(estimate.jump->camera).name, *estimate.jump,
                                    fmt::format("the time stamp {:.3f} s", to_seconds(estimate.jump->time_ns))));
  } else if (estimate.unsteady) {
    report.warnings.push_back(calibration::unsteady_text(given.camera(*estimate.unsteady).name));
  } else {
    warn_of_extrinsics(given, estimate, report.warnings);
  }
  std::ranges::move(calibration::deviation_warnings(given, estimate), std::back_inserter(report.warnings));
  if (estimate.verdict != calibration::Verdict::kInconsistent) return report;
  const std::string text = calibration::contradiction_text(estimate);
  if (!system.calibration_refined()) report.doubt = text;
  report.warnings.push_back(
      text + (system.calibration_refined() ? "; the map uses an estimate of it, MapView::rig()"
              : estimate.implausible
                  ? "; the estimate is not used: the images of some cameras disagree as a whole, so that their time "
                    "stamps or extrinsics may be far off"
                  : "; the estimate is not used, but is with calibration.refine=auto"));
  return report;
}

}  // namespace bslam::api
