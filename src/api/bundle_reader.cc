#include "api/bundle_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "system/input_check.h"

namespace bslam::api {
namespace {

constexpr const char* kProcess = "System::process";
constexpr TimeNs kMaxTime = 4'000'000'000'000'000'000;  // ns, with room for the time offset
constexpr TimeNs kMaxSpread = 1'000'000'000;            // ns between the images of a bundle

std::string camera_key(std::size_t c, const camera::Camera& camera) {
  return fmt::format("images[{}] ({})", c, camera.name);
}

}  // namespace

Status check_image(const CameraImage& image, const camera::Camera& camera, const char* name) {
  if (image.data == nullptr) return Error{name, camera.name, "no pixels (data is null)", "an image"};
  if (const Status size = system::check_size(image.width, image.height, camera, name); !size) return size;
  if (image.stride < image.width) {
    return Error{name, camera.name, fmt::format("a stride of {} bytes", image.stride),
                 fmt::format("at least {}, the width", image.width)};
  }
  if (image.mask != nullptr && image.mask_stride < image.width) {
    return Error{name, camera.name, fmt::format("a mask with a stride of {} bytes", image.mask_stride),
                 fmt::format("at least {}, the width", image.width)};
  }
  if (image.time_ns < -kMaxTime || image.time_ns > kMaxTime) {
    return Error{name, camera.name, fmt::format("time {} ns", image.time_ns), "nanoseconds within +-4e18"};
  }
  return {};
}

Result<image::ImageBundle> BundleReader::convert(const ImageBundle& bundle) const {
  if (const Status count = system::check_count(bundle.images.size(), rig_, kProcess); !count) return count.error();
  image::ImageBundle out{next_, 0, std::vector<image::CameraImage>(rig_.size())};
  bool any = false;
  for (std::size_t c = 0; c < rig_.size(); ++c) {
    const CameraImage& in = bundle.images[c];
    if (in.data == nullptr) continue;
    if (const Status status = check_image(in, rig_.camera(c), kProcess); !status) return status.error();
    image::CameraImage& image = out.images[c];
    image.state = image::ImageState::kPresent;
    image.time_ns = in.time_ns + rig_.camera(c).time_offset_ns;
    image.borrowed = {in.data, in.width, in.height, in.stride};
    if (in.mask != nullptr) image.borrowed_mask = {in.mask, in.width, in.height, in.mask_stride};
    const bool sets_time = !any || (image.time_ns < out.time_ns && out.images[0].state != image::ImageState::kPresent);
    if (sets_time) out.time_ns = image.time_ns;
    any = true;
  }
  if (!any) return Error{kProcess, "images", "none", "the image of at least one camera"};
  return out;
}

Status BundleReader::check_times(const image::ImageBundle& images) const {
  if (last_ns_) {
    if (const Status later = system::check_later(images.time_ns, *last_ns_, kProcess); !later) return later;
  }
  for (std::size_t c = 0; c < images.images.size(); ++c) {
    const image::CameraImage& image = images.images[c];
    if (image.state != image::ImageState::kPresent) continue;
    const std::string key = camera_key(c, rig_.camera(c));
    if (std::abs(image.time_ns - images.time_ns) > kMaxSpread) {
      return Error{kProcess, key,
                   fmt::format("{} s from the time of the bundle", to_seconds(image.time_ns - images.time_ns)),
                   "images within a second of each other"};
    }
    if (last_camera_ns_[c] && image.time_ns <= *last_camera_ns_[c]) {
      return Error{kProcess, key, fmt::format("time {} ns", image.time_ns),
                   fmt::format("a time after {} ns (previous image of the camera)", *last_camera_ns_[c])};
    }
  }
  return {};
}

Result<image::ImageBundle> BundleReader::read(const ImageBundle& bundle) {
  auto images = convert(bundle);
  if (!images) return images;
  if (const Status status = check_times(*images); !status) return status.error();
  last_ns_ = images->time_ns;
  for (std::size_t c = 0; c < rig_.size(); ++c) {
    if (images->images[c].state == image::ImageState::kPresent) last_camera_ns_[c] = images->images[c].time_ns;
  }
  next_ = next_.next();
  return images;
}

}  // namespace bslam::api
