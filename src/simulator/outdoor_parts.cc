#include "simulator/outdoor_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

constexpr double kGroundTile = 4.0;  // metres

}  // namespace

void add_ground(Building& b, const Vector2d& low, const Vector2d& high, const Texture& look) {
  const Vector2d size = high - low;
  b.surfaces.push_back({at_height(low, 0), {size.x(), 0, 0}, {0, size.y(), 0}, look, low});
}

void add_tiled_ground(Building& b, const Vector2d& low, const Vector2d& high, const Texture& look) {
  const auto count = [](double length) { return std::max(1, static_cast<int>(std::ceil(length / kGroundTile))); };
  const Vector2d size = high - low;
  const int columns = count(size.x()), rows = count(size.y());
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vector2d step(size.x() / columns, size.y() / rows), from = low + Vector2d(i * step.x(), j * step.y());
      add_ground(b, from, from + step, look);
    }
  }
}

void add_panel(Building& b, const Facade& f, double at, double z, const Vector2d& size, const Texture& look) {
  constexpr double kInFront = 0.03;  // metres
  const Vector2d corner = f.start + at * f.along + kInFront * left_of(f.along);
  b.surfaces.push_back(
      {at_height(corner + size.x() * f.along, z), at_height(-size.x() * f.along, 0), {0, 0, size.y()}, look});
}

void decorate(Building& b, const Facade& f, Random& random) {
  const double storey = random.uniform(2.7, 3.3);
  const double window_height = random.uniform(1.2, 1.7), window_width = random.uniform(0.8, 1.2);
  const Vector2d window(window_width, window_height);
  const int columns = std::max(1, static_cast<int>(f.length / random.uniform(1.9, 2.6)));
  const double pitch = f.length / columns;
  const int door = static_cast<int>(random.below(static_cast<std::uint32_t>(columns)));
  const Texture sill = texture(Material::kPlaster, 0.7f, random);
  for (int row = 0; (row + 1) * storey < f.height + 0.2; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double middle = (column + 0.5) * pitch;
      if (row == 0 && column == door) {
        add_panel(b, f, middle - 0.55, 0, {1.1, 2.2}, texture(Material::kWood, 0.4f, random));
      } else if (row == 0 && random.below(3) == 0) {
        add_panel(b, f, middle - 0.5, 0.8, {1.0, 1.4}, texture(Material::kPoster, 0.5f, random));
      } else {
        const double z = row * storey + 0.9;
        add_panel(b, f, middle - 0.5 * window.x(), z, window, texture(Material::kWindow, 0.5f, random));
        add_panel(b, f, middle - 0.5 * window.x() - 0.08, z - 0.12, {window.x() + 0.16, 0.1}, sill);
      }
    }
  }
}

Material facade_material(Random& random) {
  constexpr std::array kMaterials = {Material::kBrick, Material::kPlaster, Material::kBrick, Material::kTile};
  return kMaterials[random.below(kMaterials.size())];
}

void add_house(Building& b, const Vector2d& start, const Vector2d& along, double length, double depth, double height,
               Random& random) {
  const Vector2d centre = start + 0.5 * length * along - 0.5 * depth * left_of(along);
  const double shade = random.uniform(0.35, 0.6);
  const Texture wall = texture(facade_material(random), static_cast<float>(shade), random);
  add_box(b.surfaces, {at_height(centre, 0), {length, depth, height}, std::atan2(along.y(), along.x())}, wall,
          texture(Material::kTile, 0.4f, random));
  decorate(b, {start, along, length, height}, random);
}

void add_tree(Building& b, const Vector2d& place, Random& random) {
  const double trunk = random.uniform(2.4, 3.2), width = random.uniform(0.22, 0.34);
  const Texture bark = texture(Material::kWood, 0.3f, random);
  for (const double yaw : {0.0, 0.25 * std::numbers::pi})
    add_box(b.surfaces, {at_height(place, 0), {width, width, trunk + 0.8}, yaw}, bark, bark);
  const Texture leaves = texture(Material::kLeaves, 0.32f, random);
  for (int i = 0; i < 16; ++i) {
    const double size = random.uniform(0.5, 1.1), angle = random.uniform(0, 2 * std::numbers::pi);
    const double out = random.uniform(0, 1.1), up = random.uniform(0, 2.0) * (1.3 - 0.5 * out);
    const Vector2d at = place + out * Vector2d(std::cos(angle), std::sin(angle));
    add_box(b.surfaces, {at_height(at, trunk + up), {size, size, 0.8 * size}, random.uniform(0, 1.5)}, leaves, leaves);
  }
}

void add_bench(Building& b, const Vector2d& place, Random& random) {
  const Texture wood = texture(Material::kPlanks, 0.45f, random), stone = texture(Material::kPlaster, 0.5f, random);
  const double yaw = random.uniform(0, std::numbers::pi);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  for (const double side : {-0.6, 0.6})
    add_box(b.surfaces, {at_height(place + side * along, 0), {0.2, 0.4, 0.42}, yaw}, stone, stone);
  add_box(b.surfaces, {at_height(place, 0.42), {1.7, 0.45, 0.06}, yaw}, wood, wood);
}

void add_crates(Building& b, const Vector2d& place, Random& random) {
  const double yaw = random.uniform(0, std::numbers::pi);
  double z = 0;
  for (std::uint32_t i = 0, n = 1 + random.below(3); i < n; ++i) {
    const double size = random.uniform(0.45, 0.8);
    const Texture look = texture(random.below(2) == 0 ? Material::kCardboard : Material::kPlanks, 0.5f, random);
    add_box(b.surfaces, {at_height(place, z), {size, size, 0.8 * size}, yaw + random.uniform(-0.3, 0.3)}, look, look);
    z += 0.8 * size;
  }
}

void add_hedge(Building& b, const Vector2d& place, Random& random) {
  const Texture leaves = texture(Material::kLeaves, 0.28f, random);
  add_box(b.surfaces,
          {at_height(place, 0),
           {random.uniform(1.2, 2.4), 0.7, random.uniform(0.7, 1.1)},
           random.below(2) * 0.5 * std::numbers::pi},
          leaves, leaves);
}

void add_board(Building& b, const Vector2d& place, Random& random) {
  const double yaw = random.uniform(0, std::numbers::pi);
  const Texture post = texture(Material::kWood, 0.3f, random);
  const Vector2d along(std::cos(yaw), std::sin(yaw));
  for (const double side : {-0.75, 0.75})
    add_box(b.surfaces, {at_height(place + side * along, 0), {0.1, 0.1, 2.1}, yaw}, post, post);
  add_box(b.surfaces, {at_height(place, 0.7), {1.4, 0.06, 1.3}, yaw}, texture(Material::kPoster, 0.5f, random), post);
}

}  // namespace bslam::simulator
