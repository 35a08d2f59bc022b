#include "simulation/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/assert.h"
#include "base/random.h"

namespace bslam::simulation {
namespace {

using std::numbers::pi;

constexpr double kKnotSpacing = 0.1;  // seconds: fine enough for the rhythm of steps
constexpr double kWalkingPace = 1.2;  // metres per second
constexpr double kFastestPace = 1.5;
constexpr double kTurnRound_s = 4.0, kHalt_s = 1.0;  // seconds: of turning on the spot; of halting before
constexpr double kTangentReach = 0.4;  // metres of path on either side that give the direction of looking

// A few sine waves with random phases, mean 0, at most 1 in size, over a phase in laps; whole numbers of waves a lap.
class Waves {
 public:
  Waves(Random& random, std::array<int, 3> per_lap) : per_lap_(per_lap) {
    for (double& p : phase_) p = random.uniform(0, 2 * pi);
  }
  double operator()(double lap_phase) const {
    constexpr std::array kShare = {0.5, 0.3, 0.2};
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += kShare[i] * std::sin(2 * pi * per_lap_[i] * lap_phase + phase_[i]);
    return sum;
  }

 private:
  std::array<int, 3> per_lap_;
  std::array<double, 3> phase_{};
};

// Sway of one lap about the path.
struct Sway {
  explicit Sway(Random& random)
      : aside(random, {2, 3, 7}),
        up(random, {1, 4, 6}),
        step(random, {31, 33, 34}),
        yaw(random, {2, 3, 5}),
        pitch(random, {2, 5, 9}),
        roll(random, {3, 6, 11}) {}
  Waves aside, up, step, yaw, pitch, roll;
};

// What sway adds: `own` belongs to the lap and fades out at its ends, so that laps join and all begin alike.
struct Offsets {
  double aside, up, yaw, pitch, roll;
};

Offsets offsets_at(const Sway& base, const Sway& own, double lap_phase) {
  const double window = std::pow(std::sin(pi * lap_phase), 2);
  const auto both = [&](Waves Sway::*part) {
    return 0.4 * (base.*part)(lap_phase) + 0.6 * window * (own.*part)(lap_phase);
  };
  return {.aside = 0.9 * Building::kTourSway * both(&Sway::aside),
          .up = 0.26 * both(&Sway::up) + 0.012 * both(&Sway::step),
          .yaw = 0.16 * both(&Sway::yaw),
          .pitch = 0.09 * both(&Sway::pitch) + 0.006 * both(&Sway::step),
          .roll = 0.08 * both(&Sway::roll)};
}

// A closed polyline by arc length.
class Loop {
 public:
  explicit Loop(const std::vector<Vector2d>& points) : points_(points) {
    at_.push_back(0);
    for (std::size_t i = 0; i < points.size(); ++i) {
      at_.push_back(at_.back() + (points[(i + 1) % points.size()] - points[i]).norm());
    }
  }
  double length() const { return at_.back(); }
  Vector2d operator()(double arc) const {
    arc -= length() * std::floor(arc / length());
    const auto next = std::upper_bound(at_.begin() + 1, at_.end() - 1, arc);
    const std::size_t i = static_cast<std::size_t>(next - at_.begin()) - 1;
    const double share = (arc - at_[i]) / (at_[i + 1] - at_[i]);
    return points_[i] + share * (points_[(i + 1) % points_.size()] - points_[i]);
  }
  Vector2d tangent(double arc) const {
    return ((*this)(arc + kTangentReach) - (*this)(arc - kTangentReach)).normalized();
  }

