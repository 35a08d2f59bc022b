#include "image_decoding/image_file.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/random.h"
#include "support/data_on_disk.h"

namespace bslam::image_decoding {
namespace {

std::string encoded(const cv::Mat& original, const std::string& extension, const std::vector<int>& parameters = {}) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, original, bytes, parameters);
  return std::string(bytes.begin(), bytes.end());
}

// A smooth image with noise, so that an encoder uses every kind of filter.
cv::Mat picture_of(int width, int height, int type = CV_8UC1) {
  Random random(9);
  cv::Mat original(height, width, type);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width * original.channels(); ++x) {
      const double value = 0.5 + 0.3 * std::sin(0.05 * x) * std::cos(0.08 * y) + 0.05 * random.uniform();
      if (original.depth() == CV_16U) original.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(65535 * value);
      if (original.depth() == CV_8U) original.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(255 * value);
    }
  }
  return original;
}

bool equal(const image::Image& ours, const cv::Mat& theirs) {
  if (ours.width() != theirs.cols || ours.height() != theirs.rows) return false;
  for (int y = 0; y < theirs.rows; ++y) {
    if (!std::equal(ours.row(y), ours.row(y) + ours.width(), theirs.ptr<std::uint8_t>(y))) return false;
  }
  return true;
}

TEST(ImageFile, DecodesGreyPngExactly) {
  for (const auto& [width, height] : {std::pair(1, 1), {3, 5}, {640, 480}, {751, 33}}) {
    const cv::Mat original = picture_of(width, height);
    for (const int strategy :
         {cv::IMWRITE_PNG_STRATEGY_DEFAULT, cv::IMWRITE_PNG_STRATEGY_FILTERED, cv::IMWRITE_PNG_STRATEGY_RLE}) {
      for (const int level : {1, 9}) {
        const auto image = decode_grey(
            encoded(original, ".png", {cv::IMWRITE_PNG_STRATEGY, strategy, cv::IMWRITE_PNG_COMPRESSION, level}));
        ASSERT_TRUE(image);
        EXPECT_TRUE(equal(*image, original)) << width << "x" << height;
      }
    }
  }
}

TEST(ImageFile, KeepsTheUpperEightOfSixteenBits) {
  const cv::Mat original = picture_of(40, 30, CV_16UC1);
  const auto image = decode_grey(encoded(original, ".png"));
  ASSERT_TRUE(image);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_EQ(image->row(y)[x], original.at<std::uint16_t>(y, x) >> 8);
  }
}

// 12-bit values in 16-bit files, as many cameras record them, keep their upper eight bits; larger values are white.
TEST(ImageFile, KeepsTheUpperEightOfTheBitsInUse) {
  cv::Mat original = picture_of(40, 30, CV_16UC1) / 16;
  original.at<std::uint16_t>(0, 0) = 5000;
  const auto image = decode_grey(encoded(original, ".png"), {.bits = 12});
  ASSERT_TRUE(image);
  EXPECT_EQ(image->row(0)[0], 255);
  for (int y = 1; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_EQ(image->row(y)[x], original.at<std::uint16_t>(y, x) >> 4);
  }
}

// The number of bits is that of the camera, not of an image: dark images do not become bright.
TEST(ImageFile, FindsTheBitsInUseOverAllImages) {
  const support::TemporaryFolder folder;
  std::vector<image_files::ImageFile> files;
  const auto write = [&](int largest, int type) {
    files.push_back({folder.path() / (std::to_string(files.size()) + ".png")});
    ASSERT_TRUE(cv::imwrite(files.back().path.string(), cv::Mat(8, 8, type, cv::Scalar(largest))));
  };
  write(200, CV_16UC1);
  EXPECT_EQ(bits_in_use(files), 8);
  write(1023, CV_16UC1);
  EXPECT_EQ(bits_in_use(files), 10);
  write(4080, CV_16UC1);
  write(300, CV_16UC1);
  EXPECT_EQ(bits_in_use(files), 12);
  EXPECT_EQ(bits_in_use(std::span(files).last(1)), 10);
  files.insert(files.begin(), {folder.path() / "missing.png"});
  EXPECT_EQ(bits_in_use(files), 12);
  write(65520, CV_16UC1);  // 12 bits in the upper part
  EXPECT_EQ(bits_in_use(files), 16);
  files.clear();
  write(200, CV_8UC1);
  EXPECT_EQ(bits_in_use(files), std::nullopt);
  EXPECT_EQ(bits_in_use({}), std::nullopt);
  files.clear();
  write(0, CV_16UC1);  // says nothing
  EXPECT_EQ(bits_in_use(files), std::nullopt);
}

