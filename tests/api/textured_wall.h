// A wall of random squares, four metres in front of a stereo rig that moves parallel to it: every image is a section of
// one texture, so that poses and velocities are known exactly and no rendering is needed.
#pragma once

#include <bslam/bslam.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/random.h"

namespace bslam::testing {

class TexturedWall {
 public:
  static constexpr int kWidth = 320, kHeight = 240;
  static constexpr double kFocal = 200, kDepth = 4, kBaseline = 0.2;  // px, m, m
  static constexpr double kMetresPerPixel = kDepth / kFocal;
  static constexpr int kStep = 2;  // px, image motion from frame to frame
  static constexpr std::int64_t kInterval_ns = 50'000'000, kStart_ns = 1'000'000'000;
  static constexpr double kSpeed = kStep * kMetresPerPixel / (1e-9 * kInterval_ns);  // m/s, along +x of camera 0

  TexturedWall() : texture_(static_cast<std::size_t>(kTextureWidth) * kHeight) {
    constexpr int kSquare = 7;
    Random random(4);
    std::vector<int> grey(static_cast<std::size_t>((kTextureWidth / kSquare + 1) * (kHeight / kSquare + 1)));
    for (int& g : grey) g = 30 + static_cast<int>(random.below(200));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kTextureWidth; ++x) {
        const int square = y / kSquare * (kTextureWidth / kSquare + 1) + x / kSquare;
        texture_[static_cast<std::size_t>(y * kTextureWidth + x)] =
            static_cast<std::uint8_t>(grey[static_cast<std::size_t>(square)]);
      }
    }
  }

  static CameraCalibration calibration(int camera) {
    CameraCalibration out;
    out.name = camera == 0 ? "left" : "right";
    out.model = "pinhole";
    out.width = kWidth;
    out.height = kHeight;
    out.intrinsics = {kFocal, kFocal, 0.5 * (kWidth - 1), 0.5 * (kHeight - 1)};
    out.T_body_cam.translation = {kBaseline * camera, 0, 0};
    return out;
  }
  static Rig rig() { return Rig::make({calibration(0), calibration(1)}).value(); }

  // Returns the image of a camera in frame k; it refers to rows of the texture, whose stride exceeds the image width.
  CameraImage image(int k, int camera) const {
    const int shift = kStep * k + static_cast<int>(kBaseline * camera / kMetresPerPixel + 0.5);
    return {texture_.data() + shift, kWidth, kHeight, kTextureWidth, kStart_ns + k * kInterval_ns, nullptr};
  }
  ImageBundle bundle(int k) const { return {{image(k, 0), image(k, 1)}}; }

 private:
  static constexpr int kTextureWidth = 700;
  std::vector<std::uint8_t> texture_;
};

}  // namespace bslam::testing
