// Windows of a level around a sub-pixel position: the window for orientation and binary tests, and the patch that is
// stored with a keypoint.
#pragma once

#include <array>
#include <cstdint>

#include "feature/keypoints.h"
#include "image/image.h"

namespace bslam::feature {

constexpr int kWindowRadius = 15;  // pixels of the level, to all sides of the keypoint
constexpr int kWindowRows = 2 * kWindowRadius + 1;
constexpr int kWindowStride = 32;  // bytes of a row; the last column is not part of the window

// Row-major, the keypoint in row and column kWindowRadius.
using Window = std::array<std::uint8_t, kWindowRows * kWindowStride>;

// Pixels that `sample_window` reads to the right of the rounded-down position (less to the other sides).
constexpr int kWindowReach = kWindowRadius + 2;

// Samples the window around (x, y), pixels of the level, bilinearly (to a sixteenth of a pixel).
Window sample_window(const image::ImageView& level, float x, float y);

// Samples the patch around (x, y) bilinearly (to 1/128 of a pixel); see Patch in keypoints.h.
Patch sample_patch(const image::ImageView& level, float x, float y);

}  // namespace bslam::feature
