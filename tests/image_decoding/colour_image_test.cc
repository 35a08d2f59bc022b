#include "image_decoding/colour_image.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "support/data_on_disk.h"

namespace bslam::image_decoding {
namespace {

namespace fs = std::filesystem;

cv::Mat gradient(int type) {
  cv::Mat image(24, 32, type);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      if (type == CV_8UC3) image.at<cv::Vec3b>(y, x) = {static_cast<uchar>(7 * x), static_cast<uchar>(5 * y), 200};
      if (type == CV_8UC1) image.at<uchar>(y, x) = static_cast<uchar>(3 * x + 4 * y);
      if (type == CV_16UC1) image.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(256 * (3 * x + 4 * y));
    }
  return image;
}

TEST(ColourImage, ReadsRedGreenBlue) {
  const support::TemporaryFolder folder;
  const cv::Mat written = gradient(CV_8UC3);  // blue, green, red
  for (const auto& [name, tolerance] : {std::pair("a.png", 0), std::pair("a.jpg", 12)}) {
    const fs::path file = folder.path() / name;
    cv::imwrite(file.string(), written, {cv::IMWRITE_JPEG_QUALITY, 98, cv::IMWRITE_JPEG_CHROMA_QUALITY, 98});
    const auto read = read_colours({file});
    ASSERT_TRUE(read) << read.error().message();
    const cv::Vec3b in = written.at<cv::Vec3b>(12, 16), out = read->at<cv::Vec3b>(12, 16);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(out[c], in[2 - c], tolerance) << name;
  }
}

TEST(ColourImage, GreyImagesHaveEqualChannels) {
  const support::TemporaryFolder folder;
  for (const auto& [name, type] :
       {std::pair("a.png", CV_8UC1), std::pair("a.jpg", CV_8UC1), std::pair("b.png", CV_16UC1)}) {
    cv::imwrite((folder.path() / name).string(), gradient(type));
    const auto read = read_colours({folder.path() / name});
    ASSERT_TRUE(read) << read.error().message();
    const cv::Vec3b out = read->at<cv::Vec3b>(10, 20);
    EXPECT_EQ(out[0], out[1]);
    EXPECT_EQ(out[1], out[2]);
    EXPECT_NEAR(out[0], 100, 3) << name;
  }
}

// One image in memory.
class OneImage : public image_files::ImageStore {
 public:
  explicit OneImage(image_files::StoredImage image) : image_(std::move(image)) {}
  Result<image_files::StoredImage> read(std::int64_t) const override { return image_; }
  std::string name(std::int64_t) const override { return "image"; }
  std::string source(std::int64_t) const override { return "source"; }
  std::string stream(std::int64_t) const override { return "stream"; }

 private:
  image_files::StoredImage image_;
};

TEST(ColourImage, OfARecordingHasTheColoursOfItsPixels) {
  using enum image_files::PixelLayout;
  for (const auto layout : {kRgb, kBgr, kRgba, kBgra}) {
    const bool alpha = layout == kRgba || layout == kBgra, reversed = layout == kBgr || layout == kBgra;
    image_files::StoredImage stored{"skip", 4, 0, layout, 4, 3, alpha ? 18u : 14u};
    for (int y = 0; y < 3; ++y) {
      std::string row;
      for (int x = 0; x < 4; ++x) {
        const std::string red_green_blue = {static_cast<char>(10 * x), static_cast<char>(20 * y), 99};
        row += reversed ? std::string(red_green_blue.rbegin(), red_green_blue.rend()) : red_green_blue;
        if (alpha) row += '\xff';
      }
      row.resize(stored.step);
      stored.bytes += row;
    }
    stored.size = stored.bytes.size() - stored.begin;
    image_files::ImageFile image;
    image.store = std::make_shared<const OneImage>(stored);
    const auto read = read_colours(image);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->at<cv::Vec3b>(2, 3), cv::Vec3b(30, 40, 99));
  }
}

TEST(ColourImage, DamagedFilesAreErrors) {
  const support::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.png";
  cv::imwrite(file.string(), gradient(CV_8UC3));
  const std::string bytes = support::read_text(file);
  support::write_text(file, bytes.substr(0, bytes.size() / 2));
  EXPECT_FALSE(read_colours({file}));
  EXPECT_FALSE(read_colours({folder.path() / "missing.png"}));
}

TEST(ColourImage, WrittenPngsAreReadBack) {
  const support::TemporaryFolder folder;
  const cv::Mat image = gradient(CV_8UC3);
  support::write_text(folder.path() / "a.png", encode_png(image));
  const cv::Mat read = read_colours({folder.path() / "a.png"}).value();
  EXPECT_EQ(cv::norm(read, image, cv::NORM_INF), 0);
  support::write_text(folder.path() / "b.png", encode_png(gradient(CV_8UC1)));
  EXPECT_EQ(read_colours({folder.path() / "b.png"}).value().at<cv::Vec3b>(10, 20)[1], 100);
}

}  // namespace
}  // namespace bslam::image_decoding
