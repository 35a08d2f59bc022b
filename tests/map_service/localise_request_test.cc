#include "map_service/localise_request.h"

#include <gtest/gtest.h>

#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "image_decoding/colour_image.h"

namespace bslam::map_service {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr const char* kType = "multipart/form-data; boundary=b";

camera::Rig rig() {
  std::vector<camera::RigCamera> cameras;
  for (const char* name : {"cam0", "cam1"}) {
    const TimeNs offset = cameras.empty() ? 0 : 5'000'000;
    cameras.push_back({{name, camera::Pinhole({50, 50, 32, 24}), kWidth, kHeight, offset, ""}, {}});
  }
  return camera::Rig(cameras);
}

std::string pgm(int width, int height) {
  return "P5 " + std::to_string(width) + " " + std::to_string(height) + " 255\n" +
         std::string(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), '\x40');
}

std::string form(const std::vector<std::pair<std::string, std::string>>& parts) {
  std::string body;
  for (const auto& [name, content] : parts)
    body += "--b\r\nContent-Disposition: form-data; name=\"" + name + "\"\r\n\r\n" + content + "\r\n";
  return body + "--b--\r\n";
}

std::string message(const std::vector<std::pair<std::string, std::string>>& parts) {
  const auto images = images_of_request(kType, form(parts), rig());
  return images ? "" : images.error().message();
}

TEST(LocaliseRequest, AnySubsetOfTheCamerasMakesABundle) {
  const cv::Mat grey(kHeight, kWidth, CV_8UC1, cv::Scalar(7));
  const auto images = images_of_request(kType, form({{"cam1", image_decoding::encode_png(grey)}}), rig());
  ASSERT_TRUE(images) << images.error().message();
  ASSERT_EQ(images->images.size(), 2u);
  EXPECT_EQ(images->images[0].state, image::ImageState::kMissing);
  EXPECT_EQ(images->images[1].state, image::ImageState::kPresent);
  EXPECT_EQ(images->images[1].view().at(3, 4), 7);
  EXPECT_EQ(images->time_ns, 5'000'000);  // the time offset of the camera
  const auto both =
      images_of_request(kType, form({{"cam1", pgm(kWidth, kHeight)}, {"cam0", pgm(kWidth, kHeight)}}), rig());
  ASSERT_TRUE(both) << both.error().message();
  EXPECT_EQ(both->time_ns, 0);
  EXPECT_EQ(both->images[0].view().at(1, 1), 0x40);
}

TEST(LocaliseRequest, NamesMustBeThoseOfCamerasEachOnce) {
  EXPECT_EQ(message({}), "form: found no part, expected an image of one of the cameras cam0, cam1");
  EXPECT_EQ(message({{"../cam0\x01", pgm(kWidth, kHeight)}}),
            "form: found a part '../cam0?', expected names of cameras: cam0, cam1");
  EXPECT_EQ(message({{"cam0", pgm(kWidth, kHeight)}, {"cam0", pgm(kWidth, kHeight)}}),
            "form: found the part cam0 twice, expected one image per camera");
}

TEST(LocaliseRequest, AnImageOfAnotherSizeIsRefusedBeforeItIsDecoded) {
  EXPECT_EQ(message({{"cam0", pgm(kWidth, kHeight + 1)}}),
            "request: cam0: found an image of 64 x 49, expected 64 x 48, as in the calibration");
  // A header that claims 4 billion pixels, of which there are none.
  std::string png = image_decoding::encode_png(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(7)));
  png.replace(16, 8, std::string("\0\0\xff\xff\0\0\xff\xff", 8));
  EXPECT_EQ(message({{"cam0", png}}),
            "request: cam0: found an image of 65535 x 65535, expected 64 x 48, as in the calibration");
}

TEST(LocaliseRequest, DamagedImagesAreRefused) {
  const std::string png = image_decoding::encode_png(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(7)));
  const std::string expected =
      "request: cam0: found an incomplete image or another format, expected a complete PNG, JPEG, WebP or PGM image";
  for (const std::string& bytes : {std::string(), std::string("x"), png.substr(0, png.size() / 2), png.substr(0, 20),
                                   std::string("\xff\xd8\xff"), std::string("RIFF"), std::string("P5 64 48 255\n")})
    EXPECT_EQ(message({{"cam0", bytes}}), expected);
}

TEST(LocaliseRequest, AJpegWithCountlessScansIsRefused) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(7)), bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  std::string jpeg(bytes.begin(), bytes.end());
  EXPECT_EQ(message({{"cam0", jpeg}}), "");
  const std::string scan = jpeg.substr(jpeg.rfind("\xff\xda"));
  for (int i = 0; i < 100; ++i) jpeg.insert(jpeg.size() - 2, scan.substr(0, scan.size() - 2));
  EXPECT_NE(message({{"cam0", jpeg}}), "");
}

}  // namespace
}  // namespace bslam::map_service
