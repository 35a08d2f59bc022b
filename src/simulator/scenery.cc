#include "simulator/scenery.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "simulator/drive.h"
#include "simulator/route.h"
#include "simulator/town.h"

namespace bslam::simulator {
namespace {

// The streets are wide, and a rig is seldom nearer than a few metres to anything.
WorldOptions options_for_town(WorldOptions options) {
  options.texel *= 3;
  options.light_texel *= 2;
  options.ambient_rays = std::max(1, options.ambient_rays / 2);
  options.sample_spacing = 2 * options.texel;
  options.hiding_distance = 12.0;
  options.hidden_texel = 2.0;
  return options;
}

// Points of the way of a section, and of some metres before and after it, which cameras may reach.
std::vector<Vector2d> way_of(const Drive& drive, std::size_t section) {
  constexpr double kStep_s = 0.2, kMargin_s = 1.6;
  const double from = section == 0 ? 0.0 : drive.section_ends[section - 1], to = drive.section_ends[section];
  std::vector<Vector2d> way;
  for (double time = from - kMargin_s; time < to + kMargin_s; time += kStep_s) {
    const double inside = std::clamp(time, 0.0, drive.trajectory.duration_s());
    way.emplace_back(drive.trajectory.T_world_body(inside).translation().head<2>());
  }
  return way;
}

Scenery make_town_scenery(std::uint64_t seed, const TourOptions& tour, const WorldOptions& world) {
  constexpr TownDetail kObstacles{.complete = 20.0, .houses = 0.0, .background = false};
  const StreetGrid grid = make_street_grid(seed);
  const double speed = tour.speed_mps > 0 ? tour.speed_mps : kTownSpeed;
  const auto drive =
      std::make_shared<const Drive>(make_drive(make_route(grid, tour.length_m, tour.seed), speed, tour.seed));
  const auto town = [=](std::size_t section, const TownDetail& detail) {
    return make_town(grid, seed, way_of(*drive, section), detail);
  };
  return {drive->trajectory, drive->section_ends, [=](std::size_t section) { return town(section, {}); },
          [=](std::size_t section) { return town(section, kObstacles); }, options_for_town(world)};
}

}  // namespace

std::size_t Scenery::section_at(double time_s) const {
  const auto end = std::upper_bound(section_ends.begin(), section_ends.end() - 1, time_s);
  return static_cast<std::size_t>(end - section_ends.begin());
}

Scenery make_scenery(WorldKind kind, std::uint64_t seed, const TourOptions& tour, const WorldOptions& world) {
  if (kind == WorldKind::kTown) return make_town_scenery(seed, tour, world);
  const auto building = std::make_shared<const Building>(make_building(kind, seed));
  const auto same = [building](std::size_t) { return *building; };
  return {make_tour(*building, tour), {tour.duration_s}, same, same, world};
}

}  // namespace bslam::simulator
