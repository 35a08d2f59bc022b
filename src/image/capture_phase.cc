#include "image/capture_phase.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <numeric>

#include "base/median.h"
#include "image/frame_grouping.h"

namespace bslam::image {
namespace {

constexpr std::size_t kMinImages = 5;
constexpr std::size_t kMinDriftImages = 12;
constexpr TimeNs kMaxPeriod = 1'000'000'000;  // slower cameras would be too far apart for one frame
constexpr double kMinShare = 0.9;  // minimum fraction of the images that are within a tenth of the period of the phase

// Times of a camera relative to the nearest image of camera 0, of those at most 0.6 periods away.
std::vector<TimeNs> offsets(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times, TimeNs period_ns) {
  std::vector<TimeNs> out;
  for (const TimeNs time_ns : times) {
    const auto after = std::ranges::lower_bound(camera0, time_ns);
    TimeNs nearest = after == camera0.end() ? time_ns - camera0.back() : time_ns - *after;
    if (after != camera0.begin() && time_ns - *std::prev(after) < std::abs(nearest))
      nearest = time_ns - *std::prev(after);
    if (std::abs(nearest) <= period_ns - period_ns / 10 * 4) out.push_back(nearest);
  }
  return out;
}

// Number of the times between the first and the last image of camera 0.
std::size_t during(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times) {
  const auto first = std::ranges::lower_bound(times, camera0.front());
  return static_cast<std::size_t>(std::ranges::upper_bound(times, camera0.back()) - first);
}

// The middle one of the offsets within the fifth of the period that has the most of them. Its differences from these do
// not wrap around, unlike offsets near half a period.
TimeNs densest(const std::vector<TimeNs>& offsets, TimeNs period_ns) {
  std::vector<TimeNs> cyclic;
  for (const TimeNs offset : offsets) cyclic.push_back(wrapped(offset, period_ns));
  std::ranges::sort(cyclic);
  const std::size_t n = cyclic.size();
  for (std::size_t k = 0; k < n; ++k) cyclic.push_back(cyclic[k] + period_ns);
  std::size_t first = 0, count = 0;
  for (std::size_t begin = 0, end = 0; begin < n; ++begin) {
    while (end < begin + n && cyclic[end] - cyclic[begin] <= period_ns / 5) ++end;
    if (end - begin > count) {
      first = begin;
      count = end - begin;
    }
  }
  return cyclic[first + count / 2];
}

// By how much the offsets, in order of time, change within half of their number: the difference of the medians of both
// halves, or 0 if it may be by chance, since the halves overlap or are small.
TimeNs drift(const std::vector<TimeNs>& offsets) {
  if (offsets.size() < kMinDriftImages) return 0;
  const auto half = offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2);
  const std::vector<TimeNs> before(offsets.begin(), half), after(half, offsets.end());
  const auto [before_min, before_max] = std::ranges::minmax(before);
  const auto [after_min, after_max] = std::ranges::minmax(after);
  return before_max < after_min || after_max < before_min ? median(after) - median(before) : 0;
}

// Whether at least 90 % of the offsets are within a tenth of the period of this one.
bool agree(const std::vector<TimeNs>& offsets, TimeNs with, TimeNs period_ns) {
  const auto count = std::ranges::count_if(
      offsets, [&](TimeNs offset) { return std::abs(wrapped(offset - with, period_ns)) <= period_ns / 10; });
  return static_cast<double>(count) >= kMinShare * static_cast<double>(offsets.size());
}

struct Estimate {
  CapturePhase phase;        // of the middle of the images
  TimeNs drift_ns = 0;       // drift() of the delay, if it is constant
  bool former_fits = false;  // whether the former phase is as constant
};

// See capture_phase(). `former`: the former phase.
std::optional<Estimate> estimate(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times, TimeNs period_ns,
                                 const CapturePhase& former) {
  std::vector<TimeNs> relative = offsets(camera0, times, period_ns);
  if (relative.size() < kMinImages || 2 * relative.size() < during(camera0, times)) return std::nullopt;
  const TimeNs typical = densest(relative, period_ns);
  for (TimeNs& offset : relative) offset = wrapped(offset - typical, period_ns);
  const TimeNs middle = median(relative);
  if (!agree(relative, middle, period_ns)) return Estimate{};
  return Estimate{{true, wrapped(typical + middle, period_ns)},
                  drift(relative),
                  former.constant && agree(relative, wrapped(former.later_ns - typical, period_ns), period_ns)};
}

// Returns the phase of a camera, given the former one, which remains while it is right. That of a camera whose delay
// drifts is the phase of its newest image, and is renewed earlier, before images are outside of the tolerance.
CapturePhase next_phase(const Estimate& found, const CapturePhase& former, TimeNs tolerance_ns, TimeNs period_ns) {
  CapturePhase phase = found.phase;
  phase.later_ns = wrapped(phase.later_ns + found.drift_ns, period_ns);
  if (std::abs(phase.later_ns) <= tolerance_ns) phase.later_ns = 0;
  const TimeNs change_ns = std::abs(wrapped(phase.later_ns - former.later_ns, period_ns));
  const bool remains = found.former_fits && change_ns <= (found.drift_ns == 0 ? period_ns / 10 : period_ns / 20);
  return remains ? former : phase;
}

}  // namespace

