// What a data set format has to answer; one implementation per format. Internal to io.
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

// A recorded data set on disk. Cameras are counted from 0 in the order of their folders.
class Recording {
 public:
  virtual ~Recording() = default;

  virtual std::size_t camera_count() const = 0;
  // Does the layout's own calibration come with it, of any camera?
  virtual bool calibrated() const { return true; }
  // The calibration the data set itself carries.
  virtual Result<camera::RigCamera> calibration(std::size_t camera) const = 0;
  // Every image that is listed, with its time as recorded; at least one.
  virtual Result<image_files::ImageList> images(std::size_t camera) const = 0;
  virtual std::optional<std::filesystem::path> ground_truth() const { return std::nullopt; }
};

using RecordingResult = Result<std::unique_ptr<Recording>>;

// Each answers an Error where `folder` is not of that layout, saying what was looked for.
RecordingResult open_euroc(const std::filesystem::path& folder);   // mav0/camN/data.csv
RecordingResult open_kitti(const std::filesystem::path& folder);   // image_N/NNNNNN.png and times.txt
RecordingResult open_folder(const std::filesystem::path& folder);  // camN/<ns>.png

// Does the folder look like that format?
bool looks_like_euroc(const std::filesystem::path& folder);
bool looks_like_kitti(const std::filesystem::path& folder);
bool looks_like_folder(const std::filesystem::path& folder);

}  // namespace bslam::dataset
