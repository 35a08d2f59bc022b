// PNM, BMP and TIFF files, as OpenCV writes them and as other programs do.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "base/random.h"
#include "image_decoding/codecs.h"
#include "image_decoding/image_file.h"

namespace bslam::image_decoding {
namespace {

// Smooth with some noise, so that compressions find repetitions; large enough for tables of LZW to be full.
cv::Mat example(int type) {
  Random random(5);
  cv::Mat image(97, 203, type);
  const int channels = image.channels();
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols * channels; ++x) {
      const auto value = static_cast<unsigned>(x / channels + 2 * y) + static_cast<unsigned>(random.below(9));
      if (image.depth() == CV_8U) image.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(value % 256);
      if (image.depth() == CV_16U) image.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(100 * value % 65536);
    }
  }
  return image;
}

std::string written(const std::string& extension, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  std::vector<unsigned char> bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes, parameters));
  return {bytes.begin(), bytes.end()};
}

void expect_decoded(const std::string& bytes, const cv::Mat& expected, const std::string& what) {
  const cv::Mat decoded = decode_to_grey(bytes);
  ASSERT_EQ(decoded.size(), expected.size()) << what;
  ASSERT_EQ(decoded.type(), expected.type()) << what;
  EXPECT_EQ(cv::norm(decoded, expected, cv::NORM_INF), 0) << what;
}

TEST(PlainFiles, GreyImagesAreReadExactly) {
  const cv::Mat grey = example(CV_8UC1), deep = example(CV_16UC1);
  expect_decoded(written(".pgm", grey), grey, "pgm");
  expect_decoded(written(".pgm", grey, {cv::IMWRITE_PXM_BINARY, 0}), grey, "pgm as text");
  expect_decoded(written(".bmp", grey), grey, "bmp");
  expect_decoded(written(".pgm", deep), deep, "pgm of 16 bits");
  for (const int compression : {1, 5, 8, 32773, 32946}) {
    const std::vector<int> parameters = {cv::IMWRITE_TIFF_COMPRESSION, compression};
    expect_decoded(written(".tiff", grey, parameters), grey, "tiff " + std::to_string(compression));
    expect_decoded(written(".tiff", deep, parameters), deep, "tiff of 16 bits " + std::to_string(compression));
  }
}

TEST(PlainFiles, ColoursBecomeLuminance) {
  const cv::Mat colours = example(CV_8UC3);
  cv::Mat expected;
  cv::cvtColor(colours, expected, cv::COLOR_BGR2GRAY);
  for (const char* extension : {".ppm", ".bmp", ".tiff"})
    expect_decoded(written(extension, colours), expected, extension);
}

// Files that are cut off anywhere give no image, and never read outside of the file.
TEST(PlainFiles, IncompleteFilesAreNoImages) {
  const cv::Mat grey = example(CV_8UC1);
  for (const char* extension : {".pgm", ".bmp", ".tiff"}) {
    const std::string whole = written(extension, grey);
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 7) {
      if (std::string(extension) == ".tiff" && size > 2 * static_cast<std::size_t>(grey.total())) continue;
      const std::string part = whole.substr(0, size);
      EXPECT_TRUE(decode_to_grey(part).empty()) << extension << " " << size;
      EXPECT_FALSE(decode_grey(part)) << extension << " " << size;
    }
  }
}

TEST(PlainFiles, DamagedFilesAreSurvived) {
  Random random(7);
  for (const char* extension : {".pgm", ".bmp", ".tiff"}) {
    const std::string whole = written(extension, example(CV_8UC1));
    for (int k = 0; k < 300; ++k) {
      std::string damaged = whole;
      for (int n = 0; n < 3; ++n) {
        const std::size_t at = random.below(k % 2 == 0 ? 60U : static_cast<std::uint32_t>(whole.size()));
        damaged[at] = static_cast<char>(random.below(256));
      }
      decode_grey(damaged);
    }
  }
}

// Cameras of 12 bits write a largest value of 4095, or none.
TEST(PlainFiles, TheBitsInUseAreThoseOfTheValues) {
  const std::string bytes = std::string("P5\n# camera\n2 1\n65535\n") + std::string("\x0f\xff\x00\x10", 4);
  const cv::Mat decoded = decode_to_grey(bytes);
  ASSERT_EQ(decoded.type(), CV_16UC1);
  EXPECT_EQ(decoded.at<std::uint16_t>(0, 0), 4095);
  EXPECT_EQ(decode_grey(bytes, {.bits = 12})->row(0)[0], 255);
}

}  // namespace
}  // namespace bslam::image_decoding
