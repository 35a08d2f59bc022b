#include <bslam/synchronizer.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <utility>

#include "api/access.h"
#include "api/bundle_reader.h"
#include "api/guard.h"
#include "api/image_grouper.h"
#include "api/rig_impl.h"

namespace bslam {
namespace {

constexpr double kMaxSeconds = 1e6;

Status check_options(const SyncOptions& options) {
  struct Number {
    const char* name;
    double value;
  };
  for (const Number& n : {Number{"tolerance_s", options.tolerance_s}, Number{"max_wait_s", options.max_wait_s},
                          Number{"reorder_s", options.reorder_s}, Number{"silent_after_s", options.silent_after_s},
                          Number{"max_ahead_s", options.max_ahead_s}}) {
    if (n.value >= 0 && n.value <= kMaxSeconds) continue;
    return Error{"SyncOptions", n.name, fmt::format("{}", n.value), "a number of seconds in [0, 1e6]"};
  }
  if (options.max_images < 1) return Error{"SyncOptions", "max_images", "0", "1 or more"};
  if (options.max_bundles < 1) return Error{"SyncOptions", "max_bundles", "0", "1 or more"};
  return {};
}

// Copies rows of `width` bytes to `to` without gaps between them; returns the end of the copy.
std::uint8_t* copy_rows(const std::uint8_t* from, std::ptrdiff_t stride, std::size_t width, int height,
                        std::uint8_t* to) {
  for (int y = 0; y < height; ++y, to += width) std::memcpy(to, from + y * stride, width);
  return to;
}

// Returns the image with shared ownership of its pixels and its mask, which are copied if it has no owner.
CameraImage with_owner(const CameraImage& image) {
  if (image.owner) return image;
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  const std::shared_ptr<std::uint8_t[]> pixels(new std::uint8_t[width * height * (image.mask == nullptr ? 1 : 2)]);
  std::uint8_t* const mask = copy_rows(image.data, image.stride, width, image.height, pixels.get());
  CameraImage out{pixels.get(), image.width, image.height, image.width, image.time_ns, pixels};
  if (image.mask == nullptr) return out;
  copy_rows(image.mask, image.mask_stride, width, image.height, mask);
  out.mask = mask;
  out.mask_stride = image.width;
  return out;
}

Error moved_from() { return {"Synchronizer::push", "", "a Synchronizer that was moved from", "a valid Synchronizer"}; }

}  // namespace

struct Synchronizer::Impl {
  Impl(const Rig& r, SyncOptions o)
      : rig(api::Access::impl(r).rig), options(std::move(o)), grouper(rig.size(), options) {
    counts.pushed.resize(rig.size());
    counts.dropped.resize(rig.size());
  }

  Status push(std::size_t camera, const CameraImage& image);
  Status close();
  Status report(const std::vector<DroppedImage>& dropped, const char* name) const;
  void commit(std::vector<ImageBundle> bundles, std::vector<DroppedImage>& dropped, std::size_t limit);
  std::optional<ImageBundle> take();
  std::optional<ImageBundle> wait(std::optional<double> timeout_s);
  void end();  // returns when no call of wait() is in progress

  const camera::Rig rig;
  const SyncOptions options;
  std::mutex mutex;
  std::condition_variable changed;
  api::ImageGrouper grouper;  // guarded by mutex, like the next four members
  std::deque<ImageBundle> ready;
  SyncCounts counts;
  bool closed = false;
  int waiting_threads = 0;
};

// Adds complete bundles to `ready` and updates the counts. If `limit` is exceeded, the oldest bundles are discarded and
// their images appended to `dropped`. The mutex must be held.
void Synchronizer::Impl::commit(std::vector<ImageBundle> bundles, std::vector<DroppedImage>& dropped,
                                std::size_t limit) {
  counts.bundles += bundles.size();
  for (ImageBundle& bundle : bundles) ready.push_back(std::move(bundle));
  for (; ready.size() > limit; ready.pop_front()) {
    --counts.bundles;
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const CameraImage& image = ready.front().images[c];
      if (image.data != nullptr) dropped.push_back({c, image.time_ns, DropReason::kOverflow});
    }
  }
  for (const DroppedImage& d : dropped) ++counts.dropped[d.camera][static_cast<std::size_t>(d.reason)];
}

