// Reprojection errors of a map by camera and by region of the image. A wrong focal length or distortion increases them,
// and their pattern over the image shows which of the two is wrong.
#pragma once

#include <cstddef>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::calibration {

// Observed minus projected position, averaged over the observations in one cell of the image.
struct ResidualCell {
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
  std::size_t observations = 0;
};

struct ImageResiduals {
  static constexpr std::size_t kColumns = 12, kRows = 8;
  int width = 0, height = 0;  // pixels, size of the image
  std::size_t observations = 0;
  double rms_px = 0;                // root mean square of the distance to the projection; 0 without observations
  std::vector<ResidualCell> cells;  // kRows rows of kColumns cells
};

// The residuals of the observations in the map, for every camera of its rig. Outliers, which are far from the
// distribution of the others, would hide the pattern, and do not count.
// Only those of the keyframes from `first` on, such as the first one after a loaded map.
std::vector<ImageResiduals> image_residuals(const map::BundledMap& map, KeyframeId first = KeyframeId(0));

}  // namespace bslam::calibration
