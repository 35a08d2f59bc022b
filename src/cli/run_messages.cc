#include "cli/run_messages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <string_view>
#include <vector>

#include "cli/print_message.h"

namespace bslam::cli {

namespace {

// Prints the number of submaps with poses, and how many poses are in the loaded map.
std::string submaps_text(const session::RunRecord& record) {
  std::string text;
  if (record.submaps.size() > 1)
    text += fmt::format(" in {} submaps ({} in trajectory.tum)", record.submaps.size(), record.submaps[0].frames);
  if (record.map.loaded) text += fmt::format(", {} in the loaded map", session::frames_in_loaded_map(record));
  return text;
}

// The reprojection error of every camera.
void print_reprojection(const session::RunRecord& record) {
  constexpr double kLargest_px = 100;
  std::string text;
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const session::CameraRecord& camera = record.cameras[c];
    const auto share = session::inlier_share(record, c);
    if (camera.residuals.observations == 0 || !share) continue;
    const double rms_px = camera.residuals.rms_px;
    text += fmt::format("{}{} {} px ({:.0f} % inliers)", text.empty() ? "" : ", ", camera.name,
                        rms_px < kLargest_px ? fmt::format("{:.2f}", rms_px) : "over 100", 100 * *share);
  }
  if (!text.empty()) fmt::print("reprojection error: {}\n", text);
}

// Prints the estimate next to the threshold of the verdict, so that a verdict near the threshold is visible.
std::string excess_text(const session::CalibrationRecord& calibration) {
  if (!calibration.estimate.done) return "";
  return fmt::format(" (mean squared error {:.1f} % above the best estimate's, bound {:.1f} %)",
                     100 * calibration.estimate.excess_error, 100 * calibration.excess_bound);
}

// What a calibration that the images contradict means for the results.
std::string_view consequence_text(const session::CalibrationRecord& calibration) {
  return calibration.refined    ? "; the results use the refined one"
         : calibration.replaced ? "; the results use an estimate of it that cannot be relied on"
                                : "; it was not refined: poses and scale are less accurate than with a right one";
}

// The reason why the estimate of the calibration does not apply.
std::string doubt_text(const session::RunRecord& record) {
  const session::CalibrationRecord& calibration = record.calibration;
  std::vector<std::string> reasons;
  for (const calibration::CameraPair& pair : calibration.pairs) {
    if (pair.contradicted != calibration.foreign_images()) continue;
    std::string& text = reasons.emplace_back(
        fmt::format("{} and {}", record.cameras[pair.first].name, record.cameras[pair.second].name));
    if (pair.mirrored())
      text += " have mirrored images";
    else if (pair.keyframes > 0)
      text += fmt::format(" share {:.1f} % of the features in their common view", 100 * pair.matched_share());
  }
  if (calibration.foreign_images()) return fmt::format("{}", fmt::join(reasons, ", "));
  if (const auto& late = calibration.late)
    reasons.push_back(
        fmt::format("{} is about one frame {}", record.cameras[late->camera].name, late->early ? "early" : "late"));
  else if (const auto& jump = calibration.estimate.jump)
    reasons.push_back(fmt::format("the time stamps of {} seem to have changed", record.cameras[jump->camera].name));
  if (const auto& camera = calibration.estimate.unsteady)
    reasons.push_back(fmt::format("the images of {} contradict each other", record.cameras[*camera].name));
  for (const std::size_t c : calibration.disagreeing)
    reasons.push_back(fmt::format("{} shows other things than the map predicts", record.cameras[c].name));
  for (const std::size_t c : calibration.unexplained)
    reasons.push_back(fmt::format("the images of {} are not explained", record.cameras[c].name));
  return fmt::format("{}", fmt::join(reasons, ", "));
}

// The reason why the calibration could not be tested.
std::string_view untested_text(const session::RunRecord& record) {
  if (!record.complete) return "calibration: not tested, because the run was interrupted";
  if (record.cameras.size() > 1 && record.map.scale != "metric")
    return "calibration: not tested, which takes a map of metric scale";
  return "calibration: not tested, which takes more motion, and landmarks in several keyframes, or "
         "calibration.check is false";
}

// Prints whether the images agree with the calibration, in every case: no message would be understood as agreement.
void print_verdict(const session::RunRecord& record) {
  const session::CalibrationRecord& calibration = record.calibration;
  if (calibration.foreign_images())
    return fmt::print("calibration: the images do not belong to it ({})\n", doubt_text(record));
  if (record.map.keyframes == 0) return;
  switch (calibration.verdict()) {
    case calibration::Verdict::kConsistent:
      return fmt::print("calibration: consistent with the images{}\n", excess_text(calibration));
    case calibration::Verdict::kInconsistent:
      return fmt::print("calibration: contradicted by the images{}{}\n", excess_text(calibration),
                        consequence_text(calibration));
    case calibration::Verdict::kUnknown:
      break;
  }
  const std::string doubt = doubt_text(record);
  if (!doubt.empty()) return fmt::print("calibration: cannot be told ({})\n", doubt);
  if (record.map.loaded) return fmt::print("calibration: not tested in a loaded map\n");
  fmt::print("{}\n", untested_text(record));
}

}  // namespace

void print_warnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) print_message("warning: {}\n", warning);
}

void print_result(const session::RunRecord& record, const std::string& out) {
  const auto tracked = session::count(record, session::FrameOutcome::kTracked);
  const std::string frames =
      record.complete ? fmt::format("{} of {} frames have a pose", tracked, record.frames.size())
                      : fmt::format("interrupted after {} frames; {} have a pose", record.frames.size(), tracked);
  const std::string scale = record.map.keyframes > 0 ? ", scale " + record.map.scale : "";
  fmt::print("{}{}, {} keyframes, {} landmarks{}; {:.1f} s\n", frames, submaps_text(record), record.map.keyframes,
             record.map.landmarks, scale, record.wall_s);
  print_reprojection(record);
  print_verdict(record);
  fmt::print("{}\n", out);
}

}  // namespace bslam::cli
