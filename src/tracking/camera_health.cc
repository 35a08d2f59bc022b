#include "tracking/camera_health.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "base/assert.h"

namespace bslam::tracking {
namespace {

constexpr int kSlow = 10;  // frames a sound camera may be without a picture, as it fires less often than the others
constexpr int kSampleStep = 4;  // rows and columns: brightness does not hide between them

// A hash of every pixel, eight at a time.
std::uint64_t content(const image::Image& image) {
  std::uint64_t hash = 0x2545f4914f6cdd1dull;
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* row = image.row(y);
    int x = 0;
    for (; x + 8 <= image.width(); x += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, 8);
      hash = std::rotl(hash ^ word, 27) * 0x9e3779b97f4a7c15ull;
    }
    for (; x < image.width(); ++x) hash = std::rotl(hash ^ row[x], 27) * 0x9e3779b97f4a7c15ull;
  }
  return hash;
}

CameraReason exposure(const image::Image& image, const HealthOptions& options) {
  int samples = 0, dark = 0, bright = 0;
  for (int y = 0; y < image.height(); y += kSampleStep) {
    for (int x = 0; x < image.width(); x += kSampleStep, ++samples) {
      dark += image.row(y)[x] <= options.dark_level;
      bright += image.row(y)[x] >= options.bright_level;
    }
  }
  if (dark >= options.dark_share * samples) return CameraReason::kBlack;
  if (bright >= options.bright_share * samples) return CameraReason::kOverExposed;
  return CameraReason::kNone;
}

struct Edges {
  int all = 0, sharp = 0;
};

// Counts the edges among spans of pixels `step` bytes apart that begin at `first`, span after span.
void count_edges(const std::uint8_t* first, std::ptrdiff_t step, int pixels, double sharp_slope, Edges& edges) {
  constexpr int kSpan = 16, kContrast = 40;  // pixels; grey values
  for (int begin = 0; begin + kSpan < pixels; begin += kSpan) {
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

// True, false, or nothing where there are too few edges to tell.
std::optional<bool> is_blurred(const image::Image& image, const HealthOptions& options) {
  constexpr int kLines = 30, kMinEdges = 40;  // rows looked at, and columns as far apart
  const int step = std::max(1, image.height() / kLines);
  Edges edges;
  for (int y = 0; y < image.height(); y += step)
    count_edges(image.row(y), 1, image.width(), options.sharp_slope, edges);
  for (int x = 0; x < image.width(); x += step)
    count_edges(image.row(0) + x, image.width(), image.height(), options.sharp_slope, edges);
  if (edges.all < kMinEdges) return std::nullopt;
  return edges.sharp < options.sharp_share * edges.all;
}

}  // namespace

CameraMonitor::CameraMonitor(std::size_t cameras, const HealthOptions& options)
    : options_(options), cameras_(cameras) {}

PictureFaults CameraMonitor::examine(const image::ImageBundle& images) {
  PictureFaults faults{judge(images), blurred(images), {}};
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraReason outage = faults.outage[c];
    int& missed = cameras_[c].missed;
    missed = outage == CameraReason::kNoImages ? missed + 1 : 0;
    faults.failing.push_back(outage == CameraReason::kNoImages ? missed > kSlow : outage != CameraReason::kNone);
  }
  return faults;
}

std::vector<CameraReason> CameraMonitor::judge(const image::ImageBundle& images) {
  BSLAM_ASSERT(images.images.size() == cameras_.size(), "one image slot per camera");
  std::vector<CameraReason> found(cameras_.size(), CameraReason::kNoImages);
  std::vector<std::uint8_t> same(cameras_.size(), 0);
  bool any_changed = false;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const image::CameraImage& input = images.images[c];
    if (input.state != image::ImageState::kPresent) continue;
    found[c] = exposure(input.image, options_);
    const std::uint64_t now = content(input.image);
    same[c] = cameras_[c].last == now;
    any_changed |= cameras_[c].last && !same[c];
    cameras_[c].last = now;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    if (found[c] == CameraReason::kNoImages) continue;
    // Frozen it stays while its picture is the same, also where no other is there to change.
    const bool frozen = same[c] && (any_changed || camera.outage == CameraReason::kFrozen);
    if (found[c] == CameraReason::kNone && frozen) found[c] = CameraReason::kFrozen;
    if (found[c] != CameraReason::kNone) {
      camera.outage = found[c];
      camera.good = 0;
    } else if (camera.outage != CameraReason::kNone && ++camera.good < options_.readmit_after) {
      found[c] = camera.outage;
    } else {
      camera.outage = CameraReason::kNone;
    }
  }
  if (std::ranges::find(found, CameraReason::kNone) != found.end()) return found;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {  // better than nothing
    if (found[c] == CameraReason::kNoImages || cameras_[c].good == 0) continue;
    found[c] = cameras_[c].outage = CameraReason::kNone;
  }
  return found;
}

std::vector<std::uint8_t> CameraMonitor::blurred(const image::ImageBundle& images) {
  BSLAM_ASSERT(images.images.size() == cameras_.size(), "one image slot per camera");
  std::vector<std::uint8_t> out(cameras_.size(), 0);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const image::CameraImage& input = images.images[c];
    if (input.state != image::ImageState::kPresent) continue;
    Camera& camera = cameras_[c];
    if (const auto now = is_blurred(input.image, options_)) {
      camera.sharp = *now ? 0 : camera.sharp + 1;
      camera.blurred = *now || (camera.blurred && camera.sharp < options_.readmit_after);
    }
    out[c] = camera.blurred;
  }
  return out;
}

}  // namespace bslam::tracking
