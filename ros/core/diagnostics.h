// The state of SLAM and of each camera as texts and levels.
#pragma once

#include <bslam/bslam.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/outputs.h"

namespace bslam_ros {

struct CameraReport {
  std::string name;
  std::size_t received = 0;  // images that the synchroniser has accepted
  std::size_t rejected = 0;  // images that could not be converted
  std::string last_error;    // reason of the last rejection
  std::array<std::size_t, bslam::kDropReasons> dropped = {};
};

struct Report {
  std::optional<bslam::FrameResult> last;
  std::string failure;        // not empty: the last bundle was refused, or the run has ended
  double seconds_silent = 0;  // since the last frame, or since the start
  bool localize_only = false;
  std::size_t frames = 0, lost = 0, loops = 0, keyframes = 0, landmarks = 0;
  std::vector<CameraReport> cameras;
};

// The first status is that of tracking, the others those of the cameras. Error: lost, a camera that is out, a failure.
// Warning: not started, a scale that is not metric, a degraded camera. Stale: no frame for two seconds.
std::vector<DiagnosticStatus> to_diagnostics(const Report& report);

}  // namespace bslam_ros
