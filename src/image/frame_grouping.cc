#include "image/frame_grouping.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/median.h"

namespace bslam::image {
namespace {

struct StrayImage {
  std::size_t camera = 0;
  int position = 0;
  TimeNs time_ns = 0;
};

class Grouper {
 public:
  Grouper(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns, TimeNs gap_ns)
      : times_(times), tolerance_(tolerance_ns), gap_(gap_ns) {
    out_.shared_with_camera0.assign(times.size(), 0);
    out_.unassigned.assign(times.size(), 0);
    for (std::size_t k = 0; k < times[0].size(); ++k)
      out_.frames.push_back(frame_of({0, static_cast<int>(k), times[0][k]}));
    out_.shared_with_camera0[0] = static_cast<int>(times[0].size());
  }

  FrameGroups run() {
    for (std::size_t camera = 1; camera < times_.size(); ++camera) {
      for (std::size_t k = 0; k < times_[camera].size(); ++k) {
        join_nearest({camera, static_cast<int>(k), times_[camera][k]});
      }
    }
    fill_gaps();
    return std::move(out_);
  }

 private:
  GroupedFrame frame_of(const StrayImage& image) const {
    GroupedFrame frame{image.time_ns, std::vector<int>(times_.size(), -1)};
    frame.images[image.camera] = image.position;
    return frame;
  }

  void join_nearest(const StrayImage& image) {
    if (out_.frames.empty()) {
      strays_.push_back(image);
      return;
    }
    GroupedFrame& frame = nearest(image.time_ns);
    const TimeNs distance = std::abs(frame.time_ns - image.time_ns);
    if (distance > gap_) {
      strays_.push_back(image);
      return;
    }
    int& place = frame.images[image.camera];
    const auto placed_ns = [&] { return times_[image.camera][static_cast<std::size_t>(place)]; };
    if (distance > tolerance_ || (place >= 0 && std::abs(placed_ns() - frame.time_ns) <= distance)) {
      ++out_.unassigned[image.camera];
      return;
    }
    ++(place >= 0 ? out_.unassigned : out_.shared_with_camera0)[image.camera];
    place = image.position;
  }

  GroupedFrame& nearest(TimeNs time_ns) {
    const auto after = std::ranges::lower_bound(out_.frames, time_ns, {}, &GroupedFrame::time_ns);
    if (after == out_.frames.begin()) return *after;
    const auto before = std::prev(after);
    if (after == out_.frames.end()) return *before;
    return time_ns - before->time_ns <= after->time_ns - time_ns ? *before : *after;
  }

  void fill_gaps() {
    std::ranges::stable_sort(strays_, {}, &StrayImage::time_ns);
    std::vector<GroupedFrame> frames;
    for (const StrayImage& stray : strays_) {
      const bool joins = !frames.empty() && stray.time_ns - frames.back().time_ns <= tolerance_ &&
                         frames.back().images[stray.camera] < 0;
      if (!joins) frames.push_back(frame_of(stray));
      frames.back().images[stray.camera] = stray.position;
    }
    out_.frames.insert(out_.frames.end(), frames.begin(), frames.end());
    std::ranges::stable_sort(out_.frames, {}, &GroupedFrame::time_ns);
  }

  std::span<const std::vector<TimeNs>> times_;
  TimeNs tolerance_, gap_;
  std::vector<StrayImage> strays_;
  FrameGroups out_;
};

}  // namespace

FrameGroups group_frames(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns, TimeNs gap_ns) {
  return Grouper(times, tolerance_ns, gap_ns).run();
}

TimeNs gap_after(TimeNs interval_ns, TimeNs tolerance_ns) { return std::max(interval_ns / 4 * 3, tolerance_ns); }

TimeNs median_interval(std::span<const TimeNs> times) {
  if (times.size() < 2) return 0;
  std::vector<TimeNs> intervals;
  for (std::size_t k = 1; k < times.size(); ++k) intervals.push_back(times[k] - times[k - 1]);
  return lower_median(std::move(intervals));
}

}  // namespace bslam::image
