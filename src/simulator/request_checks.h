// Whether a simulation can be made as requested. The key of an error is the name of an option.
#pragma once

#include "base/result.h"
#include "simulator/scenery.h"
#include "simulator/simulation_writer.h"

namespace bslam::simulator {

inline constexpr double kMaxDuration_s = 86400.0;  // of a recording

// Checks speed, length and laps.
Status check_tour(const SimulationRequest& request);

// Checks all values.
Status check_request(const SimulationRequest& request);

// Checks that the recording is not longer than the drive, and that no camera comes too close to a surface.
Status check_scenery(const SimulationRequest& request, const Scenery& scenery);

}  // namespace bslam::simulator
