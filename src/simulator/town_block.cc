#include "simulator/town_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "simulator/town_house.h"

namespace bslam::simulator {
namespace {

constexpr double kPavementTile = 8.0, kYardTile = 15.0, kGarden = 4.0;  // metres
constexpr double kCoarseTexel = 0.25, kYardTexel = 0.15, kGardenTexel = 0.04;

enum class BlockKind { kHouses, kHall, kPark };

BlockKind kind_of(Random& random) {
  const std::uint32_t pick = random.below(100);
  return pick < 76 ? BlockKind::kHouses : pick < 88 ? BlockKind::kHall : BlockKind::kPark;
}

Area inside(const Area& area, double margin) {
  return {area.low + Vector2d::Constant(margin), area.high - Vector2d::Constant(margin)};
}

// The sides of an area with the street on their left, as seen along them: south, west, north, east.
std::array<Facade, 4> sides_of(const Area& a) {
  const Vector2d size = a.size();
  return {Facade{{a.high.x(), a.low.y()}, {-1, 0}, size.x(), 0}, Facade{a.low, {0, 1}, size.y(), 0},
          Facade{{a.low.x(), a.high.y()}, {1, 0}, size.x(), 0}, Facade{a.high, {0, -1}, size.y(), 0}};
}

void add_tiles(Building& b, const Area& area, double tile, double z, const Texture& look, double min_texel) {
  const Vector2d size = area.size();
  const int columns = std::max(1, static_cast<int>(std::lround(size.x() / tile))),
            rows = std::max(1, static_cast<int>(std::lround(size.y() / tile)));
  const Vector2d step(size.x() / columns, size.y() / rows);
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d low = area.low + Vector2d(i * step.x(), j * step.y());
      add_flat(b, {low, low + step}, z, look, min_texel);
    }
  }
}

// The frame between an area and the area `width` inside it.
void add_frame(Building& b, const Area& area, double width, double tile, const Texture& look, double min_texel) {
  const Area inner = inside(area, width);
  const auto add = [&](const Vector2d& low, const Vector2d& high) {
    add_tiles(b, {low, high}, tile, kKerb, look, min_texel);
  };
  add(area.low, {area.high.x(), inner.low.y()});
  add({area.low.x(), inner.high.y()}, area.high);
  add({area.low.x(), inner.low.y()}, {inner.low.x(), inner.high.y()});
  add({inner.high.x(), inner.low.y()}, {area.high.x(), inner.high.y()});
}

// Pavement, kerb stones, gardens and yard.
void add_block_ground(Building& b, const Area& area, Material yard, Random& random, Detail detail) {
  const Texture stone = texture(Material::kPlaster, 0.5f, random),
                slabs = texture(random.below(3) == 0 ? Material::kAsphalt : Material::kPaving, 0.36f, random),
                soil = texture(yard, yard == Material::kLeaves ? 0.26f : 0.3f, random);
  for (const Facade& side : sides_of(area)) add_front(b, side, 0, kKerb, stone);
  if (detail != Detail::kComplete) {
    add_flat(b, area, kKerb, slabs, kCoarseTexel);
    return;
  }
  constexpr double kStone = 0.18;  // metres: width of kerb stones
  add_frame(b, area, kStone, kPavementTile, stone, 0);
  add_frame(b, inside(area, kStone), Street::kPavement - kStone, kPavementTile, slabs, 0);
  const Area garden = inside(area, Street::kPavement);
  add_frame(b, garden, kGarden, kPavementTile, soil, kGardenTexel);
  add_tiles(b, inside(garden, kGarden), kYardTile, kKerb, soil, yard == Material::kLeaves ? kGardenTexel : kYardTexel);
}

// Houses along one side of a block. Villas stand apart behind gardens, others at the pavement and often side by side.
void add_row(Building& b, const Facade& side, const PartSeed& seed, Detail detail) {
  Random random(seed.town, "row", seed.place);
  const bool villas = random.below(3) == 0;
  double at = villas ? 1.0 : 0.0;
  for (std::uint64_t k = 0; side.length - at > 6; ++k) {
    const double left = side.length - at, wanted = random.uniform(7.0, 13.0), width = left - wanted < 7 ? left : wanted;
    const double back = villas ? random.uniform(2.4, 3.4) : random.uniform(0, 0.5);
    const double gap = villas ? random.uniform(2.0, 4.0) : random.below(4) == 0 ? random.uniform(1.5, 3.5) : 0.0;
    const double height = villas ? random.uniform(5.5, 8.0) : random.uniform(6.0, 13.0);
    Random own(seed.town, "house", 64 * seed.place + k);
    const Facade front{side.start + at * side.along - back * left_of(side.along), side.along, width, height};
    add_town_house(b, front, own, detail);
    if (villas && detail == Detail::kComplete)
      add_front_hedge(b, {side.start + at * side.along, side.along, width, 0}, own);
    at += width + gap;
  }
}

