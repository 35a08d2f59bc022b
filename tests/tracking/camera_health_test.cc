#include "tracking/camera_health.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/random.h"

namespace bslam::tracking {
namespace {

constexpr int kWidth = 101, kHeight = 40;  // the width is not a multiple of 8, the word size of the hash

// Grey values within [low, high], different for every seed.
image::Image textured_image(std::uint64_t seed, int low, int high) {
  Random random(seed);
  image::Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.row(y)[x] =
          static_cast<std::uint8_t>(low + static_cast<int>(random.below(static_cast<std::uint32_t>(high - low + 1))));
    }
  }
  return image;
}

image::Image good(std::uint64_t seed) { return textured_image(seed, 20, 200); }

image::ImageBundle frame(std::vector<image::Image> images) {
  image::ImageBundle bundle;
  for (image::Image& i : images) {
    const auto state = i.empty() ? image::ImageState::kMissing : image::ImageState::kPresent;
    bundle.images.push_back({state, 0, std::move(i)});
  }
  return bundle;
}

ImageFaults examine(CameraMonitor& monitor, std::vector<image::Image> images) {
  ThreadPool pool(2);
  return monitor.examine(frame(std::move(images)), {}, pool);
}

using Outages = std::vector<CameraReason>;

Outages outages(CameraMonitor& monitor, std::vector<image::Image> images) {
  return examine(monitor, std::move(images)).outage;
}

TEST(CameraMonitor, AcceptsOrdinaryImages) {
  CameraMonitor monitor(2, {});
  for (std::uint64_t k = 0; k < 5; ++k) {
    EXPECT_EQ(outages(monitor, {good(2 * k), good(2 * k + 1)}), (Outages{CameraReason::kNone, CameraReason::kNone}));
  }
}

TEST(CameraMonitor, DistinguishesBlackOverExposedAndMissingImages) {
  CameraMonitor monitor(3, {});
  EXPECT_EQ(outages(monitor, {textured_image(1, 0, 12), textured_image(2, 251, 255), {}}),
            (Outages{CameraReason::kBlack, CameraReason::kOverExposed, CameraReason::kNoImages}));
}

// The white body of a robot covers most of the view. Without a mask the camera is over-exposed.
TEST(CameraMonitor, DoesNotLookAtMaskedPixels) {
  constexpr int kBody = kHeight * 3 / 4;
  const auto view = [](std::uint64_t seed) {
    image::Image out = good(seed);
    for (int y = 0; y < kBody; ++y) std::fill_n(out.row(y), kWidth, std::uint8_t{255});
    return out;
  };
  image::Image mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) std::fill_n(mask.row(y), kWidth, static_cast<std::uint8_t>(y < kBody ? 0 : 255));
  ThreadPool pool(1);
  const std::array<image::Image, 2> of_cameras = {mask, image::Image()};
  CameraMonitor monitor(2, {});
  image::ImageBundle bundle = frame({view(1), view(2)});
  const auto expected = Outages{CameraReason::kNone, CameraReason::kOverExposed};
  EXPECT_EQ(monitor.examine(bundle, of_cameras, pool).outage, expected);
  bundle.images[1].mask = mask;  // of this image alone
  CameraMonitor another(2, {});
  EXPECT_EQ(another.examine(bundle, of_cameras, pool).outage, (Outages{CameraReason::kNone, CameraReason::kNone}));
}

// A large white object covers the view of both cameras.
TEST(CameraMonitor, UsesWhatRemainsOfOverExposedImagesIfThereIsNothingBetter) {
  const auto covered = [](std::uint64_t seed) {
    image::Image image = textured_image(seed, 251, 255);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < 30; ++x) image.row(y)[x] = good(seed + 100).row(y)[x];
    }
    return image;
  };
  CameraMonitor monitor(2, {});
  EXPECT_EQ(outages(monitor, {covered(1), covered(2)}), (Outages{CameraReason::kNone, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {covered(3), good(4)}), (Outages{CameraReason::kOverExposed, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {textured_image(5, 251, 255), textured_image(6, 251, 255)}),
            (Outages{CameraReason::kOverExposed, CameraReason::kOverExposed}));
}

TEST(CameraMonitor, ANightSceneWithLampsIsNotBlack) {
  image::Image night = textured_image(1, 0, 10);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 8; ++x) night.row(y)[x] = 180;
  }
  CameraMonitor monitor(1, {});
  EXPECT_EQ(outages(monitor, {night}), Outages{CameraReason::kNone});
}

