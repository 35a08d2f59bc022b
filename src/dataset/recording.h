// The interface of data set formats, with one implementation per format. Internal to this folder.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "dataset/recording_description.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// A recorded data set on disk. Cameras are numbered from 0 in the order of their folders.
class Recording {
 public:
  virtual ~Recording() = default;

  virtual std::size_t camera_count() const = 0;
  // Returns true if the data set contains the calibration of at least one camera.
  virtual bool calibrated() const { return true; }
  // Describes the calibration in the data set, such as "CameraInfo of a bag"; empty if it is in a format of rig files.
  virtual std::string calibration_origin() const { return {}; }
  // Returns the calibration in the data set.
  virtual Result<camera::RigCamera> calibration(std::size_t camera) const = 0;
  // Returns the rotation by which a refined calibration turned the camera in the rig frame, if it is camera 0 of the
  // rig in the data set and that says so: T_cam0_rig of camera::Rig.
  virtual geometry::SE3 turn_in_rig(std::size_t /*camera*/) const { return {}; }
  // Returns the error if a file that the calibration of the data set names does not exist. `rig`: the cameras in use.
  virtual Status check_calibration(const camera::Rig& /*rig*/) const { return {}; }
  // Returns the number of a camera in the rig file with which it was recorded, if that has more cameras.
  virtual int number_in_rig(std::size_t camera) const { return static_cast<int>(camera); }
  // Returns all listed images with their recorded time stamps; at least one.
  virtual Result<image_files::ImageList> images(std::size_t camera) const = 0;
  virtual std::optional<std::filesystem::path> ground_truth() const { return std::nullopt; }
  // Returns true if its time stamps have a known unit.
  virtual bool has_times() const { return false; }
  // Source of the time stamps of a camera, as text for the user.
  virtual std::string stamps_from(std::size_t) const { return has_times() ? "times.txt" : "names or data.csv"; }
  // Returns the names of the folders of all cameras, which may be those of cameras in the rig file; empty if they have
  // none, or the order of the cameras was requested.
  virtual std::vector<std::string> folder_names() const { return {}; }
  // Returns true if the order of the cameras does not follow from these names.
  virtual bool has_own_names() const { return false; }
  // The same for the topics of a bag: the names of cameras in them ("/cam0/image_raw": cam0; empty if it is not the
  // only one with that name), and the topics themselves. None if it is no bag, or if their order was requested or
  // recorded; if the rig was recorded, the names are those of its cameras.
  virtual std::vector<std::string> names_in_topics() const { return {}; }
  virtual std::vector<std::string> topics() const { return {}; }
  // Returns the numbers of all cameras in the rig with which they were recorded, such as 0 and 2 of folders cam0 and
  // cam2; empty if nothing says them, or the order of the cameras was requested.
  virtual std::vector<int> recorded_numbers() const { return {}; }
  // Returns true if the recording is several files that were requested in the order of the cameras.
  virtual bool in_requested_order() const { return false; }
  // Messages for the user about damaged or missing parts found when the recording was opened.
  virtual std::vector<std::string> warnings() const { return {}; }
  // Describes the images of the cameras, and what else the recording contains. Warnings and what is missing are added
  // by the caller.
  virtual RecordingDescription describe() const;
};

using RecordingResult = Result<std::unique_ptr<Recording>>;

// A recording of any format. Errors: those of the format; nothing of a known format.
struct OpenRecording {
  DatasetFormat format;
  std::unique_ptr<Recording> recording;
};
Result<OpenRecording> open_recording(const DatasetRequest& request);

// The data set of a recording that is open, as open_dataset returns it.
Result<Dataset> dataset_of(const DatasetRequest& request, const OpenRecording& opened);

// Each function returns an Error that names the expected files if `folder` does not have its format.
RecordingResult open_euroc(const std::filesystem::path& folder);      // mav0/camN/data.csv
RecordingResult open_kitti(const std::filesystem::path& folder);      // image_N/NNNNNN.png and times.txt
RecordingResult open_kitti_raw(const std::filesystem::path& folder);  // image_NN/data/*.png and timestamps.txt
// A folder of images for each camera: `names`, or all if that is empty. Numbers in names of images get their times from
// times.txt and the like (dataset/time_list.h), if there is one and no rate is given.
RecordingResult open_folder(const std::filesystem::path& path, const std::vector<std::string>& names,
                            const TimeStampOptions& stamps);
// Videos: one per camera, or one with the images of two cameras side by side. Their first images were taken together.
RecordingResult open_video(const std::vector<std::filesystem::path>& files, bool side_by_side);

// Each function returns true if the folder seems to have the format.
bool looks_like_euroc(const std::filesystem::path& folder);
bool looks_like_kitti(const std::filesystem::path& folder);
bool looks_like_kitti_raw(const std::filesystem::path& folder);
bool looks_like_folder(const std::filesystem::path& folder);      // camN, or left and right
bool has_folders_of_images(const std::filesystem::path& folder);  // folders with any names

}  // namespace bslam::dataset
