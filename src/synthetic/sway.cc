#include "synthetic/sway.h"

namespace bslam::synthetic {

Offsets offsets_at(const Sway& base, const Sway& lap_sway, double lap_phase) {
  const double window = std::pow(std::sin(std::numbers::pi * lap_phase), 2);
  const auto both = [&](Waves Sway::*part) {
    return 0.4 * (base.*part)(lap_phase) + 0.6 * window * (lap_sway.*part)(lap_phase);
  };
  return {.lateral = 0.9 * kMaxSway * both(&Sway::lateral),
          .up = 0.26 * both(&Sway::up) + 0.012 * both(&Sway::step),
          .yaw = 0.16 * both(&Sway::yaw),
          .pitch = 0.09 * both(&Sway::pitch) + 0.006 * both(&Sway::step),
          .roll = 0.08 * both(&Sway::roll)};
}

Offsets VehicleSway::operator()(double time_s) const {
  constexpr double kDegree = std::numbers::pi / 180;
  const double phase = time_s / kPeriod_s;
  return {.lateral = 0.12 * lateral(phase),
          .up = 0.025 * up(phase),
          .yaw = 0.8 * kDegree * yaw(phase),
          .pitch = 0.5 * kDegree * pitch(phase),
          .roll = 0.7 * kDegree * roll(phase)};
}

}  // namespace bslam::synthetic
