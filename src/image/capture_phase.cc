#include "image/capture_phase.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "base/median.h"
#include "image/frame_grouping.h"

namespace bslam::image {
namespace {

constexpr std::size_t kMinImages = 5;
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

}  // namespace

// Times are not multiplied: time stamps may be any, so that products could overflow.
TimeNs wrapped(TimeNs time_ns, TimeNs period_ns) {
  const TimeNs rest = time_ns % period_ns;
  return rest > period_ns - rest ? rest - period_ns : rest <= -(period_ns + rest) ? rest + period_ns : rest;
}

std::optional<CapturePhase> capture_phase(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times,
                                          TimeNs period_ns) {
  std::vector<TimeNs> relative = offsets(camera0, times, period_ns);
  if (relative.size() < kMinImages || 2 * relative.size() < during(camera0, times)) return std::nullopt;
  const TimeNs typical = densest(relative, period_ns);
  for (TimeNs& offset : relative) offset = wrapped(offset - typical, period_ns);
  const TimeNs middle = median(relative);
  const auto agree = std::ranges::count_if(
      relative, [&](TimeNs offset) { return std::abs(wrapped(offset - middle, period_ns)) <= period_ns / 10; });
  if (static_cast<double>(agree) < kMinShare * static_cast<double>(relative.size())) return CapturePhase{false, 0};
  return CapturePhase{true, wrapped(typical + middle, period_ns)};
}

CapturePhases capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns,
                             std::span<const CapturePhase> before) {
  CapturePhases out{std::vector<CapturePhase>(times.size()), tolerance_ns};
  std::ranges::copy(before, out.cameras.begin());
  const TimeNs period_ns = median_interval(times[0]);
  const bool has_period = period_ns > 0 && period_ns <= kMaxPeriod;
  for (std::size_t c = 1; c < times.size() && has_period; ++c) {
    CapturePhase& phase = out.cameras[c];
    CapturePhase found = capture_phase(times[0], times[c], period_ns).value_or(phase);
    if (std::abs(found.later_ns) <= tolerance_ns) found.later_ns = 0;
    const bool remains = phase.constant && found.constant &&
                         std::abs(wrapped(found.later_ns - phase.later_ns, period_ns)) <= period_ns / 10;
    if (!remains) phase = found;
    if (phase.constant) out.tolerance_ns = std::max(tolerance_ns, period_ns / 10);
  }
  return out;
}

}  // namespace bslam::image
