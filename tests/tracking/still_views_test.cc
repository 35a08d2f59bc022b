#include "tracking/still_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace bslam::tracking {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr TimeNs kInterval = 50'000'000;

struct View {
  double shift_px = 0;      // of the scene
  double noise = 2;         // standard deviation, grey values
  double brighter = 0;      // grey values
  double person_until = 0;  // part of the width that something else covers, which moves by itself
  std::uint64_t person = 0;
};

// A view of a textured wall.
image::Image view(std::uint64_t scene, const View& v, std::uint64_t noise_seed) {
  Random noise(noise_seed, "noise");
  image::Image out(kWidth, kHeight);
  const double phase = static_cast<double>(scene);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double at = x + v.shift_px;
      double grey =
          110 + 50 * std::sin(at / 9 + phase) * std::cos(y / 11.0 + phase) + 25 * std::sin(at / 31 - y / 17.0);
      if (x < v.person_until * kWidth) grey = 100 + 60 * std::sin(x / 13.0 + 2.4 * static_cast<double>(v.person));
      out.row(y)[x] = static_cast<std::uint8_t>(std::clamp(grey + v.brighter + v.noise * noise.normal(), 0.0, 255.0));
    }
  }
  return out;
}

class StillViewsOf {
 public:
  explicit StillViewsOf(std::size_t cameras) : views_(cameras) {}

  std::vector<std::uint8_t> frame(const std::vector<View>& cameras) {
    std::vector<std::optional<BlockMeans>> images;
    for (std::size_t c = 0; c < cameras.size(); ++c) images.push_back(block_means(view(c, cameras[c], seed_++).view()));
    return views_.update(images, kInterval * frame_++);
  }

 private:
  StillViews views_;
  std::uint64_t seed_ = 1;
  std::int64_t frame_ = 0;
};

using Still = std::vector<std::uint8_t>;

TEST(StillViews, AStillPictureIsFoundDespiteNoiseAndUntilItChanges) {
  for (const double noise : {0.0, 1.5, 3.0}) {
    StillViewsOf views(3);
    Still found;
    for (int k = 0; k < 6; ++k) found = views.frame({{2.0 * k, noise}, {0, noise}, {-3.0 * k, noise}});
    EXPECT_EQ(found, (Still{0, 1, 0})) << noise;
    // The rig stops: nothing tells that the picture is another one now.
    for (int k = 0; k < 40; ++k) found = views.frame({{10, noise}, {0, noise}, {-15, noise}});
    EXPECT_EQ(found, (Still{0, 1, 0})) << noise;
    EXPECT_EQ(views.frame({{12, noise}, {9, noise}, {-18, noise}}), (Still{0, 0, 0})) << noise;
  }
}

TEST(StillViews, SeveralAreFoundAmongMore) {
  StillViewsOf views(4);
  Still found;
  for (int k = 0; k < 6; ++k) found = views.frame({{2.0 * k}, {0}, {0}, {2.0 * k}});
  EXPECT_EQ(found, (Still{0, 1, 1, 0}));
}

TEST(StillViews, ARigAtRestOrInMotionHasNone) {
  for (const double speed : {0.0, 0.05, 0.5, 8.0}) {
    StillViewsOf views(2);
    for (int k = 0; k < 60; ++k)
      EXPECT_EQ(views.frame({{speed * k}, {0.5 * speed * k}}), (Still{0, 0})) << speed << " " << k;
  }
}

// What moves in front of a rig at rest does not make the other cameras still, nor does the exposure of one.
TEST(StillViews, PeopleAndExposureDoNotCount) {
  StillViewsOf views(3);
  for (int k = 0; k < 60; ++k) {
    const auto person = static_cast<std::uint64_t>(k);
    EXPECT_EQ(
        views.frame(
            {{.person_until = 0.45, .person = person}, {.brighter = 0.5 * k}, {.person_until = 0.3, .person = person}}),
        (Still{0, 0, 0}))
        << k;
  }
}

// A part of the view that never changes, such as the vehicle.
TEST(StillViews, APartOfTheViewMayBeStill) {
  StillViewsOf views(2);
  for (int k = 0; k < 30; ++k) {
    EXPECT_EQ(views.frame({{3.0 * k}, {.shift_px = 3.0 * k, .person_until = 0.8}}), (Still{0, 0})) << k;
  }
}

// Its first image is not compared with earlier ones of the others.
TEST(StillViews, ACameraMayBeginLater) {
  StillViews views(2);
  for (int k = 0; k < 40; ++k) {
    std::vector<std::optional<BlockMeans>> images = {block_means(view(0, {.shift_px = 0.5 * k}, 1).view()), {}};
    if (k % 7 > 3) images[1] = block_means(view(1, {.shift_px = 0.5 * k}, 2).view());
    EXPECT_EQ(views.update(images, kInterval * k), (Still{0, 0})) << k;
  }
}

// A blank wall, with the light of a lamp on it, looks the same from everywhere.
TEST(StillViews, ABlankWallIsNoStillPicture) {
  StillViews views(2);
  image::Image wall(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) wall.row(y)[x] = static_cast<std::uint8_t>(90 + x / 5);
  }
  for (int k = 0; k < 20; ++k) {
    const std::vector<std::optional<BlockMeans>> images = {block_means(view(0, {.shift_px = 3.0 * k}, 1).view()),
                                                           block_means(wall.view())};
    EXPECT_EQ(views.update(images, kInterval * k), (Still{0, 0})) << k;
  }
}

TEST(StillViews, ASingleCameraIsNeverStill) {
  StillViewsOf views(1);
  for (int k = 0; k < 30; ++k) EXPECT_EQ(views.frame({{k < 10 ? 3.0 * k : 30.0}}), Still{0});
}

TEST(BlockMeans, AreMeansOfParts) {
  image::Image image(48, 32);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) image.row(y)[x] = static_cast<std::uint8_t>(x / 2 + 8 * (y / 2));
  }
  const BlockMeans means = block_means(image.view());
  EXPECT_FLOAT_EQ(means.mean[0], 0);
  EXPECT_FLOAT_EQ(means.mean[5], 5);
  EXPECT_FLOAT_EQ(means.mean[2 * BlockMeans::kColumns + 3], 19);
}

}  // namespace
}  // namespace bslam::tracking