Status Synchronizer::Impl::push(std::size_t camera, const CameraImage& image) {
  if (camera >= rig.size()) {
    return Error{"Synchronizer::push", "camera", std::to_string(camera),
                 fmt::format("an index in [0, {}]", rig.size() - 1)};
  }
  if (const Status s = api::check_image(image, rig.camera(camera), "Synchronizer::push"); !s) return s;
  const CameraImage owned = with_owner(image);
  std::vector<DroppedImage> dropped;
  {
    const std::lock_guard lock(mutex);
    if (closed) return Error{"Synchronizer::push", "", "an image after close()", "images before close() only"};
    ++counts.pushed[camera];
    std::vector<ImageBundle> bundles;
    grouper.push(camera, image.time_ns + rig.camera(camera).time_offset_ns, owned, bundles, dropped);
    commit(std::move(bundles), dropped, options.max_bundles);
  }
  changed.notify_all();
  return report(dropped, "Synchronizer::push: on_drop");
}

Status Synchronizer::Impl::close() {
  std::vector<DroppedImage> dropped;
  {
    const std::lock_guard lock(mutex);
    if (closed) return {};
    closed = true;
    std::vector<ImageBundle> bundles;
    grouper.flush(bundles, dropped);
    commit(std::move(bundles), dropped, ready.max_size());
  }
  changed.notify_all();
  return report(dropped, "Synchronizer::close: on_drop");
}

// Reports all images and returns the first error. `name`: name of the call, for the error.
Status Synchronizer::Impl::report(const std::vector<DroppedImage>& dropped, const char* name) const {
  Status first;
  if (!options.on_drop) return first;
  for (const DroppedImage& d : dropped) {
    const Status reported = api::guarded(name, [&]() -> Status {
      options.on_drop(d);
      return {};
    });
    if (first) first = reported;
  }
  return first;
}

// The mutex must be held.
std::optional<ImageBundle> Synchronizer::Impl::take() {
  if (ready.empty()) return std::nullopt;
  ImageBundle bundle = std::move(ready.front());
  ready.pop_front();
  return bundle;
}

std::optional<ImageBundle> Synchronizer::Impl::wait(std::optional<double> timeout_s) {
  std::unique_lock lock(mutex);
  ++waiting_threads;
  const auto done = [&] { return closed || !ready.empty(); };
  if (timeout_s) {
    const double limit_s = *timeout_s > 0 ? std::min(*timeout_s, kMaxSeconds) : 0.0;  // 0 also for NaN
    changed.wait_for(lock, std::chrono::duration<double>(limit_s), done);
  } else {
    changed.wait(lock, done);
  }
  std::optional<ImageBundle> bundle = take();
  --waiting_threads;
  if (closed) changed.notify_all();  // with the mutex held: end() may destroy this afterwards
  return bundle;
}

void Synchronizer::Impl::end() {
  std::unique_lock lock(mutex);
  closed = true;
  changed.notify_all();
  changed.wait(lock, [&] { return waiting_threads == 0; });
}

Synchronizer::Synchronizer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Synchronizer::Synchronizer(Synchronizer&& other) noexcept = default;
Synchronizer& Synchronizer::operator=(Synchronizer&& other) noexcept {
  if (this == &other) return *this;
  if (impl_) impl_->end();
  impl_ = std::move(other.impl_);
  return *this;
}
Synchronizer::~Synchronizer() {
  if (impl_) impl_->end();
}

Result<Synchronizer> Synchronizer::create(const Rig& rig, SyncOptions options) {
  return api::guarded("Synchronizer::create", [&]() -> Result<Synchronizer> {
    if (const Status status = check_options(options); !status) return status.error();
    return Synchronizer(std::make_unique<Impl>(rig, std::move(options)));
  });
}

Status Synchronizer::push(std::size_t camera, const CameraImage& image) {
  if (!impl_) return moved_from();
  return api::guarded("Synchronizer::push", [&] { return impl_->push(camera, image); });
}

std::optional<ImageBundle> Synchronizer::pop() {
  if (!impl_) return std::nullopt;
  const std::lock_guard lock(impl_->mutex);
  return impl_->take();
}

std::optional<ImageBundle> Synchronizer::wait() {
  if (!impl_) return std::nullopt;
  return impl_->wait(std::nullopt);
}

std::optional<ImageBundle> Synchronizer::wait_for(double timeout_s) {
  if (!impl_) return std::nullopt;
  return impl_->wait(timeout_s);
}

Status Synchronizer::close() {
  if (!impl_) return {};
  return api::guarded("Synchronizer::close", [&] { return impl_->close(); });
}

SyncCounts Synchronizer::counts() const {
  if (!impl_) return {};
  const std::lock_guard lock(impl_->mutex);
  SyncCounts counts = impl_->counts;
  counts.waiting = impl_->grouper.waiting();
  return counts;
}

}  // namespace bslam
