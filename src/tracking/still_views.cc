#include "tracking/still_views.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"

namespace bslam::tracking {
namespace {

constexpr float kMoved = 3.0f;      // grey values by which half of the blocks change if a camera moves by some pixels
constexpr float kWholeView = 0.7f;  // minimum part of the view that changes if the camera moves
constexpr float kChanged = 1.0f;    // grey values by which a block changes that is not still
constexpr float kDiffers = 4.0f;    // difference of neighbouring blocks that motion would change
constexpr float kStill = 0.15f;     // maximum change of a still picture, relative to that of the other cameras
constexpr float kTexture = 8.0f;    // least texture of a picture that motion would change, as of texture_of
constexpr double kLongest_s = 1.0;  // between images that are compared
constexpr double kStopped_s = 1.5;  // from the motion of a camera to the image that it shows from then on
constexpr int kMovedOthers = 3;     // other cameras that nothing in front of them changes at once

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

// Whether the camera moved, and not only something in front of it.
bool moved(const BlockChange& change) { return change.half >= kMoved && change.part >= kWholeView; }

// The part of the blocks that changed, among those that differ from a neighbour by more than the noise.
float changed_part(const BlockMeans& image, const BlockMeans::Values& change) {
  int textured = 0, changed = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    const bool last = (i + 1) % BlockMeans::kColumns == 0;
    if (std::abs(image.mean[i] - image.mean[last ? i - 1 : i + 1]) < kDiffers) continue;
    ++textured;
    changed += change[i] > kChanged;
  }
  return textured > 0 ? static_cast<float>(changed) / static_cast<float>(textured) : 0.0f;
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
  return {quantile(difference, 0.5), quantile(difference, 0.9), changed_part(earlier, difference)};
}

// Only changes of others within the time in which this camera's image did not change count.
bool StillViews::is_alone(std::size_t camera) const {
  const Camera& own = cameras_[camera];
  const Comparison& of_own = *own.since_reference;
  std::vector<float> changes;
  int moving = 0;
  for (std::size_t o = 0; o < cameras_.size(); ++o) {
    const auto& other = cameras_[o].since_reference;
    if (o == camera || !other || other->since_ns < of_own.since_ns) continue;
    changes.push_back(moved(other->change) ? other->change.half : 0.0f);
    moving += moved(other->change);
  }
  const bool stopped_in_motion = own.moved_ns && to_seconds(of_own.since_ns - *own.moved_ns) < kStopped_s;
  if (changes.empty() || (moving < kMovedOthers && !stopped_in_motion)) return false;
  const float of_most = lower_median(std::move(changes));
  return of_most >= kMoved && of_own.change.most <= std::min(kChanged, kStill * of_most);
}

bool StillViews::repeats(std::size_t camera) const {
  const Camera& own = cameras_[camera];
  std::vector<float> steps;
  for (std::size_t o = 0; o < cameras_.size(); ++o) {
    const auto& other = cameras_[o].step;
    if (o != camera && other && other->since_ns >= own.step->since_ns) steps.push_back(other->change.most);
  }
  if (steps.empty()) return false;
  const float usual = std::min(own.pace, lower_median(std::move(steps)));
  return usual >= kMoved && own.step->change.most <= std::min(kChanged, kStill * usual);
}

bool StillViews::is_time_for_new_references(TimeNs time_ns) const {
  const auto is_over = [&](TimeNs since) { return time_ns < since || to_seconds(time_ns - since) >= kLongest_s; };
  if (!reference_ns_ || is_over(*reference_ns_)) return true;
  return std::ranges::all_of(cameras_, [&](const Camera& c) {
    return !c.newest || is_over(c.newest->time_ns) || c.still ||
           (c.since_reference && moved(c.since_reference->change));
  });
}

void StillViews::compare(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns) {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    camera.step.reset();
    if (!images[c]) continue;
    const auto compared_with = [&](const Image& earlier) {
      return Comparison{earlier.time_ns, change_of(earlier.blocks, *images[c])};
    };
    if (camera.newest) camera.step = compared_with(*camera.newest);
    if (camera.reference) camera.since_reference = compared_with(*camera.reference);
    if (!camera.newest) camera.moved_ns = time_ns;
  }
}

std::vector<std::uint8_t> StillViews::update(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns) {
  compare(images, time_ns);
  std::vector<std::uint8_t> out(cameras_.size(), 0);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    if (!images[c]) continue;
    if (camera.since_reference) {
      camera.still &= camera.since_reference->change.most <= kChanged;
      camera.still |= is_alone(c) && texture_of(camera.reference->blocks) >= kTexture;
    }
    const bool repeated = camera.step && repeats(c);
    if (camera.step) camera.pace = repeated ? camera.pace / 2 : camera.step->change.most;
    out[c] = camera.still || repeated;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (images[c]) cameras_[c].newest = {*images[c], time_ns};
  }
  if (!is_time_for_new_references(time_ns)) return out;
  reference_ns_ = time_ns;
  for (Camera& camera : cameras_) {
    if (camera.since_reference && moved(camera.since_reference->change)) camera.moved_ns = camera.newest->time_ns;
    if (camera.still || !camera.newest) continue;
    camera.reference = camera.newest;
    camera.since_reference.reset();
  }
  return out;
}

}  // namespace bslam::tracking
