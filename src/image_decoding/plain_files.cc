#include "image_decoding/plain_files.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

namespace bslam::image_decoding {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

// Takes the next whole number of the header of a PNM, before which there may be blanks and comments.
std::optional<std::uint32_t> take_number(std::string_view& rest) {
  constexpr std::uint32_t kMost = 1 << 24;
  while (!rest.empty() && (is_blank(rest.front()) || rest.front() == '#'))
    rest.remove_prefix(rest.front() == '#' ? std::min(rest.find('\n'), rest.size()) : 1);
  std::uint32_t value = 0;
  std::size_t digits = 0;
  for (; digits < rest.size() && rest[digits] >= '0' && rest[digits] <= '9'; ++digits) {
    value = 10 * value + static_cast<std::uint32_t>(rest[digits] - '0');
    if (value > kMost) return std::nullopt;
  }
  rest.remove_prefix(digits);
  return digits > 0 ? std::optional(value) : std::nullopt;
}

// Values as text, one after another.
bool read_text_values(std::string_view rest, cv::Mat& image) {
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols * image.channels(); ++x) {
      const auto value = take_number(rest);
      if (!value || *value > 0xffff) return false;
      if (image.depth() == CV_8U) image.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(std::min(*value, 255U));
      if (image.depth() == CV_16U) image.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(*value);
    }
  }
  return true;
}

// Values of one byte, or of two of which the first is the larger one.
bool read_values(std::string_view rest, cv::Mat& image) {
  const std::size_t row = static_cast<std::size_t>(image.cols) * image.elemSize();
  if (rest.size() < row * static_cast<std::size_t>(image.rows)) return false;
  for (int y = 0; y < image.rows; ++y) {
    const char* const from = rest.data() + row * static_cast<std::size_t>(y);
    auto* const to = image.ptr<std::uint8_t>(y);
    std::memcpy(to, from, row);
    for (std::size_t k = 0; image.depth() == CV_16U && k + 1 < row; k += 2) {
      const auto value = static_cast<std::uint16_t>(to[k] << 8 | to[k + 1]);
      std::memcpy(to + k, &value, 2);
    }
  }
  return true;
}

cv::Mat decode_pnm(std::string_view bytes, OfColours kept) {
  const char kind = bytes[1];
  std::string_view rest = bytes.substr(2);
  const auto width = take_number(rest), height = take_number(rest), most = take_number(rest);
  if (!width || !height || !most || *width < 1 || *height < 1 || *most < 1 || *most > 0xffff || rest.empty()) return {};
  if (std::uint64_t{*width} * *height > kMaxPixels || std::uint64_t{*width} * *height > rest.size()) return {};
  cv::Mat image(static_cast<int>(*height), static_cast<int>(*width),
                CV_MAKETYPE(*most > 255 ? CV_16U : CV_8U, kind == '6' ? 3 : 1));
  rest.remove_prefix(1);  // one blank
  if (!(kind == '2' ? read_text_values(rest, image) : read_values(rest, image))) return {};
  if (*most < 255) image.convertTo(image, -1, 255.0 / *most);
  if (kind == '6') cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  return one_channel(image, kept);
}

std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < count; ++k) value |= std::uint32_t{static_cast<unsigned char>(bytes[at + k])} << 8 * k;
  return value;
}

// The header of a BMP as Windows writes it since version 3.
struct BmpHeader {
  std::uint32_t begin = 0, size = 0, compression = 0, colours = 0;
  int bits = 0;
  std::int64_t width = 0, height = 0;  // a negative height: the first row is the upper one
};

std::optional<BmpHeader> bmp_header(std::string_view bytes) {
  constexpr std::size_t kHeader = 54;
  if (bytes.size() < kHeader) return std::nullopt;
  const BmpHeader h{.begin = number_at(bytes, 10, 4),
                    .size = number_at(bytes, 14, 4),
                    .compression = number_at(bytes, 30, 4),
                    .colours = number_at(bytes, 46, 4),
                    .bits = static_cast<int>(number_at(bytes, 28, 2)),
                    .width = static_cast<std::int32_t>(number_at(bytes, 18, 4)),
                    .height = static_cast<std::int32_t>(number_at(bytes, 22, 4))};
  constexpr std::uint32_t kRows = 0, kMasks = 3;
  const bool known = (h.compression == kRows && (h.bits == 8 || h.bits == 24 || h.bits == 32)) ||
                     (h.compression == kMasks && h.bits == 32);
  const std::int64_t rows = std::abs(h.height);
  if (!known || h.size < 40 || h.width < 1 || rows < 1 || h.width > 1 << 20 || rows > 1 << 20) return std::nullopt;
  return static_cast<std::uint64_t>(h.width * rows) > kMaxPixels ? std::nullopt : std::optional(h);
}

