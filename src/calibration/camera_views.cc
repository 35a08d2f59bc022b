#include "calibration/camera_views.h"

#include "feature/extractor.h"

namespace bslam::calibration {

std::vector<std::vector<View>> extract_views(const camera::Rig& rig, std::span<const image::ImageBundle> frames,
                                             std::span<const image::Image> masks) {
  std::vector<std::vector<View>> views(rig.size());
  feature::Extractor extractor({});
  for (const image::ImageBundle& bundle : frames) {
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const image::CameraImage& image = bundle.images[c];
      View& view = views[c].emplace_back();
      if (image.state != image::ImageState::kPresent) continue;
      view.time_ns = image.time_ns;
      image::Pyramid pyramid;
      extractor.extract(image.view(), masks[c].view(), rig.camera(c), pyramid, view.keypoints);
    }
  }
  return views;
}

}  // namespace bslam::calibration
