#include "tracking/late_cameras.h"

#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "frame/capture_times.h"
#include "solver/pose_solver.h"
#include "tracking/image_matches.h"
#include "tracking/track.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;
using frame::CameraFrame;
using geometry::SE3;

// Poses of a camera since its first image, in order of time.
struct TimedPose {
  TimeNs time_ns = 0;
  SE3 T_camera_first;
};
using Track = std::vector<TimedPose>;

// The pose of the camera at another image, from the points.
std::optional<SE3> estimated_pose(const camera::Rig& rig, const TwoImages& images, const CameraFrame& image) {
  std::vector<solver::PoseObservation> observations;
  for (const auto& m : match_images(images.first.keypoints, image.keypoints)) {
    const auto& point = images.points[m.a.index()];
    const std::size_t k = m.b.index();
    if (point)
      observations.push_back(
          {images.camera, *point, image.keypoints.pixel[k].cast<double>(), double{image.keypoints.sigma[k]}});
  }
  const double fraction =
      to_seconds(image.time_ns - images.first.time_ns) / to_seconds(images.second.time_ns - images.first.time_ns);
  const std::size_t c = images.camera.index();
  const SE3 T_rig_camera = rig.rig_from_cam(c);
  const auto found = solver::solve_pose(
      rig, observations, T_rig_camera * geometry::interpolate(SE3(), images.T_second_first, fraction), {});
  const bool most = 2 * static_cast<std::size_t>(found.num_inliers) > observations.size();
  if (!found.ok || !most) return std::nullopt;
  return rig.cam_from_rig(c) * found.T_rig_world;
}

bool between(const TwoImages& images, TimeNs time_ns) {
  return time_ns > images.first.time_ns && time_ns < images.second.time_ns;
}

// At most `count` of the images, evenly spaced.
std::vector<const CameraFrame*> some_of(const std::vector<const CameraFrame*>& images, std::size_t count) {
  if (images.size() <= count) return images;
  std::vector<const CameraFrame*> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(images[i * images.size() / count]);
  return out;
}

Track track_of(const camera::Rig& rig, const TwoImages& images, std::span<const BundledFrame* const> frames) {
  constexpr std::size_t kPoses = 24;
  Track out = {{images.first.time_ns, SE3()}};
  std::vector<const CameraFrame*> used;
  for (const BundledFrame* frame : frames) {
    const CameraFrame& image = frame->cameras[images.camera.index()];
    if (!image.keypoints.empty() && between(images, image.time_ns)) used.push_back(&image);
  }
  for (const CameraFrame* image : some_of(used, kPoses)) {
    if (const auto pose = estimated_pose(rig, images, *image)) out.push_back({image->time_ns, *pose});
  }
  out.push_back({images.second.time_ns, images.T_second_first});
  std::ranges::sort(out, {}, &TimedPose::time_ns);
  const auto same_time = [](const TimedPose& a, const TimedPose& b) { return a.time_ns == b.time_ns; };
  out.erase(std::unique(out.begin(), out.end(), same_time), out.end());
  return out;
}

// The first pose of the track that is not before this time within the track.
std::size_t next_pose(const Track& track, TimeNs time_ns) {
  const auto later = [&](const TimedPose& p) { return p.time_ns >= time_ns; };
  return static_cast<std::size_t>(std::ranges::find_if(track, later) - track.begin());
}

// Returns true if the poses around this time are close enough to interpolate them.
bool is_known(const Track& track, TimeNs time_ns) {
  const std::size_t next = next_pose(track, time_ns);
  return to_seconds(track[next].time_ns - track[next - 1].time_ns) <= kMaxPrediction_s;
}

// The pose at a time within the track, by constant acceleration through the three poses closest to it, or by constant
// velocity between two.
SE3 interpolated_pose(const Track& track, TimeNs time_ns) {
  const std::size_t end = next_pose(track, time_ns);
  std::vector<TimedPose> used = {track[end - 1], track[end]};
  const bool before = end >= 2, after = end + 1 < track.size();
  if (before && (!after || time_ns - track[end - 2].time_ns < track[end + 1].time_ns - time_ns))
    used.push_back(track[end - 2]);
  else if (after)
    used.push_back(track[end + 1]);
  const TimedPose& origin = used.front();
  geometry::Vector6d motion = geometry::Vector6d::Zero();  // Lagrange's polynomial; that of the origin is 0
  for (std::size_t i = 1; i < used.size(); ++i) {
    double weight = 1.0;
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (j != i) weight *= to_seconds(time_ns - used[j].time_ns) / to_seconds(used[i].time_ns - used[j].time_ns);
    }
    motion += weight * (used[i].T_camera_first * origin.T_camera_first.inverse()).log();
  }
  return SE3::exp(motion) * origin.T_camera_first;
}

geometry::Vector6d twist_between(const TimedPose& a, const TimedPose& b) {
  return (b.T_camera_first * a.T_camera_first.inverse()).log() / to_seconds(b.time_ns - a.time_ns);
}