// The colours of images with 8 bits per pixel as one channel.
std::optional<std::array<std::uint8_t, 256>> grey_table(std::string_view bytes, const BmpHeader& h, OfColours kept) {
  const std::size_t at = std::size_t{14} + h.size, count = h.colours == 0 ? 256 : std::min(h.colours, 256U);
  std::array<std::uint8_t, 256> table{};
  if (at > bytes.size() || bytes.size() - at < 4 * count) return std::nullopt;
  cv::Mat colours(1, static_cast<int>(count), CV_8UC4);
  std::memcpy(colours.data, bytes.data() + at, 4 * count);
  const cv::Mat grey = one_channel(colours, kept);
  std::copy_n(grey.ptr<std::uint8_t>(0), count, table.begin());
  return table;
}

cv::Mat decode_bmp(std::string_view bytes, OfColours kept) {
  const auto h = bmp_header(bytes);
  if (!h) return {};
  const int channels = h->bits / 8, rows = static_cast<int>(std::abs(h->height));
  const std::size_t row = static_cast<std::size_t>(h->width) * static_cast<std::size_t>(channels);
  const std::size_t step = (row + 3) / 4 * 4;
  if (h->begin > bytes.size() || bytes.size() - h->begin < step * static_cast<std::size_t>(rows)) return {};
  cv::Mat image(rows, static_cast<int>(h->width), CV_MAKETYPE(CV_8U, channels));
  for (int y = 0; y < rows; ++y) {
    const auto from = static_cast<std::size_t>(h->height > 0 ? rows - 1 - y : y);
    std::memcpy(image.ptr(y), bytes.data() + h->begin + step * from, row);
  }
  if (channels > 1) return one_channel(image, kept);
  const auto table = grey_table(bytes, *h, kept);
  if (!table) return {};
  for (int y = 0; y < rows; ++y) {
    auto* const pixels = image.ptr<std::uint8_t>(y);
    std::transform(pixels, pixels + image.cols, pixels, [&](std::uint8_t k) { return (*table)[k]; });
  }
  return image;
}

bool is_tiff(std::string_view bytes) {
  return bytes.starts_with(std::string_view("II*\0", 4)) || bytes.starts_with(std::string_view("MM\0*", 4));
}

bool is_pnm(std::string_view bytes) {
  return bytes.size() > 2 && bytes[0] == 'P' && (bytes[1] == '2' || bytes[1] == '5' || bytes[1] == '6') &&
         (is_blank(bytes[2]) || bytes[2] == '#');
}

}  // namespace

cv::Mat one_channel(const cv::Mat& image, OfColours kept) {
  if (image.channels() == 1) return image;
  cv::Mat out;
  if (kept == OfColours::kLuminance) {
    cv::cvtColor(image, out, image.channels() == 3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
    return out;
  }
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  return cv::max(cv::max(channels[0], channels[1]), channels[2]);
}

bool is_plain_file(std::string_view bytes) { return is_pnm(bytes) || bytes.starts_with("BM") || is_tiff(bytes); }

std::optional<std::pair<std::uint32_t, std::uint32_t>> size_of_pnm(std::string_view bytes) {
  if (!is_pnm(bytes)) return std::nullopt;
  std::string_view rest = bytes.substr(2);
  const auto width = take_number(rest), height = take_number(rest);
  if (!width || !height) return std::nullopt;
  return std::pair(*width, *height);
}

bool plain_file_has_colours(std::string_view bytes) {
  if (is_pnm(bytes)) return bytes[1] == '6';
  if (is_tiff(bytes)) return tiff_has_colours(bytes);
  const auto bmp = bmp_header(bytes);
  return bmp && bmp->bits > 8;
}

cv::Mat decode_plain_file(std::string_view bytes, OfColours kept) {
  if (is_pnm(bytes)) return decode_pnm(bytes, kept);
  if (bytes.starts_with("BM")) return decode_bmp(bytes, kept);
  return is_tiff(bytes) ? decode_tiff(bytes, kept) : cv::Mat();
}

}  // namespace bslam::image_decoding
