// Finds the sequences of a benchmark folder and their ground truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace bslam::benchmark {

// The frame whose poses a ground truth file contains.
enum class TruthFrame { kBody, kCamera0 };

struct Truth {
  std::filesystem::path file;
  TruthFrame frame = TruthFrame::kBody;
  std::optional<std::filesystem::path> times = {};  // time stamps of KITTI poses
};

struct Sequence {
  std::string name;  // name of the folder
  std::filesystem::path folder;
  std::optional<Truth> released;   // ground truth file of the data set
  std::optional<Truth> corrected;  // groundtruth_body.tum: recomputed body poses for protocol T (measure_run.h)
  std::optional<std::filesystem::path>
      rig;  // dso/camchain.yaml: a calibration that `bslam run` does not find by itself
};

// Returns the sequences of a folder in order of their names: the folder itself if it is a sequence, otherwise its
// subfolders that are. A sequence contains mav0 (EuRoC, TUM-VI) or image_N and times.txt (KITTI odometry). Ground
// truth, the first that exists: mav0/state_groundtruth_estimate0/data.csv (EuRoC), mav0/mocap0/data.csv and
// dso/gt_imu.csv (TUM-VI), poses.txt in the sequence or ../../poses/NAME.txt (KITTI), groundtruth_cam0.tum (bslam
// simulate). Error: the folder does not exist or contains no sequence.
Result<std::vector<Sequence>> find_sequences(const std::filesystem::path& folder);

}  // namespace bslam::benchmark
