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

// The mean of what the stamps of a camera are wrong by, beyond its time offset.
double mean_error_s(const TrackInput& input, std::size_t camera) {
  return input.state.stamps[camera].mean_s - to_seconds(input.map.rig().camera(camera).time_offset_ns);
}

// Per camera, whether the capture time of its image is corrected: its stamps are wrong, and their mean error relative
// to the reference camera is known.
std::vector<std::uint8_t> correctable(const frame::BundledFrame& frame, std::span<const StampErrors> stamps) {
  constexpr int kKnown = 5;  // errors in the mean
  std::vector<std::uint8_t> out(frame.cameras.size(), 0);
  const std::size_t reference = frame::reference_camera(frame);
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c] = c != reference && frame.cameras[c].state == image::ImageState::kPresent && wrong(stamps[c]) &&
             stamps[c].reference == reference && stamps[c].count >= kKnown;
  }
  return out;
}

// Of the errors that remain after the corrections of the frame. Those of other cameras are zero.
ShiftPrior prior_of(const TrackInput& input, const frame::BundledFrame& frame,
                    std::span<const std::uint8_t> corrected) {
  ShiftPrior out(frame.cameras.size());
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (!corrected[c]) continue;
    const double corrected_s = to_seconds(frame.cameras[c].correction_ns) - mean_error_s(input, c);
    out.set(c, input.state.stamps[c].variance_s2, corrected_s);
  }
  return out;
}

// Estimates pose and capture times. Returns false if they are not finite.
bool estimate_capture_times(const TrackInput& input, std::span<const solver::PoseObservation> observations, SE3 T,
                            std::span<const std::uint8_t> corrected, frame::BundledFrame& frame) {
  constexpr int kSteps = 6;
  constexpr double kConverged_s = 1e-5;
  for (int step = 0; step < kSteps; ++step) {
    const Vector6d twist = motion_model(input, frame).twist(T);
    const auto found = solver::time_shift_step(frame::rig_of(input.map.rig(), frame, twist), observations, T, twist,
                                               prior_of(input, frame, corrected));
    if (!found.all_finite()) return false;
    T = T.perturbed(found.pose);
    for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
      if (corrected[c]) frame.cameras[c].correct_time(found.shift_s(static_cast<Eigen::Index>(c)));
    }
    if (found.shift_s.cwiseAbs().maxCoeff() < kConverged_s) break;
  }
  return true;
}

// The variance of the errors by three successive ones, the middle one of which is compared with the line through the
// others. Nullopt if they are not close.
std::optional<double> variance_by(const StampError& first, const StampError& middle, const StampError& last) {
  if (!(to_seconds(last.time_ns - first.time_ns) <= kMaxPrediction_s) || middle.time_ns <= first.time_ns)
    return std::nullopt;
  const double b = to_seconds(middle.time_ns - first.time_ns) / to_seconds(last.time_ns - first.time_ns), a = 1 - b;
  const double difference_s = middle.offset_s - a * first.offset_s - b * last.offset_s;
  const double of_estimates_s2 = middle.variance_s2 + a * a * first.variance_s2 + b * b * last.variance_s2;
  return (difference_s * difference_s - of_estimates_s2) / (1 + a * a + b * b);
}

// Updates the errors of a camera with that of one image. Those relative to another camera are forgotten. A single one
// that is large, which is part of three differences, may be another error, and leaves the stamps exact.
void update(const StampError& found, std::size_t reference, StampErrors& stamps) {
  constexpr double kRate = 0.1, kRateOfMean = 0.02, kMost_s2 = 2 * kExact_s2, kJump = 9.0;
  if (reference != stamps.reference) stamps = {stamps.variance_s2, 0, 0, reference, {}, {}};
  const bool known = stamps.last && stamps.before_last;
  if (const auto measured = known ? variance_by(*stamps.before_last, *stamps.last, found) : std::nullopt) {
    const double most = std::max(kMost_s2, kJump * stamps.variance_s2);
    stamps.variance_s2 = std::max(0.0, (1 - kRate) * stamps.variance_s2 + kRate * std::min(*measured, most));
  }
  ++stamps.count;
  stamps.mean_s += std::max(kRateOfMean, 1.0 / stamps.count) * (found.offset_s - stamps.mean_s);
  stamps.before_last = std::exchange(stamps.last, found);
}

}  // namespace

std::vector<TimeNs> correct_capture_times(const TrackInput& input,
                                          std::span<const solver::PoseObservation> observations, const SE3& T_rig_world,
                                          frame::BundledFrame& frame) {
  const std::span<const StampErrors> stamps = input.state.stamps;
  if (std::ranges::none_of(stamps, wrong) || motion_model(input, frame).twist(T_rig_world).isZero(0)) return {};
  const std::vector<std::uint8_t> corrected = correctable(frame, stamps);
  if (std::ranges::find(corrected, 1) == corrected.end()) return {};
  std::vector<TimeNs> before;
  for (const frame::CameraFrame& camera : frame.cameras) before.push_back(camera.correction_ns);
  if (!estimate_capture_times(input, observations, T_rig_world, corrected, frame)) {
    restore_capture_times(before, frame);
    return {};
  }
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (!corrected[c]) continue;
    frame.cameras[c].correct_time(-mean_error_s(input, c));
    frame.cameras[c].stamp_variance_s2 = stamps[c].variance_s2;
  }
  return before;
}

void restore_capture_times(std::span<const TimeNs> corrections, frame::BundledFrame& frame) {
  for (std::size_t c = 0; c < corrections.size(); ++c) frame.cameras[c].set_correction(corrections[c]);
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
    const TimeNs offset_ns = map.rig().camera(c).time_offset_ns + frame.cameras[c].correction_ns;
    update({to_seconds(offset_ns) + found.shift_s(i), found.variance_s2(i), frame.time_ns}, reference, stamps[c]);
  }
}

}  // namespace bslam::tracking
