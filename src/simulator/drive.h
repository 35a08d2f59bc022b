// Drives of a vehicle along a closed route: speed, sway, and the sections in which a drive is rendered.
#pragma once

#include <vector>

#include "simulator/closed_path.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

constexpr double kTownSpeed = 8.0;     // metres per second; default
constexpr double kCameraHeight = 1.5;  // metres: of the body above the road

struct Drive {
  synthetic::Trajectory trajectory;
  // Times in seconds at which the sections end, each of about kSectionLength metres; the last one is the duration.
  std::vector<double> section_ends;

  static constexpr double kSectionLength = 100.0;
};

// Drives once along `route` with at most `speed_mps`, slower in curves, with the sway of a vehicle. The drive ends at
// its initial pose.
Drive make_drive(const ClosedPath& route, double speed_mps, std::uint64_t seed);

}  // namespace bslam::simulator
