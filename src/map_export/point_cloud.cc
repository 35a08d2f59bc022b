#include "map_export/point_cloud.h"

#include <fmt/format.h>

#include "storage/map_bytes.h"

namespace bslam::map_export {

std::string landmarks_ply(const Selection& selection, const LandmarkColours& colours,
                          const geometry::SE3& T_out_world) {
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment landmarks of a bslam map\nelement vertex {}\nproperty double x\n"
      "property double y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property int observations\nend_header\n",
      selection.landmarks.size());
  storage::ByteWriter out;
  for (std::size_t i = 0; i < selection.landmarks.size(); ++i) {
    const LandmarkId l = selection.landmarks[i];
    std::int32_t keypoints = 0;
    for_each_keypoint(selection, l, [&](KeyframeId, frame::KeypointRef) { ++keypoints; });
    const Eigen::Vector3d position = T_out_world * selection.map->landmark(l).position;
    out.numbers(position.data(), 3);
    out.numbers(colours.of[i].data(), 3);
    out.number(keypoints);
  }
  return std::move(header) + std::move(out).take();
}

}  // namespace bslam::map_export
