#include "simulator/town_house.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bslam::simulator {
namespace {

double yaw_of(const Facade& f) { return std::atan2(f.along.y(), f.along.x()); }

// A box whose back is `ahead` metres in front of a facade: `at` is the middle along the facade, `z` its lower edge.
void add_front_box(Building& b, const Facade& f, double at, double z, const Vector3d& size, const Texture& look,
                   double ahead = 0) {
  const Vector2d place = f.start + at * f.along + (ahead + 0.5 * size.y()) * left_of(f.along);
  add_box(b.surfaces, {at_height(place, z), size, yaw_of(f)}, look, look);
}

// A shop on the ground floor: its own front before the facade, windows, a door and a sign.
void add_shop(Building& b, const Facade& f, Random& random) {
  constexpr double kThickness = 0.12, kHeight = 3.1;
  const Material material = random.below(2) == 0 ? Material::kWood : Material::kPlaster;
  const Texture frame = texture(material, static_cast<float>(random.uniform(0.15, 0.6)), random);
  add_front_box(b, f, 0.5 * f.length, 0, {f.length - 0.5, kThickness, kHeight}, frame);
  const Facade front{f.start + kThickness * left_of(f.along), f.along, f.length, f.height};
  const double sign = random.uniform(2.5, f.length - 1.5), at = random.uniform(0.4, f.length - 0.6 - sign);
  add_panel(b, front, at, 2.42, {sign, 0.55}, texture(Material::kPoster, 0.5f, random));
  const int parts = std::max(2, static_cast<int>((f.length - 1.0) / random.uniform(1.7, 2.6)));
  const double pitch = (f.length - 1.0) / parts;
  const int door = static_cast<int>(random.below(static_cast<std::uint32_t>(parts)));
  for (int i = 0; i < parts; ++i) {
    const double x = 0.5 + i * pitch;
    const Texture glass = texture(Material::kWindow, 0.5f, random);
    if (i == door) {
      add_panel(b, front, x + 0.5 * pitch - 0.5, kKerb, {1.0, 2.1}, texture(Material::kWood, 0.35f, random));
    } else {
      add_panel(b, front, x + 0.12, 0.65, {pitch - 0.24, 1.6}, glass);
      if (random.below(3) == 0)
        add_panel(b, {front.start + 0.01 * left_of(f.along), f.along, f.length, 0}, x + 0.3, 0.9, {0.6, 0.85},
                  texture(Material::kPoster, 0.5f, random));
    }
  }
  if (random.below(3) == 0)
    add_front_box(b, front, 0.5 * f.length, 3.0, {0.8 * f.length, 1.1, 0.14}, texture(Material::kFabric, 0.5f, random));
}

// Balconies, a cornice and a pipe.
void add_balcony(Building& b, const Facade& f, double z, const Texture& look, Random& random) {
  const double at = random.uniform(1.5, f.length - 1.5), width = random.uniform(1.4, 2.4);
  add_front_box(b, f, at, z, {width, 0.8, 0.95}, look);
}

void add_relief(Building& b, const Facade& f, Random& random) {
  const Texture stone = texture(Material::kPlaster, 0.6f, random), metal = texture(Material::kPlain, 0.2f, random);
  add_front_box(b, f, 0.5 * f.length, f.height - 0.35, {f.length - 0.02, 0.22, 0.35}, stone);
  add_front_box(b, f, random.below(2) == 0 ? 0.15 : f.length - 0.15, kKerb, {0.1, 0.1, f.height - 0.5}, metal, 0.02);
  if (random.below(3) != 0) return;
  const Texture look = texture(random.below(2) == 0 ? Material::kPlanks : Material::kPlaster, 0.5f, random);
  for (double z = 3.2; z + 2.5 < f.height; z += 3.0) add_balcony(b, f, z, look, random);
}

Material house_material(Random& random) {
  constexpr std::array kMaterials = {Material::kBrick,   Material::kPlaster, Material::kPlaster, Material::kBrick,
                                     Material::kPlaster, Material::kTile,    Material::kPlanks};
  return kMaterials[random.below(kMaterials.size())];
}

}  // namespace

void add_front(Building& b, const Facade& f, double low, double high, const Texture& look) {
  b.surfaces.push_back(
      {at_height(f.start + f.length * f.along, low), at_height(-f.length * f.along, 0), {0, 0, high - low}, look});
}

void add_town_house(Building& b, const Facade& f, Random& random, Detail detail) {
  constexpr double kSideTexel = 0.03, kBackTexel = 0.15;  // metres; backs are seen through gaps only
  const Material material = house_material(random);
  const Texture wall = texture(material, static_cast<float>(random.uniform(0.3, 0.62)), random),
                roof = texture(Material::kTile, static_cast<float>(random.uniform(0.15, 0.4)), random);
  const Vector2d out = left_of(f.along), middle = f.start + 0.5 * f.length * f.along - 0.5 * kHouseDepth * out;
  const std::size_t first = b.surfaces.size();
  add_box(b.surfaces, {at_height(middle, 0), {f.length, kHouseDepth, f.height}, yaw_of(f)}, wall, roof);
  // Texel sizes of the faces of a box.
  constexpr std::array kTexels = {kBackTexel, kSideTexel, 0.0, kSideTexel, kBackTexel};
  for (std::size_t i = 0; i < kTexels.size(); ++i) b.surfaces[first + i].min_texel = kTexels[i];
  const double inset = random.uniform(0.6, 1.4), attic = random.uniform(1.2, 2.4);
  add_box(b.surfaces, {at_height(middle, f.height), {f.length - inset, kHouseDepth - 2 * inset, attic}, yaw_of(f)},
          roof, roof);
  const Vector2d chimney = middle + random.uniform(-0.35, 0.35) * f.length * f.along + 2.0 * out;
  for (std::size_t i = b.surfaces.size() - 6; i < b.surfaces.size(); ++i) b.surfaces[i].min_texel = 2 * kSideTexel;
  add_box(b.surfaces, {at_height(chimney, f.height), {0.7, 0.7, attic + 1.0}, yaw_of(f)}, wall, wall);
  if (detail != Detail::kComplete) return;
  decorate(b, f, random);
  add_relief(b, f, random);
  if (f.length > 5.5 && random.below(3) == 0) add_shop(b, f, random);
}

void add_front_hedge(Building& b, const Facade& line, Random& random) {
  const bool wall = random.below(3) == 0;
  const Texture look = wall ? texture(Material::kBrick, 0.4f, random) : texture(Material::kLeaves, 0.28f, random);
  const double height = random.uniform(0.7, 1.3), gap = random.uniform(0.2, 0.7) * line.length,
               thickness = wall ? 0.25 : 0.6;
  const auto add = [&](double from, double to) {
    if (to - from > 0.5)
      add_front_box(b, line, 0.5 * (from + to), kKerb, {to - from, thickness, height}, look, -thickness - 0.05);
  };
  add(0, gap - 0.7);
  add(gap + 0.7, line.length);
}

}  // namespace bslam::simulator
