#include "containers/ros_writer.h"

#include <cstring>

namespace bslam::containers {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;

// Appends numbers, aligned to their size, and strings.
class CdrWriter {
 public:
  explicit CdrWriter(std::size_t bytes) { out_.reserve(bytes + 200), out_.append("\0\1\0\0", kStart); }

  template <class T>
  void number(T value) {
    while ((out_.size() - kStart) % sizeof(T) != 0) out_ += '\0';
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    out_.append(raw, sizeof(T));
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    out_ += value;
    out_ += '\0';
  }
  void header(TimeNs stamp_ns, std::string_view frame_id) {
    number(static_cast<std::int32_t>(stamp_ns / kSecond));
    number(static_cast<std::uint32_t>(stamp_ns % kSecond));
    text(frame_id);
  }
  void bytes(const char* data, std::size_t size) { out_.append(data, size); }
  std::string take() { return std::move(out_); }

 private:
  static constexpr std::size_t kStart = 4;  // bytes of representation before the message
  std::string out_;
};

constexpr const char* kHeaderDefinition =
    "\n================================================================================\n"
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

}  // namespace

std::string grey_image_message(TimeNs stamp_ns, std::string_view frame_id, int width, int height,
                               const std::uint8_t* data, std::ptrdiff_t stride) {
  const auto row = static_cast<std::size_t>(width);
  CdrWriter out(row * static_cast<std::size_t>(height));
  out.header(stamp_ns, frame_id);
  out.number(static_cast<std::uint32_t>(height));
  out.number(static_cast<std::uint32_t>(width));
  out.text("mono8");
  out.number(std::uint8_t{0});  // little-endian
  out.number(static_cast<std::uint32_t>(row));
  out.number(static_cast<std::uint32_t>(row * static_cast<std::size_t>(height)));
  for (int y = 0; y < height; ++y) out.bytes(reinterpret_cast<const char*>(data + y * stride), row);
  return out.take();
}

std::string jpeg_image_message(TimeNs stamp_ns, std::string_view frame_id, std::string_view file) {
  CdrWriter out(file.size());
  out.header(stamp_ns, frame_id);
  out.text("jpeg");
  out.number(static_cast<std::uint32_t>(file.size()));
  out.bytes(file.data(), file.size());
  return out.take();
}

std::string image_definition() {
  return std::string(
             "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
             "uint8[] data\n") +
         kHeaderDefinition;
}

std::string compressed_image_definition() {
  return std::string("std_msgs/Header header\nstring format\nuint8[] data\n") + kHeaderDefinition;
}

}  // namespace bslam::containers
