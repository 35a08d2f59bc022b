#include "capture/v4l2_device.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "capture/pixels.h"
#include "capture/video_modes.h"
#include "capture/video_stand_in.h"

namespace bslam::capture {
namespace {

using std::chrono::milliseconds;
using State = DeviceImage::State;

constexpr const char* kPath = "/dev/video0";
constexpr int kWidth = 8, kHeight = 4;

class V4l2 : public testing::Test {
 protected:
  V4l2() { camera().modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {30}}}; }

  StandInCamera& camera() { return calls_.cameras[kPath]; }
  static StreamRequest request() { return {.width = kWidth, .height = kHeight}; }

  std::string error_of_opening() {
    const auto device = open_v4l2(calls_, kPath);
    return device ? "" : device.error().message();
  }
  std::string error_of_starting(const StreamRequest& wanted) {
    auto device = open_v4l2(calls_, kPath);
    if (!device) return "it does not open";
    const auto stream = (*device)->start(wanted);
    return stream ? "" : stream.error().message();
  }

  VideoStandIn calls_;
};

TEST_F(V4l2, DeliversImagesWithTheStampsOfTheDriver) {
  for (int k = 0; k < 10; ++k)
    camera().images.push_back({.bytes = std::string(kWidth * kHeight, static_cast<char>(k)), .time_us = 1'000'000 + k});
  {
    auto device = open_v4l2(calls_, kPath);
    ASSERT_TRUE(device.ok()) << device.error().message();
    StreamRequest wanted = request();
    wanted.clock_offset_ns = 5;
    const auto stream = (*device)->start(wanted);
    ASSERT_TRUE(stream.ok()) << stream.error().message();
    EXPECT_EQ(fourcc_text(stream->pixels), "GREY");
    EXPECT_EQ(stream->fps, 30);
    EXPECT_TRUE(camera().streaming);
    for (int k = 0; k < 10; ++k) {
      const auto image = (*device)->read(milliseconds(1));
      ASSERT_TRUE(image.ok());
      ASSERT_EQ(image->state, State::kImage) << k;
      EXPECT_EQ(image->bytes, std::string(kWidth * kHeight, static_cast<char>(k)));
      EXPECT_EQ(image->time_ns, 1'000'000'000 + 1000 * k + 5);
      EXPECT_TRUE(image->stamped);
    }
    EXPECT_EQ((*device)->read(milliseconds(1))->state, State::kNone);
  }
  EXPECT_FALSE(camera().streaming);
  EXPECT_EQ(camera().mapped, 3);
  EXPECT_EQ(camera().unmapped, camera().mapped);
  EXPECT_EQ(camera().closed, camera().opened);
}

TEST_F(V4l2, TellsThatADriverHasNoTimeStamps) {
  camera().images = {
      {.bytes = std::string(kWidth * kHeight, 'a'), .time_us = 3, .flags = V4L2_BUF_FLAG_TIMESTAMP_COPY}};
  auto device = *open_v4l2(calls_, kPath);
  ASSERT_TRUE(device->start(request()).ok());
  const auto image = device->read(milliseconds(1));
  ASSERT_TRUE(image.ok());
  EXPECT_FALSE(image->stamped);
  EXPECT_GT(image->time_ns, 3'000);
}

TEST_F(V4l2, LostImagesAreDamagedAndUnpluggingIsALoss) {
  camera().images = {{.error = EIO},
                     {.bytes = "part", .flags = V4L2_BUF_FLAG_ERROR},
                     {.bytes = std::string(kWidth * kHeight, 'a')},
                     {.error = EAGAIN},
                     {.error = ENODEV}};
  auto device = *open_v4l2(calls_, kPath);
  ASSERT_TRUE(device->start(request()).ok());
  for (const State state : {State::kDamaged, State::kDamaged, State::kImage, State::kNone})
    EXPECT_EQ(device->read(milliseconds(1))->state, state);
  const auto lost = device->read(milliseconds(1));
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().found, "a camera that was unplugged");
}

TEST_F(V4l2, ManyFailuresInARowAreALoss) {
  for (int k = 0; k < 30; ++k) camera().images.push_back({.error = EIO});
  auto device = *open_v4l2(calls_, kPath);
  ASSERT_TRUE(device->start(request()).ok());
  int damaged = 0;
  while (damaged < 40 && device->read(milliseconds(1)).ok()) ++damaged;
  EXPECT_EQ(damaged, 19);
}

TEST_F(V4l2, SaysWhyACameraCannotBeOpened) {
  calls_.cameras["/dev/video2"].name = "another";
  camera().open_error = ENOENT;
  EXPECT_EQ(error_of_opening(),
            "/dev/video0: found no such camera, expected a camera; this computer has /dev/video0, "
            "/dev/video2 (another)");
  camera().open_error = EACCES;
  EXPECT_EQ(error_of_opening(),
            "/dev/video0: no permission to use this camera; add yourself to the group video (sudo "
            "usermod -aG video $USER) and log in again");
  camera().open_error = EBUSY;
  EXPECT_EQ(error_of_opening(), "/dev/video0: another program uses this camera; end it first");
  camera().open_error = 0;
  camera().capabilities = 0;
  EXPECT_EQ(error_of_opening(),
            "/dev/video0: found no video device, expected a camera; this computer has /dev/video2 (another)");
  camera().capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_EQ(error_of_opening(),
            "/dev/video0: found a video device that delivers no images, expected a camera; this "
            "computer has /dev/video2 (another)");
  EXPECT_EQ(camera().closed, camera().opened);
}

TEST_F(V4l2, SaysWhatACameraOffersInstead) {
  camera().modes = {{V4L2_PIX_FMT_YUYV, 640, 480, {30, 15}}, {V4L2_PIX_FMT_MJPEG, 1280, 720, {60}}};
  EXPECT_EQ(error_of_starting(request()),
            "/dev/video0: found YUYV 640x480 (30, 15 frames/s), MJPG 1280x720 (60 frames/s), expected 8x4, the "
            "resolution in the rig file");
  EXPECT_EQ(
      error_of_starting({.width = 640, .height = 480, .pixels = fourcc("MJPG")}),
      "/dev/video0: found YUYV 640x480 (30, 15 frames/s), MJPG 1280x720 (60 frames/s), expected MJPG 640x480, the "
      "resolution in the rig file");
  camera().modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {}}};
  camera().forced_width = 16;
  EXPECT_EQ(error_of_starting(request()),
            "/dev/video0: found GREY 16x4 from the driver, expected GREY 8x4, the resolution in the rig file");
}

