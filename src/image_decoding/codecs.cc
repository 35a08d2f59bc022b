#include "image_decoding/codecs.h"

#include <png.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include <csetjmp>
#include <cstring>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "image_decoding/jpeg_warnings.h"

namespace bslam::image_decoding {
namespace {

const unsigned char* data(std::string_view bytes) { return reinterpret_cast<const unsigned char*>(bytes.data()); }

void read_png(png_structp png, png_bytep to, std::size_t count) {
  auto& rest = *static_cast<std::string_view*>(png_get_io_ptr(png));
  if (count > rest.size()) png_error(png, "truncated");
  std::memcpy(to, rest.data(), count);
  rest.remove_prefix(count);
}

// Leaves the libpng function in which the error occurred.
void leave(png_structp png, png_const_charp) { std::longjmp(*static_cast<std::jmp_buf*>(png_get_error_ptr(png)), 1); }

// A decoder and its buffers, which are also released after an error.
struct PngReader {
  PngReader(std::string_view bytes, OfColours of_colours)
      : rest(bytes),
        kept(of_colours),
        png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &on_error, leave, [](png_structp, auto) {})) {
    if (png) info = png_create_info_struct(png);
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  std::string_view rest;
  OfColours kept;
  std::jmp_buf on_error;
  png_structp png;
  png_infop info = nullptr;
  cv::Mat image;
  std::vector<png_bytep> rows;
};

// Reads the header, asks for luminance or colours, and reserves the image. Returns false if the size is impossible.
bool prepare(PngReader& r) {
  png_set_read_fn(r.png, &r.rest, read_png);
  png_read_info(r.png, r.info);
  const png_uint_32 width = png_get_image_width(r.png, r.info), height = png_get_image_height(r.png, r.info);
  if (std::uint64_t{width} * height > kMaxPixels) return false;
  const int depth = png_get_bit_depth(r.png, r.info), colour = png_get_color_type(r.png, r.info);
  if (colour == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(r.png);
  if (colour == PNG_COLOR_TYPE_GRAY && depth < 8) png_set_expand_gray_1_2_4_to_8(r.png);
  if (depth == 16) png_set_swap(r.png);  // little-endian
  png_set_gamma(r.png, 1.0, 1.0);        // colours are weighed as they are stored, whatever gamma the file declares
  png_set_strip_alpha(r.png);
  const bool colours = (colour & PNG_COLOR_MASK_COLOR) != 0, grey = !colours || r.kept == OfColours::kLuminance;
  if (colours && grey) png_set_rgb_to_gray(r.png, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
  png_set_interlace_handling(r.png);
  png_read_update_info(r.png, r.info);
  r.image.create(static_cast<int>(height), static_cast<int>(width),
                 CV_MAKETYPE(depth == 16 ? CV_16U : CV_8U, grey ? 1 : 3));
  for (int y = 0; y < r.image.rows; ++y) r.rows.push_back(r.image.ptr<png_byte>(y));
  return png_get_rowbytes(r.png, r.info) == r.image.step;
}

// Returns false after an error.
bool decode(PngReader& reader) {
  if (setjmp(reader.on_error)) return false;
  if (!prepare(reader)) return false;
  png_read_image(reader.png, reader.rows.data());
  return true;
}

cv::Mat decode_png(std::string_view bytes, OfColours kept) {
  PngReader reader(bytes, kept);
  return reader.info && decode(reader) ? one_channel(reader.image, kept) : cv::Mat();
}

cv::Mat decode_jpeg(std::string_view bytes, OfColours kept) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (!decoder ||
      tjDecompressHeader3(decoder.get(), data(bytes), bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return {};
  if (static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) > kMaxPixels) return {};
  const bool grey = kept == OfColours::kLuminance || colours == TJCS_GRAY;
  cv::Mat image(height, width, grey ? CV_8UC1 : CV_8UC3);
  const int failed = tjDecompress2(decoder.get(), data(bytes), bytes.size(), image.data, width,
                                   static_cast<int>(image.step), height, grey ? TJPF_GRAY : TJPF_BGR, 0);
  return failed == 0 || is_usable(decoder.get()) ? one_channel(image, kept) : cv::Mat();
}

cv::Mat decode_webp(std::string_view bytes, OfColours kept) {
  int width = 0, height = 0;
  if (!WebPGetInfo(data(bytes), bytes.size(), &width, &height)) return {};
  cv::Mat colours(height, width, CV_8UC3);
  if (!WebPDecodeBGRInto(data(bytes), bytes.size(), colours.data, colours.total() * 3, static_cast<int>(colours.step)))
    return {};
  return one_channel(colours, kept);
}

bool jpeg_has_colours(std::string_view bytes) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  int width = 0, height = 0, subsampling = 0, colours = 0;
  return decoder &&
         tjDecompressHeader3(decoder.get(), data(bytes), bytes.size(), &width, &height, &subsampling, &colours) == 0 &&
         colours != TJCS_GRAY;
}

}  // namespace

bool has_colours(std::string_view bytes) {
  constexpr std::size_t kColourType = 25;  // its position in a PNG
  if (bytes.starts_with("\x89PNG"))
    return bytes.size() > kColourType && (static_cast<unsigned char>(bytes[kColourType]) & PNG_COLOR_MASK_COLOR) != 0;
  if (bytes.starts_with("\xff\xd8")) return jpeg_has_colours(bytes);
  return bytes.starts_with("RIFF") || plain_file_has_colours(bytes);
}

cv::Mat decode_to_grey(std::string_view bytes, OfColours kept) {
  try {
    if (bytes.starts_with("\x89PNG")) return decode_png(bytes, kept);
    if (bytes.starts_with("\xff\xd8")) return decode_jpeg(bytes, kept);
    if (bytes.starts_with("RIFF")) return decode_webp(bytes, kept);
    return decode_plain_file(bytes, kept);
  } catch (const cv::Exception&) {  // no memory for the size in the header: the file is damaged
  }
  return {};
}

}  // namespace bslam::image_decoding
