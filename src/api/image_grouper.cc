#include "api/image_grouper.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace bslam::api {
namespace {

// Half of the range, so that adding a delay cannot overflow.
constexpr TimeNs kForever = std::numeric_limits<TimeNs>::max() / 2;
// Number of intervals between images from which the rate of a camera is computed.
constexpr std::size_t kRateIntervals = 16;

// Returns the shortest interval between consecutive times, or 0 for fewer than two. Unlike the median it remains the
// interval of a camera that loses many images.
TimeNs shortest_interval(const std::vector<TimeNs>& times) {
  TimeNs shortest = kForever;
  for (std::size_t k = 1; k < times.size(); ++k) shortest = std::min(shortest, times[k] - times[k - 1]);
  return times.size() < 2 ? 0 : shortest;
}

}  // namespace

ImageGrouper::ImageGrouper(std::size_t cameras, const SyncOptions& options)
    : max_images_(options.max_images),
      tolerance_(from_seconds(options.tolerance_s)),
      max_wait_(from_seconds(options.max_wait_s)),
      reorder_(from_seconds(options.reorder_s)),
      silent_after_(from_seconds(options.silent_after_s)),
      cameras_(cameras),
      recent_(cameras),
      phases_{std::vector<image::CapturePhase>(cameras), tolerance_},
      clocks_(cameras, {max_wait_, silent_after_, from_seconds(options.max_ahead_s)}),
      last_group_with_camera0_(cameras) {}

std::size_t ImageGrouper::waiting() const {
  std::size_t count = 0;
  for (const Camera& camera : cameras_) count += camera.waiting.size();
  return count;
}

void ImageGrouper::push(std::size_t camera, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
                        std::vector<DroppedImage>& dropped) {
  if (accept(camera, time_ns, image, bundles, dropped)) emit_complete(false, bundles, dropped);
}

void ImageGrouper::flush(std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  emit_complete(true, bundles, dropped);
}

// Returns false if the image must be dropped because of the clock of its camera.
bool ImageGrouper::watch_clock(std::size_t c, TimeNs time_ns, std::vector<DroppedImage>& dropped) {
  std::vector<TimeNs>& recent = recent_[c];
  std::vector<ClockWatch::Refuted> refuted;
  const ClockWatch::Verdict verdict = clocks_.add(c, time_ns, shortest_interval(recent), refuted);
  for (const ClockWatch::Refuted& r : refuted) remove(r, dropped);
  if (verdict == ClockWatch::Verdict::kFarAhead) return false;
  recent.insert(std::ranges::upper_bound(recent, time_ns), time_ns);
  if (recent.size() > kRateIntervals + 1) recent.erase(recent.begin());
  return true;
}

// Removes waiting images of a wrong clock.
void ImageGrouper::remove(const ClockWatch::Refuted& refuted, std::vector<DroppedImage>& dropped) {
  std::erase_if(recent_[refuted.camera], [&](TimeNs time_ns) { return time_ns >= refuted.from_ns; });
  std::erase_if(cameras_[refuted.camera].waiting, [&](const WaitingImage& w) {
    if (w.time_ns < refuted.from_ns) return false;
    dropped.push_back({refuted.camera, w.image.time_ns, DropReason::kFarAhead});
    return true;
  });
}

// Estimates the delays of the cameras relative to camera 0 from their newest images. New delays are adopted only if
// they do not put a waiting image before the last complete bundle.
void ImageGrouper::update_phases() {
  image::CapturePhases phases = image::capture_phases(recent_, tolerance_, phases_.cameras);
  if (phases == phases_) return;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const std::vector<WaitingImage>& waiting = cameras_[c].waiting;
    if (last_bundle_ns_ && !waiting.empty() && waiting[0].time_ns - phases.cameras[c].later_ns <= *last_bundle_ns_)
      return;
  }
  phases_ = std::move(phases);
  std::ranges::fill(last_group_with_camera0_, std::nullopt);  // determined with the former delays
}

