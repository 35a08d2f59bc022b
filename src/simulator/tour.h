// Trajectories of the body frame of the rig through the built-in worlds other than the town, with the motion of a
// person walking.
#pragma once

#include "simulator/building.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

struct TourOptions {
  double duration_s = 20.0;
  int laps = 0;  // complete laps within the duration; 0: as many as a walking pace allows
  // Mean speed in m/s if `laps` is 0, in which case the tour may end anywhere; ignored if `laps` is given. 0:
  // determined by duration and laps. In the town: the largest speed, 0 for kTownSpeed.
  double speed_mps = 0;
  std::uint64_t seed = 1;  // seed of sway and viewing directions
  double length_m = 0;     // metres, length of a drive through the town; must be 0 for other worlds
  bool back = false;       // turns around after half of the duration and returns along the same path
};

// Returns the tour through `building`: laps at walking pace, each with different sway. With complete laps, the tour
// ends at its initial pose; with `back`, if it takes more than 4.2 s, at its initial position, turned by 180 degrees.
// If the duration is too short for a lap, the tour covers part of a lap. `duration_s` must be positive.
synthetic::Trajectory make_tour(const simulator::Building& building, const TourOptions& options);

}  // namespace bslam::simulator
