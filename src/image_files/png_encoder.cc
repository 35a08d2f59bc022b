#include "image_files/png_encoder.h"

#include <libdeflate.h>

#include <cstdint>
#include <memory>
#include <string_view>

#include "base/assert.h"
#include "image_files/png_decoder.h"

namespace bslam::image_files {
namespace {

// Big-endian.
std::string number(std::uint32_t value) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift);
  return out;
}

std::string chunk(std::string_view type, const std::string& data) {
  const std::string checked = std::string(type) + data;
  return number(static_cast<std::uint32_t>(data.size())) + checked +
         number(libdeflate_crc32(0, checked.data(), checked.size()));
}

std::string compressed(const std::string& bytes) {
  constexpr int kLevel = 6;
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  BSLAM_ASSERT(compressor, "there is memory for a compressor");
  std::string out(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size()));
  return out;
}

}  // namespace

std::string encode_grey_png(const image::Image& image) {
  std::string rows;
  for (int y = 0; y < image.height(); ++y) {
    rows += '\0';  // no filter
    rows.append(reinterpret_cast<const char*>(image.row(y)), static_cast<std::size_t>(image.width()));
  }
  const std::string header = number(static_cast<std::uint32_t>(image.width())) +
                             number(static_cast<std::uint32_t>(image.height())) +
                             std::string("\x08\0\0\0\0", 5);  // 8 bits, grey, no interlacing
  return std::string(kPngSignature) + chunk("IHDR", header) + chunk("IDAT", compressed(rows)) + chunk("IEND", "");
}

}  // namespace bslam::image_files
