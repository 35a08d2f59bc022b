#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "dataset/recording_description.h"
#include "support/data_on_disk.h"
#include "video/video_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;
using image::ImageState;

constexpr int kWidth = 32, kHeight = 24, kFrames = 30;

int value(int camera, int frame, int x, int y) { return (7 * frame + 3 * x + 5 * y + 100 * camera) % 256; }

std::string big_endian(std::initializer_list<std::uint32_t> values, int bytes = 4) {
  std::string out;
  for (const std::uint32_t value : values) {
    for (int k = bytes - 1; k >= 0; --k) out += static_cast<char>(value >> 8 * k);
  }
  return out;
}

std::string atom(const std::string& name, const std::string& content) {
  return big_endian({static_cast<std::uint32_t>(content.size() + 8)}) + name + content;
}

// A table of an atom: version and flags, the number of entries, and the entries.
std::string table(const std::string& name, std::uint32_t count, std::initializer_list<std::uint32_t> entries) {
  return atom(name, big_endian({0, count}) + big_endian(entries));
}

// A QuickTime video of 20 images per second, of which an edit list hides the first `hidden`, as tools do that cut
// videos without encoding them again: only the first image is a key frame. Image k has the grey value 8 k.
std::string trimmed_video(std::uint32_t hidden) {
  constexpr std::uint32_t kCount = kFrames, kUnit = 1000, kInterval = 50;
  std::string media;
  std::string sizes = big_endian({0, 0, kCount});
  for (int k = 0; k < kFrames; ++k) {
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(8 * k)), jpeg);
    sizes += big_endian({static_cast<std::uint32_t>(jpeg.size())});
    media.append(jpeg.begin(), jpeg.end());
  }
  const std::string type = atom("ftyp", "qt  " + big_endian({0}) + "qt  ");
  const std::uint32_t shown = (kCount - hidden) * kInterval, begin = static_cast<std::uint32_t>(type.size()) + 8;
  const std::string matrix = big_endian({0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000});
  const std::string entry = atom("jpeg", big_endian({0, 1, 0, 0, 0, 0, kWidth << 16 | kHeight, 72 << 16, 72 << 16, 0}) +
                                             big_endian({1}, 2) + std::string(32, '\0') + big_endian({24, 0xffff}, 2));
  const std::string tables = atom("stsd", big_endian({0, 1}) + entry) + table("stts", 1, {kCount, kInterval}) +
                             table("stss", 1, {1}) + table("stsc", 1, {1, kCount, 1}) + atom("stsz", sizes) +
                             table("stco", 1, {begin});
  const std::string handler = atom("hdlr", big_endian({0}) + "mhlrvide" + std::string(13, '\0'));
  const std::string references = atom("dinf", atom("dref", big_endian({0, 1}) + atom("url ", big_endian({1}))));
  const std::string minf = atom("minf", atom("vmhd", big_endian({1, 0, 0})) + references + atom("stbl", tables));
  const std::string mdia =
      atom("mdia", atom("mdhd", big_endian({0, 0, 0, kUnit, kCount * kInterval, 0})) + handler + minf);
  const std::string track = atom(
      "tkhd", big_endian({15, 0, 0, 1, 0, shown, 0, 0, 0, 0}) + matrix + big_endian({kWidth << 16, kHeight << 16}));
  const std::string edits = atom("edts", table("elst", 1, {shown, hidden * kInterval, 0x10000}));
  const std::string movie = atom("mvhd", big_endian({0, 0, 0, kUnit, shown, 0x10000, 0x1000000, 0, 0}) + matrix +
                                             std::string(24, '\0') + big_endian({2}));
  return type + atom("mdat", media) + atom("moov", movie + atom("trak", track + edits + mdia));
}

// Uncompressed grey videos of 20 images per second, in the format YUV4MPEG2.
class Videos : public testing::Test {
 protected:
  void SetUp() override {
    if (video::ffmpeg_version().empty()) GTEST_SKIP() << "built without FFmpeg";
    std::string rig = "bslam_rig: 1\ncameras:\n";
    for (int c = 0; c < 2; ++c) {
      rig +=
          "  - name: cam" + std::to_string(c) +
          "\n    model: pinhole\n    resolution: [32, 24]\n    intrinsics: [20, 20, 15.5, 11.5]\n    T_body_cam: [[1, "
          "0, 0, 0." +
          std::to_string(c) + "], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
    }
    support::write_text(folder_.path() / "rig.yaml", rig);
  }

