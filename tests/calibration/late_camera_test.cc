#include "calibration/late_camera.h"

#include <gtest/gtest.h>

#include <string>

#include "base/random.h"
#include "geometry/so3.h"

namespace bslam::calibration {
namespace {

constexpr int kWidth = 480, kHeight = 360, kBlock = 6;
constexpr double kFocal = 300;
constexpr int kScroll = 9;  // pixels from a frame to the next one
constexpr TimeNs kInterval = 50'000'000;

// Two cameras side by side. The second one is turned about the horizontal axis by as much as the images scroll in
// `frames` frames.
camera::Rig rig_turned_by(int frames) {
  std::vector<camera::RigCamera> cameras;
  for (int c = 0; c < 2; ++c) {
    const camera::Camera camera{"cam" + std::to_string(c),
                                camera::Pinhole({kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight}),
                                kWidth,
                                kHeight,
                                0,
                                ""};
    const Eigen::Vector3d turn(c * frames * kScroll / kFocal, 0, 0);
    cameras.push_back({camera, geometry::SE3(geometry::so3_exp(turn), Eigen::Vector3d(0.1 * c, 0, 0))});
  }
  return camera::Rig(std::move(cameras));
}

// What a rig sees that turns steadily about the horizontal axis, far from everything. From frame `late_from` on, the
// second camera has the image of the next frame.
std::vector<image::ImageBundle> steady_turn(int frames, int late_from) {
  Random random(3);
  image::Image blocks(kWidth / kBlock, (kHeight + (frames + 1) * kScroll) / kBlock + 1);
  for (int y = 0; y < blocks.height(); ++y) {
    for (int x = 0; x < blocks.width(); ++x) blocks.row(y)[x] = static_cast<std::uint8_t>(random.below(256));
  }
  std::vector<image::ImageBundle> out(static_cast<std::size_t>(frames));
  for (int k = 0; k < frames; ++k) {
    image::ImageBundle& frame = out[static_cast<std::size_t>(k)];
    frame.time_ns = k * kInterval;
    for (int c = 0; c < 2; ++c) {
      image::Image image(kWidth, kHeight);
      const int top = (k + (c == 1 && k >= late_from ? 1 : 0)) * kScroll;
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) image.row(y)[x] = blocks.row((top + y) / kBlock)[x / kBlock];
      }
      frame.images.push_back(
          {.state = image::ImageState::kPresent, .time_ns = frame.time_ns, .image = std::move(image)});
    }
  }
  return out;
}

constexpr int kFrames = 12, kNever = kFrames;
const std::vector<image::Image> kNoMasks(2);

TEST(LateCamera, IsFoundWithTheGivenAndTheEstimatedCalibration) {
  const camera::Rig right = rig_turned_by(0);
  const auto found = find_late_camera(right, right, steady_turn(kFrames, 0), kNoMasks);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->early);
  EXPECT_FALSE(find_late_camera(right, right, steady_turn(kFrames, kNever), kNoMasks));
}

// While the rig turns steadily, images of a camera whose given rotation is wrong seem to be one frame late.
TEST(LateCamera, IsNoneIfTheEstimatedCalibrationExplainsTheImages) {
  const std::vector<image::ImageBundle> frames = steady_turn(kFrames, kNever);
  const camera::Rig right = rig_turned_by(0);
  for (const int turned : {-1, 1}) {
    const camera::Rig wrong = rig_turned_by(turned);
    EXPECT_TRUE(find_late_camera(wrong, wrong, frames, kNoMasks));
    EXPECT_FALSE(find_late_camera(wrong, right, frames, kNoMasks));
  }
}

}  // namespace
}  // namespace bslam::calibration
