// Folders and small data sets made for a test and removed after it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/timestamp.h"

namespace bslam::support {

// A folder of its own under the system's temporary folder, removed with all its content.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void write_text(const std::filesystem::path& file, std::string_view text);  // makes the folders
std::string read_text(const std::filesystem::path& file);

// An 8-bit grey picture that depends on `seed`; the format follows from the extension.
void write_picture(const std::filesystem::path& file, int width, int height, int seed = 0);

constexpr int kSmallWidth = 32, kSmallHeight = 24;
constexpr int kSmallFrames = 24;
constexpr TimeNs kSmallStart = 1'000'000'000'000, kSmallInterval = 50'000'000;

// "TIME.png" of frame k in a small data set.
std::string small_image_name(int frame);

// A sensor.yaml of the small data set: pinhole without distortion at x metres to the right of the body.
std::string small_sensor_yaml(double x);

// An EuRoC data set of `cameras` cameras with kSmallFrames pictures each, at FOLDER/mav0.
void write_small_euroc(const std::filesystem::path& folder, int cameras = 2);

// Its data.csv of these frames.
std::string small_list(const std::vector<int>& frames);

// A data set of ../shared/data beside the project, where it is present.
std::optional<std::filesystem::path> shared_data(std::string_view name);

}  // namespace bslam::support
