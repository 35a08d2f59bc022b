// Images, read by our PNG decoder and the general decoder: unchanged inputs, and inputs with corrected checksums of PNG
// chunks.
#include <libdeflate.h>

#include "decoded_image.h"
#include "image_files/png_decoder.h"

namespace bslam::fuzz {
namespace {

void put_big_endian(std::string& bytes, std::size_t at, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (24 - 8 * i));
}

std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void repair(std::string& bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t length = big_endian(bytes, at);
    if (length > bytes.size() - at - 12) return;
    put_big_endian(bytes, at + 8 + length, libdeflate_crc32(0, bytes.data() + at + 4, length + 4));
    at += length + 12;
  }
}

void append_chunk(std::string& png, const std::string& type, const std::string& data) {
  const std::size_t at = png.size();
  png += std::string(4, '\0') + type + data + std::string(4, '\0');
  put_big_endian(png, at, static_cast<std::uint32_t>(data.size()));
}

// 8-bit pixels of `channels` each, rows with all five filters.
std::string small_png(int width, int height, int channels) {
  std::string rows;
  for (int y = 0; y < height; ++y) {
    rows += static_cast<char>(y % 5);
    for (int x = 0; x < width * channels; ++x) rows += static_cast<char>(31 * x + 7 * y);
  }
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(6);
  std::string packed(libdeflate_zlib_compress_bound(compressor, rows.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor, rows.data(), rows.size(), packed.data(), packed.size()));
  libdeflate_free_compressor(compressor);
  std::string header(13, '\0');
  put_big_endian(header, 0, static_cast<std::uint32_t>(width));
  put_big_endian(header, 4, static_cast<std::uint32_t>(height));
  header[8] = 8;
  header[9] = channels == 1 ? 0 : 2;
  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", packed.substr(0, packed.size() / 2));
  append_chunk(png, "IDAT", packed.substr(packed.size() / 2));
  append_chunk(png, "IEND", "");
  repair(png);
  return png;
}

}  // namespace

std::vector<std::string> seeds() { return {small_png(9, 7, 1), small_png(5, 6, 3), small_png(1, 1, 1)}; }

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  std::string bytes(as_text(data, size));
  check_decoded_image(bytes);
  repair(bytes);
  check_decoded_image(bytes);
  return 0;
}
