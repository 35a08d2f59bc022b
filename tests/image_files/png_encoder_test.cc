#include "image_files/png_encoder.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "image_files/png_decoder.h"

namespace bslam::image_files {
namespace {

TEST(PngEncoder, WritesWhatTheDecoderReads) {
  Random random(3, "png");
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(67, 35), std::pair(752, 480)}) {
    image::Image image(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        image.row(y)[x] = static_cast<std::uint8_t>(y < height / 2 ? 255 : random.below(256));
    const std::string png = encode_grey_png(image);
    ASSERT_TRUE(is_complete_png(png));
    const auto read = decode_grey_png(png);
    ASSERT_TRUE(read);
    ASSERT_EQ(read->width(), width);
    ASSERT_EQ(read->height(), height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) ASSERT_EQ(read->row(y)[x], image.row(y)[x]) << x << " " << y;
  }
}

}  // namespace
}  // namespace bslam::image_files
