#include "tracking/motion_prediction.h"

#include <algorithm>
#include <utility>

#include "base/median.h"

namespace bslam::tracking {

using geometry::SE3;

namespace {

// A camera of the frame: its delay divided by the time since the last frame, and its weight for the pose.
struct DelayedCamera {
  double delay = 0, weight = 0;
};

std::vector<DelayedCamera> delayed_cameras(const TrackerState& state, const solver::MotionModel& motion,
                                           const frame::BundledFrame& frame, double dt) {
  std::vector<DelayedCamera> out;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (frame.cameras[c].state != image::ImageState::kPresent) continue;
    const bool known = c < state.cameras.size();
    if (known && state.cameras[c].excluded) continue;
    out.push_back({motion.delay_s[c] / dt, known ? static_cast<double>(state.cameras[c].landmarks.size()) : 0.0});
  }
  if (std::ranges::all_of(out, [](const DelayedCamera& c) { return c.weight == 0.0; })) {
    for (DelayedCamera& camera : out) camera.weight = 1.0;  // nothing was observed yet
  }
  return out;
}

// The largest gain, up to the wanted one, with which an error of the last pose does not grow from frame to frame. With
// the delays u and a gain g, errors x of the pose satisfy in the mean over the cameras, by their weights,
//   (1 + u g) ((1 + u g) x_n - u (2 g - 1) x_(n-1) + u (g - 1) x_(n-2)) = 0.
// If most of the images are early, that is u < 0, the poses can alternate around the true ones.
double stable_gain(double wanted, std::span<const DelayedCamera> cameras) {
  constexpr double kMargin = 0.5, kStep = 0.05;
  const auto is_stable = [&](double gain) {
    double sum = 0.0, squares = 0.0, alternating = 0.0;
    for (const auto [u, weight] : cameras) {
      sum += weight * (1.0 + u * gain);
      squares += weight * (1.0 + u * gain) * (1.0 + u * gain);
      alternating += weight * (1.0 + u * gain) * (1.0 + u * (4.0 * gain - 2.0));
    }
    return sum > 0.0 && alternating >= kMargin * squares;
  };
  double gain = wanted;
  while (gain > 0.5 && !is_stable(gain)) gain -= kStep;
  return gain;
}

}  // namespace

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
  double ahead = (dt + frame::farthest_delay_s(frame)) / (dt + input.state.twist_interval_s);
  if (std::ranges::min(motion.delay_s) < 0.0) {  // early images
    const double gain = stable_gain(1.0 + ahead, delayed_cameras(input.state, motion, frame, dt));
    if (gain < 1.0 + ahead) ahead = gain - 1.0;
  }
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
