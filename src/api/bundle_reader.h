// Checks image bundles passed by the caller and converts them to the internal type.
#pragma once

#include <bslam/image_bundle.h>

#include <optional>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::api {

// Returns an Error if the image cannot be from this camera. `name` is the public function, used in the Error.
Status check_image(const CameraImage& image, const camera::Camera& camera, const char* name);

class BundleReader {
 public:
  explicit BundleReader(const camera::Rig& rig) : rig_(rig), last_camera_ns_(rig.size()) {}

  // Returns the same images without copying their pixels. Applies the time offsets of the rig and assigns the next
  // frame id. Errors: those that bslam::System::process documents for a bundle. After an error the reader is unchanged.
  Result<image::ImageBundle> read(const ImageBundle& bundle);

 private:
  Result<image::ImageBundle> convert(const ImageBundle& bundle) const;
  Status check_times(const image::ImageBundle& images) const;

  const camera::Rig rig_;
  FrameId next_{0};
  std::optional<TimeNs> last_ns_;                      // time of the previous frame
  std::vector<std::optional<TimeNs>> last_camera_ns_;  // per camera: time of its last image
};

}  // namespace bslam::api
