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
constexpr double kMinShare = 0.9;             // of the images that are within a tenth of the period of the phase

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

}  // namespace

// Times are not multiplied: time stamps may be any, so that products could overflow.
TimeNs wrapped(TimeNs time_ns, TimeNs period_ns) {
  const TimeNs rest = time_ns % period_ns;
  return rest > period_ns - rest ? rest - period_ns : rest <= -(period_ns + rest) ? rest + period_ns : rest;
}

std::optional<CapturePhase> capture_phase(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times,
                                          TimeNs period_ns) {
  std::vector<TimeNs> relative = offsets(camera0, times, period_ns);
  if (relative.size() < kMinImages || 2 * relative.size() < times.size()) return std::nullopt;
  const TimeNs first = relative.front();  // differences from it do not wrap around, unlike offsets near half a period
  for (TimeNs& offset : relative) offset = wrapped(offset - first, period_ns);
  const TimeNs middle = median(relative);
  const auto agree = std::ranges::count_if(
      relative, [&](TimeNs offset) { return std::abs(wrapped(offset - middle, period_ns)) <= period_ns / 10; });
  if (static_cast<double>(agree) < kMinShare * static_cast<double>(relative.size())) return CapturePhase{false, 0};
  return CapturePhase{true, wrapped(first + middle, period_ns)};
}

CapturePhases capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns,
                             std::span<const TimeNs> before) {
  CapturePhases out{std::vector<TimeNs>(times.size(), 0), tolerance_ns};
  std::ranges::copy(before, out.later_ns.begin());
  const TimeNs period_ns = median_interval(times[0]);
  if (period_ns <= 0 || period_ns > kMaxPeriod) return out;
  for (std::size_t c = 1; c < times.size(); ++c) {
    const std::optional<CapturePhase> found = capture_phase(times[0], times[c], period_ns);
    TimeNs& later_ns = out.later_ns[c];
    if (found && std::abs(found->later_ns) <= tolerance_ns)
      later_ns = 0;
    else if (found && (later_ns == 0 || std::abs(wrapped(found->later_ns - later_ns, period_ns)) > period_ns / 10))
      later_ns = found->later_ns;
    if (later_ns != 0 || (found && found->constant)) out.tolerance_ns = std::max(tolerance_ns, period_ns / 10);
  }
  return out;
}

}  // namespace bslam::image
