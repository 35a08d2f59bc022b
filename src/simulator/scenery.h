// The content of a recording: the motion of the rig, and the world around each section of its path. Long drives have
// many sections; one at a time is in memory.
#pragma once

#include <functional>
#include <vector>

#include "simulator/building.h"
#include "simulator/tour.h"
#include "simulator/world.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

struct Scenery {
  synthetic::Trajectory trajectory;
  std::vector<double> section_ends;  // seconds; the last one is the duration of the trajectory
  std::function<Building(std::size_t section)> building;
  // All surfaces that a rig could touch; other surfaces may be missing.
  std::function<Building(std::size_t section)> obstacles;
  WorldOptions world;

  std::size_t section_at(double time_s) const;
};

// Prepares the tour of a world. The duration of a tour through the town follows from its length and speed.
Scenery make_scenery(WorldKind kind, std::uint64_t seed, const TourOptions& tour, const WorldOptions& world);

}  // namespace bslam::simulator