TEST(ImageFile, ConvertsColoursOfSixteenBitsToGrey) {
  const cv::Mat original(20, 30, CV_16UC3, cv::Scalar(3200, 1600, 800));
  const auto image = decode_grey(encoded(original, ".png"), {.bits = 12});
  ASSERT_TRUE(image);
  EXPECT_NEAR(image->row(3)[4], (0.114 * 3200 + 0.587 * 1600 + 0.299 * 800) / 16, 1.01);
}

// A uniformly coloured scene behind each of the four filters has its luminance everywhere.
TEST(ImageFile, InterpolatesTheColourFilterOfRawImages) {
  const std::array<double, 3> colour = {200, 100, 50};  // red, green, blue
  const double luminance = 0.299 * 200 + 0.587 * 100 + 0.114 * 50;
  for (const auto& [bayer, pattern] : {std::pair(Bayer::kRggb, std::array{0, 1, 1, 2}),
                                       {Bayer::kBggr, std::array{2, 1, 1, 0}},
                                       {Bayer::kGrbg, std::array{1, 0, 2, 1}},
                                       {Bayer::kGbrg, std::array{1, 2, 0, 1}}}) {
    cv::Mat raw(16, 20, CV_8UC1);
    for (int y = 0; y < raw.rows; ++y) {
      for (int x = 0; x < raw.cols; ++x) {
        const int channel = pattern[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
        raw.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(colour[static_cast<std::size_t>(channel)]);
      }
    }
    const auto image = decode_grey(encoded(raw, ".png"), {.bayer = bayer});
    ASSERT_TRUE(image);
    for (int y = 0; y < raw.rows; ++y) {
      for (int x = 0; x < raw.cols; ++x) EXPECT_NEAR(image->row(y)[x], luminance, 1.5) << x << " " << y;
    }
  }
}

TEST(ImageFile, ConvertsColoursToGrey) {
  const cv::Mat original(20, 30, CV_8UC3, cv::Scalar(200, 100, 50));  // blue, green, red
  const auto image = decode_grey(encoded(original, ".png"));
  ASSERT_TRUE(image);
  EXPECT_NEAR(image->row(3)[4], 0.114 * 200 + 0.587 * 100 + 0.299 * 50, 1.01);
}

// A chunk of a PNG with its length and checksum.
std::string chunk(const std::string& name, const std::string& data) {
  const auto big_endian = [](std::uint32_t value) {
    std::string out;
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift);
    return out;
  };
  return big_endian(static_cast<std::uint32_t>(data.size())) + name + data +
         big_endian(libdeflate_crc32(0, (name + data).data(), name.size() + data.size()));
}

// JPEG files have no such chunk, and grey values must not depend on the program that wrote an image.
TEST(ImageFile, IgnoresTheGammaThatAPngDeclares) {
  const std::string gamma = chunk("gAMA", std::string("\0\0\xb1\x8f", 4)), srgb = chunk("sRGB", std::string(1, '\0')),
                    primaries = chunk("cHRM", std::string("\0\0\x7a\x26\0\0\x80\x84\0\0\xfa\0\0\0\x80\xe8"
                                                          "\0\0\x75\x30\0\0\xea\x60\0\0\x3a\x98\0\0\x17\x70",
                                                          32));
  for (const int depth : {CV_8U, CV_16U}) {
    const double one = depth == CV_8U ? 1 : 257;
    const cv::Mat red(6, 8, CV_MAKETYPE(depth, 3), cv::Scalar(0, 0, 255 * one));
    const std::string plain = encoded(red, ".png");
    constexpr std::size_t kAfterHeader = 33;  // signature and the chunk IHDR
    for (const std::string& added : {std::string(), gamma, srgb, gamma + primaries, srgb + gamma + primaries}) {
      const auto image = decode_grey(plain.substr(0, kAfterHeader) + added + plain.substr(kAfterHeader));
      ASSERT_TRUE(image);
      EXPECT_EQ(image->row(2)[3], 76) << added.size() << " bytes, depth " << depth;
    }
  }
}

