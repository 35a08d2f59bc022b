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

// Lists the intervals without a pose.
void warn_of_losses(const session::RunRecord& record) {
  constexpr std::size_t kShown = 5;
  const std::vector<session::LostInterval> intervals = session::lost_intervals(record);
  if (intervals.empty()) return;
  std::string shown;
  for (std::size_t i = 0; i < std::min(kShown, intervals.size()); ++i) {
    shown += fmt::format("{}{:.2f} - {:.2f} s ({})", i == 0 ? "" : ", ", intervals[i].from_s, intervals[i].to_s,
                         intervals[i].reason);
  }
  if (intervals.size() > kShown)
    shown += fmt::format(" and {} more intervals, see summary.json", intervals.size() - kShown);
  fmt::print(stderr, "warning: {} of {} frames have no pose: {}\n",
             std::ranges::count(record.frames, session::FrameOutcome::kLost, &session::RunFrame::outcome),
             record.frames.size(), shown);
}

// Warns if the poses have no common world frame, or not that of the loaded map.
void warn_of_submaps(const session::RunRecord& record) {
  if (record.submaps.size() > 1) {
    fmt::print(stderr,
               "warning: {} submaps remain, each with its own world frame, because no loop closure joined them: "
               "trajectory.tum contains {} poses, trajectory_part2.tum {}{}\n",
               record.submaps.size(), record.submaps[0].frames, record.submaps[1].frames,
               record.submaps.size() > 2 ? " and so on" : "");
  }
  if (!record.map.loaded) return;
  std::int64_t outside = 0;
  for (const session::SubmapRecord& submap : record.submaps) outside += submap.loaded ? 0 : submap.frames;
  if (outside == 0 && session::frames_in_loaded_map(record) > 0) return;
  const std::int64_t inside = session::frames_in_loaded_map(record);
  const std::string found = inside == 0 ? "no" : std::to_string(inside);
  if (outside == 0) {
    fmt::print(stderr, "warning: no frames have a pose, since no place of the loaded map was recognised\n");
    return;
  }
  fmt::print(stderr,
             "warning: {} frames have a pose in the frame of the loaded map; {} frames are in a new submap, since no "
             "place of the loaded map was recognised there\n",
             found, outside);
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
  warn_of_losses(record);
  warn_of_submaps(record);
  const auto dropped = count(record, session::FrameOutcome::kDropped);
  if (dropped > 0) fmt::print(stderr, "warning: {} frames dropped: processing is slower than real time\n", dropped);
  warn_if_nothing_matches(record, rig, check_command);
}

namespace {

// In how many submaps the poses are, and how many of them are in the loaded map.
std::string submaps_text(const session::RunRecord& record) {
  std::string text;
  if (record.submaps.size() > 1)
    text += fmt::format(" in {} submaps ({} in trajectory.tum)", record.submaps.size(), record.submaps[0].frames);
  if (record.map.loaded) text += fmt::format(", {} in the loaded map", session::frames_in_loaded_map(record));
  return text;
}

// The reprojection error of every camera.
void print_reprojection(const session::RunRecord& record) {
  std::string text;
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const session::CameraRecord& camera = record.cameras[c];
    const auto share = session::inlier_share(record, c);
    if (camera.residuals.observations == 0 || !share) continue;
    text += fmt::format("{}{} {:.2f} px ({:.0f} % inliers)", text.empty() ? "" : ", ", camera.name,
                        camera.residuals.rms_px, 100 * *share);
  }
  if (!text.empty()) fmt::print("reprojection error: {}\n", text);
}

// Whether the images agree with the calibration. Silence would be taken for agreement.
void print_verdict(const session::RunRecord& record) {
  if (record.map.keyframes == 0) return;
  switch (record.calibration.estimate.verdict) {
    case calibration::Verdict::kConsistent:
      return fmt::print("calibration: consistent with the images\n");
    case calibration::Verdict::kInconsistent:
      return fmt::print("calibration: contradicted by the images\n");
    case calibration::Verdict::kUnknown:
      return fmt::print("calibration: not tested, which takes several cameras, enough motion and calibration.check\n");
  }
}

}  // namespace

void print_result(const session::RunRecord& record, const std::string& out) {
  const auto tracked = count(record, session::FrameOutcome::kTracked);
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
