// calib.txt of KITTI, without images in its folder.
#include "rig_formats/kitti_calib.h"

#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  return {
      "P0: 7.188560000000e+02 0 6.071928e+02 0 0 7.188560000000e+02 1.852157e+02 0 0 0 1 0\n"
      "P1: 7.188560000000e+02 0 6.071928e+02 -3.861448e+02 0 7.188560000000e+02 1.852157e+02 0 0 0 1 0\nTr: 1 2 3\n",
      "P2: 700 0 600 45 0 700 180 -0.1 0 0 1 0.003"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const auto file = fuzz::scratch_file("calib.txt", fuzz::as_text(data, size));
  const auto projections = rig_formats::read_kitti_calib(file);
  if (!projections) return 0;
  for (const rig_formats::KittiProjection& p : *projections) {
    fuzz::require(p.camera >= 0 && p.camera <= 3, "the camera number must be 0 to 3");
    const auto camera = rig_formats::kitti_camera(p, 1241, 376, file);
    fuzz::require(!camera || camera->T_body_cam.translation().allFinite(), "the camera position must be finite");
  }
  return 0;
}
