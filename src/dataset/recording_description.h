// Describes the content of a recording, to help the user decide how to run it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "dataset/dataset.h"

namespace bslam::dataset {

// Time of recording minus time stamp of the header, in seconds.
struct LagDescription {
  double least = 0, median = 0, most = 0;
};

// A topic, a folder of images, or a video.
struct StreamDescription {
  std::string name;           // topic, folder or file
  std::string type;           // type of its messages; "images" or "video" if there are none
  std::string encoding;       // encoding of the pixels, files or messages
  int width = 0, height = 0;  // pixels; 0 if it has no images or they cannot be read
  std::uint64_t count = 0;    // number of images or messages
  // Times of all images in increasing order; for other messages only the first and the last.
  std::vector<TimeNs> times = {};
  std::string stamps = {};  // source of the times, such as "header"
  std::optional<LagDescription> lag = {};
  int camera = -1;          // which camera of the run it would be; -1: none
  bool calibrated = false;  // the recording has intrinsics of it
  std::string unused = {};  // reason why its images would not be used, if it has any
  std::vector<std::string> notes = {};
};

// Time differences between the images of a camera and those of camera 0.
struct SynchronyDescription {
  int camera = 0;
  std::size_t images = 0;    // number of images of the camera
  std::size_t together = 0;  // number of images with an image of camera 0 within the tolerance of the request
  double median_ms = 0;      // median time to the nearest image of camera 0
};

struct RecordingDescription {
  std::string format;  // such as "ROS 1 bag"
  std::vector<StreamDescription> streams;
  bool proposed = true;  // the assignment of streams to cameras is a proposal, not requested by the user
  std::vector<std::string> warnings = {};
  std::vector<std::string> missing = {};  // input that `run` needs besides the recording; empty if nothing is missing
  std::string refusal = {};        // the error with which `run` would refuse the recording; empty if it would run
  bool only_uncalibrated = false;  // the error is that there is no calibration, and the images have no faults
  std::vector<SynchronyDescription> synchrony = {};  // one entry per camera except camera 0
};

// Opens a recording as open_dataset does, but needs no calibration. Errors: those of finding and opening the recording.
Result<RecordingDescription> describe_recording(const DatasetRequest& request);

}  // namespace bslam::dataset
