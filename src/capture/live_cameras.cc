#include "capture/live_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/rig_impl.h"
#include "base/stopwatch.h"
#include "capture/pixels.h"
#include "capture/silence.h"

namespace bslam::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kReadTimeout = std::chrono::milliseconds(100);  // after which a stop is noticed

SyncOptions sync_options(double tolerance_s, std::function<void(const DroppedImage&)> on_drop) {
  SyncOptions options;
  options.tolerance_s = tolerance_s;
  options.max_bundles = 1'000'000;  // bundles are fetched immediately, so that the limit is never reached
  options.on_drop = std::move(on_drop);
  return options;
}

const char* text_of(DropReason reason) {
  switch (reason) {
    case DropReason::kDuplicate:
      return "an image has the time stamp of an earlier one";
    case DropReason::kTooLate:
      return "an image came too late for its frame, or its time stamp went back";
    case DropReason::kFarAhead:
      return "a time stamp is far ahead of those of the other images";
    case DropReason::kOverflow:
      break;
  }
  return "an image was dropped";
}

}  // namespace

LiveCameras::LiveCameras(const camera::Rig& rig, LiveOptions options)
    : rig_(rig), options_(std::move(options)), cameras_(rig.size()) {}

std::string LiveCameras::name_of(std::size_t c) const { return rig_.camera(c).name + " (" + cameras_[c].path + ")"; }

Result<std::unique_ptr<LiveCameras>> LiveCameras::open(const camera::Rig& rig, LiveOptions options) {
  std::unique_ptr<LiveCameras> live(new LiveCameras(rig, std::move(options)));
  auto synchronizer = Synchronizer::create(
      api::make_rig(rig),
      sync_options(live->options_.sync_tolerance_s, [raw = live.get()](const DroppedImage& d) { raw->note_drop(d); }));
  if (!synchronizer) return synchronizer.error();
  live->synchronizer_.emplace(*std::move(synchronizer));
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraState& camera = live->cameras_[c];
    camera.path = live->options_.paths.at(c);
    camera.request = live->options_.request;
    camera.request.width = rig.camera(c).width;
    camera.request.height = rig.camera(c).height;
    auto device = live->options_.open(camera.path);
    if (!device) return device.error();
    auto stream = (*device)->start(camera.request);
    if (!stream) return stream.error();
    camera.device = *std::move(device);
    camera.stream = *std::move(stream);
    camera.request.pixels = camera.stream.pixels;  // used when the camera is opened again
    for (const std::string& note : camera.stream.notes) live->say(c, note);
  }
  live->running_ = rig.size();
  for (std::size_t c = 0; c < rig.size(); ++c)
    live->threads_.emplace_back([raw = live.get(), c](const std::stop_token& stop) { raw->run(c, stop); });
  return live;
}

LiveCameras::~LiveCameras() {
  stop();
  threads_.clear();  // before the other members
}

std::vector<Stream> LiveCameras::streams() const {
  const std::lock_guard lock(mutex_);
  std::vector<Stream> out;
  for (const CameraState& camera : cameras_) out.push_back(camera.stream);
  return out;
}

void LiveCameras::say(std::size_t camera, const std::string& text) {
  if (!options_.say) return;
  const std::lock_guard lock(say_mutex_);
  options_.say(name_of(camera) + ": " + text);
}

void LiveCameras::stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  stop_recording_.request_stop();
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

// ---- The thread of a camera

void LiveCameras::run(std::size_t c, const std::stop_token& stop) {
  std::exception_ptr failure;
  bool last = false;
  try {
    capture(c, stop);
  } catch (...) {
    failure = std::current_exception();
  }
  cameras_[c].device.reset();
  {
    const std::lock_guard lock(mutex_);
    last = --running_ == 0;
  }
  if (last) {
    try {
      // Close() only returns errors of on_drop, which never fails.
      [[maybe_unused]] const Status closed = synchronizer_->close();
      collect();
    } catch (...) {
      failure = std::current_exception();
    }
  }
  const std::lock_guard lock(mutex_);
  if (failure) failure_ = failure;
  ended_ = ended_ || last || failure;
  changed_.notify_all();
}

