#include "image_decoding/vignette.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "base/assert.h"
#include "base/atomic_file.h"
#include "image_decoding/codecs.h"

namespace bslam::image_decoding {
namespace {

constexpr double kMaxGain = 8, kUnit = 256;
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

Error unusable(const std::filesystem::path& file, std::string found, const camera::Camera& camera) {
  return {file.string(), "", std::move(found),
          fmt::format("a grey image of {}x{} pixels, the relative brightness of {}", camera.width, camera.height,
                      camera.name)};
}

}  // namespace

Result<Vignette> Vignette::read(const std::filesystem::path& file, const camera::Camera& camera) {
  const auto bytes = read_file(file, kMaxBytes);
  if (!bytes) return bytes.error();
  const cv::Mat decoded = decode_to_grey(*bytes);
  if (decoded.empty()) return unusable(file, "no readable image", camera);
  if (decoded.cols != camera.width || decoded.rows != camera.height)
    return unusable(file, fmt::format("{}x{} pixels", decoded.cols, decoded.rows), camera);
  cv::Mat brightness;
  decoded.convertTo(brightness, CV_64F);
  double largest = 0;
  cv::minMaxLoc(brightness, nullptr, &largest);
  if (!(largest > 0)) return unusable(file, "0 everywhere", camera);
  Vignette out;
  for (int y = 0; y < brightness.rows; ++y) {
    for (int x = 0; x < brightness.cols; ++x) {
      const double gain = std::min(kMaxGain, largest / std::max(brightness.at<double>(y, x), largest / kMaxGain));
      out.gain_.push_back(static_cast<std::uint16_t>(std::lround(gain * kUnit)));
    }
  }
  return out;
}

void Vignette::correct(image::Image& image) const {
  if (empty()) return;
  BSLAM_ASSERT(gain_.size() == static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()),
               "the image must have the resolution of the vignette");
  const std::uint16_t* gain = gain_.data();
  for (int y = 0; y < image.height(); ++y) {
    std::uint8_t* row = image.row(y);
    for (int x = 0; x < image.width(); ++x, ++gain)
      row[x] = static_cast<std::uint8_t>(std::min((row[x] * *gain + 128) >> 8, 255));
  }
}

}  // namespace bslam::image_decoding