// Returns true if the image was added to the waiting images of its camera.
bool ImageGrouper::accept(std::size_t c, TimeNs time_ns, const CameraImage& image, std::vector<ImageBundle>& bundles,
                          std::vector<DroppedImage>& dropped) {
  Camera& camera = cameras_[c];
  const auto drop = [&](DropReason reason) {
    dropped.push_back({c, image.time_ns, reason});
    return false;
  };
  if (std::ranges::binary_search(recent_[c], time_ns)) return drop(DropReason::kDuplicate);
  if (!watch_clock(c, time_ns, dropped)) return drop(DropReason::kFarAhead);
  if (camera.last_ns && time_ns <= *camera.last_ns)
    return drop(DropReason::kTooLate);  // its delay relative to camera 0 has changed
  const bool late = (last_bundle_ns_ && in_phase(c, time_ns) <= *last_bundle_ns_) || belongs_to_last_group(c, time_ns);
  if (late && !can_form_its_own_bundle(c, time_ns)) return drop(DropReason::kTooLate);
  if (late) {
    last_time_ns_ = camera.last_ns = time_ns;
    bundles.emplace_back().images.resize(cameras_.size());
    bundles.back().images[c] = image;
    return false;
  }
  const auto place = std::ranges::upper_bound(camera.waiting, time_ns, {}, &WaitingImage::time_ns);
  camera.waiting.insert(place, {time_ns, image});
  update_phases();
  return true;
}

// Returns true if an image that is too late for its bundle can be a bundle of its own, the next one in order of time,
// since no camera has an earlier image, and none is expected. This happens when the delays of the cameras change.
bool ImageGrouper::can_form_its_own_bundle(std::size_t c, TimeNs time_ns) const {
  if (last_time_ns_ && time_ns <= *last_time_ns_ + phases_.tolerance_ns) return false;
  for (std::size_t d = 0; d < cameras_.size(); ++d) {
    if (!cameras_[d].waiting.empty() && cameras_[d].waiting[0].time_ns <= time_ns) return false;
    if (d != c && complete_until(d) + phases_.cameras[d].later_ns <= time_ns) return false;
  }
  return true;
}

// Returns true if the image would be in the last bundle with an image of camera 0 if it had come earlier.
bool ImageGrouper::belongs_to_last_group(std::size_t c, TimeNs time_ns) const {
  if (c == 0 || !last_group_with_camera0_[0]) return false;
  const TimeNs distance = std::abs(in_phase(c, time_ns) - *last_group_with_camera0_[0]);
  return distance <= phases_.tolerance_ns &&
         (!last_group_with_camera0_[c] ||
          distance < std::abs(in_phase(c, *last_group_with_camera0_[c]) - *last_group_with_camera0_[0]));
}

// Returns the time, in phase with camera 0, up to which no further image of the camera is expected.
TimeNs ImageGrouper::complete_until(std::size_t c) const {
  const std::vector<TimeNs>& recent = recent_[c];
  const TimeNs last_ns = recent.empty() ? clocks_.first_ns() : recent.back();
  const TimeNs interval_ns = shortest_interval(recent), gap_ns = clocks_.newest_ns() - last_ns;
  if (gap_ns > silent_after_ && gap_ns / kAbsentIntervals > interval_ns) return kForever;
  const TimeNs timeout = clocks_.newest_ns() - max_wait_;
  if (recent.empty()) return timeout;
  const TimeNs next_due = last_ns + interval_ns / 4 * 3 - reorder_;
  return in_phase(c, std::max(next_due, timeout));
}

// Groups all waiting images. The last bundle with an image of camera 0 takes part, because images that are nearest to
// its image of camera 0 must not join another bundle. All its images stand at the time of camera 0's, so that none of
// them can join a frame of a later image of camera 0, to which it may be nearer.
image::FrameGroups ImageGrouper::grouped() const {
  std::vector<std::vector<TimeNs>> times(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (last_group_with_camera0_[c]) times[c].push_back(*last_group_with_camera0_[0]);
    for (const WaitingImage& w : cameras_[c].waiting) times[c].push_back(in_phase(c, w.time_ns));
  }
  image::FrameGroups groups = image::group_frames(times, phases_.tolerance_ns);
  if (!last_group_with_camera0_[0]) return groups;
  std::erase_if(groups.frames, [](const image::GroupedFrame& frame) { return frame.images[0] == 0; });
  for (image::GroupedFrame& frame : groups.frames) {
    for (std::size_t c = 0; c < cameras_.size(); ++c)
      frame.images[c] -= last_group_with_camera0_[c] && frame.images[c] > 0;
  }
  return groups;
}

