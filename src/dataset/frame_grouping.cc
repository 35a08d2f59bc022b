#include "dataset/frame_grouping.h"

#include <algorithm>
#include <cstdlib>

#include "base/assert.h"
#include "base/median.h"

namespace bslam::dataset {
namespace {

// The lower median, since gaps make intervals longer but never shorter.
TimeNs median_interval(const std::vector<image_files::ImageFile>& images) {
  if (images.size() < 2) return 0;
  std::vector<TimeNs> intervals;
  for (std::size_t k = 1; k < images.size(); ++k) intervals.push_back(images[k].time_ns - images[k - 1].time_ns);
  return lower_median(std::move(intervals));
}

struct StrayImage {
  std::size_t camera = 0;
  image_files::ImageFile image;
};

class Grouper {
 public:
  Grouper(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns)
      : images_(images), tolerance_(tolerance_ns) {
    out_.shared_with_camera0.assign(images.size(), 0);
    out_.unassigned.assign(images.size(), 0);
    for (const image_files::ImageFile& image : images[0]) {
      out_.frames.push_back({image.time_ns, std::vector<std::optional<image_files::ImageFile>>(images.size())});
      out_.frames.back().images[0] = image;
    }
    out_.shared_with_camera0[0] = static_cast<int>(images[0].size());
    gap_ = std::max(median_interval(images[0]) / 4 * 3, tolerance_);
  }

  FrameGrouping run() {
    for (std::size_t camera = 1; camera < images_.size(); ++camera) {
      for (const image_files::ImageFile& image : images_[camera]) join_nearest(camera, image);
    }
    fill_gaps();
    return std::move(out_);
  }

 private:
  void join_nearest(std::size_t camera, const image_files::ImageFile& image) {
    FrameEntry& frame = nearest(image.time_ns);
    const TimeNs distance = std::abs(frame.time_ns - image.time_ns);
    if (distance > gap_) {
      strays_.push_back({camera, image});
      return;
    }
    std::optional<image_files::ImageFile>& place = frame.images[camera];
    if (distance > tolerance_ || (place && std::abs(place->time_ns - frame.time_ns) <= distance)) {
      ++out_.unassigned[camera];
      return;
    }
    ++(place ? out_.unassigned : out_.shared_with_camera0)[camera];
    place = image;
  }

  FrameEntry& nearest(TimeNs time_ns) {
    const auto after = std::lower_bound(out_.frames.begin(), out_.frames.end(), time_ns,
                                        [](const FrameEntry& f, TimeNs t) { return f.time_ns < t; });
    if (after == out_.frames.begin()) return *after;
    const auto before = std::prev(after);
    if (after == out_.frames.end()) return *before;
    return time_ns - before->time_ns <= after->time_ns - time_ns ? *before : *after;
  }

  void fill_gaps() {
    const auto earlier = [](const auto& a, const auto& b) { return a.image.time_ns < b.image.time_ns; };
    std::stable_sort(strays_.begin(), strays_.end(), earlier);
    std::vector<FrameEntry> frames;
    for (const StrayImage& stray : strays_) {
      const bool joins = !frames.empty() && stray.image.time_ns - frames.back().time_ns <= tolerance_ &&
                         !frames.back().images[stray.camera];
      if (!joins)
        frames.push_back({stray.image.time_ns, std::vector<std::optional<image_files::ImageFile>>(images_.size())});
      frames.back().images[stray.camera] = stray.image;
    }
    out_.frames.insert(out_.frames.end(), frames.begin(), frames.end());
    std::stable_sort(out_.frames.begin(), out_.frames.end(),
                     [](const FrameEntry& a, const FrameEntry& b) { return a.time_ns < b.time_ns; });
  }

  std::span<const std::vector<image_files::ImageFile>> images_;
  TimeNs tolerance_, gap_ = 0;
  std::vector<StrayImage> strays_;
  FrameGrouping out_;
};

}  // namespace

FrameGrouping group_frames(std::span<const std::vector<image_files::ImageFile>> images, TimeNs tolerance_ns) {
  BSLAM_ASSERT(!images.empty() && !images[0].empty(), "camera 0 has images");
  return Grouper(images, tolerance_ns).run();
}

}  // namespace bslam::dataset
