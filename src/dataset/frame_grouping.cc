#include "dataset/frame_grouping.h"

#include <utility>

#include "base/assert.h"
#include "image/frame_grouping.h"

namespace bslam::dataset {

FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns) {
  BSLAM_ASSERT(!images.empty() && !images[0].empty(), "camera 0 must have images");
  std::vector<std::vector<TimeNs>> times(images.size());
  for (std::size_t c = 0; c < images.size(); ++c) {
    for (const image_files::ImageFile& image : images[c]) times[c].push_back(image.time_ns);
  }
  const TimeNs gap_ns = image::gap_after(image::median_interval(times[0]), tolerance_ns);
  image::FrameGroups groups = image::group_frames(times, tolerance_ns, gap_ns);
  FrameGrouping out{{}, std::move(groups.shared_with_camera0), std::move(groups.unassigned)};
  for (const image::GroupedFrame& group : groups.frames) {
    FrameEntry& frame = out.frames.emplace_back(
        FrameEntry{group.time_ns, std::vector<std::optional<image_files::ImageFile>>(images.size())});
    for (std::size_t c = 0; c < images.size(); ++c) {
      if (group.images[c] >= 0) frame.images[c] = images[c][static_cast<std::size_t>(group.images[c])];
    }
  }
  return out;
}

}  // namespace bslam::dataset
