#include "frame/bundled_frame.h"

namespace bslam::frame {

std::size_t BundledFrame::num_keypoints() const {
  std::size_t n = 0;
  for (const CameraFrame& c : cameras) n += c.keypoints.size();
  return n;
}

}  // namespace bslam::frame
