// Writes simulated recordings in EuRoC layout with exact ground truth.
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "base/result.h"
#include "base/thread_pool.h"
#include "simulator/recorder.h"
#include "simulator/tour.h"

namespace bslam::simulator {

struct SimulationRequest {
  std::filesystem::path folder;
  camera::Rig rig;
  RecordingOptions recording;
  TourOptions tour;  // its duration is replaced by the duration of the recording, except in the town
  ImagingOptions imaging;
  WorldOptions world;
  WorldKind kind = WorldKind::kBuilding;
  std::uint64_t seed = 1;  // seed of the world
  bool overwrite = false;
};

enum class SimulationOutcome {
  kWritten,
  kWasComplete,  // the same recording was already complete
  kInterrupted,  // a stop was requested; the next call continues the recording
};

// Called after each image with the number of existing images. Calls come from any thread, but one at a time.
using SimulationProgress = std::function<void(std::size_t done, std::size_t total)>;

// Renders the tour through a built-in world and writes to request.folder, which is created:
//   mav0/camN/data/STAMP.png, mav0/camN/data.csv
//   mav0/camN/sensor.yaml                        if it supports the models of all cameras
//   mav0/state_groundtruth_estimate0/data.csv    poses of the body at 200 Hz
//   groundtruth_cam0.tum                         T_world_cam0 at the times of camera 0, including dropped images
//   rig.yaml, faults.csv                         the rig in the format of bslam; images affected by a fault
//   .partial, then .complete                     a digest of the request, and the version of the lists
// Long drives are rendered section by section, so that the memory does not depend on their length.
// An incomplete recording of the same request is completed, and its images are kept. Errors: a value out of range; a
// camera that is too close to a wall or behind one; a
// folder with other content, unless `overwrite` is set; a file that cannot be written.
Result<SimulationOutcome> write_simulation(const SimulationRequest& request, ThreadPool& pool,
                                           const SimulationProgress& progress = {}, std::stop_token stop = {});

// Returns the duration in seconds of a whole drive through the town. The recording may be shorter. Errors: a length or
// speed out of range, a drive that takes longer than a recording may.
Result<double> drive_duration(const SimulationRequest& request);

// Returns a digest of everything that determines the content of the recording: 16 hexadecimal digits.
std::string simulation_digest(const SimulationRequest& request);

}  // namespace bslam::simulator
