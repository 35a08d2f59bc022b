#include "system/camera_health.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/assert.h"

namespace bslam::system {
namespace {

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

Outage exposure(const image::Image& image, const HealthOptions& options) {
  int samples = 0, dark = 0, bright = 0;
  for (int y = 0; y < image.height(); y += kSampleStep) {
    for (int x = 0; x < image.width(); x += kSampleStep, ++samples) {
      dark += image.row(y)[x] <= options.dark_level;
      bright += image.row(y)[x] >= options.bright_level;
    }
  }
  if (dark >= options.dark_share * samples) return Outage::kBlack;
  if (bright >= options.bright_share * samples) return Outage::kOverExposed;
  return Outage::kNone;
}

}  // namespace

std::string_view describe(Outage outage) {
  switch (outage) {
    case Outage::kNone: return "";
    case Outage::kNoImage: return "no-images";
    case Outage::kBlack: return "black";
    case Outage::kOverExposed: return "over-exposed";
    case Outage::kFrozen: return "frozen";
    case Outage::kInconsistent: return "inconsistent";
  }
  return "";
}

CameraMonitor::CameraMonitor(std::size_t cameras, const HealthOptions& options) : options_(options), cameras_(cameras) {}

std::vector<Outage> CameraMonitor::judge(const image::ImageBundle& images) {
  BSLAM_ASSERT(images.images.size() == cameras_.size(), "one image slot per camera");
  std::vector<Outage> found(cameras_.size(), Outage::kNoImage);
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
    if (found[c] == Outage::kNoImage) continue;
    if (found[c] == Outage::kNone && same[c] && any_changed) found[c] = Outage::kFrozen;
    if (found[c] != Outage::kNone) {
      camera.outage = found[c];
      camera.good = 0;
    } else if (camera.outage != Outage::kNone && ++camera.good < options_.readmit_after) {
      found[c] = camera.outage;
    } else {
      camera.outage = Outage::kNone;
    }
  }
  if (std::ranges::find(found, Outage::kNone) != found.end()) return found;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {  // better than nothing
    if (found[c] == Outage::kNoImage || cameras_[c].good == 0) continue;
    found[c] = cameras_[c].outage = Outage::kNone;
  }
  return found;
}

}  // namespace bslam::system
