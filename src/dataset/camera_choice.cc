#include "dataset/camera_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <system_error>
#include <utility>

#include "rig_formats/rig_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// Returns the numbers of the folders that have the names of the cameras; -1 for those without a folder.
std::vector<int> folders_by_name(const std::vector<std::string>& folders, const camera::Rig& rig,
                                 const std::vector<int>& cameras) {
  std::vector<int> out;
  for (const int camera : cameras) {
    const auto found = std::ranges::find(folders, rig.camera(static_cast<std::size_t>(camera)).name);
    out.push_back(found == folders.end() ? -1 : static_cast<int>(found - folders.begin()));
  }
  return out;
}

// Text for messages: the source of the calibration.
std::string origin_of(const DatasetRequest& request) {
  return request.rig_file ? request.rig_file->string() : request.rig_of_map ? "the map" : "the calibration";
}

std::string names_of(const camera::Rig& rig) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < rig.size(); ++c) names.push_back(rig.camera(c).name);
  return fmt::format("{}", fmt::join(names, ", "));
}

// Returns true if the recording contains only the selected cameras: there is one selected camera per folder, and either
// the recording is a single folder, or the folders were requested by name and not all selected numbers are numbers of
// folders.
bool are_those_selected(const DatasetRequest& request, const Recording& recording, const std::vector<int>& cameras) {
  const std::size_t count = recording.camera_count();
  if (request.cameras.empty() || cameras.size() != count) return false;
  const bool others = std::ranges::any_of(cameras, [&](int c) { return static_cast<std::size_t>(c) >= count; });
  return request.topics.empty() ? count == 1 && recording.has_own_names() : others;
}

// The order of the names does not identify the cameras unless there is one name per camera.
Error unknown_order(const DatasetRequest& request, const Recording& recording, const std::vector<std::string>& folders,
                    const camera::Rig& rig) {
  for (std::size_t c = 0; c < recording.camera_count(); ++c) {
    if (const auto images = recording.images(c); !images) return images.error();  // may be those of several cameras
  }
  return {request.path.string(), "", fmt::format("folders of images {}", fmt::join(folders, ", ")),
          fmt::format("those of the cameras of {} ({}): name the folders in their order with --topics, call them "
                      "like the cameras, or select cameras with --cameras",
                      origin_of(request), names_of(rig))};
}

// More topics of images than cameras: some are those of other cameras, and their names do not tell which.
Error unknown_topics(const DatasetRequest& request, const std::vector<std::string>& topics, const camera::Rig& rig) {
  return {request.path.string(), "", fmt::format("image topics {}", fmt::join(topics, ", ")),
          fmt::format("those of the {} cameras of {} ({}): name the topics in their order with --topics", rig.size(),
                      origin_of(request), names_of(rig))};
}

// Returns nullopt if the calibration of any camera cannot be read.
std::optional<camera::Rig> whole_rig(const Recording& recording) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < recording.camera_count(); ++c) {
    auto calibration = recording.calibration(c);
    if (!calibration) return std::nullopt;
    cameras.push_back(*std::move(calibration));
  }
  return camera::Rig(std::move(cameras));
}

}  // namespace

// Returns the requested cameras, or all `count` cameras if none were requested.
Result<std::vector<int>> chosen_cameras(const std::vector<int>& requested, std::size_t count) {
  std::vector<int> cameras = requested;
  if (cameras.empty()) {
    cameras.resize(count);
    std::iota(cameras.begin(), cameras.end(), 0);
  }
  std::set<int> seen;
  for (const int camera : cameras) {
    if (camera < 0 || static_cast<std::size_t>(camera) >= count) {
      return Error{"--cameras", "", std::to_string(camera), fmt::format("camera numbers from 0 to {}", count - 1)};
    }
    if (!seen.insert(camera).second) {
      return Error{"--cameras", "", fmt::format("camera {} twice", camera), "each camera at most once"};
    }
  }
  return cameras;
}

