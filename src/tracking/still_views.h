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
};
BlockChange change_of(const BlockMeans& earlier, const BlockMeans& later);

class StillViews {
 public:
  explicit StillViews(std::size_t cameras) : cameras_(cameras) {}

  // Per camera, whether it shows a still picture: it has texture, and nearly all of it is as it was at an earlier time,
  // while since then half or more of the images of most other cameras have changed. It is still until its image
  // changes. `images`: of the next frame, one per camera; nullopt: it has none that can be compared.
  std::vector<std::uint8_t> update(std::span<const std::optional<BlockMeans>> images, TimeNs time_ns);

 private:
  struct Camera {
    std::optional<BlockMeans> reference;  // image of the time that is compared with; if it is still, the still picture
    bool still = false;
  };
  std::vector<Camera> cameras_;
  std::optional<TimeNs> reference_ns_;
};

}  // namespace bslam::tracking
