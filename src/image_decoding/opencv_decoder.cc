#include "image_decoding/opencv_decoder.h"

#include <opencv2/imgcodecs.hpp>

namespace bslam::image_decoding {

cv::Mat decode_to_grey(std::string_view bytes) {
  const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  try {
    return cv::imdecode(buffer, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return {};  // a header with an impossible size: the file is damaged
  }
}

}  // namespace bslam::image_decoding
