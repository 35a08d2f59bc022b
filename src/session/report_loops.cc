#include "session/report_loops.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace bslam::session {
namespace {

// The last of the nearest times. `times` is not empty.
std::size_t nearest(const std::vector<float>& times, float time) {
  const auto after = std::ranges::upper_bound(times, time);
  if (after == times.begin()) return 0;
  const bool is_before = after == times.end() || time - *(after - 1) <= *after - time;
  return static_cast<std::size_t>(after - times.begin()) - (is_before ? 1 : 0);
}

// How far the nearest keyframe of a submap is.
float distance(const std::vector<float>& times, float time) { return std::abs(times[nearest(times, time)] - time); }

std::optional<ReportLoop> ends_of(const PlaceEvent& loop, std::span<const std::vector<float>> times) {
  const auto at = static_cast<float>(loop.at_s), with = static_cast<float>(loop.with_s);
  std::optional<std::size_t> submap;
  for (std::size_t s = 0; s < times.size(); ++s) {
    if (times[s].empty()) continue;
    if (!submap || distance(times[s], at) < distance(times[*submap], at)) submap = s;
  }
  if (!submap) return std::nullopt;
  const float here = distance(times[*submap], with);
  const auto is_nearer = [&](const std::vector<float>& other) {
    return !other.empty() && distance(other, with) < here;
  };
  if (std::ranges::any_of(times, is_nearer)) return std::nullopt;
  return ReportLoop{*submap, nearest(times[*submap], at), nearest(times[*submap], with)};
}

}  // namespace

std::vector<ReportLoop> report_loops(std::span<const PlaceEvent> loops, std::span<const std::vector<float>> times) {
  std::vector<ReportLoop> out;
  for (const PlaceEvent& loop : loops) {
    if (const auto found = ends_of(loop, times)) out.push_back(*found);
  }
  return out;
}

}  // namespace bslam::session
