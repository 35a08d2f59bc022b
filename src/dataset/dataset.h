// Recorded data sets: lists of images with their time stamps, and the calibration of the rig. The images themselves are
// read one frame at a time (dataset/frame_reader.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "camera/rig.h"
#include "dataset/time_stamps.h"
#include "image_decoding/pixel_format.h"
#include "image_decoding/vignette.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

enum class DatasetFormat { kAuto, kEuroc, kKitti, kFolder, kBag, kVideo };

// The name of a format, such as "euroc".
std::string_view format_name(DatasetFormat format);

struct DatasetRequest {
  // A folder, a bag, an MCAP file or a video; several bags of one recording, or a video of each camera, are joined by
  // commas.
  std::filesystem::path path;
  DatasetFormat format = DatasetFormat::kAuto;
  std::optional<std::filesystem::path> rig_file = {};  // default: the calibration in the data set
  // Used if there is no other calibration: that of a map of the recording, which has the cameras of the run, or a
  // single camera of which only the resolution is known.
  std::optional<camera::Rig> rig_of_map = {};
  // Of bags image topics, of the format kFolder sub-folders, in the order of the cameras; empty: all, by name.
  std::vector<std::string> topics = {};
  bool side_by_side = false;                       // for a video: each image contains those of two cameras side by side
  std::vector<int> cameras = {};                   // in this order; the first becomes camera 0; empty: all
  double sync_tolerance_s = 0.002;                 // largest time difference within a frame, see IoOptions
  std::optional<double> begin_s = {}, end_s = {};  // seconds from the first frame: begin <= t < end
  TimeStampOptions time_stamps = {};               // unit of the recorded time stamps
  // Colour filters of the cameras in use, in their order, or one for all; empty: those that a bag names.
  std::vector<image_decoding::Bayer> bayer = {};
  std::optional<std::filesystem::path> masks = {};      // folder of masks (dataset/mask_folder.h)
  std::optional<std::filesystem::path> vignettes = {};  // folder of vignettes (dataset/vignette_folder.h)
};

// Images taken at the same time, at most one of every camera.
struct FrameEntry {
  TimeNs time_ns = 0;  // time of the image of camera 0, or of the earliest image if camera 0 has none
  std::vector<std::optional<image_files::ImageFile>> images;  // one per camera in use
};

struct Dataset {
  std::string name;               // name of the folder
  DatasetFormat format;           // never kAuto
  camera::Rig rig;                // the cameras in use, in the requested order
  std::vector<int> cameras_used;  // their indices in the whole rig
  // All cameras of the calibration, in its order; nullopt if the calibration of a camera that is not in use cannot be
  // read, or is not in the recording.
  std::optional<camera::Rig> whole_rig;
  TimeNs first_time_ns = 0;  // time of the first frame of the recording, from which the seconds of a run are counted
  std::vector<FrameEntry> frames;  // in order of time, at least one
  std::optional<std::filesystem::path>
      ground_truth;  // in the format of the data set: EuRoC csv (body), groundtruth_cam0.tum beside mav0 (the first
                     // camera of the rig), or KITTI poses (image_0, the body of its calibration)
  std::vector<std::string>
      warnings;  // for the user: entries that were sorted or dropped, images in frames without camera 0
  std::vector<std::string> sources = {};  // the topic, file or folder of every camera in use
  bool sources_by_name = false;           // they were found by the names of the cameras in the calibration
  bool sources_by_topic = false;          // or by the topics that it names
  // The topics that the calibration names, one per camera of it, which may be empty; or none.
  std::vector<std::string> rig_topics = {};
  std::vector<image_decoding::PixelFormat> pixel_formats = {};  // one per camera in use
  std::vector<image_decoding::Vignette> vignettes = {};         // one per camera in use, or none
};

// Detects the format, reads the calibration and the lists of images, and groups the images into frames
// (dataset/frame_grouping.h). An image that is listed but cannot be read is not an error here; read_frame reports it as
// damaged. Errors: the folder does not exist or has an unknown format; the calibration is missing or invalid; a list is
// missing, empty or malformed; a camera has no image file, or its images differ from the calibrated resolution; two
// cameras have no common frame; a camera is requested twice or does not exist; the time range is empty or reversed; the
// time stamps are hardly nanoseconds (dataset/time_stamps.h); two cameras have the same images.
Result<Dataset> open_dataset(const DatasetRequest& request);

}  // namespace bslam::dataset
