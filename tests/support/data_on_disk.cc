#include "support/data_on_disk.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/random.h"

namespace bslam::support {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "bslam_test_XXXXXX").string();
  EXPECT_NE(::mkdtemp(pattern.data()), nullptr);
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

void write_text(const fs::path& file, std::string_view text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_image(const fs::path& file, int width, int height, int seed) {
  fs::create_directories(file.parent_path());
  Random random(static_cast<std::uint64_t>(seed));
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(4 * x + 2 * y + random.below(20));
  }
  ASSERT_TRUE(cv::imwrite(file.string(), image));
}

std::string small_image_name(int frame) { return std::to_string(kSmallStart + frame * kSmallInterval) + ".png"; }

std::string small_sensor_yaml(double x) {
  return "%YAML:1.0\nsensor_type: camera\ncomment: test\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, " +
         std::to_string(x) +
         ", 0, 1, 0, 0,\n         0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [32, 24]\ncamera_model: pinhole\n"
         "intrinsics: [20, 20, 15.5, 11.5] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n"
         "distortion_coefficients: [0, 0, 0, 0]\n";
}

std::string small_list(const std::vector<int>& frames) {
  std::string text = "#timestamp [ns],filename\n";
  for (const int k : frames)
    text += std::to_string(kSmallStart + k * kSmallInterval) + "," + small_image_name(k) + "\n";
  return text;
}

void write_small_euroc(const fs::path& folder, int cameras) {
  std::vector<int> frames;
  for (int k = 0; k < kSmallFrames; ++k) frames.push_back(k);
  for (int c = 0; c < cameras; ++c) {
    const fs::path camera = folder / "mav0" / ("cam" + std::to_string(c));
    write_text(camera / "sensor.yaml", small_sensor_yaml(0.1 * c));
    write_text(camera / "data.csv", small_list(frames));
    for (const int k : frames)
      write_image(camera / "data" / small_image_name(k), kSmallWidth, kSmallHeight, 100 * c + k);
  }
}

std::optional<fs::path> shared_data(std::string_view name) {
  const fs::path data = fs::path(BSLAM_SOURCE_DIR).parent_path() / "shared" / "data" / name;
  std::error_code error;
  return fs::is_directory(data, error) ? std::optional(data) : std::nullopt;
}

}  // namespace bslam::support
