// Decodes sensor_msgs/CompressedImage (JPEG or PNG) to grey.
#pragma once

#include <bslam/bslam.h>

#include <cstdint>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/image_conversion.h"

namespace bslam_ros {

// Errors: data that is not an image.
inline bslam::Result<RawImage> decode(const std::vector<std::uint8_t>& data, const std::string& format) {
  cv::Mat grey;
  try {
    if (!data.empty()) grey = cv::imdecode(data, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    grey.release();
  }
  if (grey.empty())
    return bslam::Error{"compressed image", "format '" + format + "'", std::to_string(data.size()) + " bytes",
                        "a JPEG or PNG image"};
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
