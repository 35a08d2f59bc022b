#include "tracking/still_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

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

// Standard normal noise, which is made once, from another place for each image.
float noise_at(std::uint64_t image, std::size_t pixel) {
  constexpr std::size_t kSize = 99'991;  // a prime, so that images do not repeat each other
  static const std::vector<float> noise = [] {
    Random random(1, "noise");
    std::vector<float> out(kSize);
    for (float& n : out) n = static_cast<float>(random.normal());
    return out;
  }();
  return noise[(pixel + 7919 * image) % kSize];
}

// A view of a textured wall.
image::Image view(std::uint64_t scene, const View& v, std::uint64_t noise_seed) {
  image::Image out(kWidth, kHeight);
  const double phase = static_cast<double>(scene), of_person = 2.4 * static_cast<double>(v.person);
  std::array<double, kWidth> fine, sine, cosine, person;
  for (int x = 0; x < kWidth; ++x) {
    const auto i = static_cast<std::size_t>(x);
    const double at = x + v.shift_px;
    fine[i] = 50 * std::sin(at / 9 + phase);
    sine[i] = 25 * std::sin(at / 31);
    cosine[i] = 25 * std::cos(at / 31);
    person[i] = 100 + 60 * std::sin(x / 13.0 + of_person);
  }
  for (int y = 0; y < kHeight; ++y) {
    const double row = std::cos(y / 11.0 + phase), row_cosine = std::cos(y / 17.0), row_sine = std::sin(y / 17.0);
    for (int x = 0; x < kWidth; ++x) {
      const auto i = static_cast<std::size_t>(x);
      double grey = 110 + fine[i] * row + sine[i] * row_cosine - cosine[i] * row_sine;
      if (x < v.person_until * kWidth) grey = person[i];
      const double noise =
          v.noise * static_cast<double>(noise_at(noise_seed, static_cast<std::size_t>(y * kWidth + x)));
      out.row(y)[x] = static_cast<std::uint8_t>(std::clamp(grey + v.brighter + noise, 0.0, 255.0));
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
    for (int k = 0; k < 12; ++k)
      found = views.frame({{2.0 * k, noise}, {2.0 * std::min(k, 5), noise}, {-3.0 * k, noise}});
    EXPECT_EQ(found, (Still{0, 1, 0})) << noise;
    // The rig stops: nothing tells that the picture is another one now.
    for (int k = 0; k < 40; ++k) found = views.frame({{22, noise}, {10, noise}, {-33, noise}});
    EXPECT_EQ(found, (Still{0, 1, 0})) << noise;
    EXPECT_EQ(views.frame({{24, noise}, {19, noise}, {-36, noise}}), (Still{0, 0, 0})) << noise;
  }
}

TEST(StillViews, SeveralAreFoundAmongMore) {
  StillViewsOf views(4);
  Still found;
  for (int k = 0; k < 12; ++k) {
    const double until = std::min(k, 5);
    found = views.frame({{2.0 * k}, {2.0 * until}, {-2.0 * until}, {2.0 * k}});
  }
  EXPECT_EQ(found, (Still{0, 1, 1, 0}));
}

TEST(StillViews, SingleImagesMayRepeatTheOneBefore) {
  StillViewsOf views(2);
  for (int k = 0; k < 60; ++k) {
    const bool repeats = k > 6 && k % 6 == 0;
    EXPECT_EQ(views.frame({{1.5 * k}, {1.5 * (repeats ? k - 1 : k)}}), (Still{0, repeats})) << k;
  }
}

TEST(StillViews, APictureMayBeStillFromTheBeginning) {
  StillViewsOf views(2);
  Still found;
  for (int k = 0; k < 8; ++k) found = views.frame({{2.0 * k}, {0}});
  EXPECT_EQ(found, (Still{0, 1}));
}

// A picture that became still while the rig was at rest may be that of a rig which is at rest still.
TEST(StillViews, AtRestThreeOtherCamerasTellThatItIsStill) {
  for (const std::size_t others : {2u, 3u}) {
    StillViewsOf views(others + 1);
    Still found;
    for (int k = 0; k < 68; ++k) {
      std::vector<View> cameras(others + 1, View{.shift_px = 2.0 * std::max(0, k - 60)});
      cameras[1].shift_px = 0;
      found = views.frame(cameras);
    }
    EXPECT_EQ(found[1], others >= 3) << others;
  }
}

// A vehicle at rest before a crossing: the traffic covers the views of the cameras in front.
TEST(StillViews, TrafficAroundARigAtRestDoesNotCount) {
  for (const std::size_t in_front : {1u, 2u}) {
    StillViewsOf views(in_front + 1);
    for (int k = 0; k < 100; ++k) {
      const double speed_until = std::min(k, 10);  // the vehicle stops
      std::vector<View> cameras(in_front + 1, View{.shift_px = 4.0 * speed_until});
      const auto bus = static_cast<std::uint64_t>(k);
      for (std::size_t c = 0; c < in_front && k >= 65 && k < 90; ++c) cameras[c] = {.person_until = 1, .person = bus};
      EXPECT_EQ(views.frame(cameras), Still(in_front + 1, 0)) << in_front << " " << k;
    }
  }
}

// Something that covers the larger part of a view is not the motion of the camera.
TEST(StillViews, WhatCoversAPartOfTheViewIsNoMotionOfTheCamera) {
  StillViewsOf views(2);
  for (int k = 0; k < 60; ++k) {
    const auto bus = static_cast<std::uint64_t>(k);
    const double shift_px = k <= 10 ? 4.0 * k : 46 - 6 * std::pow(0.6, k - 10);  // the vehicle stops
    EXPECT_EQ(views.frame({{.shift_px = shift_px, .person_until = k > 10 ? 0.6 : 0.0, .person = bus}, {shift_px}}),
              (Still{0, 0}))
        << k;
  }
}

TEST(StillViews, CamerasMayHaveOtherRatesOrAlternate) {
  struct Rates {
    int step, offset;  // of the camera that stops: it has an image in the frames offset, offset + step, ...
    int other_step, other_offset;
  };
  for (const Rates r : {Rates{2, 0, 1, 0}, Rates{3, 1, 1, 0}, Rates{2, 1, 2, 0}, Rates{1, 0, 4, 0}}) {
    StillViews views(2);
    int found = 0;
    for (int k = 0; k < 100; ++k) {
      std::vector<std::optional<BlockMeans>> images(2);
      const auto seed = static_cast<std::uint64_t>(k);
      if (k % r.step == r.offset)
        images[0] = block_means(view(0, {.shift_px = 2.0 * std::min(k, 40)}, 2 * seed + 1).view());
      if (k % r.other_step == r.other_offset)
        images[1] = block_means(view(1, {.shift_px = 2.0 * k}, 2 * seed + 2).view());
      const Still still = views.update(images, kInterval * k);
      EXPECT_FALSE(still[1]) << r.step << " " << k;
      EXPECT_FALSE(still[0] && k <= 40) << r.step << " " << k;
      found += still[0];
    }
    EXPECT_GE(found, 10 / r.step) << r.step << " " << r.other_step;
  }
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
