// A closed trajectory: some steps out and back, while the rig rotates by 360 degrees. The view at the end was not
// observed since the beginning.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>

#include "place/shipped_vocabulary.h"
#include "system/rendered_tour.h"

namespace bslam::system {

constexpr std::size_t kRound = 60, kWalk = 76;  // frames until the rig is back, and total number

// `beside` metres to the left of the trajectory and the same distance above it.
inline synthetic::Trajectory round_and_home(const simulator::Building& building, double duration_s, double beside = 0) {
  constexpr double kKnot_s = 0.1, kReach_m = 1.2;
  const double round_s = static_cast<double>(kRound) / RenderedTour::kRateHz;
  const Eigen::Vector2d ahead = (building.tour[20] - building.tour[0]).normalized(), left(-ahead.y(), ahead.x());
  std::vector<synthetic::ControlPose> control;
  for (int i = -1; (i - 3) * kKnot_s < duration_s; ++i) {
    const double turn = 2 * std::numbers::pi * i * kKnot_s / round_s;
    const Eigen::Vector2d at = building.tour[0] + 0.5 * kReach_m * (1 - std::cos(turn)) * ahead + beside * left;
    control.push_back({{at.x(), at.y(), 1.5 + beside + 0.05 * std::sin(3 * turn)},
                       std::atan2(ahead.y(), ahead.x()) + turn,
                       0.04 * std::sin(5 * turn),
                       0.03 * std::sin(4 * turn)});
  }
  return synthetic::Trajectory(std::move(control), kKnot_s);
}

inline const RenderedTour& closed_walk() {
  static const RenderedTour walk(
      2, kWalk, [](const auto& building, double duration_s) { return round_and_home(building, duration_s); });
  return walk;
}

// Segments of the trajectory one after the other, as if the rig was carried from one to the next.
struct Playback {
  std::vector<image::ImageBundle> frames;
  evaluation::Trajectory truth;
};

inline Playback play(const RenderedTour& tour, std::initializer_list<std::pair<std::size_t, std::size_t>> segments) {
  Playback out;
  for (const auto& [first, end] : segments) {
    for (std::size_t k = first; k < end; ++k) {
      image::ImageBundle images = tour.frames()[k];
      const TimeNs later_ns = tour.frames()[out.frames.size()].time_ns - images.time_ns;
      images.id = FrameId(out.frames.size());
      images.time_ns += later_ns;
      for (image::CameraImage& i : images.images) i.time_ns += later_ns;
      out.truth.push_back({tour.truth()[k].time_ns + later_ns, tour.truth()[k].T_world_frame});
      out.frames.push_back(std::move(images));
    }
  }
  return out;
}

inline void process_all(System& system, const std::vector<image::ImageBundle>& frames) {
  for (const image::ImageBundle& images : frames) must_process(system, images);
}

inline Resources with_vocabulary() { return {.vocabulary = place::shipped_vocabulary().value()}; }

inline bool is_tracked(const FrameRecord& record) { return record.result.status == tracking::TrackStatus::kTracking; }

// Error of a pose.
struct PoseError {
  double m = 0, rad = 0;
};
inline PoseError pose_error(const geometry::SE3& estimate, const geometry::SE3& truth) {
  const geometry::SE3 off = truth.inverse() * estimate;
  return {off.translation().norm(), off.rotation().angularDistance(Eigen::Quaterniond::Identity())};
}

// Checks the live poses of all tracked frames in the world frame of camera 0 at `T_world_origin`. The bounds are about
// five times the errors for these small images.
inline void expect_told_where_it_is(const System& system, const evaluation::Trajectory& truth,
                                    const geometry::SE3& T_world_origin) {
  for (const FrameRecord& record : system.frames()) {
    if (!is_tracked(record)) continue;
    const geometry::SE3 T_origin_rig = T_world_origin.inverse() * truth[record.result.frame.index()].T_world_frame;
    const PoseError error = pose_error(record.result.T_rig_world.inverse(), T_origin_rig);
    EXPECT_LT(error.m, 0.03) << "frame " << record.result.frame.value();
    EXPECT_LT(error.rad, 0.015) << "frame " << record.result.frame.value();
  }
}

// Checks that the odometry pose follows the motion of the rig, independent of corrections of the map.
inline void expect_smooth(const System& system, const evaluation::Trajectory& truth) {
  const std::vector<FrameRecord>& frames = system.frames();
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const FrameRecord& now = frames[k];
    if (!is_tracked(now)) continue;
    const PoseError sum = pose_error(now.T_rig_odom, now.result.T_rig_world * now.T_map_odom);
    EXPECT_LT(std::max(sum.m, sum.rad), 1e-9) << "frame " << k;
    if (k == 0 || !is_tracked(frames[k - 1])) continue;
    const geometry::SE3 T_now_before = truth[k].T_world_frame.inverse() * truth[k - 1].T_world_frame;
    const PoseError step = pose_error(now.T_rig_odom * frames[k - 1].T_rig_odom.inverse(), T_now_before);
    EXPECT_LT(step.m, 0.02) << "frame " << k;
    EXPECT_LT(step.rad, 0.01) << "frame " << k;
  }
}

// Returns true if the maps are bitwise identical.
inline bool identical(const map::BundledMap& a, const map::BundledMap& b) {
  const auto same = [](const geometry::SE3& x, const geometry::SE3& y) {
    return x.translation() == y.translation() && x.rotation().coeffs() == y.rotation().coeffs();
  };
  if (a.version() != b.version() || a.keyframe_ids() != b.keyframe_ids() || a.landmark_ids() != b.landmark_ids())
    return false;
  for (const KeyframeId k : a.keyframe_ids()) {
    const map::BundledKeyframe &x = a.keyframe(k), &y = b.keyframe(k);
    if (!same(x.T_rig_world, y.T_rig_world) || x.parent != y.parent || x.frame->time_ns != y.frame->time_ns)
      return false;
  }
  for (const LandmarkId l : a.landmark_ids()) {
    if (a.landmark(l).position != b.landmark(l).position || a.landmark(l).descriptor != b.landmark(l).descriptor)
      return false;
    if (!std::ranges::equal(a.observations(l), b.observations(l))) return false;
  }
  return true;
}

}  // namespace bslam::system
