#include "map_export/output_cameras.h"

#include <algorithm>
#include <cmath>

#include "image_decoding/colour_image.h"

namespace bslam::map_export {
namespace {

constexpr double kMaxTangent = 1.428;  // tangent of half the maximum field of view: 55 degrees

// Returns the smallest |x / z| (axis 0) or |y / z| (axis 1) of the rays of one side of the image, limited to
// kMaxTangent. Pixels without a ray, or with one far from the optical axis, do not limit it.
double tangent_at_side(const camera::Camera& camera, int axis, double position) {
  const int last = (axis == 0 ? camera.height : camera.width) - 1;
  double tangent = kMaxTangent;
  for (int i = 0; i <= last; i += std::max(1, last / 64)) {
    const Eigen::Vector2d pixel = axis == 0 ? Eigen::Vector2d(position, i) : Eigen::Vector2d(i, position);
    const auto ray = camera.unproject(pixel);
    if (ray && ray->z() > 0.1) tangent = std::min(tangent, std::abs((*ray)[axis]) / ray->z());
  }
  return tangent;
}

cv::Mat remap_table(const camera::Camera& from, const camera::Camera& to) {
  const camera::Intrinsics& k = camera::intrinsics(to.model);
  cv::Mat table(to.height, to.width, CV_32FC2);
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < to.width; ++x) {
      const auto pixel = from.project({(x - k.cx) / k.fx, (y - k.cy) / k.fy, 1.0});
      table.at<cv::Vec2f>(y, x) =
          pixel ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y())) : cv::Vec2f(-1, -1);
    }
  }
  return table;
}

// cv::remap would do the same, but its archive refers to LAPACK.
cv::Mat undistorted_image(const cv::Mat& recorded, const cv::Mat& table) {
  cv::Mat out(table.rows, table.cols, CV_8UC3, cv::Scalar::all(0));
  const auto right = static_cast<float>(recorded.cols - 1), bottom = static_cast<float>(recorded.rows - 1);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) {
      const cv::Vec2f from = table.at<cv::Vec2f>(y, x);
      if (from[0] < 0 || from[1] < 0 || from[0] > right || from[1] > bottom) continue;
      out.at<cv::Vec3b>(y, x) = image_decoding::colour_at(recorded, from[0], from[1]);  // rounded
    }
  }
  return out;
}

}  // namespace

camera::Camera pinhole_for(const camera::Camera& camera) {
  const double right = camera.width - 1, bottom = camera.height - 1;
  const double x = std::min(tangent_at_side(camera, 0, 0), tangent_at_side(camera, 0, right));
  const double y = std::min(tangent_at_side(camera, 1, 0), tangent_at_side(camera, 1, bottom));
  constexpr double kLeast = 1e-3;  // minimum tangent, for a camera whose rays are all on one side
  const double f = std::max(0.5 * right / std::max(x, kLeast), 0.5 * bottom / std::max(y, kLeast));
  camera::Camera pinhole = camera;
  pinhole.model = camera::Pinhole({f, f, 0.5 * right, 0.5 * bottom});
  pinhole.mask_file.clear();
  return pinhole;
}

OutputCameras::OutputCameras(const camera::Rig& rig, bool undistort) : rig_(rig), undistort_(undistort) {
  for (std::size_t c = 0; c < rig.size(); ++c)
    cameras_.push_back(undistort ? pinhole_for(rig.camera(c)) : rig.camera(c));
  maps_.resize(cameras_.size());
}

std::optional<Eigen::Vector2d> OutputCameras::pixel(std::size_t c, const Eigen::Vector2f& recorded) const {
  if (!undistort_) return recorded.cast<double>();
  const auto ray = rig_.camera(c).unproject(recorded.cast<double>());
  const auto pixel = ray ? cameras_[c].project(*ray) : std::nullopt;
  return pixel && cameras_[c].contains(*pixel) ? pixel : std::nullopt;
}

cv::Mat OutputCameras::image(std::size_t c, const cv::Mat& recorded) {
  if (!undistort_) return recorded;
  if (maps_[c].empty()) maps_[c] = remap_table(rig_.camera(c), cameras_[c]);
  return undistorted_image(recorded, maps_[c]);
}

}  // namespace bslam::map_export
