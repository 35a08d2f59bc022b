#include "dataset/vignette_folder.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

class VignetteFolder : public testing::Test {
 protected:
  void SetUp() override {
    support::write_small_euroc(data());
    std::filesystem::create_directories(vignettes());
  }
  std::filesystem::path data() const { return folder_.path() / "small"; }
  std::filesystem::path vignettes() const { return folder_.path() / "vignettes"; }
  Result<Dataset> open(std::optional<std::filesystem::path> folder) const {
    return open_dataset({.path = data(), .cameras = {1, 0}, .vignettes = std::move(folder)});
  }
  support::TemporaryFolder folder_;
};

TEST_F(VignetteFolder, CorrectsTheImagesOfTheCamera) {
  cv::Mat brightness(support::kSmallHeight, support::kSmallWidth, CV_8U, cv::Scalar(200));
  brightness.at<std::uint8_t>(3, 5) = 100;
  cv::imwrite((vignettes() / "cam1.png").string(), brightness);
  const auto plain = open({}), corrected = open(vignettes());
  ASSERT_TRUE(plain);
  ASSERT_TRUE(corrected) << corrected.error().message();
  const image::ImageBundle before = read_frame(*plain, 0), after = read_frame(*corrected, 0);
  const image::Image &dark = before.images[0].image, &bright = after.images[0].image;
  EXPECT_EQ(bright.row(3)[5], std::min(2 * dark.row(3)[5], 255));
  EXPECT_NE(dark.row(3)[5], 0);
  EXPECT_EQ(bright.row(3)[6], dark.row(3)[6]);
  EXPECT_EQ(after.images[1].image.row(3)[5], before.images[1].image.row(3)[5]);  // cam0 has no vignette
}

TEST_F(VignetteFolder, ErrorsNameFolderOrFile) {
  EXPECT_EQ(open(vignettes()).error().found, "no vignette of a camera in use");
  EXPECT_EQ(open(folder_.path() / "missing").error().file, (folder_.path() / "missing").string());
  support::write_text(vignettes() / "cam0.png", "not an image");
  EXPECT_EQ(open(vignettes()).error().file, (vignettes() / "cam0.png").string());
}

}  // namespace
}  // namespace bslam::dataset
