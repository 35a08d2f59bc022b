#include "cli/run_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "rig_formats/rig_warnings.h"

namespace bslam::cli {
namespace {

void warn_of_outages(const report::CameraRecord& camera) {
  constexpr std::size_t kShown = 3;
  std::string shown;
  std::size_t outages = 0;
  for (const report::CameraInterval& s : camera.states) {
    if (s.state == "ok" || ++outages > kShown) continue;
    shown += fmt::format("{}{} {:.1f} - {:.1f} s ({})", shown.empty() ? "" : ", ", s.state, s.from_s, s.to_s, s.reason);
  }
  if (outages == 0) return;
  if (outages > kShown) shown += fmt::format(" and {} times more", outages - kShown);
  fmt::print(stderr, "warning: {}: {}\n", camera.name, shown);
}

void warn_of_extrinsics(const report::CameraRecord& camera) {
  const auto& e = camera.extrinsics;
  if (!e || !e->suspect) return;
  fmt::print(stderr,
             "warning: {}: the images put it {:.2f} deg and {:.1f} mm away from where the rig file does, if its times "
             "are right{}\n",
             camera.name, e->change_deg, e->change_mm, e->refined ? "" : "; --set extrinsics.refine=true accepts that");
}

// Cameras that see well and agree with nothing: a few degrees off are called inconsistent, these may never get that
// far.
void warn_of_strangers(const report::RunRecord& record, const std::string& check_command) {
  constexpr double kNothing = 0.02, kSound = 0.1;  // of the keypoints
  constexpr double kEnough = 1000;                 // keypoints
  std::vector<double> keypoints(record.cameras.size()), inliers(record.cameras.size());
  for (const report::FrameRecord& frame : record.frames) {
    for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
      keypoints[c] += frame.cameras[c].keypoints;
      inliers[c] += frame.cameras[c].inliers;
    }
  }
  bool some_sound = false;
  for (std::size_t c = 0; c < keypoints.size(); ++c)
    some_sound |= keypoints[c] > kEnough && inliers[c] > kSound * keypoints[c];
  for (std::size_t c = 0; some_sound && c < keypoints.size(); ++c) {
    if (keypoints[c] < kEnough || inliers[c] > kNothing * keypoints[c]) continue;
    fmt::print(stderr,
               "warning: {}: next to nothing of what it saw ({:.0f} of {:.0f} keypoints) is where the other cameras "
               "say; is it "
               "where the rig file says? {}\n",
               record.cameras[c].name, inliers[c], keypoints[c], check_command);
  }
}

std::ptrdiff_t count(const report::RunRecord& record, report::FrameOutcome outcome) {
  return std::ranges::count(record.frames, outcome, &report::FrameRecord::outcome);
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
void warn_if_nothing_matches(const report::RunRecord& record, const camera::Rig& rig,
                             const std::string& check_command) {
  constexpr double kMuchOverlap = 0.4, kLeastShare = 0.01;
  double matched = 0, unique = 0;
  for (const report::FrameRecord& frame : record.frames) {
    matched += frame.matched_features;
    unique += frame.unique_features;
  }
  if (unique == 0 || matched >= kLeastShare * unique || largest_overlap(rig) < kMuchOverlap) return;
  fmt::print(stderr,
             "warning: by the calibration cameras see much in common, but only {:.1f} % of the features match between "
             "any two; "
             "{} tests it\n",
             100 * matched / unique, check_command);
}

}  // namespace

void print_rig_warnings(const camera::Rig& rig) {
  constexpr std::size_t kShown = 2;
  const std::vector<std::string> warnings = rig_formats::rig_warnings(rig);
  for (std::size_t i = 0; i < std::min(kShown, warnings.size()); ++i) fmt::print(stderr, "warning: {}\n", warnings[i]);
  if (warnings.size() > kShown)
    fmt::print(stderr, "warning: {} more of the kind: bslam rig info\n", warnings.size() - kShown);
}

void print_warnings(const report::RunRecord& record, const camera::Rig& rig, const std::string& check_command) {
  for (const report::CameraRecord& camera : record.cameras) {
    if (camera.skipped > 0) {
      fmt::print(stderr, "warning: {}: {} of its images could not be read, the first: {}\n", camera.name,
                 camera.skipped, camera.first_skipped);
    }
    warn_of_outages(camera);
    warn_of_extrinsics(camera);
  }
  warn_of_strangers(record, check_command);
  const auto dropped = count(record, report::FrameOutcome::kDropped);
  if (dropped > 0) fmt::print(stderr, "warning: {} frames were dropped, there was no time for them\n", dropped);
  warn_if_nothing_matches(record, rig, check_command);
}

void print_result(const report::RunRecord& record, const std::string& out) {
  const std::string scale = record.map.keyframes > 0 ? ", scale " + record.map.scale : "";
  fmt::print("{}{} of {} frames have a pose, {} keyframes, {} landmarks{}; {:.1f} s\n{}\n",
             record.complete ? "" : "interrupted: ", count(record, report::FrameOutcome::kTracked),
             record.frames.size(), record.map.keyframes, record.map.landmarks, scale, record.wall_s, out);
}

}  // namespace bslam::cli
