#include "matching/frame_builder.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace bslam::matching {
namespace {

// Two cameras and images of squares with far more corners than the budget.
class FrameBuilderTest : public ::testing::Test {
 protected:
  FrameBuilderTest() : pool(2), builder(rig.size(), options(), {}) {
    Random random(1, "squares");
    for (int c = 0; c < 2; ++c) {
      image::Image image(320, 240);
      for (int y = 0; y < 240; ++y) std::fill_n(image.row(y), 320, std::uint8_t{128});
      for (int i = 0; i < 600; ++i) {
        const auto x = static_cast<int>(random.below(308)), y = static_cast<int>(random.below(228));
        const auto grey = static_cast<std::uint8_t>(random.below(256));
        for (int r = y; r < y + 12; ++r) std::fill_n(image.row(r) + x, 12, grey);
      }
      images.images.push_back({image::ImageState::kPresent, 0, std::move(image)});
    }
  }
  static feature::FeatureOptions options() {
    feature::FeatureOptions o;
    o.per_image = 400;
    return o;
  }
  static camera::Rig two_cameras() {
    const camera::Camera camera{"camera", camera::Pinhole({260, 260, 159.5, 119.5}), 320, 240, 0, ""};
    return camera::Rig({{camera, geometry::SE3()}, {camera, geometry::SE3()}});
  }
  std::size_t keypoints(const frame::BundledFrame& frame, std::size_t camera) const {
    return frame.cameras[camera].keypoints.size();
  }

  const camera::Rig rig = two_cameras();
  ThreadPool pool;
  FrameBuilder builder;
  image::ImageBundle images;
};

TEST_F(FrameBuilderTest, ExtractsTheConfiguredNumberOfKeypoints) {
  const frame::BundledFrame frame = builder.extract(rig, images, pool);
  EXPECT_EQ(keypoints(frame, 0), 400u);
  EXPECT_EQ(keypoints(frame, 1), 400u);
}

// Left half of the image masked by the camera, upper half by the image: keypoints remain in one quarter.
TEST_F(FrameBuilderTest, IgnoresPixelsThatEitherMaskIgnores) {
  const auto mask = [](int left, int top) {
    image::Image out(320, 240);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) out.row(y)[x] = x >= left && y >= top ? 255 : 0;
    }
    return out;
  };
  FrameBuilder masked(rig.size(), options(), {mask(160, 0), image::Image()});
  const image::Image borrowed = mask(0, 120);
  images.images[0].mask = mask(0, 120);
  images.images[1].borrowed_mask = borrowed.view();
  const frame::BundledFrame frame = masked.extract(rig, images, pool);
  ASSERT_GT(keypoints(frame, 0), 50u);
  ASSERT_GT(keypoints(frame, 1), 50u);
  for (const Eigen::Vector2f& pixel : frame.cameras[0].keypoints.pixel) {
    EXPECT_GT(pixel.x(), 158.f);
    EXPECT_GT(pixel.y(), 118.f);
  }
  bool left = false;
  for (const Eigen::Vector2f& pixel : frame.cameras[1].keypoints.pixel) {
    EXPECT_GT(pixel.y(), 118.f);
    left |= pixel.x() < 150;
  }
  EXPECT_TRUE(left);
  for (image::CameraImage& image : images.images) image.mask = image::Image(), image.borrowed_mask = {};
  EXPECT_EQ(keypoints(masked.extract(rig, images, pool), 1), 400u);
}

TEST_F(FrameBuilderTest, RespectsTheBudgetOfEachCamera) {
  const frame::BundledFrame frame = builder.extract(rig, images, pool, {}, std::vector<int>{100, 300});
  EXPECT_EQ(keypoints(frame, 0), 100u);
  EXPECT_EQ(keypoints(frame, 1), 300u);
  const frame::BundledFrame other = builder.extract(rig, images, pool, {}, std::vector<int>{350, 9000});
  EXPECT_EQ(keypoints(other, 0), 350u);
  EXPECT_EQ(keypoints(other, 1), 800u);  // maximum: twice per_image
  EXPECT_EQ(keypoints(builder.extract(rig, images, pool), 1), 400u);
}

TEST_F(FrameBuilderTest, SkipsCameras) {
  const frame::BundledFrame frame =
      builder.extract(rig, images, pool, std::vector<std::uint8_t>{1, 0}, std::vector<int>{0, 250});
  EXPECT_EQ(frame.cameras[0].state, image::ImageState::kMissing);
  EXPECT_EQ(keypoints(frame, 0), 0u);
  EXPECT_TRUE(builder.pyramids()[0].levels.empty());
  EXPECT_EQ(keypoints(frame, 1), 250u);
}

}  // namespace
}  // namespace bslam::matching
