#include "map_export/landmark_colours.h"

#include <cmath>
#include <opencv2/core.hpp>

#include "image_decoding/colour_image.h"

namespace bslam::map_export {
namespace {

// Bilinear interpolation; positions outside of the image are moved to its border.
cv::Vec3f sample(const cv::Mat& image, const Eigen::Vector2f& pixel) {
  const float x = std::clamp(pixel.x(), 0.0f, static_cast<float>(image.cols - 1));
  const float y = std::clamp(pixel.y(), 0.0f, static_cast<float>(image.rows - 1));
  const int x0 = std::min(static_cast<int>(x), image.cols - 2), y0 = std::min(static_cast<int>(y), image.rows - 2);
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0);
  const auto at = [&](int dx, int dy) { return cv::Vec3f(image.at<cv::Vec3b>(y0 + dy, x0 + dx)); };
  return (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
}

struct Sum {
  cv::Vec3f colour = {0, 0, 0};
  float count = 0;
};

// Adds the colours at the keypoints of an image. `number` maps landmarks to their places in `sums`.
void add_colours(const cv::Mat& colours, const map::BundledKeyframe& keyframe, std::size_t camera,
                 const std::vector<int>& number, std::vector<Sum>& sums) {
  const feature::Keypoints& keypoints = keyframe.frame->cameras[camera].keypoints;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const FeatureId f = keyframe.frame->bundled.feature(CameraIndex(camera), KeypointIndex(i));
    const LandmarkId l = keyframe.landmarks[f.index()];
    if (!l.valid() || number[l.index()] < 0) continue;
    Sum& sum = sums[static_cast<std::size_t>(number[l.index()])];
    sum.colour += sample(colours, keypoints.pixel[i]);
    sum.count += 1;
  }
}

}  // namespace

LandmarkColours landmark_colours(const Selection& selection, const ImageTable& images) {
  std::vector<int> number(selection.map->landmark_slots(), -1);
  for (std::size_t i = 0; i < selection.landmarks.size(); ++i)
    number[selection.landmarks[i].index()] = static_cast<int>(i);
  std::vector<Sum> sums(selection.landmarks.size());
  LandmarkColours result;
  for (const MapImage& image : images.images()) {
    if (!image.recorded) continue;
    const auto colours = image_decoding::read_colours(*image.recorded, image.format);
    const camera::Camera& camera = selection.map->rig().camera(image.camera);
    if (!colours || colours->cols != camera.width || colours->rows != camera.height || colours->rows < 2) continue;
    add_colours(*colours, selection.map->keyframe(image.keyframe), image.camera, number, sums);
    ++result.read;
  }
  for (const Sum& sum : sums) {
    Colour colour = {128, 128, 128};
    for (std::size_t i = 0; i < 3 && sum.count > 0; ++i)
      colour[i] = static_cast<std::uint8_t>(std::lround(sum.colour[static_cast<int>(i)] / sum.count));
    result.of.push_back(colour);
  }
  return result;
}

}  // namespace bslam::map_export
