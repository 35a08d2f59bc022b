#include "image_files/image_size.h"

#include <gtest/gtest.h>

#include "image_files/image_folder.h"
#include "support/data_on_disk.h"

namespace bslam::image_files {
namespace {

TEST(ImageSize, IsReadFromTheHeader) {
  const support::TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg"}) {
    support::write_image(folder.path() / name, 67, 35);
    const std::string bytes = support::read_text(folder.path() / name);
    const auto size = image_size(bytes);
    ASSERT_TRUE(size) << name;
    EXPECT_EQ(size->width, 67);
    EXPECT_EQ(size->height, 35);
  }
}

TEST(ImageSize, SkipsSegmentsBeforeTheFrameHeader) {
  std::string jpeg(
      "\xff\xd8\xff\xe1\x00\x06"
      "EXIF\xff\xff\xc4\x00\x02\xff\xc2\x00\x0b\x08\x01\x02\x03\x04",
      24);
  const auto size = image_size(jpeg);
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 0x304);
  EXPECT_EQ(size->height, 0x102);
  for (std::size_t n = 0; n < jpeg.size(); ++n) EXPECT_FALSE(image_size(jpeg.substr(0, n))) << n;
}

TEST(ImageSize, ReturnsNulloptForOtherFiles) {
  EXPECT_FALSE(image_size(""));
  EXPECT_FALSE(image_size("P5 67 35 255\n"));
  EXPECT_FALSE(image_size(std::string("\xff\xd8\xff\xd9\x00\x02", 6)));
  EXPECT_FALSE(image_size("\x89PNG\r\n\x1a\n0000IHDR"));
}

TEST(ImageFolder, ReturnsTheSizeOfTheFirstReadableImage) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "1.png", "no image");
  support::write_image(folder.path() / "2.png", 40, 30);
  const auto size = first_image_size(images_in(folder.path()));
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 40);
}

}  // namespace
}  // namespace bslam::image_files
