#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "support/bag_writer.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

using image::ImageState;
using support::TestMessage;
using support::Wire;

// An image of one encoding, decoded with the filters that the user chose; a compressed one if `step` is 0.
image::Image decoded(const std::string& encoding, const std::string& data, int step, bool big_endian = false,
                     const std::vector<image_decoding::Bayer>& chosen = {}) {
  const support::TemporaryFolder folder;
  std::vector<TestMessage> all;
  for (int k = 0; k < 3; ++k) {
    const TimeNs time_ns = 1'000'000'000 + k * 100'000'000;
    const support::TestImage one{time_ns, 4, 4, static_cast<std::uint32_t>(step), encoding, data, big_endian};
    if (step == 0)
      all.push_back({"/image", "sensor_msgs/CompressedImage", time_ns, compressed_image_message(Wire::kCdr, one)});
    else
      all.push_back({"/image", "sensor_msgs/Image", time_ns, support::image_message(Wire::kCdr, one)});
  }
  support::write_text(folder.path() / "a.mcap", support::mcap_bytes(all, Wire::kCdr));
  support::write_text(
      folder.path() / "rig.yaml",
      "bslam_rig: 1\ncameras:\n  - name: a\n    model: pinhole\n    resolution: [4, 4]\n"
      "    intrinsics: [4, 4, 1.5, 1.5]\n    T_body_cam: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  const auto dataset =
      open_dataset({.path = folder.path() / "a.mcap", .rig_file = folder.path() / "rig.yaml", .bayer = chosen});
  EXPECT_TRUE(dataset) << dataset.error().message();
  if (!dataset) return {};
  const image::ImageBundle frame = read_frame(*dataset, 1);
  EXPECT_EQ(frame.images[0].state, ImageState::kPresent) << describe_damage(*dataset, 1, 0);
  return frame.images[0].image;
}

TEST(BagImages, DecodesAllEncodings) {
  const auto rows = [](int bytes, const std::function<int(int, int)>& value) {
    std::string out;
    for (int y = 0; y < 4; ++y) {
      for (int k = 0; k < bytes; ++k) out += static_cast<char>(value(y, k));
    }
    return out;
  };
  EXPECT_EQ(decoded("8UC1", rows(6, [](int y, int k) { return 10 * y + k; }), 6).row(2)[3], 23);
  // 10 bits are in use: 1000 / 4 and 40 / 4.
  const std::string words =
      rows(8, [](int y, int k) { return k % 2 == 0 ? (y == 0 ? 0xe8 : 0x28) : (y == 0 ? 3 : 0); });
  EXPECT_EQ(decoded("mono16", words, 8).row(0)[1], 250);
  EXPECT_EQ(decoded("16UC1", words, 8).row(1)[1], 10);
  std::string swapped = words;
  for (std::size_t k = 0; k < swapped.size(); k += 2) std::swap(swapped[k], swapped[k + 1]);
  EXPECT_EQ(decoded("mono16", swapped, 8, true).row(0)[1], 250);
  const std::string red = rows(12, [](int, int k) { return k % 3 == 0 ? 200 : 0; });
  EXPECT_NEAR(decoded("rgb8", red, 12).row(1)[1], 0.299 * 200, 1);
  EXPECT_NEAR(decoded("bgr8", red, 12).row(1)[1], 0.114 * 200, 1);
  const std::string green = rows(16, [](int, int k) { return k % 4 == 1 ? 100 : k % 4 == 3 ? 255 : 0; });
  EXPECT_NEAR(decoded("rgba8", green, 16).row(1)[1], 0.587 * 100, 1);
  EXPECT_NEAR(decoded("bgra8", green, 16).row(1)[1], 0.587 * 100, 1);
  const std::string pairs = rows(8, [](int, int k) { return k % 2 == 0 ? 11 : 77; });
  EXPECT_EQ(decoded("yuv422", pairs, 8).row(1)[1], 77);
  EXPECT_EQ(decoded("yuv422_yuy2", pairs, 8).row(1)[1], 11);
  EXPECT_EQ(decoded("bayer_rggb8", rows(4, [](int, int) { return 90; }), 4).row(2)[2], 90);
  EXPECT_EQ(decoded("bayer_gbrg16", rows(8, [](int, int) { return 0x50; }), 8).row(2)[2], 0x50);
}

// Files of one channel contain the pixels behind the filter, of which a format tells the kind.
TEST(BagImages, InterpolatesTheColourFilterOfCompressedImages) {
  constexpr int kRed = 200, kGreen = 100, kBlue = 40;
  const auto file = [](const cv::Mat& pixels, const std::string& extension) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(extension, pixels, bytes);
    return std::string(bytes.begin(), bytes.end());
  };
  const double grey = 0.299 * kRed + 0.587 * kGreen + 0.114 * kBlue;
  cv::Mat raw(4, 4, CV_8UC1);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const int rggb = y % 2 == x % 2 ? (x % 2 == 0 ? kRed : kBlue) : kGreen;
      raw.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(rggb);
    }
  }
  const std::string png = file(raw, ".png"), colours = file(cv::Mat(4, 4, CV_8UC3, cv::Scalar(90, 90, 90)), ".png");
  for (const char* format : {"bayer_rggb8; png compressed ", "bayer_rggb8; png compressed bayer_rggb8"}) {
    for (const auto& [x, y] : {std::pair(1, 1), {2, 1}, {1, 2}, {2, 2}})
      EXPECT_NEAR(decoded(format, png, 0).row(y)[x], grey, 1.5) << format << ", " << x << " " << y;
  }
  EXPECT_NEAR(decoded("bayer_rggb8; tiff compressed ", file(raw, ".tiff"), 0).row(1)[1], grey, 1.5);
  EXPECT_NEAR(decoded("bayer_rggb8; jpeg compressed ", file(cv::Mat(4, 4, CV_8UC1, 90), ".jpg"), 0).row(1)[1], 90, 1);
  EXPECT_NEAR(decoded("bayer_bggr8; png compressed ", png, 0).row(1)[1], 0.299 * kBlue + 0.587 * kGreen + 0.114 * kRed,
              1.5);
  for (const char* format : {"mono8; png compressed ", "png", "bayer_rggb8; png compressed mono8"})
    EXPECT_EQ(decoded(format, png, 0).row(1)[1], kBlue) << format;
  for (const char* format : {"bayer_rggb8; png compressed bgr8", "bayer_rggb8; png compressed "})
    EXPECT_EQ(decoded(format, colours, 0).row(1)[1], 90) << format;
}