TEST(ImageFile, DecodesJpeg) {
  const cv::Mat original = picture_of(64, 48);
  const std::string bytes = encoded(original, ".jpg", {cv::IMWRITE_JPEG_QUALITY, 100});
  const auto image = decode_grey(bytes);
  ASSERT_TRUE(image);
  EXPECT_TRUE(equal(*image, cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), cv::IMREAD_GRAYSCALE)));
  EXPECT_TRUE(decode_grey(bytes + std::string(100, '\0')));  // as some recorders pad
}

TEST(ImageFile, RejectsEveryTruncation) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string bytes = encoded(picture_of(64, 48), extension);
    for (std::size_t size = 0; size < bytes.size(); size += size < 100 ? 1 : 37) {
      EXPECT_FALSE(decode_grey(std::string_view(bytes).substr(0, size))) << extension << " " << size;
    }
    EXPECT_FALSE(decode_grey(std::string_view(bytes).substr(0, bytes.size() - 1)));
  }
}

// The decoder fills the missing part with grey, and only warns.
TEST(ImageFile, RejectsAJpegWhoseDataEndBeforeItsMarker) {
  const std::string bytes = encoded(picture_of(320, 240), ".jpg");
  for (const std::size_t percent : {40, 60, 80, 95})
    EXPECT_FALSE(decode_grey(bytes.substr(0, bytes.size() * percent / 100) + "\xff\xd9")) << percent;
}

TEST(ImageFile, AcceptsAJpegWithBytesBeforeItsEndMarker) {
  std::string bytes = encoded(picture_of(320, 240), ".jpg");
  const auto intact = decode_grey(bytes);
  bytes.insert(bytes.size() - 2, std::string(600, '\x55'));  // the decoder warns of them
  const auto image = decode_grey(bytes);
  ASSERT_TRUE(intact && image);
  EXPECT_EQ(image->row(239)[319], intact->row(239)[319]);
}

// Phones and action cameras add previews, depth and videos, and drivers the rest of their buffers.
TEST(ImageFile, AcceptsAJpegWithBytesAfterItsEndMarker) {
  const cv::Mat original = picture_of(320, 240, CV_8UC3);
  const std::string preview = encoded(picture_of(32, 24), ".jpg");
  for (const std::vector<int>& parameters :
       {std::vector<int>(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1}, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}}) {
    std::string bytes = encoded(original, ".jpg", parameters);
    // A segment whose content looks like the end, as that with a preview.
    bytes.insert(2, std::string("\xff\xe1") + '\0' + '\x06' + "\xff\xd9\xff\xd9");
    const auto intact = decode_grey(bytes);
    ASSERT_TRUE(intact);
    for (const std::string& added : {std::string("some text"), std::string(5000, '\xff'), preview, preview + "text"}) {
      const auto image = decode_grey(bytes + added);
      ASSERT_TRUE(image) << added.size();
      EXPECT_EQ(image->row(239)[319], intact->row(239)[319]);
    }
    for (std::size_t size = 0; size < bytes.size(); size += size + 200 < bytes.size() ? 97 : 1)
      EXPECT_FALSE(decode_grey(bytes.substr(0, size) + "text")) << size;
  }
}

TEST(ImageFile, RejectsOtherData) {
  EXPECT_FALSE(decode_grey(""));
  EXPECT_FALSE(decode_grey("not an image"));
  EXPECT_FALSE(decode_grey(std::string(5000, 'x')));
}

