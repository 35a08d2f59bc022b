#include "tracking/camera_health.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "base/assert.h"

namespace bslam::tracking {
namespace {

// Frames and time without an image of a working camera with a lower rate than the others, if both are exceeded.
constexpr int kMaxMissedFrames = 10;
constexpr double kMaxMissed_s = 0.5;
constexpr int kMaxRepeated = 4;  // identical images in a row that a slow camera's driver may insert
constexpr int kSampleStep = 4;   // only every fourth row and column is used to measure brightness

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  return std::rotl(hash ^ value, 27) * 0x9e3779b97f4a7c15ull;
}

// Returns a hash of all pixels. Four independent ones are computed side by side, of eight pixels each.
std::uint64_t content(const image::ImageView& image) {
  constexpr int kLanes = 4, kWord = 8;
  std::array<std::uint64_t, kLanes> lanes = {1, 2, 3, 4};
  std::uint64_t rest = 5;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.row(y);
    int x = 0;
    for (; x + kLanes * kWord <= image.width; x += kLanes * kWord) {
      std::array<std::uint64_t, kLanes> words;
      std::memcpy(words.data(), row + x, sizeof words);
      for (std::size_t k = 0; k < kLanes; ++k) lanes[k] = mixed(lanes[k], words[k]);
    }
    for (; x < image.width; ++x) rest = mixed(rest, row[x]);
  }
  for (const std::uint64_t lane : lanes) rest = mixed(rest, lane);
  return rest;
}

// The masks of an image; either may be empty.
struct Masks {
  image::ImageView of_camera, of_image;

  bool any() const { return !of_camera.empty() || !of_image.empty(); }
  bool ignore(int x, int y) const {
    return (!of_camera.empty() && of_camera.row(y)[x] == 0) || (!of_image.empty() && of_image.row(y)[x] == 0);
  }
};

// Completes `health` except for its content and blur.
void measure_exposure(const image::ImageView& image, const Masks& masks, const HealthOptions& options,
                      ImageHealth& health) {
  int samples = 0, dark = 0, bright = 0;
  const bool masked = masks.any();
  for (int y = 0; y < image.height; y += kSampleStep) {
    for (int x = 0; x < image.width; x += kSampleStep) {
      if (masked && masks.ignore(x, y)) continue;
      ++samples;
      dark += image.row(y)[x] <= options.dark_level;
      bright += image.row(y)[x] >= options.bright_level;
    }
  }
  if (samples == 0) return;
  health.shows_something = dark + bright < options.black_pixel_ratio * samples;
  if (dark >= options.black_pixel_ratio * samples) {
    health.reason = CameraReason::kBlack;
  } else if (bright >= options.over_exposed_pixel_ratio * samples) {
    health.reason = CameraReason::kOverExposed;
  }
}

struct Edges {
  int all = 0, sharp = 0;
};

// Divides a line of `pixels` pixels, which begins at `first` and has a distance of `step` bytes between pixels, into
// spans, and counts the spans that contain an edge and those whose edge is sharp. `ignore(i)`: pixel i is masked.
template <class Ignore>
void count_edges(const std::uint8_t* first, std::ptrdiff_t step, int pixels, double sharp_slope, const Ignore& ignore,
                 Edges& edges) {
  constexpr int kSpan = 16, kContrast = 40;  // pixels; grey values
  for (int begin = 0; begin + kSpan < pixels; begin += kSpan) {
    if (ignore(begin) || ignore(begin + kSpan)) continue;
    const std::uint8_t* p = first + begin * step;
    int low = *p, high = *p, steepest = 0;
    for (int i = 1; i <= kSpan; ++i) {
      const int before = p[(i - 1) * step], value = p[i * step];
      low = std::min(low, value);
      high = std::max(high, value);
      steepest = std::max(steepest, std::abs(value - before));
    }
    if (high - low < kContrast) continue;
    ++edges.all;
    edges.sharp += steepest >= sharp_slope * (high - low);
  }
}

// Returns nullopt if there are too few edges.
std::optional<bool> is_blurred(const image::ImageView& image, const Masks& masks, const HealthOptions& options) {
  constexpr int kLines = 30, kMinEdges = 40;  // number of rows searched; columns have the same spacing
  const int step = std::max(1, image.height / kLines);
  Edges edges;
  const bool masked = masks.any();
  for (int y = 0; y < image.height; y += step) {
    const auto ignore = [&](int x) { return masked && masks.ignore(x, y); };
    count_edges(image.row(y), 1, image.width, options.sharp_slope, ignore, edges);
  }
  for (int x = 0; x < image.width; x += step) {
    const auto ignore = [&](int y) { return masked && masks.ignore(x, y); };
    count_edges(image.row(0) + x, image.stride, image.height, options.sharp_slope, ignore, edges);
  }
  if (edges.all < kMinEdges) return std::nullopt;
  return edges.sharp < options.min_sharp_edge_ratio * edges.all;
}

