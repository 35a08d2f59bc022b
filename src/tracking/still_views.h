// Finds cameras that show a still picture while the rig moves, such as those whose encoder or driver has stalled. Their
// images may differ by noise, so that they are not identical.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/timestamp.h"
#include "image/image.h"

namespace bslam::tracking {

// The mean grey values of the blocks of an image. In blocks, noise is small compared with what motion changes.
struct BlockMeans {
  static constexpr int kColumns = 24, kRows = 16;
  using Values = std::array<float, std::size_t{kColumns} * kRows>;
  Values mean = {};
};
BlockMeans block_means(const image::ImageView& image);

// How much an image differs from an earlier one of its camera, after subtraction of the median difference, which is
// that of the exposure: quantiles of the absolute differences of the blocks, grey values.
struct BlockChange {
  float half = 0;  // exceeded by half of the blocks
  float most = 0;  // by a tenth of the blocks
  // Part of the blocks that changed at all, among those that differ from their neighbours: nearly all of them change if
  // the camera moves, but only those that it covers if something moves in front of it.
  float part = 0;
};
BlockChange change_of(const BlockMeans& earlier, const BlockMeans& later);

// A camera shows a still picture if nearly all of its image, which has texture, is as it was at an earlier time, while
// since then the whole images of most other cameras have changed. Traffic around a rig at rest may do this to one or
// two cameras for a moment, but there the picture was still before. Therefore either it must have stopped while the
// camera moved or when the recording began, or three other cameras must have changed. It is still until it changes.
// Single images that repeat the one before, as in a video of a constant frame rate, are still as well.
class StillViews {
 public:
  explicit StillViews(std::size_t cameras) : cameras_(cameras) {}

  // Per camera, whether its image of this frame is a still picture. `images`: of the next frame, one per camera;
  // nullopt: it has none that can be compared.
  std::vector<std::uint8_t> update(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns);

 private:
  struct Image {
    BlockMeans blocks;
    TimeNs time_ns = 0;
  };
  // From an earlier image of a camera to its last one.
  struct Comparison {
    TimeNs since_ns = 0;
    BlockChange change;
  };
  struct Camera {
    std::optional<Image> reference;             // what is compared with; if it is still, the still picture
    std::optional<Image> newest;                // its last image
    std::optional<Comparison> since_reference;  // its last image compared with the reference
    std::optional<Comparison> step;             // its image of this frame compared with the one before
    std::optional<TimeNs> moved_ns;  // when it last moved between two references; at first, that of its first image
    bool still = false;
    // BlockChange::most of the last step that was no repetition, halved by each repetition since: a rig that has
    // stopped shows more than a few.
    float pace = 0;
  };
  void compare(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns);
  // Whether only this camera has not changed, while most others moved.
  bool is_alone(std::size_t camera) const;
  // Whether its image repeats the one before, in the middle of the motion of all.
  bool repeats(std::size_t camera) const;
  bool is_time_for_new_references(TimeNs time_ns) const;

  std::vector<Camera> cameras_;
  std::optional<TimeNs> reference_ns_;  // when the references were chosen
};

}  // namespace bslam::tracking
