// Simulated recordings on disk, in EuRoC layout with exact ground truth.
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
  TourOptions tour;  // its duration is the recording's
  ImagingOptions imaging;
  WorldOptions world;
  WorldKind kind = WorldKind::kBuilding;
  std::uint64_t seed = 1;  // of the world
  bool overwrite = false;
};

enum class SimulationOutcome {
  kWritten,
  kWasComplete,  // the same request had been carried out before: nothing was done
  kInterrupted,  // it was asked to stop; what is written serves the next attempt
};

// Called after each picture, from any thread but one at a time: how many of all are there.
using SimulationProgress = std::function<void(std::size_t done, std::size_t total)>;

// Renders the tour through a built-in world and writes into request.folder, making it:
//   mav0/camN/data/STAMP.png, mav0/camN/data.csv
//   mav0/camN/sensor.yaml                        where it can hold the models of all cameras
//   mav0/state_groundtruth_estimate0/data.csv    the body at 200 Hz
//   groundtruth_cam0.tum                         T_world_cam0 at camera 0's times, dropped pictures among them
//   rig.yaml, faults.csv                         the rig in our format; pictures hit by a fault
//   .partial, then .complete                     a digest of the request, and the version of the lists
// A folder that holds a part of the same request's recording is completed, its pictures kept. Errors: a request out of
// range; a folder with something else in it, without `overwrite`; what cannot be written.
Result<SimulationOutcome> write_simulation(const SimulationRequest& request, ThreadPool& pool,
                                           const SimulationProgress& progress = {}, std::stop_token stop = {});

// Digest of all that decides what the recording contains: 16 hexadecimal digits.
std::string simulation_digest(const SimulationRequest& request);

}  // namespace bslam::simulator
