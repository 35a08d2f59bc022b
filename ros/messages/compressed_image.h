// Decodes sensor_msgs/CompressedImage (JPEG or PNG) to grey.
#pragma once

#include <bslam/bslam.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
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

// The byte order of this computer, in which OpenCV decodes values of 16 bits.
inline bool is_big_endian() {
  const std::uint16_t one = 1;
  unsigned char first_byte = 0;
  std::memcpy(&first_byte, &one, 1);
  return first_byte == 0;
}

// The colour filter of a file with one channel, such as "bayer_rggb"; empty if it has none. A format is that of the
// camera's images and, after `compressed`, that of the file if it differs: "bayer_rggb8; jpeg compressed " has a
// filter, and "bayer_rggb8; jpeg compressed bgr8" has none.
inline std::string colour_filter(const std::string& format) {
  const std::string compressed = "compressed", filter = "bayer_";
  const std::size_t end = format.find(';'), at = format.find(compressed);
  if (format.compare(0, filter.size(), filter) != 0 || end == std::string::npos) return "";
  const std::size_t file =
      at == std::string::npos ? std::string::npos : format.find_first_not_of(' ', at + compressed.size());
  if (file != std::string::npos && format.compare(file, filter.size(), filter) != 0) return "";
  return format.substr(0, std::min(end, format.find_first_of("0123456789")));
}

// Decodes an image as it is stored: a rotation in the metadata does not turn it, as the calibration is that of the
// camera. The encoding is mono8, or that of a Bayer image if the format names one and the file has one channel. Errors:
// data that is not an image, or only a part of one.
inline bslam::Result<RawImage> decode(const std::vector<std::uint8_t>& data, const std::string& format) {
  cv::Mat grey;
  std::string encoding = colour_filter(format);
  try {
    const bool whole = is_whole_image(data);
    if (whole && !encoding.empty()) grey = cv::imdecode(data, cv::IMREAD_UNCHANGED);
    if (!grey.empty() && (grey.type() == CV_8UC1 || grey.type() == CV_16UC1)) {
      encoding += grey.depth() == CV_8U ? "8" : "16";
    } else {
      encoding = "mono8";
      if (whole) grey = cv::imdecode(data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    }
  } catch (const cv::Exception&) {
    grey.release();
  }
  if (grey.empty())
    return bslam::Error{"compressed image", "format '" + format + "'", std::to_string(data.size()) + " bytes",
                        "a complete JPEG or PNG image"};
  const auto owner = std::make_shared<const cv::Mat>(grey);
  RawImage out;
  out.encoding = encoding;
  out.big_endian = is_big_endian();
  out.width = static_cast<std::size_t>(grey.cols);
  out.height = static_cast<std::size_t>(grey.rows);
  out.step = grey.step;
  out.data = owner->data;
  out.size = out.step * out.height;
  out.owner = std::shared_ptr<const void>(owner, owner->data);
  return out;
}

}  // namespace bslam_ros
