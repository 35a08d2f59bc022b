// Worlds whose places look exactly alike: what place recognition must not fall for. Materials, furniture and pictures
// follow from the seed; what is repeated is repeated to the texel.
#pragma once

#include "simulator/building.h"

namespace bslam::simulator {

// A corridor, 18 m x 5 m, of six equal pieces of kCorridorPeriod along x, each with a closed door, pictures and
// furniture on either side. Turned by half a turn about its middle it is the same corridor again, so that the way back
// looks like the way there. The tour goes along one side and back along the other.
Building make_corridor(std::uint64_t seed);
constexpr double kCorridorPeriod = 3.0;  // m

// Two rooms of 6.5 m x 6.5 m, the second being the first turned by half a turn about the origin, joined by a passage
// that is like nothing else. The tour goes through the passage, round the second room, back and round the first.
Building make_twin_rooms(std::uint64_t seed);

}  // namespace bslam::simulator
