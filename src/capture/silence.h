// How long a camera may deliver no image before it counts as lost. A slow camera has longer intervals, and the first
// image of any camera may take longer.
#pragma once

#include <chrono>
#include <optional>

namespace bslam::capture {

class Silence {
 public:
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;
  struct Limits {
    Seconds usual{2}, first_image{10};
  };

  Silence(const Limits& limits, Clock::time_point now) : limits_(limits), last_(now) {}

  // `usual`, or three intervals of a camera of this frame rate if these are longer. Nullopt: the rate is unknown.
  static Seconds longest(Seconds usual, std::optional<double> fps);

  void opened(Clock::time_point now);  // the camera was opened again
  void image(Clock::time_point now);   // it has delivered an image
  // The limit, if the camera has delivered nothing for longer: that of the first image until the first one or, if its
  // rate is unknown, the second one since it was opened; later the usual one, or three intervals.
  std::optional<Seconds> exceeded(std::optional<double> fps, Clock::time_point now) const;

 private:
  const Limits limits_;
  Clock::time_point last_;           // of the last image, or of its opening
  std::optional<Seconds> interval_;  // between the last two images
  bool delivered_ = false;           // an image since it was opened
};

}  // namespace bslam::capture
