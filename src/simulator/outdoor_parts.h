// Parts of the outdoor worlds: ground, facades, houses, trees and street furniture.
#pragma once

#include "base/random.h"
#include "simulator/walls.h"

namespace bslam::simulator {

// Adds a rectangle of ground at height 0. The pattern of its texture has its origin in the origin of the world.
void add_ground(Building& building, const Vector2d& low, const Vector2d& high, const Texture& look);

// Adds ground in tiles, so that only those near the tour need fine texels. Their common pattern continues across them.
void add_tiled_ground(Building& building, const Vector2d& low, const Vector2d& high, const Texture& look);

// A facade: from `start` along the unit vector `along`, with the street on its left, as seen along it.
struct Facade {
  Vector2d start, along;
  double length, height;
};

inline Vector2d left_of(const Vector2d& v) { return {-v.y(), v.x()}; }

// Adds a rectangle in front of a facade, facing the street: `at` metres along it, `z` above the ground.
void add_panel(Building& building, const Facade& facade, double at, double z, const Vector2d& size,
               const Texture& look);

// Adds windows in rows, a door and posters.
void decorate(Building& building, const Facade& facade, Random& random);

Material facade_material(Random& random);

// Adds a house: a box, whose base begins at `start` and extends `length` along `along` and `depth` away from the
// street.
void add_house(Building& building, const Vector2d& start, const Vector2d& along, double length, double depth,
               double height, Random& random);

void add_tree(Building& building, const Vector2d& place, Random& random);
void add_bench(Building& building, const Vector2d& place, Random& random);
void add_crates(Building& building, const Vector2d& place, Random& random);
void add_hedge(Building& building, const Vector2d& place, Random& random);
// A board with posters on both sides.
void add_board(Building& building, const Vector2d& place, Random& random);

}  // namespace bslam::simulator
