// A wall of random squares, four metres ahead of a stereo rig that slides along it: every image is a cut-out of one
// picture, so that poses and velocities are known exactly and nothing has to be rendered.
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
  static constexpr int kStep = 2;                                   // px the picture moves from frame to frame
  static constexpr std::int64_t kInterval = 50'000'000;             // ns
  static constexpr std::int64_t kStart = 1'000'000'000;             // ns
  static constexpr double kSpeed = kStep * kMetresPerPixel / 0.05;  // m/s, along +x of camera 0

  TexturedWall() : picture_(static_cast<std::size_t>(kPictureWidth) * kHeight) {
    constexpr int kSquare = 7;
    Random random(4);
    std::vector<int> grey(static_cast<std::size_t>((kPictureWidth / kSquare + 1) * (kHeight / kSquare + 1)));
    for (int& g : grey) g = 30 + static_cast<int>(random.below(200));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kPictureWidth; ++x) {
        const int square = y / kSquare * (kPictureWidth / kSquare + 1) + x / kSquare;
        picture_[static_cast<std::size_t>(y * kPictureWidth + x)] =
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

  // What camera c sees in frame k; borrowed rows of the picture, whose stride is wider than the image.
  CameraImage image(int k, int camera) const {
    const int shift = kStep * k + static_cast<int>(kBaseline * camera / kMetresPerPixel + 0.5);
    return {picture_.data() + shift, kWidth, kHeight, kPictureWidth, kStart + k * kInterval, nullptr};
  }
  ImageBundle bundle(int k) const { return {{image(k, 0), image(k, 1)}}; }

 private:
  static constexpr int kPictureWidth = 700;
  std::vector<std::uint8_t> picture_;
};

}  // namespace bslam::testing
