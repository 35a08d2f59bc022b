#include "calibration/image_residuals.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace bslam::calibration {
namespace {

std::size_t cell_of(const Eigen::Vector2f& pixel, const camera::Camera& camera) {
  const auto index = [](float position, int size, std::size_t cells) {
    const double share = (static_cast<double>(position) + 0.5) / size;
    return static_cast<std::size_t>(
        std::clamp(share * static_cast<double>(cells), 0.0, static_cast<double>(cells - 1)));
  };
  return index(pixel.y(), camera.height, ImageResiduals::kRows) * ImageResiduals::kColumns +
         index(pixel.x(), camera.width, ImageResiduals::kColumns);
}

// Adds the squared errors to `rms_px` and the errors to the sums of the cells.
void add_keyframe(const map::BundledMap& map, KeyframeId k, std::vector<ImageResiduals>& residuals) {
  const map::BundledKeyframe& keyframe = map.keyframe(k);
  const frame::Bundled& bundled = keyframe.frame->bundled;
  std::vector<geometry::SE3> T_cam_world;
  std::vector<camera::Shutter> shutters;
  for (std::size_t c = 0; c < residuals.size(); ++c) {
    T_cam_world.push_back(map.cam_from_world(k, CameraIndex(c)));
    shutters.push_back(map.shutter(k, CameraIndex(c)));
  }
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    const LandmarkId landmark = keyframe.landmarks[f];
    if (!landmark.valid()) continue;
    for (const frame::KeypointRef& ref : bundled.keypoints(FeatureId(f))) {
      const camera::Camera& camera = map.rig().camera(ref.camera);
      const Eigen::Vector2f& pixel = map.keypoints(k, ref.camera).pixel[ref.keypoint.index()];
      const Eigen::Vector3d point_cam = T_cam_world[ref.camera.index()] * map.landmark(landmark).position;
      const auto projected =
          camera.project(shutters[ref.camera.index()].at_row(point_cam, static_cast<double>(pixel.y())));
      if (!projected) continue;
      const Eigen::Vector2d error = pixel.cast<double>() - *projected;
      ImageResiduals& of_camera = residuals[ref.camera.index()];
      ++of_camera.observations;
      of_camera.rms_px += error.squaredNorm();
      ResidualCell& cell = of_camera.cells[cell_of(pixel, camera)];
      ++cell.observations;
      cell.mean_px += error;
    }
  }
}

}  // namespace

std::vector<ImageResiduals> image_residuals(const map::BundledMap& map, KeyframeId first) {
  std::vector<ImageResiduals> residuals(map.rig().size());
  for (std::size_t c = 0; c < residuals.size(); ++c) {
    residuals[c].width = map.rig().camera(c).width;
    residuals[c].height = map.rig().camera(c).height;
    residuals[c].cells.resize(ImageResiduals::kRows * ImageResiduals::kColumns);
  }
  for (const KeyframeId k : map.keyframe_ids()) {
    if (k >= first) add_keyframe(map, k, residuals);
  }
  for (ImageResiduals& r : residuals) {
    if (r.observations > 0) r.rms_px = std::sqrt(r.rms_px / static_cast<double>(r.observations));
    for (ResidualCell& cell : r.cells) {
      if (cell.observations > 0) cell.mean_px /= static_cast<double>(cell.observations);
    }
  }
  return residuals;
}

}  // namespace bslam::calibration