TEST_F(V4l2, ACameraInUseIsSaidToBe) {
  camera().format_error = EBUSY;
  EXPECT_EQ(error_of_starting(request()), "/dev/video0: another program uses this camera; end it first");
  camera().format_error = 0;
  camera().memory_error = EBUSY;
  EXPECT_EQ(error_of_starting(request()), "/dev/video0: another program uses this camera; end it first");
  camera().memory_error = 0;
  camera().stream_error = ENOSPC;
  EXPECT_EQ(error_of_starting(request()),
            "/dev/video0: the USB port has no room for the images of this camera; use --pixels MJPG, a lower --fps or "
            "another port");
  EXPECT_EQ(camera().closed, camera().opened);
}

TEST_F(V4l2, ChoosesTheModeByItsRateAndTheWorkOfConversion) {
  camera().modes = {{V4L2_PIX_FMT_MJPEG, kWidth, kHeight, {60, 30}},
                    {V4L2_PIX_FMT_YUYV, kWidth, kHeight, {30, 10}},
                    {V4L2_PIX_FMT_H264, kWidth, kHeight, {120}}};
  const auto pixels_for = [&](std::optional<double> fps) {
    StreamRequest wanted = request();
    wanted.fps = fps;
    const auto stream = (*open_v4l2(calls_, kPath))->start(wanted);
    return stream ? fourcc_text(stream->pixels) : stream.error().message();
  };
  EXPECT_EQ(pixels_for({}), "MJPG");
  EXPECT_EQ(pixels_for(30), "YUYV");
  EXPECT_EQ(pixels_for(60), "MJPG");
  camera().modes = {{V4L2_PIX_FMT_YUYV, 0, 0, {}}};  // the driver does not tell its sizes
  EXPECT_EQ(pixels_for({}), "YUYV");
}

