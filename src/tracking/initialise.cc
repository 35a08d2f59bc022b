#include "tracking/initialise.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "base/median.h"
#include "estimators/generalised_scale.h"
#include "frame/capture_times.h"
#include "frame/rig_at.h"
#include "tracking/image_matches.h"
#include "tracking/late_cameras.h"
#include "tracking/stereo_scale.h"
#include "tracking/track.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;
using frame::KeypointRef;
using geometry::SE3;

constexpr int kMinInliers = 50;

struct TwoView {
  std::size_t camera = 0;
  std::vector<feature::DescriptorMatch> pairs;
  estimators::RelativePose pose;
};

// Matches of every camera.
struct FramePairs {
  std::vector<std::vector<feature::DescriptorMatch>> keypoints;
  std::vector<std::vector<estimators::BearingPair>> bearings;
};

FramePairs match_cameras(const BundledFrame& first, const BundledFrame& second) {
  FramePairs out;
  for (std::size_t c = 0; c < first.cameras.size(); ++c) {
    const feature::Keypoints &a = first.cameras[c].keypoints, &b = second.cameras[c].keypoints;
    const auto& pairs = out.keypoints.emplace_back(match_images(a, b));
    auto& bearings = out.bearings.emplace_back();
    for (const feature::DescriptorMatch& p : pairs)
      bearings.push_back({a.bearing[p.a.index()], b.bearing[p.b.index()]});
  }
  return out;
}

// Returns the camera with the largest median parallax among those with enough inliers.
std::optional<TwoView> best_two_view(const FramePairs& pairs, const camera::Rig& rig,
                                     const InitialisationOptions& options, std::uint64_t seed) {
  constexpr double kNoise_px = 0.5;  // pixels of small images are larger than the usual bound
  std::optional<TwoView> best;
  for (std::size_t c = 0; c < pairs.keypoints.size(); ++c) {
    TwoView view{c, pairs.keypoints[c], {}};
    if (view.pairs.size() < static_cast<std::size_t>(options.min_monocular)) continue;
    estimators::RelativePoseOptions two_views{.min_inliers = kMinInliers, .leave_out_unmoved = true};
    two_views.inlier_angle = std::max(two_views.inlier_angle, kNoise_px * rig.camera(c).radians_per_pixel());
    const auto pose = estimators::relative_pose(pairs.bearings[c], two_views, Random(seed, "two views", c));
    if (!pose || pose->num_inliers < options.min_monocular_points) continue;
    view.pose = *pose;
    if (!best || view.pose.median_parallax > best->pose.median_parallax) best = view;
  }
  return best;
}

// Length assigned to the distance between the two frames (before: 1), and its relative standard deviation.
struct InitialScale {
  double length = 1;
  double deviation = std::numeric_limits<double>::infinity();
  // Velocity of the camera in both frames, if it was estimated: before it is scaled.
  std::optional<std::array<geometry::Vector6d, 2>> twists = {};
};

// The scale at which the points of the two views have the depths of matched features, which become landmarks as well:
// the median of the ratios. Returns nullopt if fewer than three features show it.
std::optional<InitialScale> scale_of_matched_features(const TwoView& view, const BundledFrame& first,
                                                      const camera::Rig& rig, const InitialisationOptions& options) {
  constexpr std::size_t kMinFeatures = 3;
  const CameraIndex camera(view.camera);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < view.pairs.size(); ++i) {
    if (!view.pose.inlier[i]) continue;
    const auto& point = first.bundled.point(first.bundled.feature(camera, view.pairs[i].a));
    if (!has_accurate_depth(point, options)) continue;
    const double depth = (rig.cam_from_rig(view.camera) * point->point_rig).norm();
    ratios.push_back(depth / view.pose.points_a[i].norm());
  }
  if (ratios.size() < kMinFeatures) return std::nullopt;
  const double features = static_cast<double>(ratios.size());
  const auto [ratio, deviation] = median_ratio(std::move(ratios));
  return InitialScale{ratio, (deviation + options.max_depth_error) / std::sqrt(features)};
}

