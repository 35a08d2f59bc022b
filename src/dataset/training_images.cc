#include "dataset/training_images.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "image_decoding/codecs.h"
#include "image_decoding/image_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxImageBytes = std::size_t{1} << 28;
constexpr std::array<std::string_view, 5> kExtensions{".png", ".jpg", ".jpeg", ".pgm", ".webp"};

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

Result<std::vector<fs::path>> images_below(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unreadable;
    if (is_image_name(it->path()) && it->is_regular_file(unreadable)) found.push_back(it->path());
  }
  if (error) return Error{folder.string(), "", error.message(), "a folder that can be searched"};
  std::sort(found.begin(), found.end());
  return found;
}

// Reads a number of a PGM header, after white space and comments.
std::optional<int> header_number(std::string_view& bytes) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  for (;;) {
    bytes.remove_prefix(std::min(bytes.find_first_not_of(kBlanks), bytes.size()));
    if (!bytes.starts_with('#')) break;
    bytes.remove_prefix(std::min(bytes.find('\n'), bytes.size()));
  }
  int value = 0;
  const auto [end, error] = std::from_chars(bytes.data(), bytes.data() + bytes.size(), value);
  if (error != std::errc() || value <= 0) return std::nullopt;
  bytes.remove_prefix(static_cast<std::size_t>(end - bytes.data()));
  return value;
}

// Binary PGM with 8 bits per pixel.
std::optional<image::Image> decode_pgm(std::string_view bytes) {
  bytes.remove_prefix(2);  // "P5"
  const auto width = header_number(bytes), height = header_number(bytes), most = header_number(bytes);
  if (!width || !height || !most || *most > 255 || bytes.empty()) return std::nullopt;
  bytes.remove_prefix(1);  // the single white space before the pixels
  if (bytes.size() < static_cast<std::uint64_t>(*width) * static_cast<std::uint64_t>(*height)) return std::nullopt;
  image::Image image(*width, *height);
  const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
  std::copy_n(from, static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height), image.row(0));
  return image;
}

std::optional<image::Image> decode_webp(std::string_view bytes) {
  const cv::Mat decoded = image_decoding::decode_to_grey(bytes);
  if (decoded.empty()) return std::nullopt;
  image::Image image(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) std::copy_n(decoded.ptr<std::uint8_t>(y), decoded.cols, image.row(y));
  return image;
}

// Supports more formats than the images of recordings.
std::optional<image::Image> decode_any(std::string_view bytes) {
  if (bytes.starts_with("P5")) return decode_pgm(bytes);
  if (bytes.starts_with("RIFF") && bytes.size() > 12 && bytes.substr(8, 4) == "WEBP") return decode_webp(bytes);
  return image_decoding::decode_grey(bytes);
}

image::Image shrink(const image::Image& image, int max_side) {
  const double factor = static_cast<double>(max_side) / std::max(image.width(), image.height());
  image::Image small(std::max(1, static_cast<int>(image.width() * factor)),
                     std::max(1, static_cast<int>(image.height() * factor)));
  const cv::Mat from(image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.row(0)));
  cv::Mat to(small.height(), small.width(), CV_8UC1, small.row(0));
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

Result<std::vector<fs::path>> find_images(const std::vector<std::string>& paths) {
  std::vector<fs::path> images;
  std::set<fs::path> seen;
  const auto take = [&](const fs::path& image) {
    if (seen.insert(image.lexically_normal()).second) images.push_back(image);
  };
  for (const std::string& path : paths) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) {
      const auto below = images_below(path);
      if (!below) return below.error();
      for (const fs::path& image : *below) take(image);
    } else if (!fs::exists(status)) {
      return Error{path, "", error ? error.message() : "No such file or directory", "an image or a folder of images"};
    } else if (!is_image_name(path)) {
      return Error{path, "", "a file of another type", "a PNG, JPEG, PGM or WebP image, or a folder"};
    } else {
      take(path);
    }
  }
  return images;
}

Result<image::Image> read_training_image(const fs::path& file, int max_side) {
  const auto bytes = read_file(file, kMaxImageBytes);
  if (!bytes) return bytes.error();
  auto image = decode_any(*bytes);
  if (!image)
    return Error{file.string(), "", "an incomplete image or another format", "a PNG, JPEG, PGM or WebP image"};
  const bool large = max_side > 0 && std::max(image->width(), image->height()) > max_side;
  return large ? shrink(*image, max_side) : *std::move(image);
}

}  // namespace bslam::dataset