// Damage anywhere in a PNG is detected by the checksums or does not change the image; the decoder never crashes or
// reads beyond the data.
TEST(ImageFile, HandlesDamagedBytes) {
  const cv::Mat original = picture_of(48, 36);
  const std::string bytes = encoded(original, ".png");
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 1 + i % 4; ++k)
      damaged[random.below(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<char>(1 + random.below(255));
    if (damaged == bytes) continue;
    const auto image = decode_grey(damaged);
    EXPECT_TRUE(!image || equal(*image, original));
  }
}

TEST(ImageFile, ReadsFiles) {
  const support::TemporaryFolder folder;
  support::write_image(folder.path() / "a.png", 20, 10);
  EXPECT_EQ(read_image(folder.path() / "a.png").value().width(), 20);
  EXPECT_FALSE(read_image(folder.path() / "b.png"));
  EXPECT_FALSE(read_image(folder.path()));
}

// Labels are small numbers or dark colours; only zero and black mask a pixel.
TEST(ImageFile, EveryValueOfAMaskExceptZeroIsUsed) {
  const support::TemporaryFolder folder;
  const auto expect_half = [&](const cv::Mat& used, const std::string& name) {
    cv::Mat mask = cv::Mat::zeros(10, 20, used.type());
    used.copyTo(mask.rowRange(5, 10));
    const std::string file = (folder.path() / name).string();
    ASSERT_TRUE(cv::imwrite(file, mask, {cv::IMWRITE_WEBP_QUALITY, 101}));
    const auto read = read_mask_file(file);
    ASSERT_TRUE(read) << read.error().message();
    for (int y = 0; y < 10; ++y) EXPECT_EQ(read->row(y)[3] != 0, y >= 5) << name << ", row " << y;
  };
  for (const int value : {1, 200, 255, 256, 512, 65535})
    expect_half(cv::Mat(5, 20, CV_16UC1, cv::Scalar(value)), "words.png");
  for (const cv::Scalar& colour : {cv::Scalar(1, 0, 0), cv::Scalar(0, 1, 0), cv::Scalar(0, 0, 1)}) {
    for (const char* name : {"colours.png", "colours.webp", "colours.bmp", "colours.tiff", "colours.ppm"})
      expect_half(cv::Mat(5, 20, CV_8UC3, colour), name);
    expect_half(cv::Mat(5, 20, CV_16UC3, colour), "colour_words.png");
  }
  expect_half(cv::Mat(5, 20, CV_8UC1, cv::Scalar(1)), "grey.png");
  expect_half(cv::Mat(5, 20, CV_8UC1, cv::Scalar(1)), "grey.pgm");
  ASSERT_TRUE(cv::imwrite((folder.path() / "dark.jpg").string(), cv::Mat(16, 16, CV_8UC3, cv::Scalar(5, 0, 0)),
                          {cv::IMWRITE_JPEG_QUALITY, 100}));
  EXPECT_GT(read_mask_file(folder.path() / "dark.jpg").value().row(8)[8], 0);
}

TEST(ImageFile, ReadsMasksOfTheCamerasSize) {
  const support::TemporaryFolder folder;
  support::write_image(folder.path() / "mask.png", 20, 10);
  camera::Camera camera{"c", camera::Pinhole({10, 10, 10, 5}), 20, 10, 0, ""};
  EXPECT_TRUE(read_mask(camera).value().empty());
  camera.mask_file = (folder.path() / "mask.png").string();
  EXPECT_EQ(read_mask(camera).value().height(), 10);
  camera.width = 30;
  EXPECT_EQ(read_mask(camera).error().found, "20x10 pixels");
  camera.mask_file = "none.png";
  EXPECT_FALSE(read_mask(camera));
  ASSERT_TRUE(cv::imwrite((folder.path() / "black.png").string(), cv::Mat::zeros(10, 30, CV_8U)));
  camera.mask_file = (folder.path() / "black.png").string();
  ASSERT_FALSE(read_mask(camera));
  EXPECT_EQ(read_mask(camera).error().found, "only zeros, which mask the whole image of c");
}

}  // namespace
}  // namespace bslam::image_decoding
