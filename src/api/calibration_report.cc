#include "api/calibration_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/camera_pairs.h"
#include "calibration/estimate_warnings.h"

namespace bslam::api {
namespace {

using calibration::CameraPair;
using calibration::RigRefinement;

// The pairs of cameras that should see the same things but do not.
std::vector<CameraPair> disagreeing_pairs(const system::System& system, const camera::Rig& given) {
  const map::MapSnapshot map = system.snapshot();
  std::vector<KeyframeId> keyframes = map->keyframe_ids();
  std::erase_if(keyframes, [&](KeyframeId k) { return k < system.first_keyframe(); });
  const bool suspected = system.calibration().verdict == calibration::Verdict::kInconsistent;
  std::vector<CameraPair> pairs =
      calibration::test_pairs(*map, keyframes, system.first_camera(), given, system.rig(), suspected);
  std::erase_if(pairs, [](const CameraPair& pair) { return !pair.contradicted && !pair.hardly_matched(); });
  return pairs;
}

std::string text_of(const CameraPair& pair, const camera::Rig& rig) {
  const std::string names = fmt::format("{} and {}", rig.camera(pair.first).name, rig.camera(pair.second).name);
  if (pair.contradicted) {
    return fmt::format(
        "the images do not belong to the calibration, so poses, scale and map are wrong: of cameras {}, {}", names,
        calibration::describe_pair(*pair.evidence));
  }
  return fmt::format(
      "the calibrated views of cameras {} overlap by {:.0f} %, but only {:.1f} % of the features there are matched "
      "between them: check which images are of which camera, their time stamps, and the extrinsics",
      names, 100 * pair.overlap, 100 * pair.matched_share());
}

void warn_of_extrinsics(const camera::Rig& rig, const RigRefinement& estimate, std::vector<std::string>& warnings) {
  for (std::size_t c = 1; c < std::min(estimate.cameras.size(), rig.size()); ++c) {
    const calibration::CameraRefinement& camera = estimate.cameras[c];
    if (!camera.suspect) continue;
    warnings.push_back(fmt::format("{}: estimated extrinsics differ from the calibration by {:.2f} deg and {:.1f} mm",
                                   rig.camera(c).name, camera.change_deg, camera.change_mm));
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
  const std::vector<CameraPair> pairs = disagreeing_pairs(system, given);
  for (const CameraPair& pair : pairs) {
    report.warnings.push_back(text_of(pair, given));
    if (pair.contradicted && report.doubt.empty()) report.doubt = report.warnings.back();
  }
  if (!report.doubt.empty()) return report;  // the estimate is meaningless
  if (pairs.empty()) report.verdict = to_verdict(estimate.verdict);
  warn_of_extrinsics(given, estimate, report.warnings);
  std::ranges::move(calibration::deviation_warnings(given, estimate), std::back_inserter(report.warnings));
  if (estimate.verdict != calibration::Verdict::kInconsistent) return report;
  const std::string text = calibration::contradiction_text(estimate);
  if (!system.calibration_refined()) report.doubt = text;
  report.warnings.push_back(text + (system.calibration_refined()
                                        ? "; the map uses an estimate of it, MapView::rig()"
                                        : "; the estimate is not used, but is with calibration.refine=auto"));
  return report;
}

}  // namespace bslam::api
