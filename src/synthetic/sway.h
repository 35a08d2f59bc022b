// Swaying motion of a person walking along a smooth path: sums of sine waves with random phases.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/random.h"

namespace bslam::synthetic {

inline constexpr double kMaxSway = 0.12;     // metres, maximum lateral deviation from the path
inline constexpr double kKnotSpacing = 0.1;  // seconds between control poses; short enough to represent steps

// A sum of sine waves with random phases, with mean 0 and absolute value at most 1, periodic over one lap.
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

// The sway of one lap relative to the path, without units.
struct Sway {
  explicit Sway(Random& random)
      : lateral(random, {2, 3, 7}),
        up(random, {1, 4, 6}),
        step(random, {31, 33, 34}),
        yaw(random, {2, 3, 5}),
        pitch(random, {2, 5, 9}),
        roll(random, {3, 6, 11}) {}
  Waves lateral, up, step, yaw, pitch, roll;
};

// Offsets from the path: lateral and up in metres, angles in radians.
struct Offsets {
  double lateral, up, yaw, pitch, roll;
};

// The sum of `base`, which is the same for all laps, and `lap_sway`, which belongs to one lap and fades out at its
// ends, so that consecutive laps connect. `lap_phase` runs from 0 to 1 over a lap.
Offsets offsets_at(const Sway& base, const Sway& lap_sway, double lap_phase);

// The sway of a vehicle on a street: a few centimetres and tenths of a degree. Periodic over kPeriod_s.
struct VehicleSway {
  explicit VehicleSway(Random& random)
      : lateral(random, {3, 5, 8}),
        up(random, {37, 53, 71}),
        yaw(random, {4, 7, 13}),
        pitch(random, {31, 43, 67}),
        roll(random, {23, 41, 59}) {}
  Offsets operator()(double time_s) const;
  Waves lateral, up, yaw, pitch, roll;

  static constexpr double kPeriod_s = 61.0;
};

}  // namespace bslam::synthetic