// The mean velocity at the ends of the track. Between two close images it would be that of the noise.
geometry::Vector6d first_twist(const Track& track) {
  std::size_t end = 1;
  while (end + 1 < track.size() && to_seconds(track[end + 1].time_ns - track[0].time_ns) <= kMaxPrediction_s) ++end;
  return twist_between(track[0], track[end]);
}

geometry::Vector6d last_twist(const Track& track) {
  std::size_t begin = track.size() - 2;
  while (begin > 0 && to_seconds(track.back().time_ns - track[begin - 1].time_ns) <= kMaxPrediction_s) --begin;
  return twist_between(track[begin], track.back());
}

// Images of the other camera between the two; none if it also captures together with the camera.
std::vector<const CameraFrame*> images_of(std::size_t other, const TwoImages& images,
                                          std::span<const BundledFrame* const> frames) {
  constexpr std::size_t kImages = 8;
  std::vector<const CameraFrame*> out;
  for (const BundledFrame* frame : frames) {
    const CameraFrame& image = frame->cameras[other];
    if (image.keypoints.empty()) continue;
    const bool both = !frame->cameras[images.camera.index()].keypoints.empty();
    if (both && !frame::captured_apart(*frame, CameraIndex(other), images.camera)) return {};
    if (between(images, image.time_ns)) out.push_back(&image);
  }
  return some_of(out, kImages);
}

// Appends what another camera shows of the points, at the time of its image.
void append_observations(const camera::Rig& rig, const TwoImages& images, const Track& track, std::size_t other,
                         const CameraFrame& image, std::vector<estimators::BaselineObservation>& out) {
  constexpr double kWindow =
      0.25;  // rad, maximum angle between the bearing and the direction of the point if it is far
  const SE3 T_now_first = interpolated_pose(track, image.time_ns);
  const SE3 T_other_camera = rig.cam_from_rig(other) * rig.rig_from_cam(images.camera.index());
  std::vector<Eigen::Vector3d> directions;  // zero for keypoints without a point
  for (const auto& p : images.points)
    directions.push_back(p ? T_other_camera.rotation() * (T_now_first * *p) : Eigen::Vector3d::Zero().eval());
  const feature::Keypoints &a = images.first.keypoints, &b = image.keypoints;
  const auto in_window = [&](std::size_t i, std::size_t j) {
    return images.points[i] && directions[i].dot(b.bearing[j]) >= std::cos(kWindow) * directions[i].norm();
  };
  for (const auto& m : feature::mutual_matches(a.descriptor, b.descriptor, in_window))
    out.push_back({directions[m.a.index()], T_other_camera.translation(), b.bearing[m.b.index()]});
}

}  // namespace

bool at_rest(const BundledFrame& first, const BundledFrame& second) {
  constexpr double kSame_px = 0.5;
  constexpr std::size_t kMinMatches = 50;
  const double passed_s = to_seconds(second.time_ns - first.time_ns);
  const double later_s = frame::capture_span_s(second);
  if (passed_s <= 0.0 || passed_s > kMaxPrediction_s || later_s <= to_seconds(frame::kTogetherNs)) return false;
  bool some = false;
  for (std::size_t c = 0; c < second.cameras.size(); ++c) {
    const feature::Keypoints &a = first.cameras[c].keypoints, &b = second.cameras[c].keypoints;
    std::vector<double> moved;
    for (const auto& m : match_images(a, b))
      moved.push_back((a.pixel[m.a.index()] - b.pixel[m.b.index()]).cast<double>().norm());
    if (moved.size() < kMinMatches) continue;
    some = true;
    if (median(std::move(moved)) * later_s / passed_s > kSame_px) return false;
  }
  return some;
}

std::optional<ScaleFromOtherTimes> scale_from_other_times(const camera::Rig& rig, const TwoImages& images,
                                                          std::span<const BundledFrame* const> frames) {
  constexpr double kTolerance_px = 4.0;
  const std::size_t camera = images.camera.index();
  std::optional<Track> track;
  std::optional<estimators::BaselineScale> best;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (c == camera || !rig.share_view(c, camera)) continue;
    const std::vector<const CameraFrame*> others = images_of(c, images, frames);
    if (others.empty()) continue;
    if (!track) track = track_of(rig, images, frames);
    std::vector<estimators::BaselineObservation> observations;
    for (const CameraFrame* image : others) {
      if (is_known(*track, image->time_ns)) append_observations(rig, images, *track, c, *image, observations);
    }
    const double pixel = std::max(rig.camera(c).radians_per_pixel(), rig.camera(camera).radians_per_pixel());
    const auto found = estimators::baseline_scale(observations, {.tolerance = kTolerance_px * pixel});
    if (found && (!best || found->deviation < best->deviation)) best = found;
  }
  if (!best) return std::nullopt;
  return ScaleFromOtherTimes{*best, {first_twist(*track), last_twist(*track)}};
}

}  // namespace bslam::tracking