// Times are not multiplied: time stamps may be any, so that products could overflow.
TimeNs wrapped(TimeNs time_ns, TimeNs period_ns) {
  const TimeNs rest = time_ns % period_ns;
  return rest > period_ns - rest ? rest - period_ns : rest <= -(period_ns + rest) ? rest + period_ns : rest;
}

std::optional<CapturePhase> capture_phase(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times,
                                          TimeNs period_ns) {
  const std::optional<Estimate> found = estimate(camera0, times, period_ns, {});
  return found ? std::optional(found->phase) : std::nullopt;
}

namespace {

// Returns the first of these cameras, at least one, or another one that is faster by half.
std::size_t fast_camera(std::span<const std::vector<TimeNs>> times, std::span<const std::size_t> cameras) {
  const auto period_ns = [&](std::size_t c) {
    return times[c].size() < kMinImages ? kMaxPeriod : median_interval(times[c]);
  };
  std::size_t best = cameras.front();
  for (const std::size_t c : cameras) {
    if (period_ns(c) < period_ns(best) / 3 * 2) best = c;
  }
  return best;
}

// Sets the phases of these cameras relative to the reference if its period is known. `phases`: the former ones.
void set_phases(std::span<const std::vector<TimeNs>> times, std::size_t reference, std::span<const std::size_t> cameras,
                TimeNs tolerance_ns, bool live, CapturePhases& phases) {
  const TimeNs period_ns = median_interval(times[reference]);
  if (period_ns <= 0 || period_ns > kMaxPeriod) return;
  for (const std::size_t c : cameras) {
    CapturePhase& phase = phases.cameras[c];
    if (std::optional<Estimate> found = estimate(times[reference], times[c], period_ns, phase)) {
      if (!live) found->drift_ns = 0;  // all images, not only the newest ones
      phase = next_phase(*found, phase, tolerance_ns, period_ns);
    }
    if (phase.constant) phases.tolerance_ns = std::max({phases.tolerance_ns, tolerance_ns, period_ns / 10});
  }
}

}  // namespace

CapturePhases capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns,
                             std::span<const CapturePhase> before) {
  CapturePhases out{std::vector<CapturePhase>(times.size()), tolerance_ns};
  std::ranges::copy(before, out.cameras.begin());
  std::vector<std::size_t> cameras(times.size() - 1);
  std::iota(cameras.begin(), cameras.end(), 1);
  set_phases(times, 0, cameras, tolerance_ns, !before.empty(), out);
  if (times[0].size() >= 2) std::erase_if(cameras, [&](std::size_t c) { return out.cameras[c].constant; });
  if (cameras.size() < 2) return out;
  const std::size_t reference = fast_camera(times, cameras);
  out.cameras[reference] = {};
  std::erase(cameras, reference);
  for (const std::size_t c : cameras) {
    if (!before.empty()) out.cameras[c] = before[c];
  }
  set_phases(times, reference, cameras, tolerance_ns, !before.empty(), out);
  return out;
}

}  // namespace bslam::image