 private:
  const std::vector<Vector2d>& points_;
  std::vector<double> at_;  // arc length at each point, and the whole
};

// Seconds of walking one way.
double walking_s(const TourOptions& o) { return o.back ? std::max(0.1, 0.5 * (o.duration_s - kTurnRound_s)) : o.duration_s; }

double laps_of(const TourOptions& o, double length) {
  if (o.laps > 0) return o.laps;
  if (o.speed_mps > 0) return o.speed_mps * walking_s(o) / length;
  const double wanted = kWalkingPace * walking_s(o) / length;
  const double most = std::floor(kFastestPace * walking_s(o) / length);
  return most < 1 ? wanted : std::clamp(std::round(wanted), 1.0, most);
}

// Where a tour is at a time: in laps walked, and how far it has turned round.
struct Progress {
  double laps = 0, turned = 0;  // turned: radians
};

Progress there_and_back(const TourOptions& o, double laps, double time_s) {
  const double walk = walking_s(o);
  const double turning = std::clamp((time_s - walk) / kTurnRound_s, 0.0, 1.0);
  // A walker comes to a halt within kHalt_s, and gets going the same way.
  const double away = walk - std::clamp(std::abs(time_s - 0.5 * o.duration_s) - 0.5 * kTurnRound_s, 0.0, 2 * walk);
  const double halt = std::min(kHalt_s, walk), left = walk - away;
  const double eased = left < halt ? 0.5 * left * left / halt : left - 0.5 * halt;
  return {laps * (1 - eased / (walk - 0.5 * halt)), pi * turning * turning * (3 - 2 * turning)};
}

}  // namespace

Trajectory::Trajectory(std::vector<ControlPose> control, double knot_spacing_s)
    : control_(std::move(control)), knot_spacing_s_(knot_spacing_s) {
  BSLAM_ASSERT(control_.size() >= 4 && knot_spacing_s > 0, "a cubic spline has four control poses and a knot spacing");
}

Trajectory::Vector Trajectory::blend(double time_s, bool derivative) const {
  const double at = time_s / knot_spacing_s_;
  const double last = static_cast<double>(control_.size()) - 4.0;
  const double piece = std::clamp(std::floor(at), 0.0, last);
  const double t = at - piece, t2 = t * t, s = 1 - t;
  std::array<double, 4> weight;
  if (derivative) {
    weight = {-0.5 * s * s, 1.5 * t2 - 2 * t, -1.5 * t2 + t + 0.5, 0.5 * t2};
    for (double& w : weight) w /= knot_spacing_s_;
  } else {
    weight = {s * s * s / 6, (3 * t2 * t - 6 * t2 + 4) / 6, (-3 * t2 * t + 3 * t2 + 3 * t + 1) / 6, t2 * t / 6};
  }
  Vector sum = Vector::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const ControlPose& c = control_[static_cast<std::size_t>(piece) + i];
    Vector value;
    value << c.position, c.yaw, c.pitch, c.roll;
    sum += weight[i] * value;
  }
  return sum;
}

geometry::SE3 Trajectory::T_world_body(double time_s) const {
  const Vector v = blend(time_s, false);
  const Eigen::Quaterniond q = Eigen::AngleAxisd(v[3], Vector3d::UnitZ()) * Eigen::AngleAxisd(v[4], Vector3d::UnitY()) *
                               Eigen::AngleAxisd(v[5], Vector3d::UnitX());
  return {q, v.head<3>()};
}

Vector3d Trajectory::velocity(double time_s) const { return blend(time_s, true).head<3>(); }
double Trajectory::yaw_rate(double time_s) const { return blend(time_s, true)[3]; }

Trajectory make_tour(const Building& building, const TourOptions& options) {
  BSLAM_ASSERT(options.duration_s > 0, "a tour takes time");
  const Loop loop(building.tour);
  const double laps = laps_of(options, loop.length());
  Random base_random(options.seed, "sway");
  const Sway base(base_random);
  std::vector<Sway> own;
  for (int lap = -1; lap <= static_cast<int>(laps) + 1; ++lap) {
    Random random(options.seed, "sway of lap", static_cast<std::uint64_t>(lap + 1));
    own.emplace_back(random);
  }
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(options.duration_s / kKnotSpacing)));
  const double spacing = options.duration_s / static_cast<double>(pieces);
  std::vector<ControlPose> control;
  double last_yaw = 0;
  for (std::size_t i = 0; i < pieces + 3; ++i) {
    const double step = static_cast<double>(i) - 1;
    const Progress progress = options.back ? there_and_back(options, laps, spacing * step)
                                           : Progress{laps * step / static_cast<double>(pieces), 0};
    const double lap = std::floor(progress.laps), phase = progress.laps - lap;
    const Offsets o = offsets_at(base, own[static_cast<std::size_t>(lap + 1)], phase);
    // The pace swells and ebbs by a tenth, the same way in every lap.
    const double arc = loop.length() * (phase + 0.1 / (6 * pi) * std::sin(6 * pi * phase));
    const Vector2d tangent = loop.tangent(arc), place = loop(arc) + o.aside * Vector2d(-tangent.y(), tangent.x());
    double yaw = std::atan2(tangent.y(), tangent.x());
    yaw += 2 * pi * std::round((last_yaw - yaw) / (2 * pi));
    last_yaw = yaw;
    control.push_back({{place.x(), place.y(), 1.5 + o.up}, yaw + progress.turned + o.yaw, o.pitch, o.roll});
  }
  return Trajectory(std::move(control), spacing);
}

Trajectory make_orbit(const OrbitOptions& options) {
  BSLAM_ASSERT(options.duration_s > 0 && options.period_s > 0, "an orbit takes time");
  Random random(options.seed, "orbit");
  const Sway base(random), own(random);
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::round(options.duration_s / kKnotSpacing)));
  const double spacing = options.duration_s / static_cast<double>(pieces);
  std::vector<ControlPose> control;
  for (std::size_t i = 0; i < pieces + 3; ++i) {
    const double rounds = (static_cast<double>(i) - 1) * spacing / options.period_s, angle = 2 * pi * rounds;
    const Offsets o = offsets_at(base, own, rounds - std::floor(rounds));
    const double radius = options.radius + o.aside;
    control.push_back({options.centre + Vector3d(radius * std::cos(angle), radius * std::sin(angle), o.up),
                       angle + 0.5 * pi + o.yaw, o.pitch, o.roll});
  }
  return Trajectory(std::move(control), spacing);
}

}  // namespace bslam::simulation
