#include "calibration/image_residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/median.h"
#include "solver/reprojection.h"

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

// Calls `add(camera, pixel, error)` for all observations of a keyframe, where `error` is the observed minus the
// projected position in pixels.
template <class Add>
void for_each_error(const map::BundledMap& map, KeyframeId k, const Add& add) {
  const map::BundledKeyframe& keyframe = map.keyframe(k);
  const frame::Bundled& bundled = keyframe.frame->bundled;
  std::vector<geometry::SE3> T_cam_world;
  std::vector<camera::Shutter> shutters;
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
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
      const auto error =
          solver::residual_error(camera.model, shutters[ref.camera.index()], point_cam, pixel.cast<double>());
      if (error) add(ref.camera.index(), pixel, *error);
    }
  }
}

// The squared distance from which on observations of a camera count as outliers, by camera: a number of standard
// deviations of a normal distribution with the same median. Infinite for a camera without observations in the sample.
std::vector<double> outlier_bounds(const map::BundledMap& map, std::span<const KeyframeId> keyframes) {
  constexpr double kSigmas = 10.0;
  const double median_chi2 = 2.0 * std::log(2.0);  // of two degrees of freedom
  constexpr std::size_t kSampled = 16;             // keyframes that are enough for the median
  std::vector<std::vector<float>> squared(map.rig().size());
  for (std::size_t i = 0; i < keyframes.size(); i += keyframes.size() / kSampled + 1) {
    for_each_error(map, keyframes[i], [&](std::size_t camera, const Eigen::Vector2f&, const Eigen::Vector2d& error) {
      squared[camera].push_back(static_cast<float>(error.squaredNorm()));
    });
  }
  std::vector<double> bounds;
  for (std::vector<float>& of_camera : squared) {
    bounds.push_back(of_camera.empty() ? std::numeric_limits<double>::infinity()
                                       : kSigmas * kSigmas / median_chi2 * median(std::move(of_camera)));
  }
  return bounds;
}

}  // namespace

std::vector<ImageResiduals> image_residuals(const map::BundledMap& map, KeyframeId first) {
  std::vector<ImageResiduals> residuals(map.rig().size());
  for (std::size_t c = 0; c < residuals.size(); ++c) {
    residuals[c].width = map.rig().camera(c).width;
    residuals[c].height = map.rig().camera(c).height;
    residuals[c].cells.resize(ImageResiduals::kRows * ImageResiduals::kColumns);
  }
  std::vector<KeyframeId> keyframes = map.keyframe_ids();
  std::erase_if(keyframes, [&](KeyframeId k) { return k < first; });
  const std::vector<double> bounds = outlier_bounds(map, keyframes);
  for (const KeyframeId k : keyframes) {
    for_each_error(map, k, [&](std::size_t c, const Eigen::Vector2f& pixel, const Eigen::Vector2d& error) {
      if (error.squaredNorm() > bounds[c]) return;
      ImageResiduals& of_camera = residuals[c];
      ++of_camera.observations;
      of_camera.rms_px += error.squaredNorm();
      ResidualCell& cell = of_camera.cells[cell_of(pixel, map.rig().camera(c))];
      ++cell.observations;
      cell.mean_px += error;
    });
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
