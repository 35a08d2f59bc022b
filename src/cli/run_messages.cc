#include "cli/run_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "rig_formats/rig_warnings.h"

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
  if (outages > kShown) shown += fmt::format(" and {} times more", outages - kShown);
  fmt::print(stderr, "warning: {}: {}\n", camera.name, shown);
}

void warn_of_extrinsics(const session::CameraRecord& camera) {
  const auto& e = camera.extrinsics;
  if (!e || !e->suspect) return;
  fmt::print(stderr,
             "warning: {}: the images put it {:.2f} deg and {:.1f} mm away from where the rig file does, if its times "
             "are right{}\n",
             camera.name, e->change_deg, e->change_mm, e->refined ? "" : "; --set extrinsics.refine=true accepts that");
}

// A camera that at the end of the run still agrees with nothing the others see is probably not where the rig file puts
// it.
void warn_of_disagreement(const session::RunRecord& record, std::size_t camera) {
  constexpr tracking::CameraStatus kDisagrees{tracking::CameraState::kDegraded, tracking::CameraReason::kInconsistent};
  const std::vector<session::CameraInterval>& states = record.cameras[camera].states;
  if (states.empty() || states.back().status != kDisagrees) return;
  std::int64_t keypoints = 0, inliers = 0;
  for (const session::RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    keypoints += frame.record->final_result().cameras[camera].keypoints;
    inliers += frame.record->final_result().cameras[camera].inliers;
  }
  fmt::print(stderr,
             "warning: {}: only {} of {} keypoints are inliers: check this camera's extrinsics "
             "(bslam rig info RIG --images DATA)\n",
             record.cameras[camera].name, inliers, keypoints);
}

std::ptrdiff_t count(const session::RunRecord& record, session::FrameOutcome outcome) {
  return std::ranges::count(record.frames, outcome, &session::RunFrame::outcome);
}

// Share of a camera's view that another one sees as well, the largest.
double largest_overlap(const camera::Rig& rig) {
  double share = 0;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = 0; j < rig.size(); ++j) share = i == j ? share : std::max(share, rig.overlap_share(i, j));
  }
  return share;
}

// Cameras that overlap and still see next to nothing in common.
void warn_if_nothing_matches(const session::RunRecord& record, const camera::Rig& rig) {
  constexpr double kMuchOverlap = 0.4, kLeastShare = 0.01;
  double matched = 0, unique = 0;
  for (const session::RunFrame& frame : record.frames) {
    if (!frame.record) continue;
    matched += frame.record->matched;
    unique += frame.record->unique;
  }
  if (unique == 0 || matched >= kLeastShare * unique || largest_overlap(rig) < kMuchOverlap) return;
  fmt::print(stderr,
             "warning: by the calibration cameras see much in common, but only {:.1f} % of the features match between "
             "any two; "
             "bslam rig info RIG --images DATA tests it\n",
             100 * matched / unique);
}

}  // namespace

void print_rig_warnings(const camera::Rig& rig) {
  constexpr std::size_t kShown = 2;
  const std::vector<std::string> warnings = rig_formats::rig_warnings(rig);
  for (std::size_t i = 0; i < std::min(kShown, warnings.size()); ++i) fmt::print(stderr, "warning: {}\n", warnings[i]);
  if (warnings.size() > kShown)
    fmt::print(stderr, "warning: {} more of the kind: bslam rig info\n", warnings.size() - kShown);
}

void print_warnings(const session::RunRecord& record, const camera::Rig& rig) {
  for (std::size_t c = 0; c < record.cameras.size(); ++c) {
    const session::CameraRecord& camera = record.cameras[c];
    if (camera.skipped > 0) {
      fmt::print(stderr, "warning: {}: {} of its images could not be read, the first: {}\n", camera.name,
                 camera.skipped, camera.first_skipped);
    }
    warn_of_outages(camera);
    warn_of_extrinsics(camera);
    warn_of_disagreement(record, c);
  }
  const auto dropped = count(record, session::FrameOutcome::kDropped);
  if (dropped > 0) fmt::print(stderr, "warning: {} frames were dropped, there was no time for them\n", dropped);
  warn_if_nothing_matches(record, rig);
}

void print_result(const session::RunRecord& record, const std::string& out) {
  const std::string scale = record.map.keyframes > 0 ? ", scale " + record.map.scale : "";
  fmt::print("{}{} of {} frames have a pose, {} keyframes, {} landmarks{}; {:.1f} s\n{}\n",
             record.complete ? "" : "interrupted: ", count(record, session::FrameOutcome::kTracked),
             record.frames.size(), record.map.keyframes, record.map.landmarks, scale, record.wall_s, out);
}

}  // namespace bslam::cli
