// The plain format: a folder of images for each camera, which are named by their time stamps or numbers. The
// calibration is given separately.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "dataset/camera_folders.h"
#include "dataset/image_names.h"
#include "dataset/listed_images.h"
#include "dataset/recording.h"
#include "dataset/time_list.h"
#include "rig_formats/euroc_sensor.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// The images of a camera, with numbers or with times.
struct CameraImages {
  image_files::ImageList list;
  std::string times_from;  // source of the times; empty: file names
  bool unit_is_known = false;
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
          .unit_is_known = named.in_seconds,
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

// Returns true if a file that a list names, such as 000.png, front/000.png or front/data/000.png, may be in the folder
// of a camera.
bool may_be_in(const CameraFolder& camera, const fs::path& name) {
  const fs::path parent = name.lexically_normal().parent_path(), below = parent.filename(),
                 above = parent.parent_path().filename();
  if (below.empty() || below == camera.name) return true;
  return below == camera.images.filename() && (above.empty() || above == camera.name);
}

// Times of images that the list names. One list may name those of several folders.
Result<CameraImages> with_named_times(const TimeList& list, const std::vector<fs::path>& files,
                                      const CameraFolder& camera) {
  const fs::path& folder = camera.images;
  std::vector<image_files::ImageFile> images;
  for (std::size_t k = 0; k < list.names.size(); ++k) {
    const fs::path name = list.names[k];
    if (!may_be_in(camera, name)) continue;
    images.push_back({folder / name.filename(), list.times_ns[k]});
  }
  if (images.empty()) {
    return Error{list.file.string(), "", "no image of " + folder.string(),
                 "lines of TIME FILENAME for the images in it"};
  }
  return CameraImages{.list = listed_images(std::move(images), list.file, folder, files, unit_of(list)),
                      .times_from = list.file.filename().string()};
}

// Images whose numbers are multiplied by the interval of a rate. A list of times is not used then.
Result<CameraImages> at_rate(Result<NamedImages> named, const CameraFolder& camera, const fs::path& data) {
  constexpr TimeNs kNoCount = 1'000'000'000;  // seconds since 1970 are more
  if (!named) return named.error();
  CameraImages out = from_names(*std::move(named), camera.images);
  const TimeNs first = out.list.images.empty() ? 0 : out.list.images.front().time_ns;
  if (!out.unit_is_known && first >= kNoCount) {
    out.list.warnings.push_back(
        fmt::format("{}: {} and the others are taken for the numbers of images, since --rate was given; if they are "
                    "time stamps, replace it by --stamp-unit, such as --stamp-unit s",
                    camera.images.string(), first));
  }
  const auto list = find_time_list(camera.images, data);
  if (list && *list && !out.unit_is_known)
    out.list.warnings.push_back((*list)->string() + ": not used, since --rate says when the images were taken");
  return out;
}

// Returns the images of a folder. Numbers get their times from a list, if there is one.
Result<CameraImages> read_camera(const CameraFolder& camera, const fs::path& data, const TimeStampOptions& stamps) {
  const std::vector<fs::path> files = image_files_of(camera.images);
  if (files.empty()) return Error{camera.images.string(), "", "no images", "images named by their time stamps in ns"};
  auto named = images_by_name(camera.images, files);
  if (stamps.rate_hz) return at_rate(std::move(named), camera, data);
  if (named && (named->in_seconds || are_nanoseconds(numbers_of(*named))))
    return from_names(*std::move(named), camera.images);
  const auto file = find_time_list(camera.images, data);
  if (!file) return file.error();
  if (!*file && !named) return named.error();
  if (!*file) return from_names(*std::move(named), camera.images);
  const auto list = read_time_list(**file, stamps.unit_ns.has_value());
  if (!list) return list.error();
  if (list->names.empty() && !named) return named.error();
  auto out = list->names.empty() ? with_times(*list, *std::move(named), camera.images)
                                 : with_named_times(*list, files, camera);
  if (out) out->unit_is_known = !stamps.unit_ns;
  return out;
}

class FolderRecording : public Recording {
 public:
  FolderRecording(fs::path data, CameraFolders folders, const TimeStampOptions& stamps)
      : data_(std::move(data)), folders_(std::move(folders)) {
    for (const CameraFolder& folder : folders_.cameras) cameras_.push_back(read_camera(folder, data_, stamps));
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
    return std::ranges::any_of(cameras_, [](const auto& camera) { return camera && camera->unit_is_known; });
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
  std::vector<int> recorded_numbers() const override {
    return folders_.own_names ? std::vector<int>() : folder_numbers(folder_names());
  }

 private:
  // Files that look like images, in all folders together.
  void warn_of_left_out() {
    std::size_t count = 0;
    std::string first;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      std::error_code error;
      for (fs::directory_iterator it(folders_.cameras[c].images, error), end; !error && it != end;
           it.increment(error)) {
        if (is_undecodable_image(it->path()) && count++ == 0) first = it->path().string();
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

RecordingResult open_folder(const fs::path& path, const std::vector<std::string>& names,
                            const TimeStampOptions& stamps) {
  const fs::path folder = path.has_filename() ? path : path.parent_path();
  auto folders = find_camera_folders(folder, names);
  if (!folders) return folders.error();
  if (folders->cameras.empty())
    return Error{folder.string(), "", "no camera",
                 "cam0, cam1, ..., left and right, or other folders, with images named by their time stamps in ns"};
  return std::unique_ptr<Recording>(std::make_unique<FolderRecording>(folder, *std::move(folders), stamps));
}

}  // namespace bslam::dataset
