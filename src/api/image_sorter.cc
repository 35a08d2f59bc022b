#include "api/image_sorter.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace bslam::api {
namespace {

constexpr TimeNs kForever = std::numeric_limits<TimeNs>::max() / 2;
constexpr std::size_t kRecent = 16;  // intervals between images that tell the rate of a camera
constexpr int kNewClock = 3;         // images in a row far ahead that are believed

}  // namespace

ImageSorter::ImageSorter(std::size_t cameras, const SyncOptions& options)
    : max_images_(options.max_images),
      tolerance_(from_seconds(options.tolerance_s)),
      max_wait_(from_seconds(options.max_wait_s)),
      reorder_(from_seconds(options.reorder_s)),
      silent_after_(from_seconds(options.silent_after_s)),
      max_ahead_(from_seconds(options.max_ahead_s)),
      cameras_(cameras) {}

std::size_t ImageSorter::waiting() const {
  std::size_t count = 0;
  for (const Camera& camera : cameras_) count += camera.waiting.size();
  return count;
}

void ImageSorter::push(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
                       std::vector<DroppedImage>& dropped) {
  if (accept(camera, time_ns, image, dropped)) decide(false, bundles, dropped);
}

void ImageSorter::flush(std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  decide(true, bundles, dropped);
  drop_until(kForever, DropReason::kNoFrame, dropped);
}

// A single stamp from a broken clock must not make all others look late.
bool ImageSorter::far_ahead(Camera& camera, TimeNs time_ns) const {
  const bool ahead = newest_ns_ && time_ns - *newest_ns_ > max_ahead_;
  camera.far_ahead = ahead ? camera.far_ahead + 1 : 0;
  return ahead && camera.far_ahead < kNewClock;
}

void ImageSorter::note_time(Camera& camera, TimeNs time_ns) {
  camera.recent.insert(std::ranges::upper_bound(camera.recent, time_ns), time_ns);
  if (camera.recent.size() > kRecent + 1) camera.recent.erase(camera.recent.begin());
  first_ns_ = std::min(first_ns_.value_or(time_ns), time_ns);
  newest_ns_ = std::max(newest_ns_.value_or(time_ns), time_ns);
}

// True where the image waits for its bundle now.
bool ImageSorter::accept(std::size_t c, TimeNs time_ns, const CameraImage& image, std::vector<DroppedImage>& dropped) {
  Camera& camera = cameras_[c];
  const auto drop = [&](DropReason reason) {
    dropped.push_back({c, image.time_ns, reason});
    return false;
  };
  if (std::ranges::binary_search(camera.recent, time_ns)) return drop(DropReason::kDuplicate);
  if (far_ahead(camera, time_ns)) return drop(DropReason::kFarAhead);
  note_time(camera, time_ns);
  if (handed_out_ns_ && time_ns <= *handed_out_ns_) return drop(DropReason::kTooLate);
  const bool joins_anchor = c > 0 && anchor_ns_ && time_ns - *anchor_ns_ <= tolerance_;
  if (joins_anchor) return drop(DropReason::kTooLate);
  const auto place = std::ranges::upper_bound(camera.waiting, time_ns, {}, &Waiting::time_ns);
  camera.waiting.insert(place, {time_ns, image});
  return true;
}

// No image of the camera with a time up to this one is to be expected any more.
TimeNs ImageSorter::complete_until(std::size_t c) const {
  const std::vector<TimeNs>& recent = cameras_[c].recent;
  const TimeNs last_ns = recent.empty() ? *first_ns_ : recent.back();
  if (*newest_ns_ - last_ns > silent_after_) return kForever;
  const TimeNs waited = *newest_ns_ - max_wait_;
  if (recent.empty()) return waited;
  const TimeNs next_due = last_ns + image::gap_after(image::median_interval(recent), 0) - reorder_;
  return std::max(next_due, waited);
}

TimeNs ImageSorter::gap() const { return image::gap_after(image::median_interval(cameras_[0].recent), tolerance_); }

