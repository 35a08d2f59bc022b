#include "tracking/still_views.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"

namespace bslam::tracking {
namespace {

constexpr float kMoved = 3.0f;      // grey values by which half of the blocks change if a camera moves by some pixels
constexpr float kStill = 0.15f;     // maximum change of a still picture, relative to that of the other cameras
constexpr float kTexture = 8.0f;    // least texture of a picture that motion would change, as of texture_of
constexpr float kStillGrey = 1.0f;  // its maximum change while nothing is known of the others
constexpr double kLongest_s = 1.0;  // between images that are compared

float quantile(BlockMeans::Values values, double fraction) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

// The difference of neighbouring blocks that a tenth of them exceeds: hardly any of a blank wall, which looks the same
// while a camera moves along it.
float texture_of(const BlockMeans& image) {
  BlockMeans::Values differences = {};
  for (std::size_t i = 0; i < differences.size(); ++i) {
    if ((i + 1) % BlockMeans::kColumns != 0) differences[i] = std::abs(image.mean[i + 1] - image.mean[i]);
  }
  return quantile(differences, 0.9);
}

// By how much more than half of the other cameras have changed at least; 0 without others.
float change_of_most(std::span<const std::optional<BlockChange>> changes, std::size_t camera) {
  std::vector<float> others;
  for (std::size_t o = 0; o < changes.size(); ++o) {
    if (o != camera && changes[o]) others.push_back(changes[o]->half);
  }
  return others.empty() ? 0.0f : lower_median(std::move(others));
}

}  // namespace

BlockMeans block_means(const image::ImageView& image) {
  constexpr int kRowStep = 2;  // every second row is enough
  BlockMeans out;
  for (int r = 0; r < BlockMeans::kRows; ++r) {
    const int y_begin = r * image.height / BlockMeans::kRows, y_end = (r + 1) * image.height / BlockMeans::kRows;
    for (int c = 0; c < BlockMeans::kColumns; ++c) {
      const int begin = c * image.width / BlockMeans::kColumns, end = (c + 1) * image.width / BlockMeans::kColumns;
      int sum = 0, rows = 0;
      for (int y = y_begin; y < y_end; y += kRowStep, ++rows) {
        const std::uint8_t* row = image.row(y);
        for (int x = begin; x < end; ++x) sum += row[x];
      }
      const int pixels = rows * (end - begin);
      if (pixels > 0)
        out.mean[static_cast<std::size_t>(r * BlockMeans::kColumns + c)] =
            static_cast<float>(sum) / static_cast<float>(pixels);
    }
  }
  return out;
}

BlockChange change_of(const BlockMeans& earlier, const BlockMeans& later) {
  auto difference = later.mean;
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= earlier.mean[i];
  const float of_exposure = quantile(difference, 0.5);
  for (float& d : difference) d = std::abs(d - of_exposure);
  return {quantile(difference, 0.5), quantile(difference, 0.9)};
}

std::vector<std::uint8_t> StillViews::update(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns) {
  std::vector<std::optional<BlockChange>> changes(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    if (!images[c] || !camera.reference) continue;
    changes[c] = change_of(*camera.reference, *images[c]);
    camera.still = camera.still && changes[c]->most <= kStillGrey;
  }
  std::vector<std::uint8_t> out(cameras_.size(), 0);
  bool all_moved = true;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!changes[c]) continue;
    const float others = change_of_most(changes, c);
    const bool alike = changes[c]->most <= std::min(kStillGrey, kStill * others);
    cameras_[c].still |= others >= kMoved && alike && texture_of(*cameras_[c].reference) >= kTexture;
    out[c] = cameras_[c].still;
    all_moved &= out[c] || changes[c]->half >= kMoved;
  }
  if (reference_ns_ && !all_moved && to_seconds(time_ns - *reference_ns_) < kLongest_s && time_ns >= *reference_ns_)
    return out;
  reference_ns_ = time_ns;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!cameras_[c].still) cameras_[c].reference = images[c];
  }
  return out;
}

}  // namespace bslam::tracking
