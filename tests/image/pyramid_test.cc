#include "image/pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace bslam::image {
namespace {

template <class Grey>
Image make_image(int width, int height, const Grey& grey) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<std::uint8_t>(std::lround(grey(x, y)));
  }
  return image;
}

TEST(Pyramid, HasExactRatios) {
  const Image base(753, 481);
  Pyramid pyramid;
  build_pyramid(base.view(), 8, 1.2, pyramid);
  ASSERT_EQ(pyramid.size(), 8u);
  for (std::size_t l = 0; l < pyramid.size(); ++l) {
    EXPECT_EQ(pyramid.scale_x[l], 753.0 / pyramid.levels[l].width());
    EXPECT_EQ(pyramid.scale_y[l], 481.0 / pyramid.levels[l].height());
    EXPECT_NEAR(pyramid.scale_x[l], std::pow(1.2, l), 0.01 * std::pow(1.2, l));
    EXPECT_NEAR(pyramid.from_base_x(l, pyramid.to_base_x(l, 17.25)), 17.25, 1e-12);
  }
}

TEST(Pyramid, OfAnotherSizeInTheSameMemoryEqualsANewOne) {
  Pyramid reused;
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(320, 480), std::pair(700, 90)}) {
    const Image base = make_image(width, height, [](int x, int y) { return (x * x + 3 * x * y + 5 * y) % 256; });
    Pyramid fresh;
    build_pyramid(base.view(), 8, 1.2, reused);
    build_pyramid(base.view(), 8, 1.2, fresh);
    ASSERT_EQ(reused.size(), fresh.size());
    for (std::size_t l = 0; l < fresh.size(); ++l) {
      ASSERT_EQ(reused.levels[l].width(), fresh.levels[l].width());
      for (int y = 0; y < fresh.levels[l].height(); ++y) {
        const auto *row = reused.levels[l].row(y), *expected = fresh.levels[l].row(y);
        EXPECT_TRUE(std::equal(row, row + fresh.levels[l].width(), expected)) << width << " " << l << " " << y;
      }
    }
  }
}

TEST(Pyramid, CopiesTheBaseImageUnchanged) {
  const Image base = make_image(101, 67, [](int x, int y) { return (x * 7 + y * 13) % 256; });
  const ImageView part{base.row(3) + 5, 80, 50, 101};  // a strided view
  Pyramid pyramid;
  build_pyramid(part, 1, 1.2, pyramid);
  ASSERT_EQ(pyramid.size(), 1u);
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 80; ++x) ASSERT_EQ(pyramid.levels[0].view().at(x, y), base.view().at(x + 5, y + 3));
  }
}

// A linear ramp is the same ramp in level-0 coordinates on every level, which tests the positions of the pixel centres:
// an error of half a pixel on level 1 would be 0.2 grey levels or more.
TEST(Pyramid, LevelsAreAlignedToTheirCoordinates) {
  for (const double factor : {1.2, 1.5, 2.0}) {
    const Image base = make_image(740, 430, [](int x, int y) { return 10 + 0.2137 * x + 0.1519 * y; });
    Pyramid pyramid;
    build_pyramid(base.view(), 5, factor, pyramid);
    for (std::size_t l = 0; l < pyramid.size(); ++l) {
      double sum = 0;
      int count = 0;
      const Image& level = pyramid.levels[l];
      for (int y = 4; y < level.height() - 4; ++y) {
        for (int x = 4; x < level.width() - 4; ++x, ++count) {
          const double truth = 10 + 0.2137 * pyramid.to_base_x(l, x) + 0.1519 * pyramid.to_base_y(l, y);
          ASSERT_NEAR(level.view().at(x, y), truth, 1.6) << "factor " << factor << ", level " << l;
          sum += level.view().at(x, y) - truth;
        }
      }
      EXPECT_NEAR(sum / count, 0.0, 0.05) << "factor " << factor << ", level " << l;
    }
  }
}

TEST(Pyramid, KeepsConstantImages) {
  for (const int grey : {0, 1, 128, 254, 255}) {
    const Image base = make_image(333, 257, [&](int, int) { return grey; });
    Pyramid pyramid;
    build_pyramid(base.view(), 8, 1.2, pyramid);
    for (const Image& level : pyramid.levels) {
      for (int y = 0; y < level.height(); ++y) {
        for (int x = 0; x < level.width(); ++x) ASSERT_EQ(level.view().at(x, y), grey);
      }
    }
  }
}

// Stripes finer than the resolution of a level must fade instead of aliasing to wider ones.
TEST(Pyramid, DoesNotAlias) {
  const Image base =
      make_image(600, 400, [](int x, int) { return 128 + 100 * std::cos(2 * std::numbers::pi * x / 2.2); });
  Pyramid pyramid;
  build_pyramid(base.view(), 4, 1.2, pyramid);
  const Image& level = pyramid.levels[3];
  double square = 0;
  int count = 0;
  for (int x = 5; x < level.width() - 5; ++x, ++count) square += std::pow(level.view().at(x, 100) - 128.0, 2);
  EXPECT_LT(std::sqrt(square / count), 10.0);  // 71 at level 0
}

TEST(Pyramid, OmitsLevelsThatAreTooSmall) {
  Pyramid pyramid;
  build_pyramid(Image(60, 40).view(), 8, 1.2, pyramid);
  EXPECT_EQ(pyramid.size(), 2u);  // 40, 33, 28
  build_pyramid(Image(1, 1).view(), 8, 1.2, pyramid);
  EXPECT_EQ(pyramid.size(), 1u);
  build_pyramid(ImageView{}, 8, 1.2, pyramid);
  EXPECT_EQ(pyramid.size(), 0u);
}

TEST(Pyramid, ReusesItsMemory) {
  const Image base(752, 480);
  Pyramid pyramid;
  build_pyramid(base.view(), 8, 1.2, pyramid);
  std::vector<const std::uint8_t*> before;
  for (const Image& level : pyramid.levels) before.push_back(level.row(0));
  build_pyramid(base.view(), 8, 1.2, pyramid);
  for (std::size_t l = 0; l < pyramid.size(); ++l) EXPECT_EQ(pyramid.levels[l].row(0), before[l]);
}

TEST(Pyramid, AcceptsAnySize) {
  Pyramid pyramid;
  for (int width = 33; width < 120; width += 7) {
    for (const double factor : {1.05, 1.2, 2.0})
      build_pyramid(Image(width, 40 + width % 11).view(), 16, factor, pyramid);
  }
  build_pyramid(Image(4000, 37).view(), 3, 1.05, pyramid);
  EXPECT_EQ(pyramid.levels[1].width(), 3810);
}

}  // namespace
}  // namespace bslam::image
