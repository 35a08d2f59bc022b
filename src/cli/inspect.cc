// bslam inspect: writes the BundledFrame of one input frame as JSON.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/output_file.h"
#include "cli/config_arguments.h"
#include "cli/dataset_arguments.h"
#include "cli/verbs.h"
#include "dataset/frame_reader.h"
#include "image_decoding/image_file.h"
#include "system/single_frame.h"

namespace bslam::cli {
namespace {

struct InspectArguments {
  DatasetArguments data;
  ConfigArguments config;
  std::string out;
  int frame = 0;
};

nlohmann::ordered_json to_json(const frame::BundledFrame& frame, const dataset::Dataset& dataset) {
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const feature::Keypoints& k = frame.cameras[c].keypoints;
    nlohmann::ordered_json keypoints = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < k.size(); ++i) {
      keypoints.push_back({k.pixel[i].x(), k.pixel[i].y(), k.level[i], geometry::degrees(k.angle[i])});
    }
    cameras.push_back({{"name", dataset.rig.camera(c).name}, {"keypoints", std::move(keypoints)}});
  }
  nlohmann::ordered_json features = nlohmann::ordered_json::array();
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    nlohmann::ordered_json observations = nlohmann::ordered_json::array();
    for (const frame::KeypointRef r : frame.bundled.keypoints(FeatureId(f))) {
      observations.push_back({r.camera.value(), r.keypoint.value()});
    }
    const auto& point = frame.bundled.point(FeatureId(f));
    nlohmann::ordered_json place;
    if (point) place = {point->point_rig.x(), point->point_rig.y(), point->point_rig.z()};
    features.push_back({{"id", f}, {"observations", std::move(observations)}, {"point_cam0", std::move(place)}});
  }
  return {{"time", to_seconds(frame.time_ns)}, {"cameras", std::move(cameras)}, {"features", std::move(features)}};
}

// The file must not be one of the input, and is replaced only if it is of this kind.
Status check_out(const InspectArguments& a) {
  if (Status s = check_not_input(a.out, "--out", {a.data.path, a.data.rig, a.config.file}); !s) return s;
  return check_output_file(a.out, "--out", true, "{\n \"time\"");
}

int inspect(const InspectArguments& arguments) {
  if (const Status s = check_out(arguments); !s) return report_error(s.error());
  const auto config = resolve_config(arguments.config);
  if (!config) return report_error(config.error());
  const auto request = dataset_request(arguments.data, config->io.sync_tolerance);
  if (!request) return report_error(request.error());
  const auto dataset = dataset::open_dataset(*request);
  if (!dataset) return report_error(dataset.error());
  if (arguments.frame < 0 || static_cast<std::size_t>(arguments.frame) >= dataset->frames.size()) {
    return report_error({arguments.data.path, "--frame", std::to_string(arguments.frame),
                         "0 to " + std::to_string(dataset->frames.size() - 1)});
  }
  auto masks = image_decoding::read_masks(dataset->rig);
  if (!masks) return report_error(masks.error());
  const auto images = dataset::read_frame(*dataset, static_cast<std::size_t>(arguments.frame));
  const auto frame = system::single_frame(dataset->rig, *config, *std::move(masks), images);
  const Status written = write_atomically(
      arguments.out, to_json(frame, *dataset).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  if (!written) return report_error(written.error());
  std::printf("%zu keypoints, %zu unique features = %zu monocular + %zu matched\n%s\n", frame.num_keypoints(),
              frame.bundled.size(), frame.bundled.num_monocular(), frame.bundled.num_matched(), arguments.out.c_str());
  return kExitOk;
}

}  // namespace

void add_inspect(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<InspectArguments>();
  CLI::App* verb = app.add_subcommand(
      "inspect", "write the keypoints of one input frame, and which of them were matched between cameras, as JSON");
  add_dataset_options(*verb, a->data);
  verb->add_option("--frame", a->frame, "index of the input frame, counted from 0")->required();
  verb->add_option("--out", a->out, "JSON file to write")->required();
  add_config_options(*verb, a->config);
  verb->callback([a, &exit_status] { exit_status = inspect(*a); });
}

}  // namespace bslam::cli
