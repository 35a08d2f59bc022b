// sensor.yaml of EuRoC.
#include "rig_formats/euroc_sensor.h"

#include "synthetic/rigs.h"
#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> out;
  const camera::Rig rig = synthetic::mixed_rig();
  for (std::size_t c = 0; c < rig.size(); c += 2)
    out.push_back(rig_formats::euroc_sensor_yaml({rig.camera(c), rig.body_from_cam(c)}, 20));
  out.push_back(
      "%YAML:1.0\nsensor_type: camera\ncomment: VI-Sensor\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1.0, 0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.2,\n         0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]\nrate_hz: "
      "20\n"
      "resolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.2, 367.2, 248.3] #fu, fv, cu, cv\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0001, 1.7e-05]\n");
  return out;
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const auto camera =
      rig_formats::read_euroc_sensor(fuzz::scratch_file("sensor.yaml", fuzz::as_text(data, size)), "cam0");
  if (!camera) return 0;
  fuzz::require(camera->camera.unproject({0.5 * camera->camera.width, 0.5 * camera->camera.height})
                    .value_or(Eigen::Vector3d::UnitZ())
                    .allFinite(),
                "the bearing must be finite");
  const std::string yaml = rig_formats::euroc_sensor_yaml(*camera, 20);
  fuzz::require(rig_formats::read_euroc_sensor(fuzz::scratch_file("again.yaml", yaml), "cam0").ok(),
                "a written camera must be readable");
  return 0;
}