void LiveCameras::capture(std::size_t c, const std::stop_token& stop) {
  CameraState& camera = cameras_[c];
  Silence silence({options_.silence, options_.first_image}, Clock::now());
  while (!stop.stop_requested()) {
    if (!camera.device) {
      if (!reopen(c, stop)) continue;
      silence.opened(Clock::now());
    }
    const auto image = camera.device->read(kReadTimeout);
    if (!image) {
      lose(c, image.error().found);
      continue;
    }
    if (image->state == DeviceImage::State::kEnd) return;
    if (image->state == DeviceImage::State::kDamaged) count_damaged(c);
    if (image->state == DeviceImage::State::kImage) {
      take(c, *image);
      silence.image(Clock::now());
    } else if (const auto limit = silence.exceeded(camera.stream.fps, Clock::now())) {
      lose(c, fmt::format("no image for {:.3g} s", limit->count()));
    }
  }
}

void LiveCameras::count_damaged(std::size_t c) {
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = cameras_[c].damaged++ == 0;
  }
  if (first) say(c, "a damaged image, which is not used; further ones are counted");
}

void LiveCameras::take(std::size_t c, const DeviceImage& image) {
  const Stopwatch watch;
  CameraState& camera = cameras_[c];
  auto grey = grey_image(camera.stream, image.bytes);
  if (!grey) return count_damaged(c);
  auto pixels = std::make_shared<CapturedPixels>();
  pixels->grey = *std::move(grey);
  if (is_jpeg(camera.stream.pixels)) pixels->jpeg = image.bytes;
  pixels->read_ms = watch.ms();
  bool back = false, unstamped = false;
  {
    const std::lock_guard lock(mutex_);
    back = std::exchange(camera.lost, false);
    unstamped = !image.stamped && !std::exchange(camera.unstamped, true);
    if (camera.images++ == 0) changed_.notify_all();
  }
  if (back) say(c, "images arrive again");
  if (unstamped) say(c, "the driver gives no time stamps; the times at which images arrive are used");
  const image::ImageView view = pixels->grey.view();
  const Status pushed =
      synchronizer_->push(c, {view.data, view.width, view.height, view.stride, image.time_ns, std::move(pixels)});
  if (!pushed) return count_damaged(c);  // its time is impossible
  collect();
}

// Fetches complete frames. Those that nobody has asked for in time are dropped, the oldest first.
void LiveCameras::collect() {
  const std::lock_guard lock(mutex_);
  while (auto bundle = synchronizer_->pop()) {
    waiting_.push_back({*std::move(bundle), 0, false});
    waiting_.back().time_ns = time_of(waiting_.back().bundle, rig_);
    ++frames_waiting_;
    if (!begun_ && waiting_.size() > 1) {
      waiting_.pop_front();
      --frames_waiting_;
    }
    Waiting& oldest = *std::ranges::find(waiting_, false, &Waiting::dropped);
    const std::chrono::nanoseconds span(waiting_.back().time_ns - oldest.time_ns);
    overloaded_ = overloaded_ || (begun_ && frames_waiting_ >= options_.max_waiting && span >= options_.max_span);
    if (frames_waiting_ > options_.max_waiting && span > options_.max_span) {
      oldest.dropped = true;
      oldest.bundle.images.clear();
      --frames_waiting_;
    }
  }
  changed_.notify_all();
}

void LiveCameras::lose(std::size_t c, const std::string& why) {
  cameras_[c].device.reset();
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = !std::exchange(cameras_[c].lost, true);
    cameras_[c].losses += first;
    if (first) cameras_[c].why_lost = why;
    changed_.notify_all();
  }
  if (first) say(c, why + "; the run goes on with the other cameras, and with this one when it is back");
}

// Tries to open a camera that was lost, after a while. Returns false if that failed.
bool LiveCameras::reopen(std::size_t c, const std::stop_token& stop) {
  CameraState& camera = cameras_[c];
  {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, options_.retry, [&stop] { return stop.stop_requested(); });
  }
  if (stop.stop_requested()) return false;
  auto device = options_.open(camera.path);
  if (!device) return false;
  const auto stream = (*device)->start(camera.request);
  if (!stream) return false;
  if (stream->identity != camera.stream.identity) {
    if (std::exchange(camera.other_camera, stream->identity) != stream->identity)
      say(c,
          fmt::format("found {} in place of {}; another camera is not used", stream->identity, camera.stream.identity));
    return false;
  }
  const std::lock_guard lock(mutex_);
  camera.stream = *stream;
  camera.other_camera.clear();
  camera.device = *std::move(device);
  return true;
}

void LiveCameras::note_drop(const DroppedImage& image) {
  bool first = false, overloaded = false;
  {
    const std::lock_guard lock(mutex_);
    CameraState& camera = cameras_[image.camera];
    overloaded = overloaded_ && image.reason == DropReason::kTooLate;
    camera.late_under_load += overloaded;
    first = !std::exchange(camera.drop_said[static_cast<std::size_t>(image.reason)], true);
  }
  const std::string text =
      overloaded ? "an image came too late for its frame, while the computer does not keep up" : text_of(image.reason);
  if (first) say(image.camera, text + "; it is not used, and further ones are counted");
}

