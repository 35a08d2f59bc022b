#include "cli/run_messages.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstddef>
#include <cstdio>

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
  fmt::print(stderr, "warning: {}: the images put it {:.2f} deg and {:.1f} mm away from where the rig file does{}\n", camera.name,
             e->change_deg, e->change_mm, e->refined ? "" : "; --set extrinsics.refine=true accepts that");
}

std::ptrdiff_t count(const report::RunRecord& record, report::FrameOutcome outcome) {
  return std::ranges::count(record.frames, outcome, &report::FrameRecord::outcome);
}

}  // namespace

void print_warnings(const report::RunRecord& record) {
  for (const report::CameraRecord& camera : record.cameras) {
    if (camera.skipped > 0) {
      fmt::print(stderr, "warning: {}: {} of its images could not be read, the first: {}\n", camera.name, camera.skipped,
                 camera.first_skipped);
    }
    warn_of_outages(camera);
    warn_of_extrinsics(camera);
  }
  const auto dropped = count(record, report::FrameOutcome::kDropped);
  if (dropped > 0) fmt::print(stderr, "warning: {} frames were dropped, there was no time for them\n", dropped);
}

void print_result(const report::RunRecord& record, const std::string& out) {
  const std::string scale = record.map.keyframes > 0 ? ", scale " + record.map.scale : "";
  fmt::print("{}{} of {} frames have a pose, {} keyframes, {} landmarks{}; {:.1f} s\n{}\n",
             record.complete ? "" : "interrupted: ", count(record, report::FrameOutcome::kTracked), record.frames.size(),
             record.map.keyframes, record.map.landmarks, scale, record.wall_s, out);
}

}  // namespace bslam::cli