std::optional<fs::path> rig_file_in_folder(const DatasetRequest& request) {
  fs::path folder = request.path.filename().empty() ? request.path.parent_path() : request.path;
  if (folder.filename() == "mav0") folder = folder.parent_path();
  fs::path file = folder / "rig.yaml";
  std::error_code error;
  return fs::is_regular_file(file, error) ? std::optional(std::move(file)) : std::nullopt;
}

Result<RecordedCameras> recorded_cameras(const DatasetRequest& request, const Recording& recording,
                                         const camera::Rig& rig, const std::vector<int>& cameras) {
  const std::vector<std::string> folders =
      request.topics.empty() ? recording.folder_names() : std::vector<std::string>();
  const std::vector<std::string> topics = recording.topics();
  std::vector<int> all(rig.size());
  std::iota(all.begin(), all.end(), 0);
  const auto is_found = [](int folder) { return folder >= 0; };
  for (const std::vector<std::string>& names : {folders, recording.names_in_topics()}) {
    const std::vector<int> found = folders_by_name(names, rig, cameras);
    if (!names.empty() && std::ranges::all_of(found, is_found)) return RecordedCameras{found, true};
  }
  if (topics.size() > rig.size()) return unknown_topics(request, topics, rig);
  if (are_those_selected(request, recording, cameras)) {
    all.resize(cameras.size());
    return RecordedCameras{all, false};
  }
  if (recording.has_own_names() && !folders.empty() &&
      (folders.size() != rig.size() || std::ranges::any_of(folders_by_name(folders, rig, all), is_found)))
    return unknown_order(request, recording, folders, rig);
  for (const int camera : cameras) {
    if (static_cast<std::size_t>(camera) < recording.camera_count()) continue;
    const std::size_t there = recording.camera_count();
    return Error{request.path.string(), "", fmt::format("images of {} camera{}", there, there == 1 ? "" : "s"),
                 fmt::format("images of camera {} as well, since {} has {} cameras; --cameras selects a subset", camera,
                             origin_of(request), rig.size())};
  }
  return RecordedCameras{cameras, false};
}

Result<ChosenRig> choose_given(const DatasetRequest& request, const Recording& recording) {
  const auto rig = request.rig_file ? rig_formats::read_rig(*request.rig_file) : Result(*request.rig_of_map);
  if (!rig) return rig.error();
  const auto cameras = chosen_cameras(request.cameras, rig->size());
  if (!cameras) return cameras.error();
  const auto recorded = recorded_cameras(request, recording, *rig, *cameras);
  if (!recorded) return recorded.error();
  if (!request.rig_file && !recorded->by_name && request.topics.empty() && recording.camera_count() != rig->size())
    return Error{request.path.string(), "", fmt::format("images of {} cameras", recording.camera_count()),
                 fmt::format("those of the map's cameras ({}): name them in this order with --topics, or give --rig",
                             names_of(*rig))};
  ChosenRig chosen{*cameras, rig->subset(*cameras), *rig, {}, recorded->numbers, recorded->by_name};
  if (recording.camera_count() > rig->size()) {
    chosen.warnings.push_back(
        fmt::format("{} has {} cameras but the data set has {}; the additional cameras are not used",
                    origin_of(request), rig->size(), recording.camera_count()));
  }
  return chosen;
}

Result<ChosenRig> choose_own(const DatasetRequest& request, const Recording& recording) {
  const auto cameras = chosen_cameras(request.cameras, recording.camera_count());
  if (!cameras) return cameras.error();
  if (auto whole = whole_rig(recording)) {
    camera::Rig rig = whole->subset(*cameras);
    return ChosenRig{*cameras, std::move(rig), std::move(whole), {}, *cameras};
  }
  std::vector<camera::RigCamera> calibrated;
  for (const int camera : *cameras) {
    auto calibration = recording.calibration(static_cast<std::size_t>(camera));
    if (!calibration) return calibration.error();
    calibrated.push_back(*std::move(calibration));
  }
  return ChosenRig{*cameras, camera::Rig(std::move(calibrated)), std::nullopt, {}, *cameras};
}

}  // namespace bslam::dataset
