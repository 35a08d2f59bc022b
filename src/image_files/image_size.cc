#include "image_files/image_size.h"

#include <cstddef>

namespace bslam::image_files {
namespace {

constexpr int kMaxHeaderSidePx = 1 << 20;

// Reads a big-endian number of `count` bytes.
int number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  unsigned value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return static_cast<int>(value);
}

std::optional<ImageSize> sensible(int width, int height) {
  if (width < 1 || height < 1 || width > kMaxHeaderSidePx || height > kMaxHeaderSidePx) return std::nullopt;
  return ImageSize{width, height};
}

std::optional<ImageSize> png_size(std::string_view bytes) {
  if (bytes.size() < 24 || bytes.substr(12, 4) != "IHDR") return std::nullopt;
  return sensible(number_at(bytes, 16, 4), number_at(bytes, 20, 4));
}

// Start-of-frame markers: 0xC0 to 0xCF except Huffman tables (C4), JPG (C8) and arithmetic conditioning (CC).
bool starts_frame(unsigned char marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

std::optional<ImageSize> jpeg_size(std::string_view bytes) {
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    if (bytes[at] != '\xff') return std::nullopt;
    const auto marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xff) {  // a fill byte
      ++at;
      continue;
    }
    const auto length = static_cast<std::size_t>(number_at(bytes, at + 2, 2));
    if (length < 2 || marker == 0xd9 || marker == 0xda) return std::nullopt;
    if (starts_frame(marker)) {
      if (at + 9 > bytes.size()) return std::nullopt;
      return sensible(number_at(bytes, at + 7, 2), number_at(bytes, at + 5, 2));
    }
    at += 2 + length;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ImageSize> image_size(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return png_size(bytes);
  if (bytes.starts_with("\xff\xd8")) return jpeg_size(bytes);
  return std::nullopt;
}

}  // namespace bslam::image_files
