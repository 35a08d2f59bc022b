#include "api/image_sorter.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace bslam::api {
namespace {

constexpr TimeNs kForever = std::numeric_limits<TimeNs>::max() / 2;
constexpr std::size_t kRateIntervals =
    16;                                // number of intervals between images from which the rate of a camera is computed
constexpr int kClockChangeImages = 3;  // number of consecutive images far ahead after which the new clock is accepted

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
  if (accept(camera, time_ns, image, dropped)) emit_complete(false, bundles, dropped);
}

void ImageSorter::flush(std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  emit_complete(true, bundles, dropped);
  drop_until(kForever, DropReason::kNoFrame, dropped);
}

// A single time stamp of a broken clock must not make all other images late.
bool ImageSorter::far_ahead(Camera& camera, TimeNs time_ns) const {
  const bool ahead = newest_ns_ && time_ns - *newest_ns_ > max_ahead_;
  camera.far_ahead = ahead ? camera.far_ahead + 1 : 0;
  return ahead && camera.far_ahead < kClockChangeImages;
}

void ImageSorter::update_times(Camera& camera, TimeNs time_ns) {
  camera.recent.insert(std::ranges::upper_bound(camera.recent, time_ns), time_ns);
  if (camera.recent.size() > kRateIntervals + 1) camera.recent.erase(camera.recent.begin());
  first_ns_ = std::min(first_ns_.value_or(time_ns), time_ns);
  newest_ns_ = std::max(newest_ns_.value_or(time_ns), time_ns);
}

// Returns true if the image was added to the waiting images of its camera.
bool ImageSorter::accept(std::size_t c, TimeNs time_ns, const CameraImage& image, std::vector<DroppedImage>& dropped) {
  Camera& camera = cameras_[c];
  const auto drop = [&](DropReason reason) {
    dropped.push_back({c, image.time_ns, reason});
    return false;
  };
  if (std::ranges::binary_search(camera.recent, time_ns)) return drop(DropReason::kDuplicate);
  if (far_ahead(camera, time_ns)) return drop(DropReason::kFarAhead);
  update_times(camera, time_ns);
  if (last_bundle_ns_ && time_ns <= *last_bundle_ns_) return drop(DropReason::kTooLate);
  const bool belongs_to_anchor = c > 0 && anchor_ns_ && time_ns - *anchor_ns_ <= tolerance_;
  if (belongs_to_anchor) return drop(DropReason::kTooLate);
  const auto place = std::ranges::upper_bound(camera.waiting, time_ns, {}, &WaitingImage::time_ns);
  camera.waiting.insert(place, {time_ns, image});
  return true;
}

// Returns the time up to which no further image of the camera is expected.
TimeNs ImageSorter::complete_until(std::size_t c) const {
  const std::vector<TimeNs>& recent = cameras_[c].recent;
  const TimeNs last_ns = recent.empty() ? *first_ns_ : recent.back();
  if (*newest_ns_ - last_ns > silent_after_) return kForever;
  const TimeNs timeout = *newest_ns_ - max_wait_;
  if (recent.empty()) return timeout;
  const TimeNs next_due = last_ns + image::gap_after(image::median_interval(recent), 0) - reorder_;
  return std::max(next_due, timeout);
}

TimeNs ImageSorter::gap() const { return image::gap_after(image::median_interval(cameras_[0].recent), tolerance_); }

// Groups all waiting images, following the last complete bundle with an image of camera 0.
image::FrameGroups ImageSorter::grouped() const {
  std::vector<std::vector<TimeNs>> times(cameras_.size());
  if (anchor_ns_) times[0].push_back(*anchor_ns_);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    for (const WaitingImage& w : cameras_[c].waiting) times[c].push_back(w.time_ns);
  }
  image::FrameGroups groups = image::group_frames(times, tolerance_, gap());
  if (!anchor_ns_) return groups;
  std::erase_if(groups.frames, [](const image::GroupedFrame& frame) { return frame.images[0] == 0; });
  for (image::GroupedFrame& frame : groups.frames) frame.images[0] -= frame.images[0] > 0;
  return groups;
}

// Returns true if no future image can change the frame. A future image could be nearer to camera 0's image, or be the
// image of a camera that has none in the frame.
bool ImageSorter::is_complete(const image::GroupedFrame& frame) const {
  const bool has_camera0 = frame.images[0] >= 0;
  TimeNs farthest = 0;
  for (std::size_t c = 1; c < cameras_.size(); ++c) {
    const int at = frame.images[c];
    if (at < 0) {
      if (complete_until(c) <= frame.time_ns + tolerance_) return false;
      continue;
    }
    const TimeNs distance = std::abs(cameras_[c].waiting[static_cast<std::size_t>(at)].time_ns - frame.time_ns);
    if (has_camera0 && complete_until(c) < frame.time_ns + distance) return false;
    farthest = std::max(farthest, distance);
  }
  if (has_camera0) return complete_until(0) >= frame.time_ns + 2 * farthest;
  return complete_until(0) > frame.time_ns + std::max(gap(), tolerance_);
}

bool ImageSorter::exceeds_limit() const {
  return std::ranges::any_of(cameras_, [&](const Camera& c) { return c.waiting.size() > max_images_; });
}

void ImageSorter::emit_complete(bool last, std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  while (waiting() > 0) {
    const image::FrameGroups groups = grouped();
    if (groups.frames.empty()) {  // only images that belong to no frame
      if (exceeds_limit()) drop_until(kForever, DropReason::kNoFrame, dropped);
      return;
    }
    const image::GroupedFrame& frame = groups.frames.front();
    if (!last && !exceeds_limit() && !is_complete(frame)) return;
    emit(frame, bundles, dropped);
  }
}

void ImageSorter::emit(const image::GroupedFrame& frame, std::vector<ImageBundle>& bundles,
                       std::vector<DroppedImage>& dropped) {
  ImageBundle& bundle = bundles.emplace_back();
  bundle.images.resize(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (frame.images[c] < 0) continue;
    const auto at = cameras_[c].waiting.begin() + frame.images[c];
    bundle.images[c] = std::move(at->image);
    cameras_[c].waiting.erase(at);
  }
  last_bundle_ns_ = frame.time_ns;
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
    const auto end = std::ranges::upper_bound(waiting, time_ns, {}, &WaitingImage::time_ns);
    for (auto w = waiting.begin(); w != end; ++w) dropped.push_back({c, w->image.time_ns, reason});
    waiting.erase(waiting.begin(), end);
  }
}

}  // namespace bslam::api
