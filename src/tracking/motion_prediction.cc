#include "tracking/motion_prediction.h"

#include <utility>

#include "base/median.h"

namespace bslam::tracking {

using geometry::SE3;

bool keeps_twist(const TrackerState& state, TimeNs time_ns) {
  constexpr double kFastest_s = 0.005;
  const double dt = to_seconds(time_ns - state.time_ns);
  return dt > 0 && dt < kFastest_s && state.twist && !state.twist_kept;
}

SE3 last_pose(const TrackInput& input) { return input.state.anchored.resolve(input.map).value(); }

std::optional<SE3> motion_since_last(const TrackerState& state, TimeNs time_ns) {
  const double dt = to_seconds(time_ns - state.time_ns);
  if (dt == 0) return SE3();
  if (!state.twist || dt < 0 || dt > kMaxPrediction_s) return std::nullopt;
  return SE3::exp(dt * *state.twist);
}

SE3 predict(const TrackInput& input, TimeNs time_ns) {
  return motion_since_last(input.state, time_ns).value_or(SE3()) * last_pose(input);
}

solver::MotionModel motion_model(const TrackInput& input, const frame::BundledFrame& frame) {
  solver::MotionModel motion{.delay_s = frame::delays_of(frame), .T_before = last_pose(input)};
  const double dt = to_seconds(frame.time_ns - input.state.time_ns);
  if (dt <= 0 || dt > kMaxPrediction_s) {
    motion.offset = frame.twist;  // nothing newer is known
    return motion;
  }
  if (keeps_twist(input.state, frame.time_ns)) {
    motion.offset = *input.state.twist;
    return motion;
  }
  motion.gain = 1.0 / dt;
  if (!input.state.twist) return motion;
  // From the middle of this interval to the middle of the delays, in distances of the middles of the two intervals.
  const double ahead = (dt + frame::farthest_delay_s(frame)) / (dt + input.state.twist_interval_s);
  motion.gain = (1.0 + ahead) / dt;
  motion.offset = -ahead * *input.state.twist;
  return motion;
}

bool is_plausible(const FoundPlace& place, const map::BundledMap& map, const TrackerState& state, TimeNs time_ns) {
  constexpr double kSpeeds = 2.0, kClearlyFound = 0.4;
  constexpr double kForgotten_s = 5.0;  // the rig may have been anywhere since
  const std::optional<SE3> T_rig_world = state.anchored.resolve(map);
  const double time_s = to_seconds(time_ns - state.time_ns);
  if (!T_rig_world || !state.twist || time_s > kForgotten_s || place.found_ratio >= kClearlyFound ||
      map.root_of(map.nearest_alive_ancestor(state.anchored.reference)) != map.root_of(place.matched_keyframe))
    return true;
  std::vector<double> distances;
  for (const auto& [feature, l] : place.matches)
    distances.push_back((place.T_rig_world * map.landmark(l).position).norm());
  const double travelled = kSpeeds * state.twist->tail<3>().norm() * time_s;
  const double distance = (T_rig_world->inverse().translation() - place.T_rig_world.inverse().translation()).norm();
  return distance <= travelled + (distances.empty() ? 0.0 : median(distances));
}

double image_motion_px(const map::BundledMap& map, const TrackerState& state) {
  if (!state.twist || !state.anchored.known_in(map)) return 0.0;
  const SE3 T_after = state.anchored.resolve(map).value();
  const SE3 T_before = SE3::exp(-state.twist_interval_s * *state.twist) * T_after;
  const camera::Rig& rig = map.rig();
  std::vector<double> motions;
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    for (const LandmarkId seen : state.cameras[c].landmarks) {
      const LandmarkId l = map.resolve(seen);
      if (!l.valid()) continue;
      const Eigen::Vector3d& point = map.landmark(l).position;
      const auto before = rig.camera(c).project(rig.cam_from_rig(c) * (T_before * point));
      const auto after = rig.camera(c).project(rig.cam_from_rig(c) * (T_after * point));
      if (before && after) motions.push_back((*after - *before).norm());
    }
  }
  return motions.empty() ? 0.0 : median(std::move(motions));
}

}  // namespace bslam::tracking
