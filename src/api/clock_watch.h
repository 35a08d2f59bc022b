// Decides which cameras of a live rig have a clock that can be believed. A single camera whose clock steps ahead would
// otherwise end the waiting for the images of all others, which would be too late for as long as the step lasts.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/timestamp.h"

namespace bslam::api {

inline constexpr TimeNs kAbsentIntervals = 4;  // number of intervals of a camera for which its images may be absent

// A time stamp steps ahead if it follows the camera's former one by more than its rate explains, and the other cameras
// have not advanced as much. A step is believed if most of the other cameras make it as well, if there are none, or if
// they stop. It is refuted by any other camera that continues as before; the images of the camera are then not used
// until its clock returns or the others have become silent.
class ClockWatch {
 public:
  struct Limits {
    TimeNs step_ns = 0;          // shorter steps are not noticed; how long others may be late
    TimeNs silent_after_ns = 0;  // a camera without an image for this long is ignored
    TimeNs far_ns = 0;           // longer steps need three images of the camera, and its first two are not used
  };
  enum class Verdict {
    kBelieved,
    kUndecided,  // the image waits, but no image is too late because of it
    kFarAhead    // the image is not used
  };
  struct Refuted {  // images of the camera from this time on that were undecided or believed
    std::size_t camera = 0;
    TimeNs from_ns = 0;
  };

  ClockWatch(std::size_t cameras, const Limits& limits);

  // Adds an image. `interval_ns`: interval between images of the camera, 0 if unknown. Images that prove to be wrong
  // are appended to `refuted`.
  Verdict add(std::size_t camera, TimeNs time_ns, TimeNs interval_ns, std::vector<Refuted>& refuted);

  // Time of the first and of the newest believed image. There must be one.
  TimeNs first_ns() const { return *first_ns_; }
  TimeNs newest_ns() const { return *newest_ns_; }
  // Whether two images agree on the time, which may still go back otherwise. Always true for a single camera, whose
  // first image waits for nothing.
  bool confirmed() const { return confirmed_; }

 private:
  enum class Ahead { kNo, kStep, kFar };
  struct Clock {
    std::optional<TimeNs> newest_ns;  // of its believed images
    std::optional<TimeNs> lead_ns;    // by how much they were ahead of those of the other cameras, at most
    TimeNs interval_ns = 0;
    bool refuted = false;
    int doubtful = 0;  // number of images that are ahead, since the step or since it was last refuted
    TimeNs doubtful_from_ns = 0, doubtful_until_ns = 0;
  };

  std::optional<Verdict> judge_start(std::size_t c, TimeNs time_ns, std::vector<Refuted>& refuted);
  void start_earlier(TimeNs time_ns, std::vector<Refuted>& refuted);
  Ahead ahead(std::size_t c, TimeNs time_ns, TimeNs caught_up_ns) const;
  std::optional<TimeNs> newest_of_others(std::size_t c) const;
  bool is_live(const Clock& clock) const;
  bool opposed(std::size_t c, TimeNs time_ns) const;
  void believe(std::size_t c, TimeNs time_ns);
  void settle_doubts(TimeNs interval_ns, std::vector<Refuted>& refuted);

  const Limits limits_;
  std::vector<Clock> clocks_;
  std::optional<TimeNs> first_ns_, newest_ns_;
  std::optional<TimeNs> earlier_ns_;  // an image that contradicts the first one, before the time is confirmed
  bool confirmed_ = false;
};

}  // namespace bslam::api
