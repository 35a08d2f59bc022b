// Recorded data sets: which images there are, when they were taken, and through which rig. Images are read one frame at
// a time (io/frame_reader.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "camera/rig.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

enum class DatasetFormat { kAuto, kEuroc, kKitti, kFolder };

struct DatasetRequest {
  std::filesystem::path path;
  DatasetFormat format = DatasetFormat::kAuto;
  std::optional<std::filesystem::path> rig_file = {};  // default: the calibration the data set carries
  std::vector<int> cameras = {};                       // in this order; the first is camera 0 of the run; empty = all
  double sync_tolerance_s = 0.002;                     // images of different cameras this near make one frame
  std::optional<double> begin_s = {}, end_s = {};      // seconds from the first frame: begin <= t < end
};

// One instant: at most one image of every camera.
struct FrameEntry {
  TimeNs time_ns = 0;  // of camera 0's image, or the earliest where that is missing
  std::vector<std::optional<image_files::ImageFile>> images;  // one per camera in use
};

struct Dataset {
  std::string name;               // of the folder
  DatasetFormat format;           // never kAuto
  camera::Rig rig;                // the cameras in use, in the order asked for; their names are in it
  std::vector<int> cameras_used;  // their places in the whole rig
  // All cameras of the calibration in its order; empty where the data set's own cannot be read for one that is not in
  // use.
  std::optional<camera::Rig> whole_rig;
  TimeNs first_time_ns = 0;        // of the first frame, whatever range was asked for: seconds of a run count from here
  std::vector<FrameEntry> frames;  // in order of time, at least one
  std::optional<std::filesystem::path>
      ground_truth;                   // as the format keeps it: EuRoC csv (body) or KITTI poses (camera 0)
  std::vector<std::string> warnings;  // what was passed over: lines sorted or dropped, images of no frame
};

// Finds the layout, reads the calibration and the lists of images, and groups them into frames (io/frame_grouping.h).
// An image that is listed but cannot be read is no error here; the reader reports it as damaged.
// Errors: no such folder; no known layout; calibration missing or bad; lists missing, empty or not to be parsed; a
// camera without a single image file, or whose images are not of its calibrated resolution; cameras that share no
// instant; cameras asked for twice or not there; an empty or reversed range.
Result<Dataset> open_dataset(const DatasetRequest& request);

}  // namespace bslam::dataset
