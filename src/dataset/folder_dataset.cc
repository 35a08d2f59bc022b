// The plain format: a folder of images for each camera, which are named by their time stamps or numbers. The
// calibration is given separately.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "dataset/camera_folders.h"
#include "dataset/image_names.h"
#include "dataset/recording.h"
#include "dataset/time_list.h"
#include "rig_formats/euroc_sensor.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// The images of a camera, with numbers or with times.
struct CameraImages {
  image_files::ImageList list;
  std::string times_from;  // what the times are from; empty: their unit is unknown
  std::string left_out = {};
  std::size_t left_out_count = 0;
};

std::vector<TimeNs> numbers_of(const NamedImages& named) {
  std::vector<TimeNs> numbers;
  for (const image_files::ImageFile& image : named.images) numbers.push_back(image.time_ns);
  return numbers;
}

CameraImages from_names(NamedImages named, const fs::path& folder) {
  const auto unit = named.in_seconds ? image_files::StampUnit::kSeconds : image_files::StampUnit::kOfFile;
  return {.list = image_files::in_time_order(std::move(named.images), folder.string(), unit),
          .times_from = named.in_seconds ? "names, in seconds" : "",
          .left_out = std::move(named.left_out),
          .left_out_count = named.left_out_count};
}

image_files::StampUnit unit_of(const TimeList& list) {
  return list.in_seconds ? image_files::StampUnit::kSeconds : image_files::StampUnit::kOfFile;
}

// Times of images in the order of their numbers.
Result<CameraImages> with_times(const TimeList& list, NamedImages named, const fs::path& folder) {
  if (list.times_ns.size() != named.images.size()) {
    return Error{list.file.string(), "", fmt::format("{} times", list.times_ns.size()),
                 fmt::format("{}, one for each image in {}", named.images.size(), folder.string())};
  }
  for (std::size_t k = 0; k < named.images.size(); ++k) named.images[k].time_ns = list.times_ns[k];
  CameraImages out{.list = image_files::in_time_order(std::move(named.images), list.file.string(), unit_of(list)),
                   .times_from = list.file.filename().string(),
                   .left_out = std::move(named.left_out),
                   .left_out_count = named.left_out_count};
  return out;
}

// Times of images that the list names. One list may name those of several folders.
Result<CameraImages> with_named_times(const TimeList& list, const std::vector<fs::path>& files,
                                      const fs::path& folder) {
  std::map<std::string, bool> unused;  // by the name of the file: whether no time was found for it
  for (const fs::path& file : files) unused[file.filename().string()] = true;
  const std::string parent = folder.filename().string();
  std::vector<image_files::ImageFile> images;
  for (std::size_t k = 0; k < list.names.size(); ++k) {
    const fs::path name = list.names[k];
    const std::string below = name.parent_path().filename().string();
    if (!below.empty() && below != parent) continue;
    if (const auto file = unused.find(name.filename().string()); file != unused.end()) file->second = false;
    images.push_back({folder / name.filename(), list.times_ns[k]});
  }
  if (images.empty()) {
    return Error{list.file.string(), "", "no image of " + folder.string(),
                 "lines of TIME FILENAME for the images in it"};
  }
  CameraImages out{.list = image_files::in_time_order(std::move(images), list.file.string(), unit_of(list)),
                   .times_from = list.file.filename().string()};
  for (const auto& [file, is_unused] : unused) {
    if (is_unused && out.left_out_count++ == 0) out.left_out = (folder / file).string();
  }
  return out;
}