// The two images from which the points of the view were triangulated.
TwoImages two_images(const TwoView& view, const BundledFrame& first, const BundledFrame& second) {
  const frame::CameraFrame& camera = first.cameras[view.camera];
  TwoImages out{CameraIndex(view.camera), camera, second.cameras[view.camera], view.pose.T_b_a, {}};
  out.points.resize(camera.keypoints.size());
  for (std::size_t i = 0; i < view.pairs.size(); ++i) {
    if (view.pose.inlier[i]) out.points[view.pairs[i].a.index()] = view.pose.points_a[i];
  }
  return out;
}

std::vector<const BundledFrame*> all_of(const StartFrames& frames) {
  std::vector<const BundledFrame*> out;
  for (const auto& frame : frames.between) out.push_back(frame.get());
  out.push_back(&frames.second);
  return out;
}

// Returns the length of the motion of a camera above which the rotation of the rig changes the direction of motion of
// the other cameras by less than can be measured.
double least_length(const TwoView& view, const camera::Rig& rig) {
  constexpr double kUnnoticed = 0.01;  // rad, change of the direction of motion
  const Eigen::Matrix3d turn = view.pose.T_b_a.matrix3() - Eigen::Matrix3d::Identity();
  double apart = 0.0;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_view_cam = rig.cam_from_rig(view.camera) * rig.rig_from_cam(c);
    apart = std::max(apart, (turn * T_view_cam.translation()).norm());
  }
  return apart / kUnnoticed;
}

// If the scale cannot be estimated well, it must not be chosen too small: in a small map the rotation of the rig moves
// the other cameras in clearly different directions, and their wrong matches that happen to agree with these directions
// would be accepted.
InitialScale choose_scale(const TwoView& view, const FramePairs& pairs, const StartFrames& frames,
                          const camera::Rig& rig, const InitialisationOptions& options) {
  constexpr double kNoise_px = 1.25;  // pixels of small images are larger than the usual bound
  std::vector<double> depths;
  for (std::size_t i = 0; i < view.pairs.size(); ++i) {
    if (view.pose.inlier[i]) depths.push_back(view.pose.points_a[i].norm());
  }
  const double depth = median(depths);
  if (rig.size() == 1) return {1.0 / depth, std::numeric_limits<double>::infinity()};
  const BundledFrame& first = *frames.first.frame;
  if (const auto found = scale_of_matched_features(view, first, rig, options)) return *found;
  if (const auto found = scale_from_other_times(rig, two_images(view, first, frames.second), all_of(frames)))
    return {found->scale.scale, found->scale.deviation, found->twists};
  std::vector<estimators::CameraPairs> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    estimators::CameraPairs camera{rig.cam_from_rig(c) * rig.rig_from_cam(view.camera), pairs.bearings[c]};
    camera.inlier_angle = std::max(camera.inlier_angle, kNoise_px * rig.camera(c).radians_per_pixel());
    cameras.push_back(std::move(camera));
  }
  const auto found = estimators::generalised_scale(view.pose.T_b_a, cameras);
  if (found && found->deviation <= options.max_scale_deviation)
    return {found->T_b_a.translation().norm(), found->deviation};
  double least = least_length(view, rig);
  if (found) least = std::min(least, found->T_b_a.translation().norm() * std::exp(found->deviation));
  return {std::max(options.assumed_median_depth / depth, least), std::numeric_limits<double>::infinity()};
}

// Velocities of the rig in both frames: those found with the scale, or the mean one if there is not much time between
// the frames. Returns nullopt if they do not matter or are not known.
std::optional<std::array<geometry::Vector6d, 2>> twists(const TwoView& view, const InitialScale& scale,
                                                        const StartFrames& frames, const camera::Rig& rig,
                                                        const SE3& T_second_first) {
  if (scale.twists) {
    const geometry::Matrix6d to_rig = rig.rig_from_cam(view.camera).adjoint();
    const auto in_rig = [&](std::size_t i) -> geometry::Vector6d {
      return to_rig * geometry::scaled((*scale.twists)[i], scale.length);
    };
    return std::array{in_rig(0), in_rig(1)};
  }
  const BundledFrame& first = *frames.first.frame;
  const double passed_s = to_seconds(frames.second.time_ns - first.time_ns);
  const auto apart = [](const BundledFrame& f) {
    return f.motion_unknown && std::abs(frame::farthest_delay_s(f)) > to_seconds(frame::kTogetherNs);
  };
  if ((!apart(first) && !apart(frames.second)) || passed_s <= 0.0 || passed_s > kMaxPrediction_s) return std::nullopt;
  const geometry::Vector6d mean = T_second_first.log() / passed_s;
  return std::array{mean, mean};
}

