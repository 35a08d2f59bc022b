// The sway of a walker about a smooth path: sums of sines with random phases.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/random.h"

namespace bslam::synthetic {

inline constexpr double kMaxSway = 0.12;     // metres to either side of the path
inline constexpr double kKnotSpacing = 0.1;  // seconds between control poses: fine enough for the rhythm of steps

// A few sine waves with random phases, mean 0, at most 1 in size, over a phase in laps; whole numbers of waves a lap.
class Waves {
 public:
  Waves(Random& random, std::array<int, 3> per_lap) : per_lap_(per_lap) {
    for (double& p : phase_) p = random.uniform(0, 2 * std::numbers::pi);
  }
  double operator()(double lap_phase) const {
    constexpr std::array kShare = {0.5, 0.3, 0.2};
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i)
      sum += kShare[i] * std::sin(2 * std::numbers::pi * per_lap_[i] * lap_phase + phase_[i]);
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

// `base` is common to all laps; `lap_phase` counts from 0 to 1 over a lap.
Offsets offsets_at(const Sway& base, const Sway& own, double lap_phase);

}  // namespace bslam::synthetic
