#include "api/clock_watch.h"

#include <algorithm>

namespace bslam::api {
namespace {

constexpr int kFarImages = 3;       // number of consecutive images far ahead after which a clock may be believed
constexpr TimeNs kLeadImages = 16;  // number of images after which a lead is forgotten, about
constexpr TimeNs kMaxInterval = 1'000'000'000'000'000;  // so that no multiple of an interval overflows

}  // namespace

ClockWatch::ClockWatch(std::size_t cameras, const Limits& limits)
    : limits_(limits), clocks_(cameras), confirmed_(cameras == 1) {}

bool ClockWatch::is_live(const Clock& clock) const {
  return clock.newest_ns &&
         *newest_ns_ - *clock.newest_ns <= std::max(limits_.silent_after_ns, kAbsentIntervals * clock.interval_ns);
}

std::optional<TimeNs> ClockWatch::newest_of_others(std::size_t c) const {
  std::optional<TimeNs> newest_ns;
  for (std::size_t d = 0; d < clocks_.size(); ++d) {
    if (d != c && is_live(clocks_[d]))
      newest_ns = std::max(newest_ns.value_or(*clocks_[d].newest_ns), *clocks_[d].newest_ns);
  }
  return newest_ns;
}

// `caught_up_ns`: by how much the other cameras have advanced since the image came.
ClockWatch::Ahead ClockWatch::ahead(std::size_t c, TimeNs time_ns, TimeNs caught_up_ns) const {
  const Clock& clock = clocks_[c];
  const TimeNs gap = time_ns - *newest_ns_;
  if (gap > limits_.far_ns && gap / kAbsentIntervals > clock.interval_ns) return Ahead::kFar;
  const std::optional<TimeNs> others_ns = newest_of_others(c);
  if (!others_ns || !clock.lead_ns || time_ns - *others_ns + caught_up_ns <= limits_.step_ns) return Ahead::kNo;
  const TimeNs step_ns = time_ns - *others_ns - std::max(*clock.lead_ns - caught_up_ns, TimeNs{0});
  if (clock.refuted) return step_ns > limits_.step_ns / 4 ? Ahead::kStep : Ahead::kNo;
  const bool steps = clock.doubtful > 0 || time_ns - *clock.newest_ns - clock.interval_ns > limits_.step_ns / 2;
  return steps && step_ns > limits_.step_ns / 2 ? Ahead::kStep : Ahead::kNo;
}

// Returns true if the clock of a doubtful camera must not be believed yet: at least half of the live cameras neither
// share it nor have stopped meanwhile. If only one of them goes on as before, the camera is no longer doubtful.
bool ClockWatch::opposed(std::size_t c, TimeNs time_ns) const {
  const Clock& clock = clocks_[c];
  int others = 0, agreeing = 0;
  for (std::size_t d = 0; d < clocks_.size(); ++d) {
    const Clock& other = clocks_[d];
    if (d == c || !is_live(other)) continue;
    const TimeNs late_ns = std::max(limits_.step_ns, kAbsentIntervals * other.interval_ns);
    const TimeNs stopped_ns = clock.refuted ? std::max(limits_.silent_after_ns, late_ns) : late_ns;
    if (other.doubtful > 0 && time_ns - other.doubtful_until_ns <= late_ns) {
      ++agreeing;
    } else if (time_ns - clock.doubtful_from_ns <= stopped_ns) {
      ++others;
    }
  }
  return others > agreeing;
}

void ClockWatch::believe(std::size_t c, TimeNs time_ns) {
  Clock& clock = clocks_[c];
  clock.newest_ns = std::max(clock.newest_ns.value_or(time_ns), time_ns);
  clock.doubtful = 0;
  clock.refuted = false;
  first_ns_ = std::min(first_ns_.value_or(time_ns), time_ns);
  newest_ns_ = std::max(newest_ns_.value_or(time_ns), time_ns);
  const std::optional<TimeNs> others_ns = newest_of_others(c);
  if (!others_ns) {
    clock.lead_ns = std::nullopt;
    return;
  }
  const TimeNs former_ns = clock.lead_ns.value_or(0);
  clock.lead_ns = std::max(*clock.newest_ns - *others_ns, former_ns - former_ns / kLeadImages);
}

// Decides on the cameras in doubt after another one, with this interval, has advanced.
void ClockWatch::settle_doubts(TimeNs interval_ns, std::vector<Refuted>& refuted) {
  for (std::size_t d = 0; d < clocks_.size(); ++d) {
    Clock& clock = clocks_[d];
    if (clock.doubtful == 0) continue;
    if (ahead(d, clock.doubtful_until_ns, interval_ns) == Ahead::kNo) {
      believe(d, clock.doubtful_until_ns);
      continue;
    }
    refuted.push_back({d, clock.doubtful_from_ns});
    clock.refuted = true;
    clock.doubtful = 0;
  }
}

// The first images were wrong: everything that is far ahead of this time is forgotten.
void ClockWatch::start_earlier(TimeNs time_ns, std::vector<Refuted>& refuted) {
  const TimeNs until_ns = std::max(time_ns, *earlier_ns_) + limits_.far_ns;
  for (std::size_t d = 0; d < clocks_.size(); ++d) {
    if (clocks_[d].newest_ns && *clocks_[d].newest_ns > until_ns) clocks_[d] = {};
    refuted.push_back({d, until_ns + 1});
  }
  first_ns_ = newest_ns_ = *earlier_ns_;
  confirmed_ = true;
}

// Before the time is confirmed: returns the verdict on an image that is far before the first one.
std::optional<ClockWatch::Verdict> ClockWatch::judge_start(std::size_t c, TimeNs time_ns,
                                                           std::vector<Refuted>& refuted) {
  if (*newest_ns_ - time_ns <= limits_.far_ns) {
    confirmed_ = time_ns - *newest_ns_ <= limits_.far_ns;
    return std::nullopt;
  }
  if (!earlier_ns_ || std::max(time_ns - *earlier_ns_, *earlier_ns_ - time_ns) > limits_.far_ns) {
    earlier_ns_ = time_ns;
    return Verdict::kUndecided;
  }
  start_earlier(time_ns, refuted);
  believe(c, time_ns);
  return Verdict::kBelieved;
}

ClockWatch::Verdict ClockWatch::add(std::size_t c, TimeNs time_ns, TimeNs interval_ns, std::vector<Refuted>& refuted) {
  Clock& clock = clocks_[c];
  if (interval_ns > 0) clock.interval_ns = std::min(interval_ns, kMaxInterval);
  if (newest_ns_ && !confirmed_) {
    if (const std::optional<Verdict> verdict = judge_start(c, time_ns, refuted)) return *verdict;
  }
  const Ahead by = newest_ns_ ? ahead(c, time_ns, 0) : Ahead::kNo;
  if (by != Ahead::kNo) {
    if (clock.doubtful == 0)
      clock.doubtful_from_ns = time_ns;
    else if (clock.interval_ns == 0)
      clock.interval_ns = std::clamp(time_ns - clock.doubtful_until_ns, TimeNs{0}, kMaxInterval);
    clock.doubtful_until_ns = time_ns;
    ++clock.doubtful;
    const bool unused = by == Ahead::kFar || clock.refuted;
    if (opposed(c, time_ns) || (by == Ahead::kFar && clock.doubtful < kFarImages))
      return unused ? Verdict::kFarAhead : Verdict::kUndecided;
    confirmed_ = true;
  }
  const bool advances = !clock.newest_ns || time_ns > *clock.newest_ns;
  believe(c, time_ns);
  if (advances) settle_doubts(clock.interval_ns, refuted);
  return Verdict::kBelieved;
}

}  // namespace bslam::api
