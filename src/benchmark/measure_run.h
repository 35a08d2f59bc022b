// Measures one finished run of a sequence: errors by two protocols, coverage, time and memory.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "benchmark/sequence.h"
#include "geometry/se3.h"

namespace bslam::benchmark {

// RMSE of the positions in metres after rigid alignment, over all frames with a pose.
//   P: the path of camera 0 against the positions of the body in the ground truth of the data set. The camera is not at
//      the body's origin, so that even a perfect path has an error of some centimetres. Used by earlier publications.
//   T: the path of camera 0, converted to the body with the calibration, against the corrected ground truth if there is
//      one, otherwise against that of the data set. Ground truth of camera 0 is compared directly.
struct RunMeasurement {
  int run = 1;               // counted from 1
  std::string failure = {};  // why there is no result; empty if the run succeeded
  std::optional<double> ate_p_m = {}, ate_t_m = {};
  std::optional<double> ate_t_live_m = {};  // protocol T, poses as reported during the run
  std::string truth_problem = {};           // why there are no errors although there is ground truth
  // The calibration gives camera 0 no pose on the body, so that its path is compared with the poses of the body.
  bool body_is_camera = false;
  bool contradicted = false;  // the images contradict the calibration
  int frames = 0, frames_with_pose = 0, submaps = 0, loops = 0;
  std::optional<double> frame_ms_median = {}, frame_ms_p95 = {}, peak_mb = {};
};

// Reads the files of a run from `folder`. `body_from_camera` is the calibrated pose of camera 0 of the run in the body.
// A ground truth that cannot be read or compared is described in `truth_problem`. Error: summary.json cannot be read.
Result<RunMeasurement> measure_run(const std::filesystem::path& folder, const Sequence& sequence,
                                   const geometry::SE3& body_from_camera);

}  // namespace bslam::benchmark