// All that waits, behind the last instant of camera 0 that was handed out.
image::FrameGroups ImageSorter::grouped() const {
  std::vector<std::vector<TimeNs>> times(cameras_.size());
  if (anchor_ns_) times[0].push_back(*anchor_ns_);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    for (const Waiting& w : cameras_[c].waiting) times[c].push_back(w.time_ns);
  }
  image::FrameGroups groups = image::group_frames(times, tolerance_, gap());
  if (!anchor_ns_) return groups;
  std::erase_if(groups.frames, [](const image::GroupedFrame& frame) { return frame.images[0] == 0; });
  for (image::GroupedFrame& frame : groups.frames) frame.images[0] -= frame.images[0] > 0;
  return groups;
}

// Can no image still to come change the frame? One may by being nearer to camera 0's, or by filling a place.
bool ImageSorter::decided(const image::GroupedFrame& frame) const {
  const bool led = frame.images[0] >= 0;
  TimeNs farthest = 0;
  for (std::size_t c = 1; c < cameras_.size(); ++c) {
    const int at = frame.images[c];
    if (at < 0) {
      if (complete_until(c) <= frame.time_ns + tolerance_) return false;
      continue;
    }
    const TimeNs distance = std::abs(cameras_[c].waiting[static_cast<std::size_t>(at)].time_ns - frame.time_ns);
    if (led && complete_until(c) < frame.time_ns + distance) return false;
    farthest = std::max(farthest, distance);
  }
  if (led) return complete_until(0) >= frame.time_ns + 2 * farthest;
  return complete_until(0) > frame.time_ns + std::max(gap(), tolerance_);
}

bool ImageSorter::overfull() const {
  return std::ranges::any_of(cameras_, [&](const Camera& c) { return c.waiting.size() > max_images_; });
}

void ImageSorter::decide(bool last, std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  while (waiting() > 0) {
    const image::FrameGroups groups = grouped();
    if (groups.frames.empty()) {  // only images that belong to no frame
      if (overfull()) drop_until(kForever, DropReason::kNoFrame, dropped);
      return;
    }
    const image::GroupedFrame& frame = groups.frames.front();
    if (!last && !overfull() && !decided(frame)) return;
    hand_out(frame, bundles, dropped);
  }
}

void ImageSorter::hand_out(const image::GroupedFrame& frame, std::vector<ImageBundle>& bundles,
                           std::vector<DroppedImage>& dropped) {
  ImageBundle& bundle = bundles.emplace_back();
  bundle.images.resize(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (frame.images[c] < 0) continue;
    const auto at = cameras_[c].waiting.begin() + frame.images[c];
    bundle.images[c] = std::move(at->image);
    cameras_[c].waiting.erase(at);
  }
  handed_out_ns_ = frame.time_ns;
  if (frame.images[0] >= 0) anchor_ns_ = frame.time_ns;
  drop_until(frame.time_ns, DropReason::kNoFrame, dropped);
  if (frame.images[0] >= 0) {  // another image of a camera was nearer
    for (std::size_t c = 1; c < cameras_.size(); ++c) {
      auto& waiting = cameras_[c].waiting;
      while (!waiting.empty() && waiting.front().time_ns - frame.time_ns <= tolerance_) {
        dropped.push_back({c, waiting.front().image.time_ns, DropReason::kNoFrame});
        waiting.erase(waiting.begin());
      }
    }
  }
}

void ImageSorter::drop_until(TimeNs time_ns, DropReason reason, std::vector<DroppedImage>& dropped) {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    auto& waiting = cameras_[c].waiting;
    const auto end = std::ranges::upper_bound(waiting, time_ns, {}, &Waiting::time_ns);
    for (auto w = waiting.begin(); w != end; ++w) dropped.push_back({c, w->image.time_ns, reason});
    waiting.erase(waiting.begin(), end);
  }
}

}  // namespace bslam::api