TEST_F(V4l2, TellsWhenItsRateDiffers) {
  StreamRequest wanted = request();
  wanted.fps = 20;
  auto set = (*open_v4l2(calls_, kPath))->start(wanted);
  ASSERT_TRUE(set.ok());
  EXPECT_TRUE(set->notes.empty());
  EXPECT_EQ(set->fps, 20);
  camera().set_fps = 15;
  camera().rate_can_be_set = false;
  set = (*open_v4l2(calls_, kPath))->start(wanted);
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->notes, std::vector<std::string>{"15 frames/s instead of 20"});
  EXPECT_EQ(set->identity, "test camera at usb-1");
  camera().rate_error = EINVAL;
  set = (*open_v4l2(calls_, kPath))->start(wanted);
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->fps, 15);
  EXPECT_EQ(set->notes, std::vector<std::string>{"15 frames/s instead of 20"});
}

TEST_F(V4l2, SetsTheHighestRateUpTo60Itself) {
  camera().modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {120, 60, 30}}};
  auto set = (*open_v4l2(calls_, kPath))->start(request());
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->fps, 60);
  camera().rate_error = EINVAL;
  camera().set_fps = 30;
  set = (*open_v4l2(calls_, kPath))->start(request());
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->fps, 30);
  EXPECT_TRUE(set->notes.empty());
}

TEST_F(V4l2, SetsTheExposure) {
  using Exposure = StreamRequest::Exposure;
  StreamRequest wanted = request();
  wanted.exposure = Exposure::kFixed;
  wanted.exposure_us = 8000;
  EXPECT_EQ(error_of_starting(wanted),
            "/dev/video0: --exposure: found a camera whose exposure cannot be set, expected no --exposure");
  camera().controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY}, {V4L2_CID_EXPOSURE_ABSOLUTE, 1}};
  EXPECT_EQ(error_of_starting(wanted), "");
  EXPECT_EQ(camera().controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera().controls[V4L2_CID_EXPOSURE_ABSOLUTE], 80);
  EXPECT_EQ(error_of_starting(request()), "");  // left as it is
  EXPECT_EQ(camera().controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  wanted.exposure = Exposure::kAutomatic;
  EXPECT_EQ(error_of_starting(wanted), "");
  EXPECT_EQ(camera().controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY);
  wanted.exposure = Exposure::kFixed;
  wanted.exposure_us = 600'000;
  EXPECT_EQ(error_of_starting(wanted), "/dev/video0: --exposure: found 600000 us, expected 100 to 500000 us");
}

TEST_F(V4l2, ListsTheDevices) {
  camera().modes.push_back({V4L2_PIX_FMT_H264, 1920, 1080, {60, 30}});
  calls_.cameras["/dev/video1"].capabilities = V4L2_CAP_META_CAPTURE;
  calls_.cameras["/dev/video2"].open_error = EACCES;
  EXPECT_EQ(
      devices_text(calls_),
      "/dev/video0: test camera\n  GREY 8x4 (30 frames/s)\n  H264 1920x1080 (60, 30 frames/s), which bslam does not "
      "read\n/dev/video1: test camera (delivers no images)\n/dev/video2: Permission denied\n");
}

TEST(VideoModes, ARangeOfRatesIsTold) {
  const VideoMode mode{.pixels = V4L2_PIX_FMT_GREY,
                       .width = 8,
                       .height = 4,
                       .min_width = 8,
                       .min_height = 4,
                       .fps = {120, 7.5},
                       .any_between = true};
  EXPECT_EQ(modes_text({mode}), "GREY 8x4 (7.5 to 120 frames/s)");
}

// ---- Pixels

std::string ramp(int count, int from = 0) {
  std::string out;
  for (int k = 0; k < count; ++k) out += static_cast<char>(from + 3 * k);
  return out;
}

// A row of pixels of this brightness, whose other bytes are 0x77.
std::string row_of(FourCc format, std::size_t step, int y) {
  std::string row(step, '\x77');
  for (int x = 0; x < kWidth; ++x) {
    const int value = 10 * y + 5 * x, bytes = bytes_per_pixel(format);
    if (bytes == 3) {
      for (int k = 0; k < 3; ++k) row[static_cast<std::size_t>(3 * x + k)] = static_cast<char>(value);
    } else if (format == fourcc("Y10 ") || format == fourcc("Y12 ")) {
      const int word = value << (format == fourcc("Y10 ") ? 2 : 4);
      row[static_cast<std::size_t>(2 * x)] = static_cast<char>(word & 255);
      row[static_cast<std::size_t>(2 * x + 1)] = static_cast<char>(word >> 8);
    } else {
      const bool second = format == fourcc("UYVY") || format == fourcc("Y16 ");
      row[static_cast<std::size_t>(bytes * x + (second ? 1 : 0))] = static_cast<char>(value);
    }
  }
  return row;
}

