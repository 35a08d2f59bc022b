// PNM, BMP and TIFF images.
#include "decoded_image.h"

namespace bslam::fuzz {
namespace {

std::string little_endian(std::uint32_t value, int count) {
  std::string out;
  for (int k = 0; k < count; ++k) out += static_cast<char>(value >> 8 * k);
  return out;
}

std::string small_bmp(int bits) {
  const std::string palette(bits == 8 ? 1024 : 0, 'p');
  const auto begin = static_cast<std::uint32_t>(54 + palette.size());
  std::string bytes = "BM" + std::string(8, '\0') + little_endian(begin, 4) + little_endian(40, 4);
  bytes += little_endian(5, 4) + little_endian(3, 4) + little_endian(1, 2);
  bytes += little_endian(static_cast<std::uint32_t>(bits), 2) + std::string(24, '\0');
  return bytes + palette + std::string(80, 'x');
}

// 7 x 4 pixels in two strips, whose bytes are those of the compression as far as they go.
std::string small_tiff(std::uint32_t compression, std::uint32_t bits) {
  constexpr std::uint32_t kShort = 3, kLong = 4, kStrip = 64;
  const std::uint32_t fields[][3] = {
      {256, kShort, 7}, {257, kShort, 4}, {258, kShort, bits}, {259, kShort, compression},
      {262, kShort, 1}, {278, kShort, 2}, {317, kShort, 2}};
  std::string bytes = std::string("II*\0", 4) + little_endian(8, 4) + little_endian(9, 2);
  for (const auto& [tag, type, value] : fields)
    bytes += little_endian(tag, 2) + little_endian(type, 2) + little_endian(1, 4) + little_endian(value, 4);
  const auto lists = static_cast<std::uint32_t>(bytes.size()) + 28;
  bytes += little_endian(273, 2) + little_endian(kLong, 2) + little_endian(2, 4) + little_endian(lists, 4);
  bytes += little_endian(279, 2) + little_endian(kLong, 2) + little_endian(2, 4) + little_endian(lists + 8, 4);
  bytes += little_endian(0, 4) + little_endian(lists + 16, 4) + little_endian(lists + 16 + kStrip, 4);
  bytes += little_endian(kStrip, 4) + little_endian(kStrip, 4);
  for (std::uint32_t k = 0; k < 2 * kStrip; ++k) bytes += static_cast<char>(k % 11 == 0 ? 0x80 : 3 * k);
  return bytes;
}

}  // namespace

std::vector<std::string> seeds() {
  std::vector<std::string> out = {"P5\n# comment\n4 2\n255\nabcdefgh",
                                  "P5 2 2 4095\nabcdefgh",
                                  "P6 2 1 255\nabcdef",
                                  "P2 2 2 9\n1 2 3 9\n",
                                  small_bmp(8),
                                  small_bmp(24),
                                  small_bmp(32)};
  for (const std::uint32_t compression : {1U, 5U, 8U, 32773U}) {
    out.push_back(small_tiff(compression, 8));
    out.push_back(small_tiff(compression, 16));
  }
  return out;
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  check_decoded_image(as_text(data, size));
  return 0;
}
