// bslam map: describes saved maps; exports and merges them.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/verbs.h"
#include "storage/map_file.h"
#include "storage/submaps.h"

namespace bslam::cli {
namespace {

namespace fs = std::filesystem;

struct MapArguments {
  std::string file;
  bool json = false;
};

std::string vocabulary_name(std::uint64_t id) { return id == 0 ? "none" : fmt::format("{:016x}", id); }

nlohmann::ordered_json to_json(const storage::SavedMap& saved, std::uintmax_t file_bytes) {
  const map::BundledMap& map = saved.map;
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array(), submaps = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
    const camera::Camera& camera = map.rig().camera(c);
    cameras.push_back({{"name", camera.name},
                       {"model", camera::model_name(camera.model)},
                       {"resolution", {camera.width, camera.height}}});
  }
  for (const storage::Submap& p : storage::submaps_of(map)) {
    submaps.push_back({{"keyframes", p.keyframes.size()},
                       {"landmarks", p.landmarks},
                       {"extent_m", {p.extent.x(), p.extent.y(), p.extent.z()}},
                       {"from", to_seconds(storage::first_time(map, p))},
                       {"to", to_seconds(storage::last_time(map, p))}});
  }
  return {
      {"schema", 1},
      {"version", saved.info.version},
      {"data", saved.info.data},
      {"warning", saved.info.warning.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(saved.info.warning)},
      {"file_bytes", file_bytes},
      {"cameras", std::move(cameras)},
      {"keyframes", map.num_keyframes()},
      {"landmarks", map.num_landmarks()},
      {"observations", map.num_observations()},
      {"scale", map::scale_name(map.scale())},
      {"vocabulary", vocabulary_name(saved.info.vocabulary)},
      {"parts", std::move(submaps)}};
}

void print_info(const storage::SavedMap& saved, std::uintmax_t file_bytes) {
  const map::BundledMap& map = saved.map;
  std::string text =
      fmt::format("{}: {:.1f} MB, written by bslam {}{}\n", saved.file, static_cast<double>(file_bytes) / 1e6,
                  saved.info.version, saved.info.data.empty() ? "" : " from " + saved.info.data);
  for (std::size_t c = 0; c < map.rig().size(); ++c) {
    const camera::Camera& camera = map.rig().camera(c);
    text += fmt::format("camera {} ({}): {}, {}x{}\n", c, camera.name, camera::model_name(camera.model), camera.width,
                        camera.height);
  }
  text += fmt::format("{} keyframes, {} landmarks, {} observations; scale {}; vocabulary {}\n", map.num_keyframes(),
                      map.num_landmarks(), map.num_observations(), map::scale_name(map.scale()),
                      vocabulary_name(saved.info.vocabulary));
  const std::string unit = map.scale() == map::Scale::kMetric ? "m" : "units";
  const std::vector<storage::Submap> submaps = storage::submaps_of(map);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const TimeNs from = storage::first_time(map, submaps[i]), to = storage::last_time(map, submaps[i]);
    text +=
        fmt::format("submap {}: {} keyframes over {:.1f} x {:.1f} x {:.1f} {}, {} landmarks, {:.3f} s to {:.3f} s\n", i,
                    submaps[i].keyframes.size(), submaps[i].extent.x(), submaps[i].extent.y(), submaps[i].extent.z(),
                    unit, submaps[i].landmarks, to_seconds(from), to_seconds(to));
  }
  if (!saved.info.warning.empty()) text += fmt::format("warning of the run that made it: {}\n", saved.info.warning);
  std::fputs(text.c_str(), stdout);
}

int map_info(const MapArguments& arguments) {
  const auto saved = storage::read_map(arguments.file);
  if (!saved) return report_error(saved.error());
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(arguments.file, error);
  if (arguments.json) {
    std::printf("%s\n", to_json(*saved, bytes).dump(1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  } else {
    print_info(*saved, bytes);
  }
  return kExitOk;
}

}  // namespace

void add_map(CLI::App& app, int& exit_status) {
  const auto arguments = std::make_shared<MapArguments>();
  CLI::App* map = app.add_subcommand("map", "describe, export and merge saved maps");
  map->require_subcommand(1);

  CLI::App* info = map->add_subcommand("info", "print cameras, size, submaps, scale, extent and times of a map");
  info->add_option("FILE", arguments->file, "a saved map")->required();
  info->add_flag("--json", arguments->json, "print JSON");
  info->callback([arguments, &exit_status] { exit_status = map_info(*arguments); });

  add_map_export(*map, exit_status);
  add_map_merge(*map, exit_status);
  add_map_transfer(*map, exit_status);
}

}  // namespace bslam::cli
