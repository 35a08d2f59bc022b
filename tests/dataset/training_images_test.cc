#include "dataset/training_images.h"

#include <gtest/gtest.h>

#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

TEST(TrainingImages, AreFoundInFoldersAndSubfolders) {
  const support::TemporaryFolder folder;
  const fs::path root = folder.path();
  for (const char* name : {"b/z.png", "b/a.JPG", "a.pgm", "b/c/d.webp", "notes.txt", "b/e.png.bak", "f.jpeg"})
    support::write_text(root / name, "x");
  fs::create_directories(root / "folder.png");
  const auto found = find_images({(root / "f.jpeg").string(), root.string()});
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(*found, (std::vector<fs::path>{root / "f.jpeg", root / "a.pgm", root / "b/a.JPG", root / "b/c/d.webp",
                                           root / "b/z.png"}));
}

TEST(TrainingImages, RejectOtherFiles) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "notes.txt", "x");
  EXPECT_EQ(find_images({(folder.path() / "none").string()}).error().file, (folder.path() / "none").string());
  EXPECT_FALSE(find_images({(folder.path() / "notes.txt").string()}).ok());
  EXPECT_TRUE(find_images({folder.path().string()}).value().empty());
}

TEST(TrainingImages, AreReadInAllFormats) {
  const support::TemporaryFolder folder;
  for (const char* name : {"a.png", "b.jpg", "c.pgm", "d.webp", "e.bmp", "f.pnm", "g.tif", "h.tiff"}) {
    support::write_image(folder.path() / name, 60, 40);
    EXPECT_EQ(find_images({folder.path().string()})->back(), folder.path() / name);
    const auto image = read_training_image(folder.path() / name, 0);
    ASSERT_TRUE(image.ok()) << name << ": " << image.error().message();
    EXPECT_EQ(image->width(), 60);
    EXPECT_EQ(image->height(), 40);
  }
}

TEST(TrainingImages, AreRejectedWhenTruncated) {
  const support::TemporaryFolder folder;
  for (const char* name : {"a.png", "b.jpg", "c.pgm", "d.webp"}) {
    support::write_image(folder.path() / name, 60, 40);
    const std::string bytes = support::read_text(folder.path() / name);
    support::write_text(folder.path() / name, bytes.substr(0, bytes.size() / 2));
    EXPECT_FALSE(read_training_image(folder.path() / name, 0).ok()) << name;
  }
  support::write_text(folder.path() / "e.png", "not an image");
  EXPECT_EQ(read_training_image(folder.path() / "e.png", 0).error().file, (folder.path() / "e.png").string());
}

TEST(TrainingImages, OfPgmMayHaveComments) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "a.pgm", "P5 # made by hand\n3\n# rows\n2 255\nabcdef");
  const auto image = read_training_image(folder.path() / "a.pgm", 0);
  ASSERT_TRUE(image.ok());
  EXPECT_EQ(image->width(), 3);
  EXPECT_EQ(image->row(1)[2], 'f');
  for (const char* text :
       {"P5", "P5 3", "P5 3 2 65535\nabcdef", "P5 3 2 65536\nabcdefabcdef", "P5 3 2 255\nabcde", "P5 -3 2 255\nabcdef",
        "P5 99999999999 2 255\na", "P5 2000000000 2000000000 255\na", "P5 #"}) {
    support::write_text(folder.path() / "a.pgm", text);
    EXPECT_FALSE(read_training_image(folder.path() / "a.pgm", 0).ok()) << text;
  }
}

TEST(TrainingImages, AreShrunkByAveraging) {
  const support::TemporaryFolder folder;
  support::write_image(folder.path() / "a.png", 80, 40, 3);
  const auto full = read_training_image(folder.path() / "a.png", 80).value();
  ASSERT_EQ(full.width(), 80);
  const auto half = read_training_image(folder.path() / "a.png", 40).value();
  ASSERT_EQ(half.width(), 40);
  ASSERT_EQ(half.height(), 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 40; ++x) {
      const int sum = full.row(2 * y)[2 * x] + full.row(2 * y)[2 * x + 1] + full.row(2 * y + 1)[2 * x] +
                      full.row(2 * y + 1)[2 * x + 1];
      ASSERT_NEAR(half.row(y)[x], sum / 4.0, 0.51);
    }
  }
}

}  // namespace
}  // namespace bslam::dataset