// ---- The thread of the run

Result<TimeNs> LiveCameras::wait_for_first_frame() {
  std::unique_lock lock(mutex_);
  const auto seen = [this] {
    return std::ranges::all_of(cameras_, [](const CameraState& c) { return c.images > 0; }) && !waiting_.empty();
  };
  Silence::Seconds limit = options_.first_image;
  for (const CameraState& camera : cameras_) limit = Silence::longest(limit, camera.stream.fps);
  changed_.wait_for(lock, limit,
                    [&] { return seen() || ended_ || stopped_ || std::ranges::any_of(cameras_, &CameraState::lost); });
  if (failure_) std::rethrow_exception(failure_);
  if (seen()) return waiting_.front().time_ns;
  if (stopped_) return Error{"bslam live", "", "an interruption", "images"};
  return no_images();
}

// Returns the reason why there is no frame: a camera was lost or has delivered nothing. mutex_ must be held.
Error LiveCameras::no_images() const {
  auto culprit = std::ranges::find(cameras_, true, &CameraState::lost);
  if (culprit == cameras_.end()) culprit = std::ranges::find(cameras_, std::size_t{0}, &CameraState::images);
  const auto c = static_cast<std::size_t>(culprit == cameras_.end() ? 0 : culprit - cameras_.begin());
  const CameraState& camera = cameras_[c];
  std::string found = camera.lost ? camera.why_lost : "";
  if (camera.images == 0 && camera.damaged > 0)
    found += fmt::format("{}{} damaged images and no good one", found.empty() ? "" : " after ", camera.damaged);
  return Error{camera.path, rig_.camera(c).name, found.empty() ? "no image" : found, "images of this camera"};
}

void LiveCameras::begin() {
  const std::lock_guard lock(mutex_);
  begun_ = true;
  waiting_.clear();
  frames_waiting_ = 0;
}

std::optional<TimeNs> LiveCameras::wait_for_frame() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_.empty() || ended_; });
  return waiting_.empty() ? std::nullopt : std::optional(waiting_.front().time_ns);
}

std::optional<session::FrameSource::Item> LiveCameras::next() {
  Waiting frame;
  Item item;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty() || ended_; });
    if (failure_) std::rethrow_exception(failure_);
    if (waiting_.empty()) return std::nullopt;
    frame = std::move(waiting_.front());
    waiting_.pop_front();
    frames_waiting_ -= !frame.dropped;
    overloaded_ = overloaded_ && frames_waiting_ > 0;
    item.waiting = frames_waiting_;
    if (!waiting_.empty()) item.waiting_s = to_seconds(waiting_.back().time_ns - frame.time_ns);
  }
  item.images.time_ns = frame.time_ns;
  // Only frames that are recorded are processed.
  item.dropped = frame.dropped || (recorder_ && !recorder_->add(frame.bundle, stop_recording_.get_token()));
  if (item.dropped) return item;
  item.images = frame_of(frame.bundle, rig_, FrameId(handed_out_++));
  for (const CameraImage& image : frame.bundle.images) {
    if (image.data != nullptr) item.read_ms += pixels_of(image).read_ms;
  }
  return item;
}

std::vector<std::string> LiveCameras::notes() const {
  const SyncCounts counts = synchronizer_->counts();
  const std::lock_guard lock(mutex_);
  std::vector<std::string> out;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraState& camera = cameras_[c];
    const std::string name = name_of(c);
    if (camera.damaged > 0) out.push_back(fmt::format("{}: {} damaged images were not used", name, camera.damaged));
    if (camera.losses > 0)
      out.push_back(fmt::format("{}: lost {}{}", name,
                                camera.losses == 1 ? "once" : fmt::format("{} times", camera.losses),
                                camera.lost ? ", and not back" : ""));
    std::size_t dropped = 0;
    for (const std::size_t count : counts.dropped[c]) dropped += count;
    if (dropped == 0) continue;
    std::string reasons;
    for (std::size_t r = 0; r < kDropReasons; ++r) {
      if (counts.dropped[c][r] == 0) continue;
      reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", counts.dropped[c][r],
                             to_string(static_cast<DropReason>(r)));
    }
    if (camera.late_under_load > 0)
      reasons += fmt::format("; {} while the computer did not keep up", camera.late_under_load);
    out.push_back(fmt::format("{}: {} images were in no frame ({})", name, dropped, reasons));
  }
  return out;
}

}  // namespace bslam::capture
