#include "image_decoding/vignette.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "support/data_on_disk.h"

namespace bslam::image_decoding {
namespace {

const camera::Camera kCamera{"front", camera::Pinhole({10, 10, 2, 1}), 4, 2, 0, ""};

class VignetteFile : public testing::Test {
 protected:
  std::filesystem::path write(const cv::Mat& image) const {
    cv::imwrite(file().string(), image);
    return file();
  }
  std::filesystem::path file() const { return folder_.path() / "cam0.png"; }
  support::TemporaryFolder folder_;
};

TEST_F(VignetteFile, MakesAllPixelsAsBrightAsTheBrightestPlace) {
  // The largest value stands for no loss, whatever it is; factors end at 8.
  const cv::Mat brightness = (cv::Mat_<std::uint16_t>(2, 4) << 20000, 40000, 10000, 5000, 4000, 0, 30000, 40000);
  const auto vignette = Vignette::read(write(brightness), kCamera);
  ASSERT_TRUE(vignette) << vignette.error().message();
  image::Image image(4, 2);
  for (int y = 0; y < 2; ++y) std::fill_n(image.row(y), 4, std::uint8_t{30});
  image.row(1)[3] = 255;
  vignette->correct(image);
  const std::uint8_t expected[2][4] = {{60, 30, 120, 240}, {240, 240, 40, 255}};
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 4; ++x) EXPECT_EQ(image.row(y)[x], expected[y][x]) << x << " " << y;
  }
}

TEST_F(VignetteFile, EightBitsAreEnough) {
  const cv::Mat brightness = (cv::Mat_<std::uint8_t>(2, 4) << 50, 100, 100, 100, 100, 100, 100, 100);
  const auto vignette = Vignette::read(write(brightness), kCamera);
  ASSERT_TRUE(vignette) << vignette.error().message();
  image::Image image(4, 2);
  for (int y = 0; y < 2; ++y) std::fill_n(image.row(y), 4, std::uint8_t{100});
  vignette->correct(image);
  EXPECT_EQ(image.row(0)[0], 200);
  EXPECT_EQ(image.row(1)[0], 100);
}

TEST_F(VignetteFile, WithoutOneImagesRemainAsTheyAre) {
  image::Image image(4, 2);
  for (int y = 0; y < 2; ++y) std::fill_n(image.row(y), 4, std::uint8_t{100});
  Vignette().correct(image);
  EXPECT_EQ(image.row(1)[3], 100);
}

TEST_F(VignetteFile, ErrorsNameTheFile) {
  EXPECT_EQ(Vignette::read(file(), kCamera).error().file, file().string());
  support::write_text(file(), "not an image");
  EXPECT_EQ(Vignette::read(file(), kCamera).error().found, "no readable image");
  EXPECT_EQ(Vignette::read(write(cv::Mat::zeros(2, 4, CV_8U)), kCamera).error().found, "0 everywhere");
  const auto vignette = Vignette::read(write(cv::Mat::ones(3, 4, CV_8U)), kCamera);
  EXPECT_EQ(vignette.error().found, "4x3 pixels");
  EXPECT_EQ(vignette.error().file, file().string());
}

}  // namespace
}  // namespace bslam::image_decoding
