// Decodes sensor_msgs/CompressedImage (JPEG or PNG) to grey.
#pragma once

#include <bslam/bslam.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/image_conversion.h"

namespace bslam_ros {

// Whether the data is a JPEG or a PNG up to its end: a decoder would fill the missing part of a truncated image with
// grey. Zeros may follow, with which some drivers fill their buffers.
inline bool is_whole_image(const std::vector<std::uint8_t>& data) {
  using Bytes = std::vector<std::uint8_t>;
  const auto end = std::find_if(data.rbegin(), data.rend(), [](std::uint8_t byte) { return byte != 0; });
  const auto begins = [&](const Bytes& with) {
    return data.size() >= with.size() && std::equal(with.begin(), with.end(), data.begin());
  };
  const auto ends = [&](const Bytes& with) {
    return data.rend() - end >= static_cast<std::ptrdiff_t>(with.size()) && std::equal(with.rbegin(), with.rend(), end);
  };
  const bool jpeg = begins({0xff, 0xd8}) && ends({0xff, 0xd9});  // the marker EOI
  const bool png = begins({0x89, 'P', 'N', 'G'}) && ends({'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82});
  return jpeg || png;
}

// Decodes an image as it is stored: a rotation in the metadata does not turn it, as the calibration is that of the
// camera. Errors: data that is not an image, or only a part of one.
inline bslam::Result<RawImage> decode(const std::vector<std::uint8_t>& data, const std::string& format) {
  cv::Mat grey;
  try {
    if (is_whole_image(data)) grey = cv::imdecode(data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    grey.release();
  }
  if (grey.empty())
    return bslam::Error{"compressed image", "format '" + format + "'", std::to_string(data.size()) + " bytes",
                        "a complete JPEG or PNG image"};
  const auto owner = std::make_shared<const cv::Mat>(grey);
  RawImage out;
  out.encoding = "mono8";
  out.width = static_cast<std::size_t>(grey.cols);
  out.height = static_cast<std::size_t>(grey.rows);
  out.step = grey.step;
  out.data = owner->data;
  out.size = out.step * out.height;
  out.owner = std::shared_ptr<const void>(owner, owner->data);
  return out;
}

}  // namespace bslam_ros