// Drivers name wrong filters, and images without a filter as if they had one.
TEST(BagImages, AChosenColourFilterIsUsedInPlaceOfTheNamedOne) {
  using image_decoding::Bayer;
  const auto red_green_blue = [](int red, int green, int blue) { return 0.299 * red + 0.587 * green + 0.114 * blue; };
  std::string raw;  // 200 at even, 40 at odd places of the diagonal, else 100
  for (int k = 0; k < 16; ++k) raw += static_cast<char>((k / 4 + k % 4) % 2 == 1 ? 100 : k % 2 == 0 ? 200 : 40);
  for (const auto& [chosen, grey] : {std::pair(std::vector<Bayer>{}, red_green_blue(40, 100, 200)),
                                     {{Bayer::kRggb}, red_green_blue(200, 100, 40)},
                                     {{Bayer::kNone}, 40.0}}) {
    EXPECT_NEAR(decoded("bayer_bggr8", raw, 4, false, chosen).row(1)[1], grey, 1.5) << chosen.size();
  }
  std::vector<std::uint8_t> png;
  cv::imencode(".png", cv::Mat(4, 4, CV_8UC1, raw.data()), png);
  const std::string file(png.begin(), png.end());
  EXPECT_NEAR(decoded("bayer_bggr8; png compressed ", file, 0, false, {Bayer::kRggb}).row(1)[1],
              red_green_blue(200, 100, 40), 1.5);
  EXPECT_EQ(decoded("bayer_bggr8; png compressed ", file, 0, false, {Bayer::kNone}).row(1)[1], 40);
}

}  // namespace
}  // namespace bslam::dataset
