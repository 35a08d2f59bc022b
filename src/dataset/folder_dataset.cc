// The plain format: folders camN/, or left/ and right/, with images named by their time stamps in nanoseconds. The
// calibration is given separately.
#include <algorithm>
#include <utility>

#include "dataset/recording.h"
#include "rig_formats/euroc_sensor.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

class FolderRecording : public Recording {
 public:
  explicit FolderRecording(std::vector<fs::path> folders) : folders_(std::move(folders)) {}

  std::size_t camera_count() const override { return folders_.size(); }

  bool calibrated() const override { return false; }

  Result<camera::RigCamera> calibration(std::size_t camera) const override {
    const std::string data = folders_[camera].parent_path().string();
    return Error{data, "", "no calibration", "a rig file (--rig FILE)",
                 "no calibration in " + data + "; specify it with --rig FILE"};
  }

  Result<image_files::ImageList> images(std::size_t camera) const override {
    std::vector<image_files::ImageFile> images;
    for (image_files::NumberedImage& image : image_files::images_in(folders_[camera]))
      images.push_back({std::move(image.path), image.number});
    if (images.empty())
      return Error{folders_[camera].string(), "", "no images", "images named by their time stamps in ns"};
    return image_files::in_time_order(std::move(images), folders_[camera].string());
  }

 private:
  std::vector<fs::path> folders_;
};

// cam0, cam1, ..., or left and right.
std::vector<fs::path> image_folders(const fs::path& folder) {
  std::vector<fs::path> folders = rig_formats::camera_folders(folder, "");
  std::error_code error;
  if (!folders.empty()) return folders;
  for (const char* side : {"left", "right"}) {
    if (fs::is_directory(folder / side, error)) folders.push_back(folder / side);
  }
  return folders;
}

}  // namespace

bool looks_like_folder(const fs::path& folder) {
  const auto folders = image_folders(folder);
  return std::any_of(folders.begin(), folders.end(),
                     [](const fs::path& f) { return !image_files::images_in(f).empty(); });
}

RecordingResult open_folder(const fs::path& folder) {
  auto folders = image_folders(folder);
  if (folders.empty())
    return Error{folder.string(), "", "no camera",
                 "cam0, cam1, ..., or left and right, with images named by their time stamps in ns"};
  return std::unique_ptr<Recording>(std::make_unique<FolderRecording>(std::move(folders)));
}

}  // namespace bslam::dataset