TEST(CameraMonitor, DetectsAFrozenCameraButNotARigAtRest) {
  CameraMonitor monitor(2, {});
  outages(monitor, {good(1), good(2)});
  EXPECT_EQ(outages(monitor, {good(1), good(2)}), (Outages{CameraReason::kNone, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {good(3), good(2)}), (Outages{CameraReason::kNone, CameraReason::kFrozen}));
}

TEST(CameraMonitor, NoticesThatAllImagesAreRepeated) {
  CameraMonitor monitor(3, {});
  EXPECT_FALSE(examine(monitor, {good(1), good(2), good(3)}).repeated);
  EXPECT_TRUE(examine(monitor, {good(1), good(2), good(3)}).repeated);
  EXPECT_TRUE(examine(monitor, {good(1), {}, good(3)}).repeated);
  EXPECT_FALSE(examine(monitor, {good(1), good(2), good(4)}).repeated);
  EXPECT_FALSE(examine(monitor, {{}, {}, {}}).repeated);
}

TEST(CameraMonitor, AFrozenCameraStaysFrozenIfTheOthersMissAFrame) {
  CameraMonitor monitor(2, {});
  outages(monitor, {good(1), good(2)});
  EXPECT_EQ(outages(monitor, {good(3), good(2)}), (Outages{CameraReason::kNone, CameraReason::kFrozen}));
  for (int k = 0; k < 4; ++k)
    EXPECT_EQ(outages(monitor, {{}, good(2)}), (Outages{CameraReason::kNoImages, CameraReason::kFrozen}));
  EXPECT_EQ(outages(monitor, {good(4), good(2)}), (Outages{CameraReason::kNone, CameraReason::kFrozen}));
}

// As of a driver that repeats the images of a slow camera.
TEST(CameraMonitor, ACameraThatRepeatsItsImagesIsUsedWithItsNewOnes) {
  for (const int times : {2, 5}) {
    CameraMonitor monitor(2, {});
    outages(monitor, {good(1), good(1000)});
    for (int k = 1; k < 30; ++k) {
      const auto image = static_cast<std::uint64_t>(k / times);
      const Outages found = outages(monitor, {good(2 + static_cast<std::uint64_t>(k)), good(1000 + image)});
      EXPECT_EQ(found[1], k % times == 0 ? CameraReason::kNone : CameraReason::kFrozen) << k;
    }
  }
}

// After a longer failure, one good image may be an accident.
TEST(CameraMonitor, ACameraThatWasFrozenForLongIsReadmittedAfterSeveralImages) {
  CameraMonitor monitor(2, {.readmit_after = 3});
  for (std::uint64_t k = 0; k < 7; ++k) outages(monitor, {good(k), good(1000)});
  for (std::uint64_t k = 7; k < 9; ++k)
    EXPECT_EQ(outages(monitor, {good(k), good(1000 + k)})[1], CameraReason::kFrozen) << k;
  EXPECT_EQ(outages(monitor, {good(9), good(1009)})[1], CameraReason::kNone);
}

TEST(CameraMonitor, AnImageWithOneChangedPixelIsNotRepeated) {
  CameraMonitor monitor(2, {});
  image::Image almost = good(2);
  outages(monitor, {good(1), good(2)});
  EXPECT_TRUE(examine(monitor, {good(1), good(2)}).repeated);
  almost.row(kHeight - 1)[kWidth - 1] ^= 1;
  const ImageFaults faults = examine(monitor, {good(1), almost});
  EXPECT_FALSE(faults.repeated);
  EXPECT_EQ(faults.outage[1], CameraReason::kNone);
}

// The picture of a stalled encoder, with noise.
TEST(CameraMonitor, ACameraThatShowsAStillPictureIsFrozen) {
  CameraMonitor monitor(2, {});
  outages(monitor, {good(1), good(1001)});
  outages(monitor, {good(2), good(1002)});
  for (std::uint64_t k = 3; k < 8; ++k) {
    image::Image almost = good(1002);
    almost.row(static_cast<int>(k))[k] ^= 1;
    EXPECT_EQ(outages(monitor, {good(k), almost}), (Outages{CameraReason::kNone, CameraReason::kFrozen})) << k;
  }
}

TEST(CameraMonitor, ReadmitsAfterConsecutiveGoodImages) {
  CameraMonitor monitor(2, {.readmit_after = 3});
  outages(monitor, {textured_image(1, 0, 5), good(11)});
  EXPECT_EQ(outages(monitor, {good(1), good(12)}), (Outages{CameraReason::kBlack, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {good(2), good(13)}), (Outages{CameraReason::kBlack, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {textured_image(2, 0, 5), good(14)}),
            (Outages{CameraReason::kBlack, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {good(3), good(15)}), (Outages{CameraReason::kBlack, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {good(4), good(16)}), (Outages{CameraReason::kBlack, CameraReason::kNone}));
  EXPECT_EQ(outages(monitor, {good(5), good(17)}), (Outages{CameraReason::kNone, CameraReason::kNone}));
}

TEST(CameraMonitor, ReadmitsImmediatelyIfNoOtherCameraIsLeft) {
  CameraMonitor monitor(3, {.readmit_after = 3});
  const Outages dark(3, CameraReason::kBlack);
  EXPECT_EQ(outages(monitor, {textured_image(1, 0, 5), textured_image(2, 0, 5), textured_image(3, 0, 5)}), dark);
  EXPECT_EQ(outages(monitor, {textured_image(4, 0, 5), good(1), {}}),
            (Outages{CameraReason::kBlack, CameraReason::kNone, CameraReason::kNoImages}));
  EXPECT_EQ(outages(monitor, {good(2), good(3), good(4)}),
            (Outages{CameraReason::kBlack, CameraReason::kNone, CameraReason::kBlack}));
}

TEST(CameraMonitor, ACameraIsUsedWithItsFirstImageAfterMissingOnes) {
  CameraMonitor monitor(2, {});
  outages(monitor, {good(1), good(2)});
  EXPECT_EQ(outages(monitor, {good(3), {}}), (Outages{CameraReason::kNone, CameraReason::kNoImages}));
  EXPECT_EQ(outages(monitor, {good(4), good(5)}), (Outages{CameraReason::kNone, CameraReason::kNone}));
}

// Tiles of 40 pixels whose edges are blurred with standard deviations of `across` pixels along rows and `along` pixels
// along columns.
image::Image tiles(double across, double along, int contrast = 60) {
  const auto edge = [](int at, double sigma) {
    const int in_tile = at % 40;
    return std::erf((in_tile - 19.5) / (std::sqrt(2.0) * sigma)) * ((at / 40) % 2 == 0 ? 1 : -1);
  };
  image::Image image(320, 240);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      image.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(128 + contrast * (0.5 * edge(x, across) + 0.5 * edge(y, along))));
    }
  }
  return image;
}

using Flags = std::vector<std::uint8_t>;

TEST(CameraMonitor, DistinguishesBlurredImagesFromSharpAndMotionBlurredOnes) {
  CameraMonitor monitor(3, {});
  EXPECT_EQ(examine(monitor, {tiles(0.6, 0.6), tiles(4, 4), tiles(6, 0.6)}).blurred, (Flags{0, 1, 0}));
}

// Sharp edges of the robot itself do not tell whether the camera is in focus.
TEST(CameraMonitor, DoesNotLookForEdgesInMaskedPixels) {
  image::Image image = tiles(4, 4);
  const image::Image sharp = tiles(0.6, 0.6);
  image::Image mask(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    const bool body = y < image.height() / 2;
    std::fill_n(mask.row(y), image.width(), static_cast<std::uint8_t>(body ? 0 : 255));
    if (body) std::copy_n(sharp.row(y), image.width(), image.row(y));
  }
  ThreadPool pool(1);
  CameraMonitor monitor(1, {});
  EXPECT_EQ(monitor.examine(frame({image}), {}, pool).blurred, Flags{0});
  CameraMonitor masked(1, {});
  EXPECT_EQ(masked.examine(frame({image}), std::span(&mask, 1), pool).blurred, Flags{1});
}

TEST(CameraMonitor, DetectsNoBlurInImagesWithoutEdges) {
  CameraMonitor monitor(2, {});
  EXPECT_EQ(examine(monitor, {tiles(4, 4, 15), {}}).blurred, (Flags{0, 0}));
}

TEST(CameraMonitor, AMissingImageDoesNotMakeACameraSharp) {
  CameraMonitor monitor(1, {});
  EXPECT_EQ(examine(monitor, {tiles(4, 4)}).blurred, Flags{1});
  EXPECT_EQ(examine(monitor, {{}}).blurred, Flags{1});
}

TEST(CameraMonitor, ACameraIsBlurredUntilSeveralImagesAreSharp) {
  CameraMonitor monitor(1, {});
  EXPECT_EQ(examine(monitor, {tiles(4, 4)}).blurred, Flags{1});
  EXPECT_EQ(examine(monitor, {tiles(0.6, 0.6)}).blurred, Flags{1});
  EXPECT_EQ(examine(monitor, {tiles(4, 4, 15)}).blurred, Flags{1});  // too few edges
  EXPECT_EQ(examine(monitor, {tiles(0.6, 0.6)}).blurred, Flags{1});
  EXPECT_EQ(examine(monitor, {tiles(0.6, 0.6)}).blurred, Flags{0});
}

}  // namespace
}  // namespace bslam::tracking
