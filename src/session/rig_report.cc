#include "session/rig_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "base/atomic_file.h"
#include "calibration/convention_check.h"
#include "calibration/rig_description.h"
#include "calibration/rig_warnings.h"
#include "image_decoding/image_file.h"
#include "report/rig_plot.h"
#include "rig_formats/rig_file.h"
#include "session/image_test.h"
#include "session/late_camera_json.h"
#include "session/rig_source.h"
#include "storage/map_file.h"

namespace bslam::session {
namespace {

using calibration::PairEvidence;
using Json = nlohmann::ordered_json;

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// `from_camera_0`: the rig in the frame of its camera 0.
Json camera_json(const camera::Rig& rig, const camera::Rig& from_camera_0, std::size_t i) {
  const camera::Camera& camera = rig.camera(i);
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const calibration::FieldOfView view = calibration::field_of_view(camera);
  const geometry::SE3& T = rig.body_from_cam(i);
  const geometry::SE3& T_cam0_cam = from_camera_0.rig_from_cam(i);
  Json overlaps = Json::array();
  for (std::size_t j = 0; j < rig.size(); ++j) overlaps.push_back(i == j ? 1.0 : rig.overlap_share(i, j));
  return {{"name", camera.name},
          {"model", camera::model_name(camera.model)},
          {"resolution", {camera.width, camera.height}},
          {"intrinsics", {k.fx, k.fy, k.cx, k.cy}},
          {"distortion", camera::distortion(camera.model)},
          {"field_of_view_deg",
           {{"horizontal", geometry::degrees(view.horizontal)},
            {"vertical", geometry::degrees(view.vertical)},
            {"diagonal", geometry::degrees(view.diagonal)}}},
          {"position_body", vector_json(T.translation())},
          {"optical_axis_body", vector_json(T.rotation() * Eigen::Vector3d::UnitZ())},
          {"position_cam0", vector_json(T_cam0_cam.translation())},
          {"optical_axis_cam0", vector_json(T_cam0_cam.rotation() * Eigen::Vector3d::UnitZ())},
          {"time_offset_s", static_cast<double>(camera.time_offset_ns) / 1e9},
          {"rolling_shutter_readout_s", camera.readout_s},
          {"mask", camera.mask_file.empty() ? Json() : Json(camera.mask_file)},
          {"overlaps", std::move(overlaps)}};
}

Json evidence_json(const std::vector<PairEvidence>& evidence) {
  Json pairs = Json::array();
  for (const PairEvidence& pair : evidence) {
    pairs.push_back({{"cameras", {pair.first, pair.second}},
                     {"matches", pair.matches},
                     {"mirrored", pair.mirrored ? Json(pair.mirrored->camera) : Json()},
                     {"fit_as_given", pair.agreeing[0]},
                     {"fit_inverted", pair.agreeing[1]},
                     {"fit_pair_inverted", pair.agreeing[2]},
                     {"fit_swapped", pair.agreeing[3]},
                     {"fit_swapped_inverted", pair.agreeing[4]},
                     {"fit_mirrored", pair.agreeing[5]},
                     {"fit_upside_down", pair.agreeing[6]},
                     {"fit_exchanged", pair.exchanged ? Json(pair.exchanged->agreeing) : Json()},
                     {"exchanged_for", pair.exchanged ? Json(pair.exchanged->cameras) : Json()},
                     {"fit_another", pair.other ? Json(pair.other->agreeing) : Json()},
                     {"another_turned_deg", pair.other ? Json(pair.other->rotated_deg) : Json()},
                     {"another_displaced_deg", pair.other ? Json(pair.other->displaced_deg) : Json()},
                     {"verdict", pair.verdict ? Json(calibration::convention_in_words(*pair.verdict)) : Json()}});
  }
  return pairs;
}

// Returns likely mistakes in the calibration, and masks that cannot be used.
std::vector<std::string> warnings_of(const camera::Rig& rig) {
  std::vector<std::string> warnings = calibration::rig_warnings(rig);
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const auto mask = image_decoding::read_mask(rig.camera(i));
    if (!mask) warnings.push_back("mask of " + rig.camera(i).name + ": " + mask.error().message());
  }
  return warnings;
}

// Reads a calibration file, or the calibration of a bag or of a saved map.
Result<RigSource> read_calibration(const RigReportRequest& request) {
  if (request.images.empty() && rig_formats::is_saved_map(request.file)) {
    const auto map = storage::read_map(request.file);
    if (!map) return map.error();
    return RigSource{{map->map.rig(), rig_formats::RigFormat::kBslam, {}}, "saved map"};
  }
  dataset::DatasetRequest recording = request.recording;
  recording.path = request.file;
  return read_rig_source(recording);
}

// The results of the test with the images of a recording.
struct ImageEvidence {
  std::vector<PairEvidence> pairs;
  std::optional<calibration::LateCamera> late;
};

std::string as_json(const RigSource& calibration, const std::optional<ImageEvidence>& evidence) {
  const rig_formats::RigFile& file = calibration.file;
  const camera::Rig& rig = file.rig;
  const camera::Rig from_camera_0 = rig.in_frame_of_camera_0();
  Json cameras = Json::array(), baselines = Json::array();
  for (std::size_t i = 0; i < rig.size(); ++i) {
    cameras.push_back(camera_json(rig, from_camera_0, i));
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      const double length = (rig.rig_from_cam(i).translation() - rig.rig_from_cam(j).translation()).norm();
      baselines.push_back({{"cameras", {i, j}}, {"length_m", length}});
    }
  }
  Json json = {{"schema", 1},
               {"format", calibration.format},
               {"cameras", std::move(cameras)},
               {"baselines", std::move(baselines)},
               {"notes", file.notes},
               {"warnings", warnings_of(rig)}};
  if (evidence) json["images"] = evidence_json(evidence->pairs);
  if (evidence) {
    const auto& late = evidence->late;
    json["late_camera"] =
        late ? late_camera_json({{"camera", late->camera}, {"reference", late->reference}}, *late) : Json();
  }
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string as_text(const RigSource& calibration, const std::optional<ImageEvidence>& evidence) {
  const rig_formats::RigFile& file = calibration.file;
  std::string text = fmt::format("format: {}\n", calibration.format) + calibration::describe_rig(file.rig);
  for (const std::string& note : file.notes) text += "note: " + note + "\n";
  for (const std::string& warning : warnings_of(file.rig)) text += "warning: " + warning + "\n";
  if (!evidence) return text;
  if (const auto& late = evidence->late) {
    text += "warning: " +
            calibration::describe_late_camera(*late, file.rig.camera(late->camera).name,
                                              file.rig.camera(late->reference).name) +
            "\n";
  }
  return text + calibration::describe_evidence(evidence->pairs);
}

// Tests the calibration against the images of a recording.
Result<ImageEvidence> check_against_images(const RigReportRequest& request, bool own_calibration) {
  constexpr double kTolerance_s = 0.1;  // wide enough to group the images of cameras that capture late
  dataset::DatasetRequest recording = request.recording;
  recording.path = request.images;
  if (!own_calibration) recording.rig_file = request.file;
  recording.sync_tolerance_s = kTolerance_s;
  const auto dataset = dataset::open_dataset(recording);
  if (!dataset) return dataset.error();
  auto pairs = test_against_images(*dataset);
  if (!pairs) return pairs.error();
  return ImageEvidence{*std::move(pairs), late_camera(*dataset, dataset->rig)};
}

}  // namespace

Result<std::string> report_rig(const RigReportRequest& request) {
  const auto calibration = read_calibration(request);
  if (!calibration) return calibration.error();
  if (!request.svg.empty()) {
    const Status written = write_atomically(request.svg, report::rig_plot_svg(calibration->file.rig));
    if (!written) return written.error();
  }
  std::optional<ImageEvidence> evidence;
  if (!request.images.empty()) {
    auto checked = check_against_images(request, calibration->of_recording);
    if (!checked) return checked.error();
    evidence = std::move(*checked);
  }
  return request.json ? as_json(*calibration, evidence) : as_text(*calibration, evidence);
}

}  // namespace bslam::session
