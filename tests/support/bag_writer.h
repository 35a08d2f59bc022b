// Small bags and MCAP files for tests and as seeds of fuzzing: messages of cameras, and the files that contain them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/timestamp.h"

namespace bslam::support {

enum class Wire { kRos1, kCdr, kCdrBigEndian, kProtobuf };

struct TestImage {
  TimeNs stamp_ns = 0;
  std::uint32_t width = 0, height = 0, step = 0;
  std::string encoding;  // or the format of a compressed image
  std::string data;
  bool big_endian = false;
  std::string frame_id = "camera";
};

// sensor_msgs/Image or foxglove.RawImage.
std::string image_message(Wire wire, const TestImage& image);
// sensor_msgs/CompressedImage or foxglove.CompressedImage.
std::string compressed_image_message(Wire wire, const TestImage& image);

struct TestCalibration {
  std::uint32_t width = 0, height = 0;
  std::string model = "plumb_bob";
  std::vector<double> D, K, R, P;  // K, R: 9 numbers, P: 12
};

// sensor_msgs/CameraInfo or foxglove.CameraCalibration.
std::string calibration_message(Wire wire, const TestCalibration& calibration);

struct TestMessage {
  std::string topic, type;  // of ROS 1, such as sensor_msgs/Image
  TimeNs time_ns = 0;
  std::string bytes;
};

struct BagLayout {
  std::string compression = {};        // none, bz2, lz4 or zstd; MCAP has no bz2, ROS 1 bags no zstd
  std::size_t messages_per_chunk = 4;  // 0: no chunks (MCAP)
  bool index = true;
};

// Compressed as one stream: "bz2", "lz4" or "zstd"; any other name: as it is.
std::string compress(const std::string& name, const std::string& bytes);

std::string rosbag1_bytes(const std::vector<TestMessage>& messages, const BagLayout& layout = {});
// `wire` gives the serialisation; types become those of ROS 2 or Foxglove.
std::string mcap_bytes(const std::vector<TestMessage>& messages, Wire wire, const BagLayout& layout = {});
// With `zstd`, each message is compressed.
void write_sqlite_bag(const std::filesystem::path& file, const std::vector<TestMessage>& messages, bool zstd = false);

}  // namespace bslam::support
