// Temporary folders and small data sets for tests.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/timestamp.h"

namespace bslam::support {

// A new folder in the system's temporary folder; the destructor removes it with its content.
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

void write_text(const std::filesystem::path& file, std::string_view text);  // creates missing folders
std::string read_text(const std::filesystem::path& file);

// Writes an 8-bit grey image that depends on `seed`; the extension determines the format.
void write_image(const std::filesystem::path& file, int width, int height, int seed = 0);

constexpr int kSmallWidth = 32, kSmallHeight = 24;
constexpr int kSmallFrames = 24;
constexpr TimeNs kSmallStart = 1'000'000'000'000, kSmallInterval = 50'000'000;

// Returns the file name "TIME.png" of a frame of the small data set.
std::string small_image_name(int frame);

// Returns a sensor.yaml of the small data set: a pinhole camera without distortion, x metres to the right of the body.
std::string small_sensor_yaml(double x);

// Writes an EuRoC data set of `cameras` cameras with kSmallFrames images each to FOLDER/mav0.
void write_small_euroc(const std::filesystem::path& folder, int cameras = 2);

// Returns the data.csv of the small data set with the given frames.
std::string small_list(const std::vector<int>& frames);

// Path of a data set in ../shared/data, relative to the project; nullopt if it is not present.
std::optional<std::filesystem::path> shared_data(std::string_view name);

}  // namespace bslam::support