void add_houses(Building& b, const Area& area, const PartSeed& seed, Detail detail) {
  constexpr double kBehindCorner = kHouseDepth + 4.5;  // the sides in the west and east lie between the other two
  std::uint64_t index = 0;
  for (Facade side : sides_of(area)) {
    if (side.along.x() == 0) {
      side.start += kBehindCorner * side.along;
      side.length -= 2 * kBehindCorner;
    }
    add_row(b, side, {seed.town, 4 * seed.place + index}, detail);
    ++index;
  }
}

// A long building with plain walls, a few gates and windows high up.
void add_hall(Building& b, const Area& area, Random& random, Detail detail) {
  const Area base = inside(area, random.uniform(0.3, 1.5));
  const Material material = random.below(2) == 0 ? Material::kPlaster : Material::kBrick;
  const double height = random.uniform(4.5, 8.0);
  const Texture wall = texture(material, static_cast<float>(random.uniform(0.38, 0.6)), random);
  add_flat(b, base, height, texture(Material::kTile, 0.4f, random), kCoarseTexel);
  for (Facade side : sides_of(base)) {
    side.height = height;
    Random own(random.next(), "side");
    Texture look = wall;
    look.seed = static_cast<std::uint32_t>(own.next());
    constexpr double kPiece = 10.0;
    const int pieces = std::max(1, static_cast<int>(std::lround(side.length / kPiece)));
    for (int i = 0; i < pieces; ++i) {
      const double from = side.length * i / pieces, to = side.length * (i + 1) / pieces;
      add_front(b, {side.start + from * side.along, side.along, to - from, 0}, 0, height, look);
      b.surfaces.back().pattern_origin = {-to, 0};
    }
    const double gate = own.uniform(4.0, 6.0), windows = own.uniform(4.5, 7.0);
    const double at = own.uniform(2.0, side.length - gate - 2.0);
    const Texture door = texture(Material::kPlanks, 0.4f, own);
    if (detail != Detail::kComplete) continue;
    add_panel(b, side, at, kKerb, {gate, 3.2}, door);
    for (double x = 2; x + 2.5 < side.length; x += windows)
      add_panel(b, side, x, height - 1.3, {2.0, 0.8}, texture(Material::kWindow, 0.5f, own));
  }
}

void add_park(Building& b, const Area& area, Random& random) {
  const Vector2d size = area.size();
  const auto place = [&](double margin) {
    return Vector2d(area.low +
                    Vector2d{random.uniform(margin, size.x() - margin), random.uniform(margin, size.y() - margin)});
  };
  const int trees = static_cast<int>(size.prod() / 160);
  for (int i = 0; i < trees; ++i) add_tree(b, place(1.5), random);
  for (int i = 0; i < 8; ++i) add_hedge(b, place(2.0), random);
  for (int i = 0; i < 5; ++i) add_bench(b, place(2.0), random);
  for (int i = 0; i < 3; ++i) add_board(b, place(2.0), random);
}

void add_outline(Building& b, const Area& area, BlockKind kind, Random& random) {
  add_flat(b, area, kKerb, texture(Material::kLeaves, 0.26f, random), kCoarseTexel);
  if (kind == BlockKind::kPark) return;
  const Area box = inside(area, Street::kPavement + 1);
  const double height = kind == BlockKind::kHall ? 6.0 : 9.0;
  const Texture wall = texture(Material::kPlaster, 0.42f, random);
  const Vector2d middle = 0.5 * (box.low + box.high), size = box.size();
  add_box(b.surfaces, {at_height(middle, 0), {size.x(), size.y(), height}}, wall, wall);
}

}  // namespace

void add_flat(Building& b, const Area& area, double z, const Texture& look, double min_texel) {
  const Vector2d size = area.size();
  b.surfaces.push_back({at_height(area.low, z), {size.x(), 0, 0}, {0, size.y(), 0}, look, area.low, min_texel});
}

void add_block(Building& b, const Area& area, const PartSeed& seed, Detail detail) {
  Random random(seed.town, "block", seed.place), own(seed.town, "inside of block", seed.place);
  const BlockKind kind = kind_of(random);
  if (detail == Detail::kOutline) {
    add_outline(b, area, kind, random);
    return;
  }
  const bool green = kind == BlockKind::kPark || (kind == BlockKind::kHouses && random.below(2) == 0);
  add_block_ground(b, area, green ? Material::kLeaves : Material::kPlaster, random, detail);
  const Area lots = inside(area, Street::kPavement);
  if (kind == BlockKind::kHouses) add_houses(b, lots, seed, detail);
  if (kind == BlockKind::kHall) add_hall(b, lots, own, detail);
  if (kind == BlockKind::kPark && detail == Detail::kComplete) add_park(b, lots, own);
}

}  // namespace bslam::simulator
