// Messages of ROS 1, whose fields follow each other, and of ROS 2, whose numbers are aligned to their size (CDR, OMG
// document formal/02-06-51, section 15.3).
#include <algorithm>

#include "base/byte_reader.h"
#include "containers/messages.h"

namespace bslam::containers {
namespace {

constexpr TimeNs kMaxSeconds = 9'000'000'000;
constexpr std::uint32_t kMaxCoefficients = 1000;

class RosReader {
 public:
  // `message` without the four bytes of representation that precede CDR.
  RosReader(bool cdr, std::endian order, std::string_view message) : cdr_(cdr), in_(message, order) {}

  template <class T>
  T number() {
    if (cdr_) in_.align(sizeof(T), 0);
    return in_.number<T>();
  }
  std::string string() {
    const std::string_view bytes = in_.take(number<std::uint32_t>());
    return std::string(cdr_ && bytes.ends_with('\0') ? bytes.substr(0, bytes.size() - 1) : bytes);
  }
  void header(TimeNs& stamp_ns, std::string& frame_id) {
    if (!cdr_) number<std::uint32_t>();  // sequence number
    // ROS 1 has no negative seconds, and ROS 2 none after 2038.
    const TimeNs seconds = cdr_ ? number<std::int32_t>() : static_cast<TimeNs>(number<std::uint32_t>());
    stamp_ns = std::clamp(seconds, -kMaxSeconds, kMaxSeconds) * 1'000'000'000 + number<std::uint32_t>();
    frame_id = string();
  }
  template <std::size_t N>
  void numbers(std::array<double, N>& out) {
    for (double& value : out) value = number<double>();
  }
  const ByteReader& bytes() const { return in_; }

 private:
  bool cdr_;
  ByteReader in_;
};

constexpr std::size_t kRepresentation = 4;  // bytes before CDR

// Plain CDR only, of either byte order.
std::optional<RosReader> reader(bool cdr, std::string_view message) {
  if (!cdr) return RosReader(false, std::endian::little, message);
  if (message.size() < kRepresentation || message[0] != 0 || message[1] < 0 || message[1] > 1) return std::nullopt;
  return RosReader(true, message[1] == 1 ? std::endian::little : std::endian::big, message.substr(kRepresentation));
}

}  // namespace

std::optional<ImageMessage> parse_ros_image(bool cdr, bool compressed, std::string_view message) {
  auto in = reader(cdr, message);
  if (!in) return std::nullopt;
  ImageMessage out;
  out.compressed = compressed;
  in->header(out.stamp_ns, out.frame_id);
  if (!compressed) {
    out.height = in->number<std::uint32_t>();
    out.width = in->number<std::uint32_t>();
  }
  out.encoding = in->string();
  if (!compressed) {
    out.big_endian = in->number<std::uint8_t>() != 0;
    out.step = in->number<std::uint32_t>();
  }
  out.data_size = in->number<std::uint32_t>();
  out.data_at = in->bytes().position() + (cdr ? kRepresentation : 0);
  return in->bytes().ok() ? std::optional(std::move(out)) : std::nullopt;
}

std::optional<CameraInfo> parse_ros_camera_info(bool cdr, std::string_view message) {
  auto in = reader(cdr, message);
  if (!in) return std::nullopt;
  CameraInfo out;
  TimeNs stamp_ns = 0;
  in->header(stamp_ns, out.frame_id);
  out.height = in->number<std::uint32_t>();
  out.width = in->number<std::uint32_t>();
  out.distortion_model = in->string();
  const auto count = in->number<std::uint32_t>();
  if (count > kMaxCoefficients) return std::nullopt;
  for (std::uint32_t k = 0; k < count; ++k) out.distortion.push_back(in->number<double>());
  in->numbers(out.K);
  in->numbers(out.R);
  in->numbers(out.P);
  out.binning_x = in->number<std::uint32_t>();
  out.binning_y = in->number<std::uint32_t>();
  out.roi_x = in->number<std::uint32_t>();
  out.roi_y = in->number<std::uint32_t>();
  out.roi_height = in->number<std::uint32_t>();
  out.roi_width = in->number<std::uint32_t>();
  return in->bytes().ok() ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace bslam::containers
