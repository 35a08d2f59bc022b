// Houses of the town.
#pragma once

#include "simulator/outdoor_parts.h"
#include "simulator/town_block.h"

namespace bslam::simulator {

constexpr double kHouseDepth = 9.0;  // metres

// Adds a wall between two heights, which faces the street on the left of the facade.
void add_front(Building& building, const Facade& facade, double low, double high, const Texture& look);

// Adds a house behind its front, as a town house or with a shop.
void add_town_house(Building& building, const Facade& front, Random& random, Detail detail);

// Adds a hedge along the front of a garden, with an opening.
void add_front_hedge(Building& building, const Facade& line, Random& random);

}  // namespace bslam::simulator
