// The calibration in a file, or in a recording.
#pragma once

#include <string>

#include "base/result.h"
#include "dataset/dataset.h"
#include "rig_formats/rig_file.h"

namespace bslam::session {

struct RigSource {
  rig_formats::RigFile file;
  std::string format;         // for the user
  bool of_recording = false;  // a bag, with its own calibration
};

// Reads a calibration file, or the calibration that the bag or MCAP file `recording.path` contains. Errors: those of
// both.
Result<RigSource> read_rig_source(const dataset::DatasetRequest& recording);

}  // namespace bslam::session
