#include "containers/message_file.h"

#include <algorithm>
#include <array>

#include "containers/compression.h"
#include "containers/input_file.h"

namespace bslam::containers {

void MessageFile::count_message(std::uint32_t topic, TimeNs received_ns, std::uint32_t chunk, std::uint64_t at) {
  Topic& of = topics_.at(topic);
  of.first_ns = of.count == 0 ? received_ns : std::min(of.first_ns, received_ns);
  of.last_ns = of.count == 0 ? received_ns : std::max(of.last_ns, received_ns);
  ++of.count;
  if (is_needed(of.type)) messages_.push_back({received_ns, at, chunk, topic});
}

bool MessageFile::is_compressed_message(std::string_view bytes) { return bytes.starts_with("\x28\xb5\x2f\xfd"); }

std::string MessageFile::decompressed_message(std::string_view whole, std::size_t max_bytes) {
  return decompress(Compression::kZstd, whole, std::min(max_bytes, kMaxMessageBytes));
}

MessageFileResult open_message_file(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file) return file.error();
  const std::string start = file->read(0, 16);
  if (start.starts_with("#ROSBAG V")) return open_rosbag1(path);
  if (start.starts_with("\x89MCAP")) return open_mcap(path);
  if (start.starts_with("SQLite format 3")) return open_sqlite_bag(path);
  if (start.starts_with("\x28\xb5\x2f\xfd")) {  // zstd
    return Error{path.string(), "", "a compressed file", "a bag, MCAP or SQLite file",
                 path.string() + ": the whole file is compressed; decompress it with zstd -d"};
  }
  return Error{path.string(), "", start.empty() ? "an empty file" : "a file of another format",
               "a ROS 1 bag (.bag), a ROS 2 bag (.db3, .mcap) or an MCAP file"};
}

bool has_message_file_name(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  constexpr std::array<std::string_view, 6> kEnds{".bag", ".db3", ".mcap", ".bag.active", ".db3.zstd", ".mcap.zstd"};
  return std::ranges::any_of(kEnds, [&](std::string_view end) { return name.ends_with(end); });
}

bool is_needed(std::string_view type) {
  constexpr std::array<std::string_view, 6> kTypes{"sensor_msgs/Image",        "sensor_msgs/CompressedImage",
                                                   "sensor_msgs/CameraInfo",   "foxglove/RawImage",
                                                   "foxglove/CompressedImage", "foxglove/CameraCalibration"};
  return std::ranges::find(kTypes, type) != kTypes.end();
}

std::string plain_type(std::string_view type) {
  std::string plain(type);
  if (const std::size_t msg = plain.find("/msg/"); msg != std::string::npos) plain.erase(msg, 4);
  if (plain.find('/') == std::string::npos) {
    if (const std::size_t dot = plain.rfind('.'); dot != std::string::npos) plain[dot] = '/';
  }
  return plain;
}

}  // namespace bslam::containers