// Returns true if no future image can change the frame. A future image could be nearer to camera 0's image, be the
// image of a camera that has none in the frame, or be an image of camera 0 that is nearer to an image of the frame.
bool ImageGrouper::is_complete(const image::GroupedFrame& frame) const {
  const bool has_camera0 = frame.images[0] >= 0;
  TimeNs farthest = 0;
  for (std::size_t c = 1; c < cameras_.size(); ++c) {
    const int at = frame.images[c];
    if (at < 0) {
      if (complete_until(c) <= frame.time_ns + phases_.tolerance_ns) return false;
      continue;
    }
    const TimeNs time_ns = cameras_[c].waiting[static_cast<std::size_t>(at)].time_ns;
    const TimeNs distance = std::abs(in_phase(c, time_ns) - frame.time_ns);
    if (has_camera0 && complete_until(c) < frame.time_ns + distance) return false;
    farthest = std::max(farthest, distance);
  }
  if (has_camera0) return complete_until(0) >= frame.time_ns + 2 * farthest;
  return complete_until(0) > frame.time_ns + farthest + phases_.tolerance_ns;
}

bool ImageGrouper::exceeds_limit() const {
  return std::ranges::any_of(cameras_, [&](const Camera& c) { return c.waiting.size() > max_images_; });
}

void ImageGrouper::emit_complete(bool last, std::vector<ImageBundle>& bundles, std::vector<DroppedImage>& dropped) {
  while (waiting() > 0) {
    const image::FrameGroups groups = grouped();
    if (groups.frames.empty()) return;
    const image::GroupedFrame& frame = groups.frames.front();
    if (last_bundle_ns_ && frame.time_ns <= *last_bundle_ns_) {
      drop(frame, dropped);
      continue;
    }
    if (!last && !exceeds_limit() && !(clocks_.confirmed() && is_complete(frame))) return;
    const image::GroupedFrame& next = earliest(groups);
    if (last_time_ns_ && bundle_time(next) <= *last_time_ns_) {
      drop(next, dropped);
      continue;
    }
    emit(next, bundles);
    if (&next == &frame) last_bundle_ns_ = frame.time_ns;
  }
}

// Returns the frame whose bundle comes first in time. This is the first frame unless the estimated delays are out of
// date: then a later frame may contain an earlier image.
const image::GroupedFrame& ImageGrouper::earliest(const image::FrameGroups& groups) const {
  const image::GroupedFrame* first = &groups.frames.front();
  for (const image::GroupedFrame& frame : groups.frames) {
    // no earlier image of any of its cameras is waiting
    const bool in_order = std::ranges::all_of(frame.images, [](int at) { return at <= 0; });
    if (in_order && bundle_time(frame) < bundle_time(*first)) first = &frame;
  }
  return *first;
}

// Returns the time of camera 0's image, or of the earliest image, which System::process takes as the time of the
// bundle.
TimeNs ImageGrouper::bundle_time(const image::GroupedFrame& frame) const {
  if (frame.images[0] >= 0) return frame.time_ns;
  TimeNs earliest_ns = kForever;
  for (std::size_t c = 1; c < cameras_.size(); ++c) {
    if (frame.images[c] < 0) continue;
    earliest_ns = std::min(earliest_ns, cameras_[c].waiting[static_cast<std::size_t>(frame.images[c])].time_ns);
  }
  return earliest_ns;
}

void ImageGrouper::emit(const image::GroupedFrame& frame, std::vector<ImageBundle>& bundles) {
  if (frame.images[0] >= 0) {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      last_group_with_camera0_[c] =
          frame.images[c] < 0 ? std::nullopt
                              : std::optional(cameras_[c].waiting[static_cast<std::size_t>(frame.images[c])].time_ns);
    }
  }
  last_time_ns_ = bundle_time(frame);
  ImageBundle& bundle = bundles.emplace_back();
  bundle.images.resize(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (frame.images[c] < 0) continue;
    cameras_[c].last_ns = cameras_[c].waiting[static_cast<std::size_t>(frame.images[c])].time_ns;
    bundle.images[c] = take(c, frame.images[c]);
  }
}

// Drops the images of a frame that comes too late: a bundle of the same or a later time is already complete.
void ImageGrouper::drop(const image::GroupedFrame& frame, std::vector<DroppedImage>& dropped) {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (frame.images[c] >= 0) dropped.push_back({c, take(c, frame.images[c]).time_ns, DropReason::kTooLate});
  }
}

// Removes a waiting image.
CameraImage ImageGrouper::take(std::size_t c, int position) {
  const auto at = cameras_[c].waiting.begin() + position;
  CameraImage image = std::move(at->image);
  cameras_[c].waiting.erase(at);
  return image;
}

}  // namespace bslam::api
