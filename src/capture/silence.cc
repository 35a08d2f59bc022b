#include "capture/silence.h"

#include <algorithm>

namespace bslam::capture {
namespace {

constexpr int kIntervals = 3;  // number of intervals of a camera for which its images may be absent

}  // namespace

Silence::Seconds Silence::longest(Seconds usual, std::optional<double> fps) {
  return fps && *fps > 0 ? std::max(usual, kIntervals * Seconds(1 / *fps)) : usual;
}

void Silence::opened(Clock::time_point now) {
  last_ = now;
  delivered_ = false;
}

void Silence::image(Clock::time_point now) {
  if (delivered_) interval_ = now - last_;
  last_ = now;
  delivered_ = true;
}

std::optional<Silence::Seconds> Silence::exceeded(std::optional<double> fps, Clock::time_point now) const {
  const bool first = !delivered_ || (!fps && !interval_);
  const Seconds usual = first ? limits_.first_image : limits_.usual;
  const Seconds limit = std::max(longest(usual, fps), kIntervals * interval_.value_or(Seconds::zero()));
  return now - last_ > limit ? std::optional(limit) : std::nullopt;
}

}  // namespace bslam::capture
