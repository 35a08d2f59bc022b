// Bundles as callers hand them over, checked, as bundles of the estimator.
#pragma once

#include <bslam/image_bundle.h>

#include <optional>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::api {

// Why an image cannot be of this camera; `name`: of the public function, for the Error.
Status check_image(const CameraImage& image, const camera::Camera& camera, const char* name);

class BundleReader {
 public:
  explicit BundleReader(const camera::Rig& rig) : rig_(rig), last_camera_ns_(rig.size()) {}

  // The same images, their memory borrowed, with the time offsets of the rig applied and the number of the next frame.
  // Errors as those of bslam::System::process about a bundle; then it does not count.
  Result<image::ImageBundle> read(const ImageBundle& bundle);

 private:
  Result<image::ImageBundle> convert(const ImageBundle& bundle) const;
  Status check_times(const image::ImageBundle& images) const;

  const camera::Rig rig_;
  FrameId next_{0};
  std::optional<TimeNs> last_ns_;                      // of the frame before
  std::vector<std::optional<TimeNs>> last_camera_ns_;  // per camera, of its last image
};

}  // namespace bslam::api
