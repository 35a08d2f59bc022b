// Trajectories of the body frame of the rig through the built-in building, at the motion of a person walking.
#pragma once

#include "simulator/building.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

struct TourOptions {
  double duration_s = 20.0;
  int laps = 0;  // complete laps within the duration; 0: as many as a walking pace allows
  // Mean speed; 0: determined by duration and laps. With a speed but no laps, the tour may end anywhere.
  double speed_mps = 0;
  std::uint64_t seed = 1;  // seed of sway and viewing directions
  double length_m = 0;     // metres: of a drive through the town; other tours have none
  bool back = false;       // turns around after half of the duration and returns along the same path
};

// Returns the tour through the building: laps at walking pace, each with different sway. With complete laps, the tour
// ends at its initial pose. If the duration is too short for a lap, the tour covers part of a lap.
synthetic::Trajectory make_tour(const simulator::Building& building, const TourOptions& options);

}  // namespace bslam::simulator
