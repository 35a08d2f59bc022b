#include "image_decoding/pixel_rows.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/max_image_side.h"

namespace bslam::image_decoding {
namespace {

using image_files::PixelLayout;
using image_files::StoredImage;

// Values from one pixel to the next.
int channels_of(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::kRgb:
    case PixelLayout::kBgr:
      return 3;
    case PixelLayout::kRgba:
    case PixelLayout::kBgra:
      return 4;
    case PixelLayout::kUyvy:
    case PixelLayout::kYuyv:
      return 2;
    default:
      return 1;
  }
}

int colour_conversion(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::kRgb:
      return cv::COLOR_RGB2GRAY;
    case PixelLayout::kBgr:
      return cv::COLOR_BGR2GRAY;
    case PixelLayout::kRgba:
      return cv::COLOR_RGBA2GRAY;
    default:
      return cv::COLOR_BGRA2GRAY;
  }
}

bool fits(const StoredImage& image) {
  if (image.width < 1 || image.height < 1 || image.width > kMaxImageSidePx || image.height > kMaxImageSidePx)
    return false;
  const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.bytes_per_value) *
                          static_cast<std::size_t>(channels_of(image.layout));
  if (image.begin > image.bytes.size() || image.size > image.bytes.size() - image.begin) return false;
  if (image.step < row || image.size < row) return false;
  // The last row may be shorter than a step.
  return image.step <= (image.size - row) / std::max<std::size_t>(1, static_cast<std::size_t>(image.height) - 1) ||
         image.height == 1;
}

const std::uint8_t* row_of(const StoredImage& image, int y) {
  return reinterpret_cast<const std::uint8_t*>(image.bytes.data()) + image.begin +
         static_cast<std::size_t>(y) * image.step;
}

std::uint16_t value_at(const std::uint8_t* row, int index, bool big_endian) {
  const int low = 2 * index + (big_endian ? 1 : 0), high = 2 * index + (big_endian ? 0 : 1);
  return static_cast<std::uint16_t>(row[low] | row[high] << 8);
}

// The brightness of a row of two-byte values, with the same weights of the colours as for one-byte values.
void grey_of_words(const StoredImage& image, int y, int bits, std::uint8_t* out) {
  const int channels = channels_of(image.layout), shift = bits - 8;
  const std::uint8_t* row = row_of(image, y);
  const bool blue_first = image.layout == PixelLayout::kBgr || image.layout == PixelLayout::kBgra;
  for (int x = 0; x < image.width; ++x) {
    std::uint32_t value = value_at(row, x * channels, image.big_endian);
    if (channels >= 3) {  // the weights of 8-bit images
      const std::uint32_t green = value_at(row, x * channels + 1, image.big_endian);
      const std::uint32_t last = value_at(row, x * channels + 2, image.big_endian);
      value = (299 * (blue_first ? last : value) + 587 * green + 114 * (blue_first ? value : last) + 500) / 1000;
    }
    out[x] = static_cast<std::uint8_t>(std::min<std::uint32_t>(value >> shift, 255));
  }
}

}  // namespace

std::optional<image::Image> grey_of_rows(const StoredImage& image, int bits) {
  if (!fits(image)) return std::nullopt;
  image::Image grey(image.width, image.height);
  const int channels = channels_of(image.layout);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = row_of(image, y);
    if (image.bytes_per_value == 2) {
      grey_of_words(image, y, bits, grey.row(y));
    } else if (channels == 1) {
      std::copy_n(row, image.width, grey.row(y));
    } else if (channels == 2) {
      const int first = image.layout == PixelLayout::kUyvy ? 1 : 0;
      for (int x = 0; x < image.width; ++x) grey.row(y)[x] = row[2 * x + first];
    } else {
      const cv::Mat colours(1, image.width, CV_MAKETYPE(CV_8U, channels), const_cast<std::uint8_t*>(row));
      cv::Mat out(1, image.width, CV_8UC1, grey.row(y));
      cv::cvtColor(colours, out, colour_conversion(image.layout));
    }
  }
  return grey;
}

std::uint16_t largest_value(const StoredImage& image) {
  if (!fits(image) || image.bytes_per_value != 2) return 0;
  std::uint16_t largest = 0;
  const int values = image.width * channels_of(image.layout);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < values; ++x) largest = std::max(largest, value_at(row_of(image, y), x, image.big_endian));
  }
  return largest;
}

Bayer filter_of(PixelLayout layout, std::optional<Bayer> chosen) {
  switch (layout) {
    case PixelLayout::kRggb:
      return chosen.value_or(Bayer::kRggb);
    case PixelLayout::kBggr:
      return chosen.value_or(Bayer::kBggr);
    case PixelLayout::kGrbg:
      return chosen.value_or(Bayer::kGrbg);
    case PixelLayout::kGbrg:
      return chosen.value_or(Bayer::kGbrg);
    case PixelLayout::kGrey:
      return chosen.value_or(Bayer::kNone);
    default:
      return Bayer::kNone;
  }
}

}  // namespace bslam::image_decoding
