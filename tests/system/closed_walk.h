// A walk that comes back to where it began: some steps out and home again, while the rig turns once round. What it sees
// at the end it has not seen since the beginning.
#pragma once

#include <initializer_list>
#include <utility>

#include "place/shipped_vocabulary.h"
#include "system/rendered_tour.h"

namespace bslam::system {

constexpr std::size_t kRound = 60, kWalk = 76;  // frames until the rig is back, and in all

inline simulation::Trajectory round_and_home(const simulation::Building& building, double duration_s) {
  constexpr double kKnot_s = 0.1, kReach_m = 1.2;
  const double round_s = static_cast<double>(kRound) / RenderedTour::kRateHz;
  const Eigen::Vector2d ahead = (building.tour[20] - building.tour[0]).normalized();
  std::vector<simulation::ControlPose> control;
  for (int i = -1; (i - 3) * kKnot_s < duration_s; ++i) {
    const double turn = 2 * std::numbers::pi * i * kKnot_s / round_s;
    const Eigen::Vector2d at = building.tour[0] + 0.5 * kReach_m * (1 - std::cos(turn)) * ahead;
    control.push_back({{at.x(), at.y(), 1.5 + 0.05 * std::sin(3 * turn)},
                       std::atan2(ahead.y(), ahead.x()) + turn, 0.04 * std::sin(5 * turn), 0.03 * std::sin(4 * turn)});
  }
  return simulation::Trajectory(std::move(control), kKnot_s);
}

inline const RenderedTour& closed_walk() {
  static const RenderedTour walk(2, kWalk, round_and_home);
  return walk;
}

// Stretches of the walk one after the other, as if the rig were carried from one to the next.
struct Playback {
  std::vector<image::ImageBundle> frames;
  evaluation::Trajectory truth;
};
inline Playback play(const RenderedTour& tour, std::initializer_list<std::pair<std::size_t, std::size_t>> stretches) {
  Playback out;
  for (const auto& [first, end] : stretches) {
    for (std::size_t k = first; k < end; ++k) {
      image::ImageBundle images = tour.frames()[k];
      const TimeNs later_ns = tour.frames()[out.frames.size()].time_ns - images.time_ns;
      images.id = FrameId(out.frames.size());
      images.time_ns += later_ns;
      for (image::CameraImage& i : images.images) i.time_ns += later_ns;
      out.truth.push_back({tour.truth()[k].time_ns + later_ns, tour.truth()[k].T_world_frame});
      out.frames.push_back(std::move(images));
    }
  }
  return out;
}

inline Resources with_vocabulary() { return {.vocabulary = place::shipped_vocabulary().value()}; }

}  // namespace bslam::system
