// A square in a town under the open sky, 34 m x 26 m: a block in the middle, houses with facades around it, trees,
// hedges and street furniture. The tour leads around the block. The seed determines houses, trees and materials.
#pragma once

#include "simulator/building.h"

namespace bslam::simulator {

Building make_outdoor(std::uint64_t seed);

}  // namespace bslam::simulator
