#include "simulator/tour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/assert.h"
#include "base/random.h"
#include "simulator/closed_path.h"
#include "synthetic/sway.h"

namespace bslam::simulator {
namespace {

using std::numbers::pi;
using synthetic::ControlPose;
using synthetic::kKnotSpacing;
using synthetic::Offsets;
using synthetic::Sway;
using synthetic::Trajectory;

constexpr double kWalkingPace = 1.2;  // metres per second
constexpr double kFastestPace = 1.5;
constexpr double kTurnRound_s = 4.0,
                 kHalt_s = 1.0;        // seconds for turning on the spot, and for stopping before the turn
constexpr double kTangentReach = 0.4;  // metres of path on either side that determine the viewing direction

// Returns the duration of walking in one direction, in seconds.
double walking_s(const TourOptions& o) {
  return o.back ? std::max(0.1, 0.5 * (o.duration_s - kTurnRound_s)) : o.duration_s;
}

double laps_of(const TourOptions& o, double length) {
  if (o.laps > 0) return o.laps;
  if (o.speed_mps > 0) return o.speed_mps * walking_s(o) / length;
  const double wanted = kWalkingPace * walking_s(o) / length;
  const double max_laps = std::floor(kFastestPace * walking_s(o) / length);
  return max_laps < 1 ? wanted : std::clamp(std::round(wanted), 1.0, max_laps);
}

// Progress of a tour, including the rotation while turning around.
struct Progress {
  double laps = 0, yaw = 0;  // laps walked; rotation in radians
};

Progress out_and_back(const TourOptions& o, double laps, double time_s) {
  const double walk = walking_s(o);
  const double turning = std::clamp((time_s - walk) / kTurnRound_s, 0.0, 1.0);
  // The speed falls to zero within kHalt_s and rises in the same way.
  const double away = walk - std::clamp(std::abs(time_s - 0.5 * o.duration_s) - 0.5 * kTurnRound_s, 0.0, 2 * walk);
  const double halt = std::min(kHalt_s, walk), left = walk - away;
  const double eased = left < halt ? 0.5 * left * left / halt : left - 0.5 * halt;
  return {laps * (1 - eased / (walk - 0.5 * halt)), pi * turning * turning * (3 - 2 * turning)};
}

}  // namespace

Trajectory make_tour(const simulator::Building& building, const TourOptions& options) {
  BSLAM_ASSERT(options.duration_s > 0, "duration must be positive");
  const ClosedPath loop(building.tour);
  const double laps = laps_of(options, loop.length());
  Random base_random(options.seed, "sway");
  const Sway base(base_random);
  std::vector<Sway> lap_sway;
  for (int lap = -1; lap <= static_cast<int>(laps) + 1; ++lap) {
    Random random(options.seed, "sway of lap", static_cast<std::uint64_t>(lap + 1));
    lap_sway.emplace_back(random);
  }
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(options.duration_s / kKnotSpacing)));
  const double spacing = options.duration_s / static_cast<double>(pieces);
  std::vector<ControlPose> control;
  double last_yaw = 0;
  for (std::size_t i = 0; i < pieces + 3; ++i) {
    const double step = static_cast<double>(i) - 1;
    const Progress progress = options.back ? out_and_back(options, laps, spacing * step)
                                           : Progress{laps * step / static_cast<double>(pieces), 0};
    const double lap = std::floor(progress.laps), phase = progress.laps - lap;
    const Offsets o = offsets_at(base, lap_sway[static_cast<std::size_t>(lap + 1)], phase);
    // The speed varies by 10 %, equally in every lap.
    const double arc = loop.length() * (phase + 0.1 / (6 * pi) * std::sin(6 * pi * phase));
    const Vector2d tangent = loop.tangent(arc, kTangentReach),
                   place = loop(arc) + o.lateral * Vector2d(-tangent.y(), tangent.x());
    double yaw = std::atan2(tangent.y(), tangent.x());
    yaw += 2 * pi * std::round((last_yaw - yaw) / (2 * pi));
    last_yaw = yaw;
    control.push_back({{place.x(), place.y(), 1.5 + o.up}, yaw + progress.yaw + o.yaw, o.pitch, o.roll});
  }
  return Trajectory(std::move(control), spacing);
}

}  // namespace bslam::simulator
