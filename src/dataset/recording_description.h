// What a recording contains, for people who decide how to run it.
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
  std::string name;                // topic, folder or file
  std::string type;                // of its messages; "images" or "video" otherwise
  std::string encoding;            // of the pixels, the files or the messages
  int width = 0, height = 0;       // pixels; 0 if it has no images or they cannot be read
  std::uint64_t count = 0;         // of images or messages
  std::vector<TimeNs> times = {};  // of all images in increasing order; of other messages the first and the last
  std::string stamps = {};         // where the times are from, such as "header"
  std::optional<LagDescription> lag = {};
  int camera = -1;          // which camera of the run it would be; -1: none
  bool calibrated = false;  // the recording has intrinsics of it
  std::string unused = {};  // why it would not be used, if it has images
  std::vector<std::string> notes = {};
};

// How the images of a camera lie to those of camera 0.
struct SynchronyDescription {
  int camera = 0;
  std::size_t images = 0;    // of the camera
  std::size_t together = 0;  // those with an image of camera 0 within the tolerance of the request
  double median_ms = 0;      // median time to the nearest image of camera 0
};

struct RecordingDescription {
  std::string format;  // such as "ROS 1 bag"
  std::vector<StreamDescription> streams;
  bool proposed = true;  // which stream is which camera was not requested
  std::vector<std::string> warnings = {};
  std::vector<std::string> missing = {};  // what `run` needs beside the recording; empty if it would run
  std::string refusal = {};        // the error with which `run` would refuse the recording; empty if it would run
  bool only_uncalibrated = false;  // the error is that there is no calibration, and the images have no faults
  std::vector<SynchronyDescription> synchrony = {};  // of all cameras except 0
};

// Opens a recording as open_dataset does, but needs no calibration. Errors: those of finding and opening the recording.
Result<RecordingDescription> describe_recording(const DatasetRequest& request);

}  // namespace bslam::dataset
