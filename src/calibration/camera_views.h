// Keypoints of some frames of a recording, by camera, for tests of a calibration against images.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "camera/rig.h"
#include "feature/keypoints.h"
#include "image/image_bundle.h"

namespace bslam::calibration {

struct View {
  std::optional<TimeNs> time_ns = {};  // nullopt without an image
  feature::Detections keypoints;
};

// Keypoints by camera and frame. `masks`: one image per camera, empty or of its resolution; keypoints where it is 0 are
// ignored.
std::vector<std::vector<View>> extract_views(const camera::Rig& rig, std::span<const image::ImageBundle> frames,
                                             std::span<const image::Image> masks);

}  // namespace bslam::calibration
