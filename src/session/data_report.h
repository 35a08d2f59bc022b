// The report of `bslam data info` on a recording.
#pragma once

#include <string>

#include "base/result.h"
#include "dataset/dataset.h"

namespace bslam::session {

struct DataReport {
  std::string text;   // or JSON
  bool runs = false;  // `run` would not refuse the recording, except that it may need a calibration
};

// Returns text or JSON for stdout: format, duration, and for every topic, folder or video its type, images and times;
// which camera it would be; whether the cameras are synchronous; what is missing for a run. Errors: those of
// describe_recording.
Result<DataReport> report_data(const dataset::DatasetRequest& request, bool json);

}  // namespace bslam::session
