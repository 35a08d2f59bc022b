// The largest images that are accepted.
#pragma once

namespace bslam {

// Maximum width and height of the images of a camera. Bounds the memory that a damaged header can request.
inline constexpr int kMaxImageSidePx = 20000;

}  // namespace bslam
