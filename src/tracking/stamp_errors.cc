#include "tracking/stamp_errors.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "frame/capture_times.h"
#include "solver/time_shifts.h"
#include "tracking/motion_prediction.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;
using geometry::Vector6d;
using solver::ShiftPrior;

constexpr double kMillisecond_s2 = 1e-6;  // squared
// Stamps whose errors have a smaller variance are taken as exact.
constexpr double kExact_s2 = 0.25 * kMillisecond_s2;

bool wrong(const StampErrors& stamps) { return stamps.variance_s2 > kExact_s2; }

// Of the errors that remain after the corrections of the frame. Those of the reference camera and of cameras with exact
// stamps are zero.
ShiftPrior prior_of(const frame::BundledFrame& frame, std::size_t reference, std::span<const StampErrors> stamps) {
  ShiftPrior out(frame.cameras.size());
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (c != reference && wrong(stamps[c]))
      out.set(c, stamps[c].variance_s2, to_seconds(frame.cameras[c].correction_ns));
  }
  return out;
}

// The variance of the errors by three successive ones, the middle one of which is compared with the line through the
// others. Nullopt if they are not close.
std::optional<double> variance_by(const StampError& first, const StampError& middle, const StampError& last) {
  if (!(to_seconds(last.time_ns - first.time_ns) <= kMaxPrediction_s) || middle.time_ns <= first.time_ns)
    return std::nullopt;
  const double b = to_seconds(middle.time_ns - first.time_ns) / to_seconds(last.time_ns - first.time_ns), a = 1 - b;
  const double difference_s = middle.error_s - a * first.error_s - b * last.error_s;
  const double of_estimates_s2 = middle.variance_s2 + a * a * first.variance_s2 + b * b * last.variance_s2;
  return (difference_s * difference_s - of_estimates_s2) / (1 + a * a + b * b);
}

// Updates the errors of a camera with that of one image. A single one that is large, which is part of three
// differences, may be another error, and leaves the stamps exact.
void update(const StampError& found, StampErrors& stamps) {
  constexpr double kRate = 0.1, kRateOfMean = 0.02, kMost_s2 = 2 * kExact_s2, kJump = 9.0;
  const bool known = stamps.last && stamps.before_last;
  if (const auto measured = known ? variance_by(*stamps.before_last, *stamps.last, found) : std::nullopt) {
    const double most = std::max(kMost_s2, kJump * stamps.variance_s2);
    stamps.variance_s2 = std::max(0.0, (1 - kRate) * stamps.variance_s2 + kRate * std::min(*measured, most));
  }
  stamps.mean_s += kRateOfMean * (found.error_s - stamps.mean_s);
  stamps.before_last = std::exchange(stamps.last, found);
}

}  // namespace

void correct_capture_times(const TrackInput& input, std::span<const solver::PoseObservation> observations,
                           const SE3& T_rig_world, frame::BundledFrame& frame) {
  constexpr int kSteps = 6;
  constexpr double kConverged_s = 1e-5;
  const std::span<const StampErrors> stamps = input.state.stamps;
  if (std::ranges::none_of(stamps, wrong)) return;
  const std::size_t reference = frame::reference_camera(frame);
  SE3 T = T_rig_world;
  for (int step = 0; step < kSteps; ++step) {
    const Vector6d twist = motion_model(input, frame).twist(T);
    const auto found = solver::time_shift_step(frame::rig_of(input.map.rig(), frame, twist), observations, T, twist,
                                               prior_of(frame, reference, stamps));
    if (!found.all_finite()) return;
    T = T.perturbed(found.pose);
    for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
      if (c == reference || !wrong(stamps[c])) continue;
      frame.cameras[c].correct_time(found.shift_s(static_cast<Eigen::Index>(c)));
      frame.cameras[c].stamp_variance_s2 = stamps[c].variance_s2;
    }
    if (found.shift_s.cwiseAbs().maxCoeff() < kConverged_s) break;
  }
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (c != reference && wrong(stamps[c])) frame.cameras[c].correct_time(-stamps[c].mean_s);
  }
}

void update_stamp_errors(const map::BundledMap& map, const frame::BundledFrame& frame, const SE3& T_rig_world,
                         const FrameMatches& inliers, std::vector<StampErrors>& stamps) {
  const std::size_t cameras = frame.cameras.size();
  stamps.resize(cameras);
  if (cameras == 1 || frame.twist.isZero(0)) return;
  const std::size_t reference = frame::reference_camera(frame);
  ShiftPrior prior(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    if (c != reference) prior.set(c, ShiftPrior::kUnknown_s2);
  }
  const auto found = solver::time_shift_step(frame::rig_of(map.rig(), frame), pose_observations(map, frame, inliers),
                                             T_rig_world, frame.twist, prior);
  for (std::size_t c = 0; c < cameras; ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    if (c == reference || !(found.variance_s2(i) < kMillisecond_s2)) continue;
    const double error_s = to_seconds(frame.cameras[c].correction_ns) + found.shift_s(i);
    update({error_s, found.variance_s2(i), frame.time_ns}, stamps[c]);
  }
}

}  // namespace bslam::tracking
