// Rigs in all formats that are recognised by the content of one file.
#include "rig_formats/rig_file.h"

#include "synthetic/rigs.h"
#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  return {rig_formats::rig_to_yaml(synthetic::mixed_rig()), rig_formats::rig_to_yaml(synthetic::ring_rig(1)),
          "bslam_rig: 1\ncameras:\n  - model: pinhole\n    resolution: [64, 48]\n    intrinsics: [50, 50, 32, 24]\n"
          "    T_body_cam: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n    mask: a.png\n",
          "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.01, 0, 0]\n  "
          "distortion_model: equidistant\n"
          "  intrinsics: [400, 400, 320, 240]\n  resolution: [640, 480]\n  rostopic: /a\n"
          "cam1:\n  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n  camera_model: pinhole\n"
          "  distortion_coeffs: [0.1, 0.01, 0, 0]\n  distortion_model: radtan\n  intrinsics: [400, 400, 320, 240]\n  "
          "resolution: [640, 480]\n",
          "%YAML:1.0\ncameras:\n  - {T_SC: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],\n"
          "    image_dimension: [640, 480],\n"
          "    distortion_coefficients: [0.1, 0.01, 0, 0],\n    distortion_type: radialtangential,\n"
          "    focal_length: [400, 400],\n    principal_point: [320, 240],\n    slam_use: okvis}\n"
          "camera_parameters:\n  image_delay: 0.01\n"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const auto rig = rig_formats::read_rig(fuzz::scratch_file("rig.yaml", fuzz::as_text(data, size)));
  if (!rig) return 0;
  const std::string yaml = rig_formats::rig_to_yaml(*rig);
  const auto again = rig_formats::read_rig(fuzz::scratch_file("again.yaml", yaml));
  fuzz::require(again.ok() && again->size() == rig->size(), "a written rig must be readable");
  return 0;
}
