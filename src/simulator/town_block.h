// Blocks of the town with their pavements: houses around a yard, halls, parks.
#pragma once

#include "simulator/outdoor_parts.h"
#include "simulator/street_grid.h"

namespace bslam::simulator {

constexpr double kKerb = 0.12;  // metres: height of pavements and yards above the road

enum class Detail {
  kOutline,  // a box with the size of the block
  kHouses,   // houses without windows and street furniture
  kComplete,
};

// The seed of a part of the town: that of the town, and the place of the part in it.
struct PartSeed {
  std::uint64_t town, place;
};

// Adds a horizontal rectangle at a height. The pattern of its texture has its origin in the origin of the world.
void add_flat(Building& building, const Area& area, double z, const Texture& look, double min_texel = 0);

// Adds the block within `area`. Houses and halls are the same in kHouses and kComplete.
void add_block(Building& building, const Area& area, const PartSeed& seed, Detail detail);

}  // namespace bslam::simulator
