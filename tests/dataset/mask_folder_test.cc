#include "dataset/mask_folder.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

class MaskFolder : public testing::Test {
 protected:
  void SetUp() override {
    support::write_small_euroc(data());
    std::filesystem::create_directories(masks());
  }
  std::filesystem::path data() const { return folder_.path() / "small"; }
  std::filesystem::path masks() const { return folder_.path() / "masks"; }
  Result<Dataset> open(const std::vector<int>& cameras) const {
    return open_dataset({.path = data(), .cameras = cameras, .masks = masks()});
  }
  support::TemporaryFolder folder_;
};

TEST_F(MaskFolder, GivesMasksByTheNumberOfTheCamera) {
  support::write_image(masks() / "cam1.png", support::kSmallWidth, support::kSmallHeight);
  const auto dataset = open({1, 0});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(std::size_t{0}).mask_file, (masks() / "cam1.png").string());
  EXPECT_EQ(dataset->rig.camera(std::size_t{1}).mask_file, "");
}

TEST_F(MaskFolder, ErrorsNameTheFile) {
  EXPECT_EQ(open({0, 1}).error().found, "no mask of a camera in use");
  support::write_image(masks() / "cam1.png", 20, 10);
  EXPECT_EQ(open({0}).error().found, "no mask of a camera in use");
  EXPECT_EQ(open({0, 1}).error().file, (masks() / "cam1.png").string());
  EXPECT_EQ(open({0, 1}).error().found, "20x10 pixels");
  support::write_text(masks() / "cam1.png", "not an image");
  EXPECT_EQ(open({0, 1}).error().file, (masks() / "cam1.png").string());
  std::filesystem::remove_all(masks());
  EXPECT_EQ(open({0, 1}).error().found, "no such folder");
}

TEST_F(MaskFolder, ImagesHaveMasksOfTheirOwn) {
  const std::string name = support::small_image_name(3);
  std::filesystem::create_directories(masks() / "cam1");
  support::write_image(masks() / "cam1" / name, support::kSmallWidth, support::kSmallHeight);
  const auto dataset = open({1, 0});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(dataset->warnings.empty());
  for (std::size_t f = 0; f < dataset->frames.size(); ++f) {
    const image::ImageBundle bundle = read_frame(*dataset, f);
    EXPECT_EQ(bundle.images[0].mask_view().empty(), f != 3) << "frame " << f;
    EXPECT_TRUE(bundle.images[1].mask_view().empty());
  }
}

TEST_F(MaskFolder, MasksOfImagesMayBeSmallNumbersOf16Bits) {
  std::filesystem::create_directories(masks() / "cam1");
  const cv::Mat ones(support::kSmallHeight, support::kSmallWidth, CV_16UC1, cv::Scalar(1));
  ASSERT_TRUE(cv::imwrite((masks() / "cam1" / support::small_image_name(3)).string(), ones));
  const auto dataset = open({1, 0});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_NE(read_frame(*dataset, 3).images[0].mask.row(4)[4], 0);
}

TEST_F(MaskFolder, MasksThatBelongToNoImageAreReported) {
  std::filesystem::create_directories(masks() / "cam1");
  support::write_image(masks() / "cam1" / "12.png", support::kSmallWidth, support::kSmallHeight);
  EXPECT_EQ(open({0, 1}).error().file, (masks() / "cam1").string());
  EXPECT_NE(open({0, 1}).error().found.find("12.png"), std::string::npos);
  support::write_image(masks() / "cam1" / support::small_image_name(0), support::kSmallWidth, support::kSmallHeight);
  const auto dataset = open({0, 1});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->warnings.size(), 1u);
  EXPECT_NE(dataset->warnings[0].find("1 of 2 masks belong to no image of cam1"), std::string::npos);
}

TEST_F(MaskFolder, MasksOfNoCameraAreReported) {
  support::write_image(masks() / "cam1.png", support::kSmallWidth, support::kSmallHeight);
  support::write_image(masks() / "cam2.png", support::kSmallWidth, support::kSmallHeight);
  std::filesystem::create_directories(masks() / "cam7");
  support::write_image(masks() / "cam7" / "12.png", support::kSmallWidth, support::kSmallHeight);
  const auto dataset = open({1});  // the mask of camera 0 would be one of the rig
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->warnings.size(), 1u);
  EXPECT_NE(dataset->warnings[0].find("cam2.png, cam7 are masks of no camera, since there are 2"), std::string::npos);
}

TEST_F(MaskFolder, ImagesWithOtherNamesAreReported) {
  for (const char* name : {"cam0.png", "cam01.png", "cam1.jpg", "mask.png"})
    support::write_image(masks() / name, support::kSmallWidth, support::kSmallHeight);
  support::write_text(masks() / "notes.txt", "masks of people");
  const auto dataset = open({0, 1});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->warnings.size(), 1u);
  EXPECT_NE(dataset->warnings[0].find("cam01.png, cam1.jpg, mask.png not used"), std::string::npos);
}

TEST_F(MaskFolder, AnImageWhoseMaskCannotBeReadIsDamaged) {
  std::filesystem::create_directories(masks() / "cam1");
  const auto file = [&](int frame) { return masks() / "cam1" / support::small_image_name(frame); };
  support::write_image(file(0), 20, 10);
  EXPECT_EQ(open({0, 1}).error().found, "20x10 pixels");
  support::write_image(file(0), support::kSmallWidth, support::kSmallHeight);
  support::write_text(file(5), "not an image");
  const auto dataset = open({0, 1});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(read_frame(*dataset, 5).images[1].state, image::ImageState::kDamaged);
  EXPECT_NE(describe_damage(*dataset, 5, 1).find(file(5).string()), std::string::npos);
}

}  // namespace
}  // namespace bslam::dataset