ImageHealth image_health(const image::ImageView& image, const Masks& masks, const HealthOptions& options) {
  ImageHealth out{.content = content(image), .blurred = is_blurred(image, masks, options)};
  measure_exposure(image, masks, options, out);
  out.blocks = block_means(image);
  return out;
}

}  // namespace

CameraMonitor::CameraMonitor(std::size_t cameras, const HealthOptions& options)
    : options_(options), cameras_(cameras), still_views_(cameras) {}

ImageFaults CameraMonitor::examine(const image::ImageBundle& images, std::span<const image::Image> masks,
                                   ThreadPool& pool) {
  BSLAM_ASSERT(images.images.size() == cameras_.size(), "there must be one image entry per camera");
  BSLAM_ASSERT(masks.empty() || masks.size() == cameras_.size(), "there must be one mask entry per camera");
  Health health(cameras_.size());
  pool.for_each(cameras_.size(), [&](std::size_t c) {
    const image::CameraImage& input = images.images[c];
    if (input.state != image::ImageState::kPresent) return;
    const Masks of_image{masks.empty() ? image::ImageView() : masks[c].view(), input.mask_view()};
    health[c] = image_health(input.view(), of_image, options_);
  });
  ImageFaults faults;
  faults.outage = find_outages(health, images.time_ns, faults.repeated);
  faults.blurred = find_blurred(health);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraReason outage = faults.outage[c];
    Camera& camera = cameras_[c];
    const bool missing = outage == CameraReason::kNoImages;
    camera.missed = missing ? camera.missed + 1 : 0;
    if (!missing || !camera.last_image_ns) camera.last_image_ns = images.time_ns;
    const double missing_s = to_seconds(images.time_ns - *camera.last_image_ns);
    faults.failing.push_back(missing ? camera.missed > kMaxMissedFrames && missing_s > kMaxMissed_s
                                     : outage != CameraReason::kNone);
  }
  return faults;
}

std::vector<CameraReason> CameraMonitor::find_outages(const Health& images, TimeNs time_ns, bool& repeated) {
  std::vector<CameraReason> found(cameras_.size(), CameraReason::kNoImages);
  const std::vector<std::uint8_t> still = find_still(images, time_ns);
  std::vector<std::uint8_t> same(cameras_.size(), 0);
  bool any_changed = false;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!images[c]) continue;
    found[c] = images[c]->reason;
    same[c] = cameras_[c].last == images[c]->content;
    any_changed |= cameras_[c].last && !same[c];
    cameras_[c].last = images[c]->content;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    if (found[c] == CameraReason::kNoImages) continue;
    same[c] |= still[c];
    // A frozen camera stays frozen as long as its image is the same, even if no other camera has an image.
    const bool frozen = same[c] && (still[c] || any_changed || camera.outage == CameraReason::kFrozen);
    if (found[c] == CameraReason::kNone && frozen) found[c] = CameraReason::kFrozen;
    if (camera.outage == CameraReason::kFrozen && !same[c] && camera.repeated <= kMaxRepeated)
      camera.outage = CameraReason::kNone;
    camera.repeated += same[c];
    if (found[c] != CameraReason::kNone) {
      camera.outage = found[c];
      camera.good = 0;
    } else if (camera.outage != CameraReason::kNone && ++camera.good < options_.readmit_after) {
      found[c] = camera.outage;
    } else {
      camera.outage = CameraReason::kNone;
      camera.repeated = 0;
    }
  }
  admit_if_none_is_left(images, found);
  bool any = false, any_new = false;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (found[c] != CameraReason::kNone) continue;
    any = true;
    any_new |= !same[c];
  }
  repeated = any && !any_new;
  return found;
}

std::vector<std::uint8_t> CameraMonitor::find_still(const Health& images, TimeNs time_ns) {
  std::vector<std::optional<BlockMeans>> blocks(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (images[c] && images[c]->reason == CameraReason::kNone) blocks[c] = images[c]->blocks;
  }
  return still_views_.update(blocks, time_ns);
}

void CameraMonitor::admit_if_none_is_left(const Health& images, std::vector<CameraReason>& found) {
  const auto any_used = [&] { return std::ranges::find(found, CameraReason::kNone) != found.end(); };
  if (any_used()) return;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (found[c] == CameraReason::kNoImages || cameras_[c].good == 0) continue;
    found[c] = cameras_[c].outage = CameraReason::kNone;
  }
  if (any_used()) return;
  // A large white object may cover most of the view. The rest of the image is better than no image.
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (found[c] == CameraReason::kOverExposed && images[c]->shows_something) found[c] = CameraReason::kNone;
  }
}

std::vector<std::uint8_t> CameraMonitor::find_blurred(const Health& images) {
  std::vector<std::uint8_t> out(cameras_.size(), 0);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    if (const auto now = images[c] ? images[c]->blurred : std::nullopt) {
      camera.sharp = *now ? 0 : camera.sharp + 1;
      camera.blurred = *now || (camera.blurred && camera.sharp < options_.readmit_after);
    }
    out[c] = camera.blurred;
  }
  return out;
}

}  // namespace bslam::tracking
