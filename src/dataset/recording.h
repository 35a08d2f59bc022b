// The interface of data set formats, with one implementation per format. Internal to this folder.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// A recorded data set on disk. Cameras are numbered from 0 in the order of their folders.
class Recording {
 public:
  virtual ~Recording() = default;

  virtual std::size_t camera_count() const = 0;
  // Returns true if the data set contains the calibration of at least one camera.
  virtual bool calibrated() const { return true; }
  // Returns the calibration in the data set.
  virtual Result<camera::RigCamera> calibration(std::size_t camera) const = 0;
  // Returns all listed images with their recorded time stamps; at least one.
  virtual Result<image_files::ImageList> images(std::size_t camera) const = 0;
  virtual std::optional<std::filesystem::path> ground_truth() const { return std::nullopt; }
};

using RecordingResult = Result<std::unique_ptr<Recording>>;

// Each function returns an Error that names the expected files if `folder` does not have its format.
RecordingResult open_euroc(const std::filesystem::path& folder);   // mav0/camN/data.csv
RecordingResult open_kitti(const std::filesystem::path& folder);   // image_N/NNNNNN.png and times.txt
RecordingResult open_folder(const std::filesystem::path& folder);  // camN/<ns>.png

// Each function returns true if the folder seems to have the format.
bool looks_like_euroc(const std::filesystem::path& folder);
bool looks_like_kitti(const std::filesystem::path& folder);
bool looks_like_folder(const std::filesystem::path& folder);

}  // namespace bslam::dataset