bool is_colour_filter(FourCc format) {
  return format == fourcc("RGGB") || format == fourcc("GRBG") || format == fourcc("GBRG") || format == fourcc("BA81");
}

TEST(Pixels, BrightnessOfEveryFormat) {
  constexpr std::size_t kStep = 32;
  for (const FourCc format : pixel_formats()) {
    if (is_jpeg(format) || is_colour_filter(format)) continue;
    std::string bytes;
    for (int y = 0; y < kHeight; ++y) bytes += row_of(format, kStep, y);
    if (format == fourcc("NV12")) bytes += std::string(kStep * kHeight / 2, '\x33');
    const Stream stream{.pixels = format, .width = kWidth, .height = kHeight, .step = kStep};
    const auto image = grey_image(stream, bytes);
    ASSERT_TRUE(image.has_value()) << fourcc_text(format);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) EXPECT_EQ(image->row(y)[x], 10 * y + 5 * x) << fourcc_text(format);
    }
    EXPECT_FALSE(grey_image(stream, bytes.substr(0, kStep * (kHeight - 1))).has_value()) << fourcc_text(format);
    EXPECT_FALSE(grey_image(stream, "").has_value()) << fourcc_text(format);
  }
}

TEST(Pixels, ColourFilters) {
  // A red scene: only the pixels with a red filter are bright, and its luminance is that of red.
  for (const auto& [format, red] : {std::pair(fourcc("RGGB"), 0), std::pair(fourcc("GRBG"), 1),
                                    std::pair(fourcc("GBRG"), 2), std::pair(fourcc("BA81"), 3)}) {
    std::string bytes(kWidth * kHeight, '\0');
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (2 * (y % 2) + x % 2 == red) bytes[static_cast<std::size_t>(y * kWidth + x)] = '\xc8';
      }
    }
    const Stream stream{.pixels = format, .width = kWidth, .height = kHeight, .step = kWidth};
    const auto image = grey_image(stream, bytes);
    ASSERT_TRUE(image.has_value()) << fourcc_text(format);
    EXPECT_NEAR(image->row(1)[3], 0.299 * 200, 2) << fourcc_text(format);
  }
}

// The tables of a JPEG, which the frames of many cameras lack.
std::string without_huffman_tables(std::string jpeg) {
  for (std::size_t at = jpeg.find("\xff\xc4"); at != std::string::npos; at = jpeg.find("\xff\xc4")) {
    const auto length = static_cast<std::size_t>(static_cast<unsigned char>(jpeg[at + 2]) * 256 +
                                                 static_cast<unsigned char>(jpeg[at + 3]));
    jpeg.erase(at, length + 2);
  }
  return jpeg;
}

TEST(Pixels, JpegAsCamerasDeliverIt) {
  cv::Mat picture(16, 32, CV_8UC1);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x) picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(5 * x + 3 * y);
  }
  std::vector<std::uint8_t> file;
  ASSERT_TRUE(cv::imencode(".jpg", picture, file, {cv::IMWRITE_JPEG_QUALITY, 100}));
  const std::string jpeg(file.begin(), file.end());
  const Stream stream{.pixels = fourcc("MJPG"), .width = 32, .height = 16, .step = 0};
  for (const std::string& bytes : {jpeg, jpeg + std::string(1000, '\0'), without_huffman_tables(jpeg)}) {
    const auto image = grey_image(stream, bytes);
    ASSERT_TRUE(image.has_value());
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 32; ++x) EXPECT_NEAR(image->row(y)[x], picture.at<std::uint8_t>(y, x), 3);
    }
  }
  EXPECT_LT(without_huffman_tables(jpeg).size(), jpeg.size());
  EXPECT_FALSE(grey_image(stream, jpeg.substr(0, jpeg.size() / 2)).has_value());
  EXPECT_FALSE(grey_image(stream, ramp(100)).has_value());
  const Stream other{.pixels = fourcc("MJPG"), .width = 16, .height = 16, .step = 0};
  EXPECT_FALSE(grey_image(other, jpeg).has_value());
}

}  // namespace
}  // namespace bslam::capture
