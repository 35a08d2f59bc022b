#include "tracking/landmark_support.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "tracking/image_cells.h"

namespace bslam::tracking {
namespace {

constexpr double kUnconfirmed = 0.1;  // support of a cell without confirmed landmarks

// Seconds between the first and the last keyframe that observe a landmark, at most kLongObserved_s.
double time_observed(const map::BundledMap& map, LandmarkId landmark) {
  TimeNs first = std::numeric_limits<TimeNs>::max(), last = std::numeric_limits<TimeNs>::lowest();
  for (const map::Observation& o : map.observations(landmark)) {
    const TimeNs time_ns = map.keyframe(o.keyframe).frame->time_ns;
    first = std::min(first, time_ns);
    last = std::max(last, time_ns);
  }
  return first >= last ? 0.0 : std::min(kLongObserved_s, to_seconds(last - first));
}

}  // namespace

std::vector<std::uint8_t> confirmed_landmarks(const map::BundledMap& map, const TrackerState& state,
                                              const FrameMatches& matches) {
  constexpr std::uint32_t kMinFound = 2, kOneIn = 3;  // frames
  std::vector<std::uint8_t> out;
  for (const auto& of_camera : matches) {
    for (const Match& m : of_camera) {
      const map::Landmark& landmark = map.landmark(m.landmark);
      std::uint32_t expected = landmark.expected, found = landmark.found;
      for (const auto* recent : {&state.visibility_counts, &state.pending_counts}) {
        const auto counts = std::ranges::lower_bound(*recent, m.landmark, {}, &map::VisibilityCount::landmark);
        if (counts == recent->end() || counts->landmark != m.landmark) continue;
        expected += counts->expected;
        found += counts->found;
      }
      out.push_back(time_observed(map, m.landmark) > 0.0 || (found >= kMinFound && kOneIn * found >= expected));
    }
  }
  return out;
}

LandmarkSupport support(const map::BundledMap& map, const FrameMatches& matches,
                        std::span<const solver::PoseObservation> observations, std::span<const std::uint8_t> inlier,
                        std::span<const std::uint8_t> confirmed) {
  LandmarkSupport out;
  std::size_t i = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    std::array<double, kCells * kCells> spread{}, lasting{};
    for (const Match& m : matches[c]) {
      const std::size_t at = i++;
      if (!inlier[at]) continue;
      const std::size_t k = cell_of(observations[at].pixel, map.rig().camera(c));
      spread[k] = std::max(spread[k], confirmed.empty() || confirmed[at] ? kCellSupport : kUnconfirmed);
      if (lasting[k] < kLongObserved_s) lasting[k] = std::max(lasting[k], time_observed(map, m.landmark));
    }
    out.spread += std::accumulate(spread.begin(), spread.end(), 0.0);
    out.lasting += std::accumulate(lasting.begin(), lasting.end(), 0.0);
  }
  return out;
}

bool lasting_landmarks_found(const map::BundledMap& map, std::span<const LandmarkId> visible,
                             const FrameMatches& matches, std::span<const std::uint8_t> inlier) {
  constexpr double kLasting = 0.5;  // s
  constexpr double kAboutAsOften = 1.0 / 3.0;
  constexpr std::size_t kEnough = 50;  // landmarks
  std::vector<LandmarkId> found;
  std::size_t i = 0;
  for (const auto& of_camera : matches) {
    for (const Match& m : of_camera) {
      if (inlier[i++]) found.push_back(m.landmark);
    }
  }
  std::ranges::sort(found);
  struct Counts {
    std::size_t visible = 0, found = 0;
    double share() const { return visible > 0 ? static_cast<double>(found) / static_cast<double>(visible) : 0.0; }
  } lasting, new_ones;
  for (const LandmarkId l : visible) {
    Counts& counts = time_observed(map, l) >= kLasting ? lasting : new_ones;
    ++counts.visible;
    counts.found += std::ranges::binary_search(found, l);
  }
  if (std::min(lasting.visible, new_ones.visible) < kEnough) return true;
  return lasting.share() >= kAboutAsOften * new_ones.share();
}

}  // namespace bslam::tracking