// Returns the images of a folder. Numbers get their times from a list, if there is one and `lists` may be used.
Result<CameraImages> read_camera(const CameraFolder& camera, const fs::path& data, bool lists) {
  const std::vector<fs::path> files = image_files_of(camera.images);
  if (files.empty()) return Error{camera.images.string(), "", "no images", "images named by their time stamps in ns"};
  auto named = images_by_name(camera.images, files);
  if (named && (named->in_seconds || !lists || are_nanoseconds(numbers_of(*named))))
    return from_names(*std::move(named), camera.images);
  const auto list = lists ? find_time_list(camera.images, data) : Result(std::optional<TimeList>());
  if (!list) return list.error();
  if (*list && !(*list)->names.empty()) return with_named_times(**list, files, camera.images);
  if (!named) return named.error();
  return *list ? with_times(**list, *std::move(named), camera.images) : from_names(*std::move(named), camera.images);
}

class FolderRecording : public Recording {
 public:
  FolderRecording(fs::path data, CameraFolders folders, bool lists)
      : data_(std::move(data)), folders_(std::move(folders)) {
    for (const CameraFolder& folder : folders_.cameras) cameras_.push_back(read_camera(folder, data_, lists));
    warn_of_left_out();
  }

  std::size_t camera_count() const override { return folders_.cameras.size(); }
  bool calibrated() const override { return false; }
  std::vector<std::string> warnings() const override { return folders_.warnings; }

  Result<camera::RigCamera> calibration(std::size_t) const override {
    const std::string data = data_.string();
    return Error{data, "", "no calibration", "a rig file (--rig FILE)",
                 "no calibration in " + data + "; specify it with --rig FILE"};
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    if (!cameras_[camera]) return cameras_[camera].error();
    return cameras_[camera]->list;
  }

  bool has_times() const override {
    return std::ranges::any_of(cameras_, [](const auto& camera) { return camera && !camera->times_from.empty(); });
  }
  std::string stamps_from(std::size_t camera) const override {
    const bool known = cameras_[camera] && !cameras_[camera]->times_from.empty();
    return known ? cameras_[camera]->times_from : "names";
  }
  std::vector<std::string> folder_names() const override {
    std::vector<std::string> names;
    for (const CameraFolder& folder : folders_.cameras) names.push_back(folder.name);
    return names;
  }
  bool has_own_names() const override { return folders_.own_names; }

 private:
  // Files that look like images, in all folders together.
  void warn_of_left_out() {
    std::size_t count = 0;
    std::string first;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      std::error_code error;
      for (fs::directory_iterator it(folders_.cameras[c].images, error), end; !error && it != end;
           it.increment(error)) {
        if (may_be_image(it->path()) && count++ == 0) first = it->path().string();
      }
      if (!cameras_[c] || cameras_[c]->left_out_count == 0) continue;
      if (count == 0) first = cameras_[c]->left_out;
      count += cameras_[c]->left_out_count;
    }
    if (count == 0) return;
    folders_.warnings.push_back(
        count == 1
            ? fmt::format("{}: a file that looks like an image is not used: {}", data_.string(), first)
            : fmt::format("{}: {} files that look like images are not used, such as {}", data_.string(), count, first));
  }

  fs::path data_;
  CameraFolders folders_;
  std::vector<Result<CameraImages>> cameras_;
};

}  // namespace

bool looks_like_folder(const fs::path& folder) {
  const auto found = find_camera_folders(folder, {});
  return found && !found->own_names && std::ranges::any_of(found->cameras, [](const CameraFolder& camera) {
           return !image_files_of(camera.images).empty();
         });
}

bool has_folders_of_images(const fs::path& folder) {
  const auto found = find_camera_folders(folder, {});
  return found && !found->cameras.empty();
}

RecordingResult open_folder(const fs::path& path, const std::vector<std::string>& names, bool lists) {
  const fs::path folder = path.has_filename() ? path : path.parent_path();
  auto folders = find_camera_folders(folder, names);
  if (!folders) return folders.error();
  if (folders->cameras.empty())
    return Error{folder.string(), "", "no camera",
                 "cam0, cam1, ..., left and right, or other folders, with images named by their time stamps in ns"};
  return std::unique_ptr<Recording>(std::make_unique<FolderRecording>(folder, *std::move(folders), lists));
}

}  // namespace bslam::dataset
