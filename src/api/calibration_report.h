// What a run has found out about the calibration of its rig.
#pragma once

#include <bslam/system.h>

#include <string>
#include <vector>

#include "camera/rig.h"
#include "system/system.h"

namespace bslam::api {

struct CalibrationReport {
  CalibrationVerdict verdict = CalibrationVerdict::kUnknown;
  std::vector<std::string> warnings;  // without line breaks
  std::string doubt;                  // reason why the map cannot be relied on; empty if there is none
};

// After system::System::finish(). `given`: the calibration of the run, with its cameras.
CalibrationReport report_calibration(const system::System& system, const camera::Rig& given);

}  // namespace bslam::api
