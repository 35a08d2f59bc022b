// What `bslam rig info` tells of a calibration.
#pragma once

#include <string>

#include "base/result.h"

namespace bslam::session {

struct RigReportRequest {
  std::string file;         // a calibration, or the folder of a data set
  bool json = false;        // else text
  std::string svg = {};     // draw into this file; empty: nowhere
  std::string images = {};  // a data set to test the extrinsics against; empty: none
};

// Text or JSON for stdout: format, cameras, places, overlaps, notes, warnings. Errors: what cannot be read or written.
Result<std::string> report_rig(const RigReportRequest& request);

}  // namespace bslam::session
