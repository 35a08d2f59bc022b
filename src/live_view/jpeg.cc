#include "live_view/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>

namespace bslam::live_view {

std::string small_jpeg(const image::ImageView& image, int max_width) {
  constexpr int kQuality = 70;
  if (image.empty()) return {};
  // OpenCV has no matrices of constant values; this one is only read.
  const cv::Mat whole(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  cv::Mat small = whole;
  if (image.width > max_width) {
    const int height = std::max(1, image.height * max_width / image.width);
    cv::resize(whole, small, {max_width, height}, 0, 0, cv::INTER_AREA);
  }
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = !encoder
                         ? -1
                         : tjCompress2(encoder.get(), small.data, small.cols, static_cast<int>(small.step), small.rows,
                                       TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, kQuality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owned(bytes, tjFree);
  if (failed != 0) return {};
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace bslam::live_view
