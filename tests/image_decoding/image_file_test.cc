#include "image_decoding/image_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/random.h"
#include "support/data_on_disk.h"

namespace bslam::image_decoding {
namespace {

std::string encoded(const cv::Mat& original, const std::string& extension, const std::vector<int>& parameters = {}) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, original, bytes, parameters);
  return std::string(bytes.begin(), bytes.end());
}

// A smooth image with noise, so that an encoder uses every kind of filter.
cv::Mat picture_of(int width, int height, int type = CV_8UC1) {
  Random random(9);
  cv::Mat original(height, width, type);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width * original.channels(); ++x) {
      const double value = 0.5 + 0.3 * std::sin(0.05 * x) * std::cos(0.08 * y) + 0.05 * random.uniform();
      if (original.depth() == CV_16U) original.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(65535 * value);
      if (original.depth() == CV_8U) original.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(255 * value);
    }
  }
  return original;
}

bool equal(const image::Image& ours, const cv::Mat& theirs) {
  if (ours.width() != theirs.cols || ours.height() != theirs.rows) return false;
  for (int y = 0; y < theirs.rows; ++y) {
    if (!std::equal(ours.row(y), ours.row(y) + ours.width(), theirs.ptr<std::uint8_t>(y))) return false;
  }
  return true;
}

TEST(ImageFile, DecodesGreyPngExactly) {
  for (const auto& [width, height] : {std::pair(1, 1), {3, 5}, {640, 480}, {751, 33}}) {
    const cv::Mat original = picture_of(width, height);
    for (const int strategy :
         {cv::IMWRITE_PNG_STRATEGY_DEFAULT, cv::IMWRITE_PNG_STRATEGY_FILTERED, cv::IMWRITE_PNG_STRATEGY_RLE}) {
      for (const int level : {1, 9}) {
        const auto image = decode_grey(
            encoded(original, ".png", {cv::IMWRITE_PNG_STRATEGY, strategy, cv::IMWRITE_PNG_COMPRESSION, level}));
        ASSERT_TRUE(image);
        EXPECT_TRUE(equal(*image, original)) << width << "x" << height;
      }
    }
  }
}

TEST(ImageFile, KeepsTheUpperEightOfSixteenBits) {
  const cv::Mat original = picture_of(40, 30, CV_16UC1);
  const auto image = decode_grey(encoded(original, ".png"));
  ASSERT_TRUE(image);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_EQ(image->row(y)[x], original.at<std::uint16_t>(y, x) >> 8);
  }
}

TEST(ImageFile, ConvertsColoursToGrey) {
  const cv::Mat original(20, 30, CV_8UC3, cv::Scalar(200, 100, 50));  // blue, green, red
  const auto image = decode_grey(encoded(original, ".png"));
  ASSERT_TRUE(image);
  EXPECT_NEAR(image->row(3)[4], 0.114 * 200 + 0.587 * 100 + 0.299 * 50, 1.01);
}

TEST(ImageFile, DecodesJpeg) {
  const cv::Mat original = picture_of(64, 48);
  const std::string bytes = encoded(original, ".jpg", {cv::IMWRITE_JPEG_QUALITY, 100});
  const auto image = decode_grey(bytes);
  ASSERT_TRUE(image);
  EXPECT_TRUE(equal(*image, cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), cv::IMREAD_GRAYSCALE)));
  EXPECT_TRUE(decode_grey(bytes + std::string(100, '\0')));  // as some recorders pad
}

TEST(ImageFile, RejectsEveryTruncation) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string bytes = encoded(picture_of(64, 48), extension);
    for (std::size_t size = 0; size < bytes.size(); size += size < 100 ? 1 : 37) {
      EXPECT_FALSE(decode_grey(std::string_view(bytes).substr(0, size))) << extension << " " << size;
    }
    EXPECT_FALSE(decode_grey(std::string_view(bytes).substr(0, bytes.size() - 1)));
  }
}

TEST(ImageFile, RejectsOtherData) {
  EXPECT_FALSE(decode_grey(""));
  EXPECT_FALSE(decode_grey("not an image"));
  EXPECT_FALSE(decode_grey(std::string(5000, 'x')));
}

// Damage anywhere in a PNG is detected by the checksums or does not change the image; the decoder never crashes or
// reads beyond the data.
TEST(ImageFile, HandlesDamagedBytes) {
  const cv::Mat original = picture_of(48, 36);
  const std::string bytes = encoded(original, ".png");
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 1 + i % 4; ++k)
      damaged[random.below(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<char>(1 + random.below(255));
    if (damaged == bytes) continue;
    const auto image = decode_grey(damaged);
    EXPECT_TRUE(!image || equal(*image, original));
  }
}

TEST(ImageFile, ReadsFiles) {
  const support::TemporaryFolder folder;
  support::write_image(folder.path() / "a.png", 20, 10);
  EXPECT_EQ(read_image(folder.path() / "a.png").value().width(), 20);
  EXPECT_FALSE(read_image(folder.path() / "b.png"));
  EXPECT_FALSE(read_image(folder.path()));
}

TEST(ImageFile, ReadsMasksOfTheCamerasSize) {
  const support::TemporaryFolder folder;
  support::write_image(folder.path() / "mask.png", 20, 10);
  camera::Camera camera{"c", camera::Pinhole({10, 10, 10, 5}), 20, 10, 0, ""};
  EXPECT_TRUE(read_mask(camera).value().empty());
  camera.mask_file = (folder.path() / "mask.png").string();
  EXPECT_EQ(read_mask(camera).value().height(), 10);
  camera.width = 30;
  EXPECT_EQ(read_mask(camera).error().found, "20x10 pixels");
  camera.mask_file = "none.png";
  EXPECT_FALSE(read_mask(camera));
  ASSERT_TRUE(cv::imwrite((folder.path() / "black.png").string(), cv::Mat::zeros(10, 30, CV_8U)));
  camera.mask_file = (folder.path() / "black.png").string();
  ASSERT_FALSE(read_mask(camera));
  EXPECT_EQ(read_mask(camera).error().found, "only zeros, which mask the whole image of c");
}

}  // namespace
}  // namespace bslam::image_decoding