  fs::path file(const std::string& name) const { return folder_.path() / name; }
  // The images of `cameras` cameras, beginning with `first`, beside each other.
  std::string bytes(int first, int cameras = 1, int frames = kFrames) const {
    std::string out = "YUV4MPEG2 W" + std::to_string(cameras * kWidth) + " H24 F20:1 Ip A1:1 Cmono\n";
    for (int k = 0; k < frames; ++k) {
      out += "FRAME\n";
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < cameras * kWidth; ++x)
          out += static_cast<char>(value(first + x / kWidth, k, x % kWidth, y));
      }
    }
    return out;
  }
  DatasetRequest request(const std::string& files, bool side_by_side = false) const {
    return {.path = files, .rig_file = file("rig.yaml"), .side_by_side = side_by_side};
  }
  std::string pair() const { return file("left.y4m").string() + "," + file("right.y4m").string(); }

  static void expect_image(const image::CameraImage& image, int camera, int frame) {
    ASSERT_EQ(image.state, ImageState::kPresent);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) ASSERT_EQ(image.image.row(y)[x], value(camera, frame, x, y));
    }
  }

  support::TemporaryFolder folder_;
};

TEST_F(Videos, OnePerCameraIsRead) {
  support::write_text(file("left.y4m"), bytes(0));
  support::write_text(file("right.y4m"), bytes(1));
  const auto dataset = open_dataset(request(pair()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->format, DatasetFormat::kVideo);
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kFrames));
  // Forwards, backwards and with jumps.
  for (const int k : {0, 1, 2, 3, 10, 29, 28, 5, 6, 7, 0}) {
    const image::ImageBundle frame = read_frame(*dataset, static_cast<std::size_t>(k));
    EXPECT_EQ(frame.time_ns, k * 50'000'000);
    for (int c = 0; c < 2; ++c) expect_image(frame.images[static_cast<std::size_t>(c)], c, k);
  }
}

TEST_F(Videos, SideBySideIsTwoCameras) {
  support::write_text(file("both.y4m"), bytes(0, 2));
  const auto dataset = open_dataset(request(file("both.y4m"), true));
  ASSERT_TRUE(dataset) << dataset.error().message();
  const image::ImageBundle frame = read_frame(*dataset, 12);
  expect_image(frame.images[0], 0, 12);
  expect_image(frame.images[1], 1, 12);
  EXPECT_EQ(describe_recording(request(file("both.y4m"), true))->streams[1].width, kWidth);
}

TEST_F(Videos, OtherLengthsAreAWarning) {
  support::write_text(file("left.y4m"), bytes(0));
  support::write_text(file("right.y4m"), bytes(1, 1, 20));
  const auto dataset = open_dataset(request(pair()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kFrames));
  ASSERT_FALSE(dataset->warnings.empty());
  EXPECT_NE(dataset->warnings[0].find("has 20 images but"), std::string::npos) << dataset->warnings[0];
  EXPECT_EQ(read_frame(*dataset, 25).images[1].state, ImageState::kMissing);
}

TEST_F(Videos, BeginWithTheFirstImageThatIsShown) {
  support::write_text(file("left.mov"), trimmed_video(7));
  support::write_text(file("right.mov"), trimmed_video(2));
  for (const auto& [name, hidden] : {std::pair("left.mov", 7), {"right.mov", 2}}) {
    DatasetRequest one = request(file(name));
    one.cameras = {0};
    const auto dataset = open_dataset(one);
    ASSERT_TRUE(dataset) << dataset.error().message();
    ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(kFrames - hidden));
    for (const std::size_t k : {0, 1, 20, 5, 0}) {
      const image::ImageBundle frame = read_frame(*dataset, k);
      EXPECT_EQ(frame.time_ns, static_cast<TimeNs>(k) * 50'000'000);
      ASSERT_EQ(frame.images[0].state, ImageState::kPresent) << name << ", image " << k;
      EXPECT_NEAR(frame.images[0].image.row(5)[5], 8 * (static_cast<int>(k) + hidden), 2) << name << ", image " << k;
    }
  }
}

TEST_F(Videos, ACutVideoIsReadAsFarAsItGoes) {
  const std::string whole = bytes(0);
  support::write_text(file("left.y4m"), whole.substr(0, whole.size() / 2 + 17));
  support::write_text(file("right.y4m"), bytes(1));
  const auto dataset = open_dataset(request(pair()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  expect_image(read_frame(*dataset, 10).images[0], 0, 10);
  ASSERT_FALSE(dataset->warnings.empty());
}

TEST_F(Videos, ErrorsNameTheFile) {
  support::write_text(file("left.y4m"), "no video");
  const auto other = open_dataset(request(file("left.y4m")));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().file, file("left.y4m").string());
  EXPECT_NE(other.error().message().find("no video that FFmpeg can read (Invalid "), std::string::npos)
      << other.error().message();
  EXPECT_EQ(open_dataset(request(pair())).error().file, file("right.y4m").string());
  const std::string twice = file("left.y4m").string() + "," + file("left.y4m").string();
  EXPECT_NE(open_dataset(request(twice)).error().message().find("twice"), std::string::npos);
  support::write_text(file("left.y4m"), bytes(0));
  EXPECT_NE(open_dataset({.path = file("left.y4m")}).error().message().find("--rig"), std::string::npos);
}

}  // namespace
}  // namespace bslam::dataset
