// The report of `bslam rig info` on a calibration.
#pragma once

#include <string>

#include "base/result.h"
#include "dataset/dataset.h"

namespace bslam::session {

struct RigReportRequest {
  std::string file;         // a calibration, the folder of a data set, a bag with CameraInfo, or a saved map
  bool json = false;        // text otherwise
  std::string svg = {};     // draw the rig into this file unless empty
  std::string images = {};  // test the extrinsics against this data set unless empty
  dataset::DatasetRequest recording = {};  // how to read the data set; path and calibration are those above
};

// Returns text or JSON for stdout: format, cameras, poses, overlaps, notes, warnings. Errors: a file that cannot be
// read or written.
Result<std::string> report_rig(const RigReportRequest& request);

}  // namespace bslam::session
