// Whether a rig fits along its tour: cameras inside walls or behind them would render images that no camera can take.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "camera/rig.h"
#include "simulator/surface.h"
#include "synthetic/trajectory.h"

namespace bslam::simulator {

constexpr double kCameraClearance = 0.05;  // metres; minimum distance of a camera from all surfaces

struct Collision {
  std::size_t camera = 0;
  double time_s = 0;    // since the beginning of the trajectory
  double distance = 0;  // metres from the nearest surface; 0: a surface is between the body and the camera
};

// Returns the first time in [from_s, to_s] at which a camera is too close to a surface, or behind one as seen from the
// origin of the body frame, which the tour keeps clear of all surfaces.
std::optional<Collision> first_collision(const std::vector<Surface>& surfaces, const camera::Rig& rig,
                                         const synthetic::Trajectory& trajectory, double from_s, double to_s);

}  // namespace bslam::simulator