BundledFrame with_twist(BundledFrame frame, const geometry::Vector6d& twist) {
  frame.twist = twist;
  frame.motion_unknown = false;
  return frame;
}

}  // namespace

bool comparable(const BundledFrame& first, const BundledFrame& second, const InitialisationOptions& options) {
  for (std::size_t c = 0; c < first.cameras.size(); ++c) {
    const auto pairs = match_images(first.cameras[c].keypoints, second.cameras[c].keypoints);
    if (pairs.size() >= static_cast<std::size_t>(options.min_monocular)) return true;
  }
  return false;
}

std::optional<StartedMap> initialise_metric(const BundledFrame& frame, std::span<const image::Pyramid> pyramids,
                                            const InitialisationOptions& options, map::MapDraft& draft) {
  int metric = 0;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f)
    metric += has_accurate_depth(frame.bundled.point(FeatureId(f)), options);
  if (metric < options.min_matched) return std::nullopt;
  StartedMap out;
  out.keyframes.push_back(make_keyframe(frame, {}, SE3(), pyramids, KeyframeId(), options, draft));
  return out;
}

std::optional<StartedMap> initialise_monocular(const StartFrames& frames, const InitialisationOptions& options,
                                               Random random, map::MapDraft& draft) {
  const StartCandidate& first = frames.first;
  const BundledFrame& second = frames.second;
  const frame::RigAt rig_at(draft.map().rig(), second);
  const camera::Rig& rig = *rig_at;
  const FramePairs pairs = match_cameras(*first.frame, second);
  const auto view = best_two_view(pairs, rig, options, random.next());
  if (!view) return std::nullopt;
  const InitialScale scale = choose_scale(*view, pairs, frames, rig, options);
  if (frames.scale_needed && !std::isfinite(scale.deviation)) return std::nullopt;
  const SE3 T_b_a(view->pose.T_b_a.rotation(), scale.length * view->pose.T_b_a.translation());
  const SE3 T_second_first = rig.rig_from_cam(view->camera) * T_b_a * rig.cam_from_rig(view->camera);
  const auto motion = twists(*view, scale, frames, rig, T_second_first);
  const BundledFrame a = motion ? with_twist(*first.frame, (*motion)[0]) : *first.frame;
  const BundledFrame b = motion ? with_twist(second, (*motion)[1]) : second;
  const SE3 T_rig_cam = frame::rig_of(draft.map().rig(), a).rig_from_cam(view->camera);

  StartedMap out;
  out.scale = rig.size() == 1 ? map::Scale::kUpToScale : map::Scale::kUnobservable;
  out.scale_deviation = scale.deviation;
  out.keyframes.push_back(make_keyframe(a, {}, SE3(), first.pyramids, KeyframeId(), options, draft));
  const KeyframeId key_a = out.keyframes[0].keyframe;
  out.keyframes.push_back(make_keyframe(b, {}, T_second_first, frames.pyramids, key_a, options, draft));
  const KeyframeId key_b = out.keyframes[1].keyframe;
  const CameraIndex camera(view->camera);
  for (std::size_t i = 0; i < view->pairs.size(); ++i) {
    if (!view->pose.inlier[i]) continue;
    const FeatureId fa = draft.map().keyframe(key_a).frame->bundled.feature(camera, view->pairs[i].a);
    const FeatureId fb = draft.map().keyframe(key_b).frame->bundled.feature(camera, view->pairs[i].b);
    if (draft.map().landmark_of(key_a, fa).valid() || draft.map().landmark_of(key_b, fb).valid()) continue;
    const LandmarkId l =
        draft.add_landmark(T_rig_cam * (scale.length * view->pose.points_a[i]),
                           {{key_a, fa}, {key_b, fb, /*aligned=*/false}}, {key_a, {camera, view->pairs[i].a}});
    for (NewKeyframe& k : out.keyframes) k.landmarks.push_back(l);
  }
  return out;
}

}  // namespace bslam::tracking
