// Worlds with places that look exactly alike, for tests of place recognition. The seed determines materials, furniture
// and pictures. Repeated parts are identical in every texel.
#pragma once

#include "simulator/building.h"

namespace bslam::simulator {

// A corridor, 18 m x 5 m, of six equal segments of length kCorridorPeriod along x, each with a closed door, pictures
// and furniture on both sides. It is symmetric under a rotation by 180 degrees about its centre, so that it looks the
// same in both directions. The tour leads along one side and back along the other.
Building make_corridor(std::uint64_t seed);
constexpr double kCorridorPeriod = 3.0;  // m

// Two rooms of 6.5 m x 6.5 m, connected by a unique passage. The second room is the first one rotated by 180 degrees
// about the origin. The tour leads through the passage, around the second room, back, and around the first room.
Building make_twin_rooms(std::uint64_t seed);

}  // namespace bslam::simulator
