#include "map_export/landmark_colours.h"

#include <cmath>
#include <opencv2/core.hpp>

#include "image_decoding/colour_image.h"

namespace bslam::map_export {
namespace {

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
    sum.colour += image_decoding::colour_at(colours, keypoints.pixel[i].x(), keypoints.pixel[i].y());
    sum.count += 1;
  }
}

}  // namespace

LandmarkColours landmark_colours(const Selection& selection, const ImageTable& images,
                                 const std::stop_token& interrupted) {
  std::vector<int> number(selection.map->landmark_slots(), -1);
  for (std::size_t i = 0; i < selection.landmarks.size(); ++i)
    number[selection.landmarks[i].index()] = static_cast<int>(i);
  std::vector<Sum> sums(selection.landmarks.size());
  LandmarkColours result;
  for (const MapImage& image : images.images()) {
    if (interrupted.stop_requested()) break;
    if (!image.recorded) continue;
    const auto colours = image_decoding::read_colours(*image.recorded, image.format);
    const camera::Camera& camera = selection.map->rig().camera(image.camera);
    if (!colours || colours->cols != camera.width || colours->rows != camera.height) continue;
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
