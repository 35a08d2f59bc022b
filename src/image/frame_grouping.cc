#include "image/frame_grouping.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/median.h"

namespace bslam::image {
namespace {

struct SingleImage {
  std::size_t camera = 0;
  int position = 0;
  TimeNs time_ns = 0;
};

class Grouper {
 public:
  Grouper(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns) : times_(times), tolerance_(tolerance_ns) {
    out_.shared_with_camera0.assign(times.size(), 0);
    for (std::size_t k = 0; k < times[0].size(); ++k)
      out_.frames.push_back(frame_of({0, static_cast<int>(k), times[0][k]}));
    out_.shared_with_camera0[0] = static_cast<int>(times[0].size());
  }

  FrameGroups run() {
    for (std::size_t camera = 1; camera < times_.size(); ++camera) {
      for (std::size_t k = 0; k < times_[camera].size(); ++k) {
        join_camera0({camera, static_cast<int>(k), times_[camera][k]});
      }
    }
    group_remaining();
    return std::move(out_);
  }

 private:
  GroupedFrame frame_of(const SingleImage& image) const {
    GroupedFrame frame{image.time_ns, std::vector<int>(times_.size(), -1)};
    frame.images[image.camera] = image.position;
    return frame;
  }

  void join_camera0(SingleImage image) {
    GroupedFrame* frame = nearest(image.time_ns);
    if (frame == nullptr || distance(*frame, image) > tolerance_) {
      remaining_.push_back(image);
      return;
    }
    int& place = frame->images[image.camera];
    if (place < 0) {
      ++out_.shared_with_camera0[image.camera];
    } else {
      SingleImage other{image.camera, place, times_[image.camera][static_cast<std::size_t>(place)]};
      if (distance(*frame, other) <= distance(*frame, image)) std::swap(other, image);
      remaining_.push_back(other);
    }
    place = image.position;
  }

  static TimeNs distance(const GroupedFrame& frame, const SingleImage& image) {
    return std::abs(frame.time_ns - image.time_ns);
  }

  // Returns the frame of the nearest image of camera 0, or nullptr if there is none.
  GroupedFrame* nearest(TimeNs time_ns) {
    if (out_.frames.empty()) return nullptr;
    const auto after = std::ranges::lower_bound(out_.frames, time_ns, {}, &GroupedFrame::time_ns);
    if (after == out_.frames.begin()) return &*after;
    const auto before = std::prev(after);
    if (after == out_.frames.end()) return &*before;
    return time_ns - before->time_ns <= after->time_ns - time_ns ? &*before : &*after;
  }

  void group_remaining() {
    std::ranges::stable_sort(remaining_, {}, &SingleImage::time_ns);
    std::vector<GroupedFrame> frames;
    for (const SingleImage& image : remaining_) {
      const bool joins = !frames.empty() && frames.back().images[image.camera] < 0 &&
                         image.time_ns - frames.back().time_ns <= tolerance_ &&
                         !camera0_between(frames.back().time_ns, image.time_ns);
      if (!joins) frames.push_back(frame_of(image));
      frames.back().images[image.camera] = image.position;
    }
    out_.frames.insert(out_.frames.end(), frames.begin(), frames.end());
    std::ranges::stable_sort(out_.frames, {}, &GroupedFrame::time_ns);
  }

  bool camera0_between(TimeNs begin_ns, TimeNs end_ns) const {
    const auto next = std::ranges::upper_bound(times_[0], begin_ns);
    return next != times_[0].end() && *next <= end_ns;
  }

  std::span<const std::vector<TimeNs>> times_;
  TimeNs tolerance_;
  std::vector<SingleImage> remaining_;  // images in no frame of camera 0
  FrameGroups out_;
};

}  // namespace

FrameGroups group_frames(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns) {
  return Grouper(times, tolerance_ns).run();
}

TimeNs median_interval(std::span<const TimeNs> times) {
  if (times.size() < 2) return 0;
  std::vector<TimeNs> intervals;
  for (std::size_t k = 1; k < times.size(); ++k) intervals.push_back(times[k] - times[k - 1]);
  return lower_median(std::move(intervals));
}

}  // namespace bslam::image
