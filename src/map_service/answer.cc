#include "map_service/answer.h"

#include <bslam/frame_result.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "api/frame_conversion.h"

namespace bslam::map_service {
namespace {

using nlohmann::ordered_json;

std::string text_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

// Row-major values as an array of rows.
template <std::size_t N>
ordered_json rows_of(const std::array<double, N>& values, std::size_t columns) {
  ordered_json rows = ordered_json::array();
  for (std::size_t i = 0; i < N; i += columns) {
    ordered_json row = ordered_json::array();
    for (std::size_t k = 0; k < columns; ++k) row.push_back(values[i + k]);
    rows.push_back(std::move(row));
  }
  return rows;
}

ordered_json pose_json(const Pose& pose) {
  return {{"position", pose.translation}, {"quaternion_xyzw", pose.rotation}, {"matrix", rows_of(pose.matrix(), 4)}};
}

// Cameras without an image are left out.
ordered_json cameras_json(const tracking::FrameRecord& record, const FrameResult& result, const camera::Rig& rig) {
  ordered_json cameras = ordered_json::object();
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    const CameraResult& camera = result.cameras[c];
    if (record.images[c] != image::ImageState::kPresent) continue;
    cameras[rig.camera(c).name] = {{"state", to_string(camera.state)},
                                   {"reason", camera.reason},
                                   {"keypoints", camera.keypoints},
                                   {"matches", camera.matched},
                                   {"inliers", camera.inliers}};
  }
  return cameras;
}

}  // namespace

std::string localisation_json(const tracking::FrameRecord& record, const camera::Rig& rig) {
  const FrameResult result = api::to_frame_result(record, rig);
  const bool found = result.tracking();
  ordered_json json{{"localised", found}, {"reason", to_string(result.reason)}};
  json["T_world_cam0"] = found ? pose_json(result.T_world_cam0) : ordered_json();
  json["T_world_body"] = found ? pose_json(result.T_world_body) : ordered_json();
  json["covariance"] = result.covariance ? rows_of(*result.covariance, 6) : ordered_json();
  json["scale"] = found ? ordered_json(to_string(result.scale)) : ordered_json();
  json["submap"] = found ? ordered_json(result.submap) : ordered_json();
  json["keyframe"] = found ? ordered_json(result.keyframe_id) : ordered_json();
  json["cameras"] = cameras_json(record, result, rig);
  return text_of(json);
}

std::string map_json(const MapSource& source, const map::BundledMap& map, const camera::Rig& rig) {
  ordered_json cameras = ordered_json::array(), submaps = ordered_json::array();
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    cameras.push_back({{"name", camera.name},
                       {"model", camera::model_name(camera.model)},
                       {"width", camera.width},
                       {"height", camera.height}});
  }
  for (const KeyframeId root : map.roots())
    submaps.push_back({{"submap", root.value()}, {"keyframes", map.keyframes_of_submap(root).size()}});
  return text_of({{"name", source.name},
                  {"id", source.id},
                  {"data", source.data},
                  {"version", source.made_by},
                  {"warning", source.warning.empty() ? ordered_json() : ordered_json(source.warning)},
                  {"cameras", std::move(cameras)},
                  {"keyframes", map.num_keyframes()},
                  {"landmarks", map.num_landmarks()},
                  {"scale", map::scale_name(map.scale())},
                  {"submaps", std::move(submaps)}});
}

std::string error_json(std::string_view message) { return text_of({{"error", message}}); }

}  // namespace bslam::map_service
