#include "simulator/drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/assert.h"
#include "base/random.h"
#include "synthetic/sway.h"

namespace bslam::simulator {
namespace {

using std::numbers::pi;
using synthetic::ControlPose;
using synthetic::kKnotSpacing;

constexpr double kReach = 1.5;         // metres of path on either side that determine the direction
constexpr double kMaxYawRate = 0.65;   // radians per second; sway adds less than 0.1
constexpr double kAcceleration = 2.0;  // metres per second squared, also for braking
constexpr double kSmooth_s = 2.0;      // seconds at both ends in which the sway fades out, so that the ends connect

double angle_between(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

// The times at which equidistant points of a route are reached.
struct Timetable {
  double step = 0;              // metres between points
  std::vector<double> reached;  // seconds, from 0 to the duration

  // Arc length at a time; the drive goes on with its initial or final speed before and after it.
  double arc(double time_s) const {
    const auto next = std::upper_bound(reached.begin() + 1, reached.end() - 1, time_s);
    const auto i = static_cast<std::size_t>(next - reached.begin()) - 1;
    return step * (static_cast<double>(i) + (time_s - reached[i]) / (reached[i + 1] - reached[i]));
  }
};

// The speed at `count` equidistant points of the route.
std::vector<double> speeds(const ClosedPath& route, std::size_t count, double step, double speed_mps) {
  std::vector<double> speed(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double arc = step * static_cast<double>(i);
    const double turn = angle_between(route.tangent(arc - kReach, kReach), route.tangent(arc + kReach, kReach));
    speed[i] = std::min(speed_mps, kMaxYawRate * 2 * kReach / std::max(1e-9, std::abs(turn)));
  }
  const auto limit = [&](double& at, double neighbour) {
    at = std::min(at, std::sqrt(neighbour * neighbour + 2 * kAcceleration * step));
  };
  for (int round = 0; round < 2; ++round) {  // the second round connects end and start
    for (std::size_t i = 0; i < count; ++i) limit(speed[(i + 1) % count], speed[i]);
    for (std::size_t i = count; i-- > 0;) limit(speed[i], speed[(i + 1) % count]);
  }
  return speed;
}

Timetable make_timetable(const ClosedPath& route, double speed_mps) {
  const auto count = static_cast<std::size_t>(std::max(1.0, std::round(route.length() / 0.5)));
  Timetable table{route.length() / static_cast<double>(count), {0.0}};
  const std::vector<double> speed = speeds(route, count, table.step, speed_mps);
  for (std::size_t i = 0; i < count; ++i)
    table.reached.push_back(table.reached.back() + 2 * table.step / (speed[i] + speed[(i + 1) % count]));
  return table;
}

}  // namespace

Drive make_drive(const ClosedPath& route, double speed_mps, std::uint64_t seed) {
  BSLAM_ASSERT(speed_mps > 0, "speed must be positive");
  Random random(seed, "vehicle");
  const synthetic::VehicleSway sway(random);
  const Timetable table = make_timetable(route, speed_mps);
  const double duration = table.reached.back();
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(duration / kKnotSpacing)));
  const double spacing = duration / static_cast<double>(pieces);
  std::vector<ControlPose> control;
  double last_yaw = 0;
  for (std::size_t i = 0; i < pieces + 3; ++i) {
    const double time = (static_cast<double>(i) - 1) * spacing, arc = table.arc(time);
    const double inside = std::clamp(std::min(time, duration - time) / kSmooth_s, 0.0, 1.0);
    const double share = inside * inside * (3 - 2 * inside);
    const synthetic::Offsets o = sway(time);
    const Vector2d tangent = route.tangent(arc, kReach),
                   place = route(arc) + share * o.lateral * Vector2d(-tangent.y(), tangent.x());
    double yaw = std::atan2(tangent.y(), tangent.x());
    yaw += 2 * pi * std::round((last_yaw - yaw) / (2 * pi));
    last_yaw = yaw;
    control.push_back(
        {{place.x(), place.y(), kCameraHeight + share * o.up}, yaw + share * o.yaw, share * o.pitch, share * o.roll});
  }
  Drive drive{synthetic::Trajectory(std::move(control), spacing), {}};
  const double sections = std::max(1.0, std::round(route.length() / Drive::kSectionLength));
  for (double k = 1; k < sections; ++k) {
    const double points = std::round(k / sections * route.length() / table.step);
    drive.section_ends.push_back(table.reached[static_cast<std::size_t>(points)]);
  }
  drive.section_ends.push_back(duration);
  return drive;
}

}  // namespace bslam::simulator
