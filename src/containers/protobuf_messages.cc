// Foxglove's messages in the wire format of protocol buffers: fields of a number, a type, and a value.
#include <algorithm>
#include <limits>
#include <utility>

#include "base/byte_reader.h"
#include "containers/messages.h"

namespace bslam::containers {
namespace {

constexpr std::size_t kMaxCoefficients = 1000;

struct Field {
  std::uint32_t number = 0;
  std::uint32_t wire = 0;   // 0 varint, 1 fixed 64 bits, 2 length-delimited bytes, 5 fixed 32 bits
  std::uint64_t value = 0;  // value of a fixed or varint field; number of bytes of a length-delimited field
  std::string_view bytes;   // bytes of a length-delimited field, as far as they are present
  std::uint64_t at = 0;     // offset of the bytes in the message
};

std::uint64_t varint(ByteReader& in) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const auto byte = in.number<std::uint8_t>();
    value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
    if ((byte & 0x80) == 0) return value;
  }
  in.skip(std::numeric_limits<std::uint64_t>::max());  // longer than 64 bits: damaged
  return 0;
}

// Returns the next field, or nullopt at the end or if it is damaged. The bytes of a field may be truncated.
std::optional<Field> next_field(ByteReader& in) {
  if (in.left() == 0) return std::nullopt;
  const std::uint64_t tag = varint(in);
  Field field{static_cast<std::uint32_t>(tag >> 3), static_cast<std::uint32_t>(tag & 7), 0, {}, 0};
  if (field.wire == 0) {
    field.value = varint(in);
  } else if (field.wire == 1) {
    field.value = in.number<std::uint64_t>();
  } else if (field.wire == 5) {
    field.value = in.number<std::uint32_t>();
  } else if (field.wire == 2) {
    field.value = varint(in);
    field.at = in.position();
    field.bytes = in.take(std::min<std::uint64_t>(field.value, in.left()));
  } else {
    return std::nullopt;
  }
  return in.ok() ? std::optional(field) : std::nullopt;
}

std::optional<TimeNs> parse_time(std::string_view message) {
  constexpr std::uint64_t kMaxSeconds = 9'000'000'000;
  std::uint64_t seconds = 0, nanoseconds = 0;
  ByteReader in(message);
  while (const auto field = next_field(in)) {
    if (field->number == 1) seconds = field->value;
    if (field->number == 2) nanoseconds = field->value;
  }
  if (!in.ok() || seconds > kMaxSeconds || nanoseconds > 1'000'000'000) return std::nullopt;
  return static_cast<TimeNs>(seconds * 1'000'000'000 + nanoseconds);
}

double real(std::uint64_t bits) { return std::bit_cast<double>(bits); }

// Adds a repeated number, packed or not.
void add_reals(const Field& field, std::vector<double>& out) {
  if (field.wire == 1 && out.size() < kMaxCoefficients) out.push_back(real(field.value));
  ByteReader in(field.bytes);
  while (field.wire == 2 && in.left() >= sizeof(double) && out.size() < kMaxCoefficients)
    out.push_back(in.number<double>());
}

template <std::size_t N>
bool copy(const std::vector<double>& from, std::array<double, N>& to) {
  if (from.empty()) return true;
  if (from.size() != N) return false;
  std::ranges::copy(from, to.begin());
  return true;
}

}  // namespace

std::optional<ImageMessage> parse_protobuf_image(bool compressed, std::string_view message) {
  // foxglove.RawImage: 1 timestamp, 2 width, 3 height, 4 encoding, 5 step, 6 data, 7 frame_id.
  // foxglove.CompressedImage: 1 timestamp, 2 data, 3 format, 4 frame_id.
  const std::uint32_t data = compressed ? 2 : 6, encoding = compressed ? 3 : 4, frame = compressed ? 4 : 7;
  ImageMessage out;
  out.compressed = compressed;
  std::optional<bool> valid_time;
  bool whole = true;
  ByteReader in(message);
  while (const auto field = next_field(in)) {
    if (field->number == 1 && field->wire == 2) {
      const auto time = parse_time(field->bytes);
      valid_time = time.has_value();
      out.stamp_ns = time.value_or(0);
    }
    if (field->number == encoding && field->wire == 2) out.encoding = field->bytes;
    if (field->number == frame && field->wire == 2) out.frame_id = field->bytes;
    if (field->number == data && field->wire == 2) {
      out.data_at = field->at;
      out.data_size = field->value;
    }
    whole &= field->wire != 2 || field->bytes.size() == field->value;
    if (compressed || field->wire != 5) continue;
    if (field->number == 2) out.width = static_cast<std::uint32_t>(field->value);
    if (field->number == 3) out.height = static_cast<std::uint32_t>(field->value);
    if (field->number == 5) out.step = static_cast<std::uint32_t>(field->value);
  }
  // Only a message that is complete tells that it has no time stamp.
  const bool good = in.ok() && valid_time.value_or(whole && out.data_at > 0);
  return good ? std::optional(std::move(out)) : std::nullopt;
}

std::optional<CameraInfo> parse_protobuf_calibration(std::string_view message) {
  // foxglove.CameraCalibration: 2 width, 3 height, 4 distortion_model, 5 D, 6 K, 7 R, 8 P, 9 frame_id.
  CameraInfo out;
  std::vector<double> K, R, P;
  ByteReader in(message);
  while (const auto field = next_field(in)) {
    if (field->number == 2) out.width = static_cast<std::uint32_t>(field->value);
    if (field->number == 3) out.height = static_cast<std::uint32_t>(field->value);
    if (field->number == 4) out.distortion_model = field->bytes;
    if (field->number == 5) add_reals(*field, out.distortion);
    if (field->number == 6) add_reals(*field, K);
    if (field->number == 7) add_reals(*field, R);
    if (field->number == 8) add_reals(*field, P);
    if (field->number == 9) out.frame_id = field->bytes;
  }
  const bool good = in.ok() && copy(K, out.K) && copy(R, out.R) && copy(P, out.P);
  return good ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace bslam::containers
