#include "simulator/request_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "simulator/clearance.h"
#include "simulator/route.h"

namespace bslam::simulator {
namespace {

constexpr double kMinTownSpeed = 1.0, kMaxTownSpeed = 20.0;  // metres per second

Error out_of_range(const char* key, double found, const std::string& expected) {
  return Error{"", key, fmt::format("{}", found), expected};
}

bool within(double value, double low, double high) { return value >= low && value <= high; }

Status check_town_tour(const TourOptions& t) {
  if (!within(t.length_m, kShortestRoute, kLongestRoute)) {
    return out_of_range("length", t.length_m,
                        fmt::format("a length from {:.0f}m to {:.0f}km", kShortestRoute, 1e-3 * kLongestRoute));
  }
  if (t.speed_mps != 0 && !within(t.speed_mps, kMinTownSpeed, kMaxTownSpeed))
    return out_of_range("speed", t.speed_mps, "metres per second in [1, 20] with --world town, or 0: 8 m/s");
  if (t.laps > 0) return out_of_range("laps", t.laps, "no laps with --world town: --length");
  if (t.back) return Error{"", "back", "--world town", "another world: the drive contains loops"};
  return {};
}

Status check_clearance(const SimulationRequest& r, const Scenery& scenery) {
  double from = 0;
  for (std::size_t section = 0; from < r.recording.duration_s && section < scenery.section_ends.size(); ++section) {
    const double to = std::min(scenery.section_ends[section], r.recording.duration_s);
    const auto collision = first_collision(scenery.obstacles(section).surfaces, r.rig, scenery.trajectory, from, to);
    from = to;
    if (!collision) continue;
    const std::string& camera = r.rig.camera(collision->camera).name;
    const std::string place = collision->distance > 0 ? fmt::format("{:.3f} m from a surface", collision->distance)
                                                      : std::string("behind a wall, the floor or the ceiling");
    const bool outdoors = r.kind == WorldKind::kOutdoor || r.kind == WorldKind::kTown;
    return Error{"", "rig", fmt::format("camera {} {} after {:.2f} s", camera, place, collision->time_s),
                 fmt::format("cameras that keep {} m from all surfaces: a smaller rig{}", kCameraClearance,
                             outdoors ? "" : ", or --world outdoor")};
  }
  return {};
}

}  // namespace

Status check_tour(const SimulationRequest& r) {
  if (r.kind == WorldKind::kTown) return check_town_tour(r.tour);
  if (r.tour.length_m != 0) return out_of_range("length", r.tour.length_m, "a length with --world town only");
  if (!within(r.tour.speed_mps, 0, 5))
    return out_of_range("speed", r.tour.speed_mps, "metres per second in [0, 5] (0: walking pace)");
  if (!within(r.tour.laps, 0, 1000))
    return out_of_range("laps", r.tour.laps, "a number in [0, 1000] (0: determined by the walking pace)");
  if (r.tour.laps > 0 && r.tour.speed_mps > 0) {
    return Error{"", "speed", fmt::format("{} with {} laps", r.tour.speed_mps, r.tour.laps),
                 "either a speed or a number of laps"};
  }
  return {};
}

Status check_request(const SimulationRequest& r) {
  if (!(within(r.recording.duration_s, 1e-3, kMaxDuration_s)))
    return out_of_range("duration", r.recording.duration_s, "seconds in (0, 86400]");
  if (!(within(r.recording.rate_hz, 1e-3, 1000)))
    return out_of_range("rate", r.recording.rate_hz, "images per second in (0, 1000]");
  if (!within(r.recording.exposure_s, 0, 1))
    return out_of_range("exposure-ms", 1e3 * r.recording.exposure_s, "milliseconds in [0, 1000]");
  for (const Fault& f : r.recording.faults) {
    if (f.from_s >= r.recording.duration_s) {
      return Error{"", "faults", fmt::format("{} from {} s", fault_name(f.type), f.from_s),
                   fmt::format("a start time within the {} s of the recording", r.recording.duration_s)};
    }
  }
  if (!within(r.imaging.noise, 0, 1000)) return out_of_range("noise", r.imaging.noise, "a factor in [0, 1000]");
  if (!within(to_seconds(r.recording.start_ns), 0, 4e9))
    return out_of_range("start", to_seconds(r.recording.start_ns), "seconds in [0, 4e9]");
  return check_tour(r);
}

Status check_scenery(const SimulationRequest& r, const Scenery& scenery) {
  constexpr double kRounding = 1e-6;
  if (r.recording.duration_s > scenery.section_ends.back() + kRounding) {
    return out_of_range(
        "duration", r.recording.duration_s,
        fmt::format("at most the {:.2f} s of the drive, or a greater --length", scenery.section_ends.back()));
  }
  return check_clearance(r, scenery);
}

}  // namespace bslam::simulator
