// Walks through the built-in building, as trajectories of the rig's body.
#pragma once

#include "simulator/building.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

struct TourOptions {
  double duration_s = 20.0;
  int laps = 0;            // whole laps within the duration; 0: as many as suit a walking pace
  double speed_mps = 0;    // mean pace; 0: from duration and laps. With a pace but no laps the tour may end anywhere
  std::uint64_t seed = 1;  // of sway and looking around
  bool back = false;       // the laps, or what there is time for, in half of the time; then it turns round and walks them back
};

// The tour through the building: rounds of it at walking pace, each with a sway of its own, starting and (with whole
// laps) ending at the same pose. Durations too short for a lap drive a part of one.
synthetic::Trajectory make_tour(const simulator::Building& building, const TourOptions& options);

}  // namespace bslam::simulator
