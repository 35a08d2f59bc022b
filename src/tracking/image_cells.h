// The grid with which tracking measures how widely matches are spread over an image.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "camera/camera.h"

namespace bslam::tracking {

constexpr int kCells = 8;  // number of cells per side

inline std::size_t cell_of(const Eigen::Vector2d& pixel, const camera::Camera& camera) {
  const auto along = [](double position, int size) {
    return std::clamp(static_cast<int>(kCells * position / size), 0, kCells - 1);
  };
  return static_cast<std::size_t>(kCells * along(pixel.y(), camera.height) + along(pixel.x(), camera.width));
}

}  // namespace bslam::tracking
