#include "cli/run_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "calibration/rig_warnings.h"

namespace bslam::cli {
namespace {

void warn_of_outages(const session::CameraRecord& camera) {
  constexpr std::size_t kShown = 3;
  std::string shown;
  std::size_t outages = 0;
  for (const session::CameraInterval& s : camera.states) {
    if (s.status.state == tracking::CameraState::kOk || ++outages > kShown) continue;
    shown += fmt::format("{}{} {:.1f} - {:.1f} s ({})", shown.empty() ? "" : ", ", tracking::describe(s.status.state),
                         s.from_s, s.to_s, tracking::describe(s.status.reason));
  }
  if (outages == 0) return;
  if (outages > kShown) shown += fmt::format(" and {} more intervals", outages - kShown);
  fmt::print(stderr, "warning: {}: {}\n", camera.name, shown);
}

void warn_of_extrinsics(const session::CameraRecord& camera) {
  const auto& e = camera.extrinsics;
  if (!e || !e->suspect) return;
  fmt::print(stderr, "warning: {}: estimated extrinsics differ from the calibration by {:.2f} deg and {:.1f} mm{}\n",
             camera.name, e->change_deg, e->change_mm,
             e->refined ? "" : "; use the estimate with --set calibration.refine=true");
}

// Warns if the images contradict the times of a camera.
void warn_of_timing(const std::string& name, const calibration::CameraRefinement& camera) {
  if (camera.time_offset.refined) {
    fmt::print(stderr, "warning: {}: its images show the scene {:.2f} ms {} than its time stamps say (time_offset_s)\n",
               name, std::abs(camera.time_offset.change_ms), camera.time_offset.change_ms > 0 ? "later" : "earlier");
  }
  if (camera.readout.refined) {
    fmt::print(stderr,
               "warning: {}: its images show a rolling shutter whose readout differs from the calibration by {:.2f} ms "
               "(rolling_shutter_readout_s)\n",
               name, camera.readout.change_ms);
  }
}

void warn_of_calibration(const session::CalibrationRecord& calibration) {
  if (calibration.estimate.verdict != calibration::Verdict::kInconsistent) return;
  fmt::print(stderr,
             "warning: the images contradict the calibration, which multiplies their squared reprojection error by "
             "{:.1f}; {}\n",
             1 + calibration.estimate.excess_error,
             calibration.refined ? "it was refined: see calibration in summary.json, and rig_refined.yaml"
                                 : "refine it with --set calibration.refine=auto");
}

// Warns about a camera that is still inconsistent with the others at the end of the run: its extrinsics are probably
// wrong.
void warn_of_disagreement(const session::RunRecord& record, std::size_t camera, const std::string& check_command) {
  constexpr tracking::CameraStatus kDisagrees{tracking::CameraState::kDegraded, tracking::CameraReason::kInconsistent};
  const std::vector<session::CameraInterval>& states = record.cameras[camera].states;
  if (states.empty() || states.back().status != kDisagrees) return;
  std::int64_t keypoints = 0, inliers = 0;
  for (const session::RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    keypoints += frame.record->final_result().cameras[camera].keypoints;
    inliers += frame.record->final_result().cameras[camera].inliers;
  }
  fmt::print(stderr, "warning: {}: only {} of {} keypoints are inliers: check this camera's extrinsics ({})\n",
             record.cameras[camera].name, inliers, keypoints, check_command);
}

std::ptrdiff_t count(const session::RunRecord& record, session::FrameOutcome outcome) {
  return std::ranges::count(record.frames, outcome, &session::RunFrame::outcome);
}

// Returns the maximum fraction of a camera's field of view that is in view of another camera.
double largest_overlap(const camera::Rig& rig) {
  double share = 0;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = 0; j < rig.size(); ++j) share = i == j ? share : std::max(share, rig.overlap_share(i, j));
  }
  return share;
}

// Warns if the fields of view of two cameras overlap, but hardly any feature is matched between cameras.
void warn_if_nothing_matches(const session::RunRecord& record, const camera::Rig& rig,
                             const std::string& check_command) {
  constexpr double kMuchOverlap = 0.4, kLeastShare = 0.01;
  double matched = 0, unique = 0;
  for (const session::RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    matched += frame.record->matched;
    unique += frame.record->unique;
  }
  if (unique == 0 || matched >= kLeastShare * unique || largest_overlap(rig) < kMuchOverlap) return;
  fmt::print(stderr,
             "warning: the calibrated fields of view overlap, but only {:.1f} % of the features are matched between "
             "cameras: check the calibration ({})\n",
             100 * matched / unique, check_command);
}

}  // namespace

void print_rig_warnings(const camera::Rig& rig) {
  constexpr std::size_t kShown = 2;
  const std::vector<std::string> warnings = calibration::rig_warnings(rig);
  for (std::size_t i = 0; i < std::min(kShown, warnings.size()); ++i) fmt::print(stderr, "warning: {}\n", warnings[i]);
  if (warnings.size() > kShown)
    fmt::print(stderr, "warning: {} more warnings about the calibration: bslam rig info\n", warnings.size() - kShown);
}

void print_warnings(const session::RunRecord& record, const camera::Rig& rig, const std::string& check_command) {
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const session::CameraRecord& camera = record.cameras[c];
    if (camera.skipped > 0) {
      fmt::print(stderr, "warning: {}: {} of its images could not be read, the first: {}\n", camera.name,
                 camera.skipped, camera.first_skipped);
    }
    warn_of_outages(camera);
    warn_of_extrinsics(camera);
    warn_of_disagreement(record, c, check_command);
  }
  const auto& estimates = record.calibration.estimate.cameras;
  for (std::size_t c = 0; c < std::min(estimates.size(), record.cameras.size()); ++c)
    warn_of_timing(record.cameras[c].name, estimates[c]);
  warn_of_calibration(record.calibration);
  const auto dropped = count(record, session::FrameOutcome::kDropped);
  if (dropped > 0) fmt::print(stderr, "warning: {} frames dropped: processing is slower than real time\n", dropped);
  warn_if_nothing_matches(record, rig, check_command);
}

void print_result(const session::RunRecord& record, const std::string& out) {
  const auto tracked = count(record, session::FrameOutcome::kTracked);
  const std::string frames =
      record.complete ? fmt::format("{} of {} frames have a pose", tracked, record.frames.size())
                      : fmt::format("interrupted after {} frames; {} have a pose", record.frames.size(), tracked);
  const std::string scale = record.map.keyframes > 0 ? ", scale " + record.map.scale : "";
  fmt::print("{}, {} keyframes, {} landmarks{}; {:.1f} s\n{}\n", frames, record.map.keyframes, record.map.landmarks,
             scale, record.wall_s, out);
}

}  // namespace bslam::cli
