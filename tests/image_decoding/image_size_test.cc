#include "image_decoding/image_size.h"

#include <gtest/gtest.h>

#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace bslam::image_decoding {
namespace {

std::string encoded(const char* extension) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, cv::Mat(7, 20, CV_8UC1, cv::Scalar(9)), bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(ImageSize, IsThatOfTheHeader) {
  for (const char* extension : {".png", ".jpg", ".pgm", ".webp"}) {
    const std::string bytes = encoded(extension);
    const auto size = size_in_header(bytes);
    ASSERT_TRUE(size) << extension;
    EXPECT_EQ(size->width, 20u) << extension;
    EXPECT_EQ(size->height, 7u) << extension;
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const auto part = size_in_header(bytes.substr(0, length));  // known, or not, but never another one
      EXPECT_TRUE(!part || extension == std::string(".pgm") || (part->width == 20 && part->height == 7))
          << extension << length;
    }
  }
}

TEST(ImageSize, IsUnknownForOtherFiles) {
  for (const std::string& bytes :
       {std::string(), std::string("P5"), std::string("P5 x"), std::string("RIFF"), std::string("\x89PNG\r\n\x1a\n"),
        std::string("P5 0 7 255\n"), std::string(100, '\xff')})
    EXPECT_FALSE(size_in_header(bytes)) << bytes;
}

}  // namespace
}  // namespace bslam::image_decoding
