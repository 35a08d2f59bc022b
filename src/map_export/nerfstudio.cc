#include "map_export/nerfstudio.h"

#include <nlohmann/json.hpp>

namespace bslam::map_export {
namespace {

using nlohmann::ordered_json;

// Returns OPENCV, OPENCV_FISHEYE, or an empty string.
std::string_view nerfstudio_model(const camera::CameraModel& model) {
  if (std::holds_alternative<camera::KannalaBrandt>(model)) return "OPENCV_FISHEYE";
  if (std::holds_alternative<camera::Pinhole>(model)) return "OPENCV";
  const bool radtan = std::holds_alternative<camera::PinholeRadTan>(model);
  return radtan && camera::distortion(model).size() <= 5 ? "OPENCV" : "";
}

Result<std::string_view> common_model(const camera::Rig& rig, const OutputCameras& cameras) {
  std::string_view common;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const std::string_view model = nerfstudio_model(cameras.camera(c).model);
    if (model.empty() || (!common.empty() && model != common))
      return Error{
          "", rig.camera(c).name, std::string(camera::model_name(cameras.camera(c).model)),
          "cameras of one kind that nerfstudio has, pinhole, pinhole-radtan with at most five coefficients, or "
          "kannala-brandt; or undistorted images: --undistort --images DATA"};
    common = model;
  }
  return common;
}

void add_intrinsics(const camera::Camera& camera, ordered_json& frame) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  frame["w"] = camera.width;
  frame["h"] = camera.height;
  frame["fl_x"] = k.fx;
  frame["fl_y"] = k.fy;
  frame["cx"] = k.cx + 0.5;
  frame["cy"] = k.cy + 0.5;
  const bool fisheye = std::holds_alternative<camera::KannalaBrandt>(camera.model);
  const std::vector<const char*> names = fisheye ? std::vector<const char*>{"k1", "k2", "k3", "k4"}
                                                 : std::vector<const char*>{"k1", "k2", "p1", "p2", "k3"};
  const std::vector<double> d = camera::distortion(camera.model);
  for (std::size_t i = 0; i < names.size(); ++i) frame[names[i]] = i < d.size() ? d[i] : 0.0;
}

ordered_json matrix_json(const Eigen::Matrix4d& m) {
  ordered_json rows = ordered_json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

}  // namespace

Result<std::string> nerfstudio_json(const Selection& selection, const ImageTable& images, const OutputCameras& cameras,
                                    const std::vector<std::string>& paths, const std::string& ply) {
  const auto model = common_model(selection.map->rig(), cameras);
  if (!model) return model.error();
  ordered_json frames = ordered_json::array();
  const Eigen::Vector4d opengl(1, -1, -1, 1);  // the signs of the axes
  for (std::size_t i = 0; i < images.images().size(); ++i) {
    const MapImage& image = images.images()[i];
    ordered_json frame = {{"file_path", paths[i]}};
    add_intrinsics(cameras.camera(image.camera), frame);
    const geometry::SE3 T_world_cam =
        selection.map->cam_from_world(image.keyframe, CameraIndex(image.camera)).inverse();
    frame["transform_matrix"] = matrix_json((selection.T_upright_world * T_world_cam).matrix() * opengl.asDiagonal());
    frames.push_back(std::move(frame));
  }
  const ordered_json json = {{"camera_model", *model},
                             {"ply_file_path", ply},
                             {"T_upright_world", matrix_json(selection.T_upright_world.matrix())},
                             {"frames", std::move(frames)}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace bslam::map_export
