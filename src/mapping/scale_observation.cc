#include "mapping/scale_observation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "adjustment/bundle_problem.h"
#include "mapping/predicted_matches.h"
#include "mapping/rig_scale.h"

namespace bslam::mapping {
namespace {

// Largest scale factor applied at once: the equations are linearised, and far from the solution only the sign of the
// correction is reliable.
constexpr double kMaxScaleStep = 3.0;
constexpr double kMaxMetricCorrectionSigmas =
    3.0;                                      // in standard deviations: a smaller correction leaves the map metric
constexpr double kMinCorrectionSigmas = 0.5;  // in standard deviations: a smaller correction is not applied
// A metric scale that was estimated from motion is checked at keyframes with this interval. The map is no longer metric
// if an estimate differs from its scale by more than both limits.
constexpr std::size_t kCheckInterval = 4;
constexpr double kContradictionSigmas = 5.0, kContradiction = 0.05;
// Relative standard deviation of the scale without predicted matches up to which they are used.
constexpr double kMaxIndependentDeviation = 0.1;

// Only the oldest keyframe is fixed: fixing more would constrain the shape from which the scale is estimated.
adjustment::Selection select_observers(const map::BundledMap& map, KeyframeId keyframe, int limit) {
  adjustment::Selection out;
  out.free_keyframes.push_back(keyframe);
  for (const map::Covisible& c : map.best_covisible(keyframe, static_cast<std::size_t>(limit - 1))) {
    out.free_keyframes.push_back(c.keyframe);
  }
  std::sort(out.free_keyframes.begin(), out.free_keyframes.end());
  out.fixed_keyframes.push_back(out.free_keyframes.front());
  out.free_keyframes.erase(out.free_keyframes.begin());
  std::vector<std::uint8_t> taken(map.landmark_slots(), 0);
  const auto add = [&](KeyframeId k) {
    for (const LandmarkId l : map.keyframe(k).landmarks) {
      if (l.valid() && !std::exchange(taken[l.index()], std::uint8_t{1})) out.landmarks.push_back(l);
    }
  };
  add(out.fixed_keyframes.front());
  for (const KeyframeId k : out.free_keyframes) add(k);
  std::sort(out.landmarks.begin(), out.landmarks.end());
  return out;
}

// Returns true if the scale is to be estimated at this keyframe. Several submaps share one metric scale, which cannot
// be checked with one submap.
bool due(const map::BundledMap& map, KeyframeId keyframe) {
  if (map.scale() != map::Scale::kMetric) return map.scale() == map::Scale::kUnobservable;
  return map.scale_deviation() > 0 && keyframe.index() % kCheckInterval == 0 && map.roots().size() == 1;
}

// No estimate is made from more than `keyframes` keyframes.
int min_keyframes(const ScaleOptions& options) { return std::min(options.min_keyframes, options.keyframes); }

// Returns true if an estimate from this number of keyframes contradicts the scale that the map has.
bool contradicts(const RigScale& found, const map::BundledMap& map, std::size_t keyframes,
                 const ScaleOptions& options) {
  const bool metric = map.scale() == map::Scale::kMetric;
  const double deviation = metric ? std::hypot(found.deviation, map.scale_deviation()) : found.deviation;
  return static_cast<int>(keyframes) >= min_keyframes(options) &&
         std::abs(std::log(found.scale)) > std::max(kContradictionSigmas * deviation, kContradiction);
}

// Predicted matches confirm the scale that the map has, right or wrong. So they are used only if the scale is known
// without them and they agree, or if they contradict it.
std::optional<RigScale> estimate_scale(const adjustment::BundleProblem& selected, const map::BundledMap& map,
                                       const ScaleOptions& options) {
  const RigScaleOptions rig_options{.sigma_rotation = geometry::radians(options.sigma_rotation_deg),
                                    .correlated_observations = options.correlated_observations};
  const auto all = rig_scale(selected.problem, rig_options);
  if (all && contradicts(*all, map, selected.keyframes.size(), options)) return all;
  const solver::ReprojectionProblem divided = without_predicted_matches(selected.problem);
  if (divided.points.size() == selected.problem.points.size() &&
      divided.observations.size() == selected.problem.observations.size())
    return all;  // there are none
  const auto independent = rig_scale(divided, rig_options);
  if (!all || !independent || independent->deviation > kMaxIndependentDeviation) return independent;
  const bool agree = std::abs(std::log(all->scale / independent->scale)) <= independent->deviation;
  return agree ? all : independent;
}

// A calibration that was estimated from a map of wrong scale is wrong as well.
void withdraw_scale(double deviation, map::MapDraft& draft) {
  draft.set_scale(map::Scale::kUnobservable, deviation);
  if (draft.map().rig_deviation()) draft.set_rig(draft.map().given_rig(), nullptr);
}

}  // namespace

ScaleReport observe_scale(KeyframeId keyframe, const ScaleOptions& options, const FeatureModel& features,
                          map::MapDraft& draft) {
  ScaleReport report;
  const map::BundledMap& map = draft.map();
  if (!due(map, keyframe)) return report;
  const adjustment::Selection selection = select_observers(map, keyframe, options.keyframes);
  const auto selected = adjustment::build_problem(map, selection, features);
  const std::optional<RigScale> found = estimate_scale(selected, map, options);
  if (!found) return report;
  if (map.scale() == map::Scale::kMetric) {
    if (!contradicts(*found, map, selected.keyframes.size(), options)) return report;
    withdraw_scale(found->deviation, draft);
  }
  report.observed = true;
  report.deviation = found->deviation;
  report.keyframes = static_cast<int>(selected.keyframes.size());
  if (found->deviation > options.max_correcting_deviation) return report;
  const double correction = std::clamp(found->scale, 1.0 / kMaxScaleStep, kMaxScaleStep);
  // every scaling is a map correction, which invalidates the work of other stages
  if (std::abs(correction - 1.0) > kMinCorrectionSigmas * found->deviation) {
    report.correction = correction;
    draft.scale_submap(map.root_of(keyframe), correction);
  }
  // Remaining relative error of a scale that was too far off for one step.
  const double left = std::abs(found->scale / correction - 1.0);
  draft.set_scale(map::Scale::kUnobservable, std::max(found->deviation, left));
  return report;
}

void apply_stereo_scale(KeyframeId keyframe, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  const std::optional<frame::StereoScale> found = map.keyframe(keyframe).frame->stereo_scale;
  if (!found || map.scale() != map::Scale::kUnobservable || found->gauge_epoch != map.gauge_epoch()) return;
  draft.scale_submap(map.root_of(keyframe), found->factor);
  draft.set_scale(map::Scale::kUnobservable, std::numeric_limits<double>::infinity());
  const map::BundledKeyframe& entry = map.keyframe(keyframe);
  const geometry::SE3 T_world_rig = entry.T_rig_world.inverse();
  map::SetPoses moved;
  for (std::size_t f = 0; f < entry.frame->bundled.num_matched(); ++f) {
    const LandmarkId l = entry.landmarks[f];
    const auto& point = entry.frame->bundled.point(FeatureId(f));
    if (l.valid() && point && map.observations(l).size() == 1)
      moved.landmarks.emplace_back(l, T_world_rig * point->point_rig);
  }
  draft.set_poses(std::move(moved));
}

bool is_metric(const ScaleReport& report, double deviation_before, const ScaleOptions& options) {
  const double max_deviation = std::min(options.max_deviation, options.max_correcting_deviation);
  return report.observed && report.keyframes >= min_keyframes(options) && report.deviation <= max_deviation &&
         deviation_before <= max_deviation &&
         std::abs(report.correction - 1.0) <= kMaxMetricCorrectionSigmas * report.deviation;
}

}  // namespace bslam::mapping
