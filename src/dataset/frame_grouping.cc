#include "dataset/frame_grouping.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "base/assert.h"
#include "image/capture_phase.h"
#include "image/frame_grouping.h"

namespace bslam::dataset {
namespace {

// Returns the distance from `time_ns` to the nearest of `times`, which are increasing and at least one.
TimeNs distance(const std::vector<TimeNs>& times, TimeNs time_ns) {
  const auto after = std::ranges::lower_bound(times, time_ns);
  if (after == times.begin()) return *after - time_ns;
  const TimeNs before_ns = time_ns - *std::prev(after);
  return after == times.end() ? before_ns : std::min(before_ns, *after - time_ns);
}

}  // namespace

FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns) {
  BSLAM_ASSERT(!images.empty() && !images[0].empty(), "camera 0 must have images");
  std::vector<std::vector<TimeNs>> times(images.size());
  for (std::size_t c = 0; c < images.size(); ++c) {
    for (const image_files::ImageFile& image : images[c]) times[c].push_back(image.time_ns);
  }
  const image::CapturePhases phases = image::capture_phases(times, tolerance_ns);
  for (std::size_t c = 0; c < times.size(); ++c) {
    for (TimeNs& time_ns : times[c]) time_ns -= phases.cameras[c].later_ns;
  }
  image::FrameGroups groups = image::group_frames(times, phases.tolerance_ns);
  FrameGrouping out{{}, std::move(groups.shared_with_camera0), std::vector<int>(images.size(), 0), phases.tolerance_ns};
  const TimeNs near_ns = image::median_interval(times[0]) / 4 * 3;
  for (const image::GroupedFrame& group : groups.frames) {
    FrameEntry& frame = out.frames.emplace_back(
        FrameEntry{group.time_ns, std::vector<std::optional<image_files::ImageFile>>(images.size())});
    const bool beside = group.images[0] < 0 && distance(times[0], group.time_ns) < near_ns;
    for (std::size_t c = 0; c < images.size(); ++c) {
      if (group.images[c] < 0) continue;
      frame.images[c] = images[c][static_cast<std::size_t>(group.images[c])];
      out.beside_camera0[c] += beside;
    }
  }
  return out;
}

namespace {

constexpr TimeNs kMaxApart = 1'000'000'000;

// Sets the time of the frame. Returns false if its images are too far apart.
bool set_time(FrameEntry& frame) {
  std::optional<TimeNs> first, last;
  for (const auto& image : frame.images) {
    if (!image) continue;
    first = std::min(first.value_or(image->time_ns), image->time_ns);
    last = std::max(last.value_or(image->time_ns), image->time_ns);
  }
  frame.time_ns = frame.images[0] ? frame.images[0]->time_ns : *first;
  return *last - *first <= kMaxApart;
}

}  // namespace

std::optional<FrameGrouping> recorded_frames(std::span<const std::vector<image_files::ImageFile>> images) {
  std::map<TimeNs, FrameEntry> frames;
  FrameGrouping out{{}, std::vector<int>(images.size(), 0), std::vector<int>(images.size(), 0), 0};
  for (std::size_t c = 0; c < images.size(); ++c) {
    for (const image_files::ImageFile& image : images[c]) {
      if (!image.frame_ns) return std::nullopt;
      FrameEntry& frame = frames[*image.frame_ns];
      frame.images.resize(images.size());
      if (frame.images[c]) return std::nullopt;
      frame.images[c] = image;
      out.shared_with_camera0[c] += frame.images[0].has_value();
    }
  }
  for (auto& [key, frame] : frames) {
    if (!set_time(frame)) return std::nullopt;
    if (!out.frames.empty() && frame.time_ns <= out.frames.back().time_ns) return std::nullopt;
    out.frames.push_back(std::move(frame));
  }
  return out;
}

}  // namespace bslam::dataset
