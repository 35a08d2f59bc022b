#include "dataset/camera_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <system_error>
#include <utility>

#include "dataset/topic_names.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// Where each camera of a rig is in a recording, by what the recording says about its cameras; -1: not in it.
struct CameraPlaces {
  std::vector<int> of_cameras;
  bool by_name = false;

  bool has(int camera) const { return of_cameras[static_cast<std::size_t>(camera)] >= 0; }
};

bool is_found(int place) { return place >= 0; }

template <class T>
int place_of(const T& value, const std::vector<T>& in) {
  const auto found = std::ranges::find(in, value);
  return found == in.end() ? -1 : static_cast<int>(found - in.begin());
}

// Returns nullopt unless a folder or topic has the name of a camera.
std::optional<CameraPlaces> places_by_name(const std::vector<std::string>& folders, const Recording& recording,
                                           const camera::Rig& rig) {
  for (const std::vector<std::string>& names : {folders, recording.names_in_topics()}) {
    CameraPlaces places{.of_cameras = {}, .by_name = true};
    for (std::size_t c = 0; c < rig.size(); ++c) places.of_cameras.push_back(place_of(rig.camera(c).name, names));
    if (std::ranges::any_of(places.of_cameras, is_found)) return places;
  }
  return std::nullopt;
}

// The result of looking for the topics that a rig file names.
struct TopicSearch {
  std::optional<CameraPlaces> places;  // if the topics of all selected cameras were found
  std::string problem = {};            // otherwise, if any was found
};

TopicSearch places_by_topic(const rig_formats::RigFile& file, const Recording& recording,
                            const std::vector<int>& cameras) {
  std::vector<std::string> recorded = recording.topics();
  for (std::string& topic : recorded) topic = plain_topic(topic);
  CameraPlaces places;
  for (const std::string& topic : file.topics) places.of_cameras.push_back(place_of(plain_topic(topic), recorded));
  if (std::ranges::none_of(places.of_cameras, is_found)) return {};
  for (const int camera : cameras) {
    const auto c = static_cast<std::size_t>(camera);
    const std::string& topic = file.topics[c];
    if (topic.empty()) return {{}, fmt::format("it names none for {}", file.rig.camera(c).name)};
    if (!places.has(camera)) return {{}, fmt::format("the recording has no images of {}", topic)};
    if (std::ranges::count(places.of_cameras, places.of_cameras[c]) > 1)
      return {{}, fmt::format("it names {} for more than one camera", topic)};
  }
  return {std::move(places)};
}

// Returns true if the numbers may be those of the cameras of the rig: it has all of them, or it is a rig of the first
// cameras of a recording that has all.
bool are_numbers_in(const std::vector<int>& numbers, const camera::Rig& rig) {
  const int largest = std::ranges::max(numbers);
  return largest < static_cast<int>(std::max(rig.size(), numbers.size()));
}

// Returns nullopt if the recording has no numbers of the rig.
std::optional<CameraPlaces> places_by_number(const std::vector<int>& numbers, const camera::Rig& rig) {
  if (numbers.empty() || !are_numbers_in(numbers, rig)) return std::nullopt;
  CameraPlaces places;
  for (std::size_t c = 0; c < rig.size(); ++c) places.of_cameras.push_back(place_of(static_cast<int>(c), numbers));
  if (std::ranges::none_of(places.of_cameras, is_found)) return std::nullopt;
  return places;
}

