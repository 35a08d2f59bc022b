#include "session/report_arrays.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace bslam::session {

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kDigits[(group >> (18U - 6U * static_cast<unsigned>(k))) & 63U];
  }
  return text;
}

std::size_t report_stride(std::size_t count, std::size_t limit) {
  return std::max<std::size_t>(1, (count + limit - 1) / limit);
}

nlohmann::ordered_json float_array(std::span<const float> values) {
  static_assert(std::endian::native == std::endian::little);
  nlohmann::ordered_json json;
  json["f32"] = base64({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  return json;
}

}  // namespace bslam::session
