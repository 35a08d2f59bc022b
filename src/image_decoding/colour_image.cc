#include "image_decoding/colour_image.h"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "base/atomic_file.h"
#include "image_decoding/image_file.h"
#include "image_decoding/jpeg_warnings.h"

namespace bslam::image_decoding {
namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{1} << 30;
constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;

// The grey values in all three channels.
cv::Mat from_grey(const image::Image& grey) {
  cv::Mat out(grey.height(), grey.width(), CV_8UC3);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) out.at<cv::Vec3b>(y, x) = cv::Vec3b::all(grey.row(y)[x]);
  }
  return out;
}

// Returns an empty matrix for files without colours, with 16 bits, or that are damaged.
cv::Mat colours_of_png(std::string_view bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  cv::Mat out;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) && (png.format & PNG_FORMAT_FLAG_COLOR) &&
      !(png.format & PNG_FORMAT_FLAG_LINEAR) && std::uint64_t{png.width} * png.height <= kMaxPixels) {
    const bool alpha = png.format & PNG_FORMAT_FLAG_ALPHA;
    png.format = PNG_FORMAT_RGB;
    const png_color black{0, 0, 0};
    out.create(static_cast<int>(png.height), static_cast<int>(png.width), CV_8UC3);
    if (!png_image_finish_read(&png, alpha ? &black : nullptr, out.data, static_cast<png_int_32>(out.step), nullptr))
      out.release();
  }
  png_image_free(&png);
  return out;
}

cv::Mat colours_of_jpeg(std::string_view bytes) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (!decoder || tjDecompressHeader3(decoder.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return {};
  if (colours == TJCS_GRAY || static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) > kMaxPixels)
    return {};
  cv::Mat out(height, width, CV_8UC3);
  const int failed = tjDecompress2(decoder.get(), data, bytes.size(), out.data, width, static_cast<int>(out.step),
                                   height, TJPF_RGB, 0);
  return failed == 0 || is_usable(decoder.get()) ? out : cv::Mat();
}

cv::Mat colours_of_file(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return colours_of_png(bytes);
  return bytes.starts_with("\xff\xd8") ? colours_of_jpeg(bytes) : cv::Mat();
}

// Converts pixels to RGB. The image must have been checked by read_image.
cv::Mat colours_of_pixels(const image_files::StoredImage& stored) {
  using enum image_files::PixelLayout;
  const auto code = stored.layout == kRgb    ? -1
                    : stored.layout == kBgr  ? cv::COLOR_BGR2RGB
                    : stored.layout == kRgba ? cv::COLOR_RGBA2RGB
                                             : cv::COLOR_BGRA2RGB;
  const int type = stored.layout == kRgb || stored.layout == kBgr ? CV_8UC3 : CV_8UC4;
  std::string bytes = stored.bytes.substr(stored.begin, stored.size);
  const cv::Mat pixels(stored.height, stored.width, type, bytes.data(), stored.step);
  if (code < 0) return pixels.clone();
  cv::Mat out;
  cv::cvtColor(pixels, out, code);
  return out;
}

// Returns the RGB image of an image in a recording; empty if the image has no colours or a layout that is read as grey
// values only.
cv::Mat colours_of_stored(const image_files::StoredImage& stored) {
  using enum image_files::PixelLayout;
  const std::string_view bytes = std::string_view(stored.bytes).substr(stored.begin, stored.size);
  if (stored.layout == kFile) return colours_of_file(bytes);
  const bool channels =
      stored.layout == kRgb || stored.layout == kBgr || stored.layout == kRgba || stored.layout == kBgra;
  return channels && stored.bytes_per_value == 1 ? colours_of_pixels(stored) : cv::Mat();
}

}  // namespace

Result<cv::Mat> read_colours(const image_files::ImageFile& image, const PixelFormat& format) {
  const auto grey = read_image(image, format);  // read_image also checks that the image is complete
  if (!grey) return grey.error();
  cv::Mat colours;
  if (image.store) {
    const auto stored = image.store->read(image.entry);
    if (!stored) return stored.error();
    colours = colours_of_stored(*stored);
  } else {
    const auto bytes = read_file(image.path, kMaxImageBytes);
    if (!bytes) return bytes.error();
    colours = colours_of_file(*bytes);
  }
  return colours.cols == grey->width() && colours.rows == grey->height() ? colours : from_grey(*grey);
}

cv::Vec3f colour_at(const cv::Mat& image, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(image.cols - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(image.rows - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.cols - 1), y1 = std::min(y0 + 1, image.rows - 1);
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0);
  const auto at = [&](int column, int row) { return cv::Vec3f(image.at<cv::Vec3b>(row, column)); };
  return (1 - v) * ((1 - u) * at(x0, y0) + u * at(x1, y0)) + v * ((1 - u) * at(x0, y1) + u * at(x1, y1));
}

std::string encode_png(const cv::Mat& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.cols);
  png.height = static_cast<png_uint_32>(image.rows);
  png.format = image.channels() == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png.flags = PNG_IMAGE_FLAG_FAST;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = bytes.size();
  const bool written =
      png_image_write_to_memory(&png, bytes.data(), &size, 0, image.data, static_cast<png_int_32>(image.step), nullptr);
  bytes.resize(written ? size : 0);
  return bytes;
}

}  // namespace bslam::image_decoding