// Returns true if every camera that is found by its name is also found there by its number.
bool agree(const CameraPlaces& by_name, const CameraPlaces& by_number) {
  for (std::size_t c = 0; c < by_name.of_cameras.size(); ++c) {
    if (is_found(by_name.of_cameras[c]) && by_name.of_cameras[c] != by_number.of_cameras[c]) return false;
  }
  return true;
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
// the recording is of a single camera that may be any, or the folders were requested in their order and not all
// selected numbers are numbers of folders.
bool are_those_selected(const DatasetRequest& request, const Recording& recording, const std::vector<int>& cameras) {
  const std::size_t count = recording.camera_count();
  if (request.cameras.empty() || cameras.size() != count) return false;
  const bool requested = !request.topics.empty() || recording.in_requested_order();
  const bool others = std::ranges::any_of(cameras, [&](int c) { return static_cast<std::size_t>(c) >= count; });
  return requested ? others : count == 1;
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

// The recording has no images of `camera`. `places`: where the others are, if it says so.
Error without_camera(const DatasetRequest& request, const Recording& recording, const camera::Rig& rig,
                     std::size_t camera, const std::optional<CameraPlaces>& places) {
  std::vector<std::string> names;
  std::vector<std::size_t> numbers;
  for (std::size_t c = 0; places && c < rig.size(); ++c) {
    if (!is_found(places->of_cameras[c])) continue;
    names.push_back(rig.camera(c).name);
    numbers.push_back(c);
  }
  const std::size_t there = recording.camera_count();
  const bool requested = !request.topics.empty() || recording.in_requested_order();
  std::string remedy = fmt::format("--cameras {} selects those that it has", fmt::join(numbers, ","));
  if (!recording.names_in_topics().empty()) remedy += ", and --topics names the topics of all cameras in their order";
  if (!places) {
    remedy = request.cameras.empty() ? "--cameras selects a subset"
             : requested             ? "--cameras selects as many as there are images of, in their order"
                                     : "--topics names the images of the selected cameras in their order";
  }
  return {request.path.string(), "",
          places ? fmt::format("images of {}", fmt::join(names, ", "))
                 : fmt::format("images of {} camera{}", there, there == 1 ? "" : "s"),
          fmt::format("images of camera {} ({}) as well, since {} has {} cameras; {}", camera, rig.camera(camera).name,
                      origin_of(request), rig.size(), remedy)};
}

// The numbers of the recorded cameras are not those of the rig, and there are not as many.
Error other_numbers(const DatasetRequest& request, const std::vector<int>& numbers, const camera::Rig& rig) {
  return {request.path.string(), "", fmt::format("images of the cameras with the numbers {}", fmt::join(numbers, ", ")),
          fmt::format("those of the cameras of {} ({}): call these like their folders, or give the calibration of all "
                      "cameras up to the largest number",
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
  return camera::Rig(std::move(cameras), recording.turn_in_rig(0));
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
                                         const rig_formats::RigFile& file, const std::vector<int>& cameras) {
  const camera::Rig& rig = file.rig;
  const std::vector<std::string> topics = recording.topics();
  const TopicSearch by_topic = places_by_topic(file, recording, cameras);
  const auto folders = request.topics.empty() ? recording.folder_names() : std::vector<std::string>();
  const std::vector<int> numbers = recording.recorded_numbers();
  auto places = by_topic.places ? by_topic.places : places_by_name(folders, recording, rig);
  const auto has = [&](int camera) { return places->has(camera); };
  const bool all_named = places && std::ranges::all_of(cameras, has);
  if (!all_named && topics.size() > rig.size()) return unknown_topics(request, topics, rig);
  const bool only_selected = !places && numbers.empty() && are_those_selected(request, recording, cameras);
  const bool own_names = recording.has_own_names() && !folders.empty();
  if (own_names && !all_named && !only_selected && (places || folders.size() != rig.size()))
    return unknown_order(request, recording, folders, rig);
  const auto by_number = places_by_number(numbers, rig);
  if (!all_named && by_number && (!places || agree(*places, *by_number))) places = by_number;
  if (!places && !numbers.empty() && numbers.size() != rig.size()) return other_numbers(request, numbers, rig);
  RecordedCameras out{.numbers = {}, .by_name = places && places->by_name, .by_topic = by_topic.places.has_value()};
  if (!by_topic.problem.empty()) {
    out.warning =
        fmt::format("{}: the topics that it names for its cameras are not used, since {}; choose with --topics",
                    origin_of(request), by_topic.problem);
  }
  for (const int camera : cameras) {
    const int in_order = only_selected ? static_cast<int>(out.numbers.size()) : camera;
    const int place = places ? places->of_cameras[static_cast<std::size_t>(camera)] : in_order;
    if (!is_found(place) || static_cast<std::size_t>(place) >= recording.camera_count())
      return without_camera(request, recording, rig, static_cast<std::size_t>(camera), places);
    out.numbers.push_back(place);
  }
  return out;
}

Result<ChosenRig> choose_given(const DatasetRequest& request, const Recording& recording) {
  const auto file = request.rig_file ? rig_formats::read_rig_file(*request.rig_file)
                                     : Result(rig_formats::RigFile{*request.rig_of_map, {}, {}});
  if (!file) return file.error();
  const camera::Rig* const rig = &file->rig;
  const auto cameras = chosen_cameras(request.cameras, rig->size());
  if (!cameras) return cameras.error();
  const auto recorded = recorded_cameras(request, recording, *file, *cameras);
  if (!recorded) return recorded.error();
  if (!request.rig_file && !recorded->by_name && request.topics.empty() && recording.camera_count() != rig->size())
    return Error{request.path.string(), "", fmt::format("images of {} cameras", recording.camera_count()),
                 fmt::format("those of the map's cameras ({}): name them in this order with --topics, or give --rig",
                             names_of(*rig))};
  ChosenRig chosen{*cameras,          rig->subset(*cameras), *rig,        {}, recorded->numbers,
                   recorded->by_name, recorded->by_topic,    file->topics};
  if (!recorded->warning.empty()) chosen.warnings.push_back(recorded->warning);
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
  camera::Rig rig(std::move(calibrated), recording.turn_in_rig(static_cast<std::size_t>(cameras->front())));
  return ChosenRig{*cameras, std::move(rig), std::nullopt, {}, *cameras};
}

}  // namespace bslam::dataset
