#include "tracking/camera_consensus.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/median.h"
#include "map/keyframe_landmarks.h"
#include "map/search_points.h"

namespace bslam::tracking {

using geometry::SE3;

namespace {

constexpr double kClearlyLess = 0.5;  // fraction of the largest inlier ratio

bool conflict(const LandmarkCounts& agreeing, const ConsensusOptions& options) {
  return agreeing.expected >= options.min_expected &&
         agreeing.found < options.conflict_inlier_ratio * agreeing.expected;
}

// The inlier ratio below which a camera agrees clearly less than the best one with enough matches.
double clearly_lower_ratio(const std::vector<LandmarkCounts>& agreeing, const ConsensusOptions& options) {
  double best = 0.0;
  for (const LandmarkCounts& camera : agreeing) {
    if (camera.expected >= options.min_expected) best = std::max(best, camera.ratio());
  }
  return kClearlyLess * best;
}

// Returns true if no camera with enough matches agrees clearly less with a pose than the best one.
bool agreed_by_all(const solver::PoseSolution& pose, const FrameMatches& matches, const ConsensusOptions& options) {
  std::vector<LandmarkCounts> agreeing;
  for (std::size_t c = 0; c < matches.size(); ++c)
    agreeing.push_back({static_cast<int>(matches[c].size()), pose.inliers_per_camera[c]});
  const double lower = clearly_lower_ratio(agreeing, options);
  return std::ranges::all_of(agreeing, [&](const LandmarkCounts& camera) {
    return camera.expected < options.min_expected || camera.ratio() >= lower;
  });
}

// Median distance of the landmarks from the rig, in map units: a translation by it looks like a rotation by a radian.
double median_distance(std::span<const solver::PoseObservation> observations, const SE3& T_rig_world) {
  std::vector<double> distances;
  for (const solver::PoseObservation& o : observations) distances.push_back((T_rig_world * o.point_world).norm());
  return distances.empty() ? 1.0 : median(std::move(distances));
}

}  // namespace

CameraConsensusState readmitted(bool established) {
  CameraConsensusState camera;
  camera.established = established;
  return camera;
}

std::vector<CameraConsensusState> readmit_observing_cameras(std::vector<CameraConsensusState> cameras,
                                                            const std::vector<int>& seen,
                                                            const ConsensusOptions& options) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    cameras[c].landmarks.clear();
    if (seen[c] >= options.min_expected) cameras[c] = readmitted(true);
  }
  return cameras;
}

std::vector<LandmarkCounts> count_reobserved(const map::BundledMap& map, const frame::BundledFrame& frame,
                                             const SE3& T_rig_world, const std::vector<CameraConsensusState>& states,
                                             const FrameMatches& found) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<LandmarkCounts> out(states.size());
  for (std::size_t c = 0; c < states.size(); ++c) {
    if (frame.cameras[c].state != image::ImageState::kPresent || states[c].excluded) continue;
    std::vector<LandmarkId> again;
    if (c < found.size()) {
      for (const Match& m : found[c]) again.push_back(m.landmark);
    }
    std::sort(again.begin(), again.end());
    const SE3 T_cam_world = rig.cam_from_rig(c) * T_rig_world;
    for (const LandmarkId before : states[c].landmarks) {
      const LandmarkId l = map.resolve(before);
      if (!l.valid()) continue;
      const auto pixel = camera::project(rig.camera(c), rig.shutter(c), T_cam_world * map.landmark(l).position);
      if (!pixel || !rig.camera(c).contains(*pixel)) continue;
      ++out[c].expected;
      out[c].found += std::binary_search(again.begin(), again.end(), l);
    }
  }
  return out;
}

std::vector<LandmarkCounts> count_own(const map::BundledMap& map, const frame::BundledFrame& frame,
                                      const SE3& T_rig_world, std::span<const std::uint8_t> excluded,
                                      std::span<const LandmarkId> landmarks,
                                      const matching::ProjectionSearchOptions& windows) {
  std::vector<LandmarkCounts> out(excluded.size());
  if (std::ranges::find(excluded, std::uint8_t{1}) == excluded.end()) return out;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (!excluded[c] || frame.cameras[c].keypoints.empty()) continue;
    const std::vector<LandmarkId> own = map::observed_by(map, landmarks, CameraIndex(c));
    const auto found =
        matching::search_by_projection(rig, CameraIndex(c), frame.cameras[c], rig.cam_from_rig(c) * T_rig_world,
                                       map::search_points(map, own), {}, windows);
    out[c] = {static_cast<int>(found.visible.size()), static_cast<int>(found.matches.size())};
  }
  return out;
}

std::vector<LandmarkCounts> count_agreeing(const FrameMatches& matches, std::span<const std::uint8_t> inlier,
                                           const ConsensusOptions& options) {
  std::vector<LandmarkCounts> out(matches.size());
  std::vector<std::vector<LandmarkId>> outliers(matches.size());
  std::size_t i = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    out[c].expected = static_cast<int>(matches[c].size());
    for (const Match& m : matches[c]) {
      const bool agrees = inlier[i++] != 0;
      out[c].found += agrees;
      if (!agrees) outliers[c].push_back(m.landmark);
    }
  }
  std::vector<LandmarkId> moved;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    if (out[c].expected >= options.min_expected && !conflict(out[c], options))
      moved.insert(moved.end(), outliers[c].begin(), outliers[c].end());
  }
  std::ranges::sort(moved);
  for (std::size_t c = 0; c < matches.size(); ++c) {
    if (!conflict(out[c], options)) continue;
    out[c].expected -= static_cast<int>(
        std::ranges::count_if(outliers[c], [&](LandmarkId l) { return std::ranges::binary_search(moved, l); }));
  }
  return out;
}

std::vector<std::uint8_t> conflicting_cameras(const std::vector<LandmarkCounts>& agreeing,
                                              const std::vector<CameraConsensusState>& states,
                                              const ConsensusOptions& options) {
  std::vector<std::uint8_t> out(agreeing.size(), 0);
  for (std::size_t c = 0; c < states.size(); ++c) out[c] = states[c].established && conflict(agreeing[c], options);
  return out;
}

std::vector<std::uint8_t> contradicting_cameras(const std::vector<LandmarkCounts>& agreeing,
                                                const std::vector<CameraConsensusState>& states,
                                                const ConsensusOptions& options) {
  std::vector<std::uint8_t> out = conflicting_cameras(agreeing, states, options);
  const double lower = clearly_lower_ratio(agreeing, options);
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (agreeing[c].ratio() >= lower) out[c] = 0;
  }
  return out;
}

solver::PoseSolution pose_of_most_consistent_camera(const camera::Rig& rig, const FrameMatches& matches,
                                                    std::span<const solver::PoseObservation> observations,
                                                    const solver::PoseSolution& of_all, const SE3& predicted,
                                                    const ConsensusOptions& options,
                                                    const solver::PoseSolverOptions& pose) {
  constexpr double kMaxAgreeingChi2 = 25.0;  // squared normalised error of observations that agree with such a pose
  const auto healthy = [&](int inliers, std::size_t found) {
    return inliers >= options.healthy_reobservation_ratio * static_cast<double>(found);
  };
  const double scene = median_distance(observations, predicted);
  solver::PoseSolution best;
  double min_distance = std::numeric_limits<double>::infinity();
  bool contradiction = true;  // no pose agrees with all cameras
  const auto consider = [&](const SE3& T_rig_world) {
    const geometry::Vector6d difference = (T_rig_world * predicted.inverse()).log();
    const double distance = difference.head<3>().norm() + difference.tail<3>().norm() / scene;
    solver::PoseSolverOptions near = pose;
    near.first_chi2 = kMaxAgreeingChi2;
    solver::PoseSolution joint = solver::solve_pose(rig, observations, T_rig_world, near);
    if (!joint.ok) return;
    contradiction = contradiction && !agreed_by_all(joint, matches, options);
    if (distance >= min_distance) return;
    min_distance = distance;
    best = std::move(joint);
  };
  std::size_t first = 0;
  bool any_healthy = false;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const auto own = observations.subspan(first, matches[c].size());
    first += own.size();
    if (static_cast<int>(own.size()) < options.min_expected) continue;
    const solver::PoseSolution single = solver::solve_pose(rig, own, predicted, pose);
    if (single.ok && healthy(single.num_inliers, own.size())) consider(single.T_rig_world);
    any_healthy = any_healthy || (of_all.ok && healthy(of_all.inliers_per_camera[c], own.size()));
  }
  if (!contradiction) return {};
  if (any_healthy) consider(of_all.T_rig_world);
  return best;
}

std::vector<std::uint8_t> cameras_losing_view(const std::vector<LandmarkCounts>& reobserved,
                                              std::span<const LandmarkCounts> aligned,
                                              const std::vector<CameraConsensusState>& states,
                                              const ConsensusOptions& options) {
  std::vector<std::uint8_t> out(reobserved.size(), 0);
  const auto counts = [&](const LandmarkCounts& e) { return e.expected >= options.min_expected; };
  const auto healthy = [&](const LandmarkCounts& e) {
    return counts(e) && e.ratio() >= options.healthy_reobservation_ratio;
  };
  const bool any_healthy = std::ranges::any_of(reobserved, healthy);
  for (std::size_t c = 0; any_healthy && c < out.size(); ++c) {
    out[c] = counts(reobserved[c]) && reobserved[c].ratio() < options.min_reobservation_ratio &&
             states[c].reobservation_ratio >= options.previous_reobservation_ratio &&
             !(c < aligned.size() && healthy(aligned[c]));
  }
  return out;
}

void update_reobservation_ratio(CameraConsensusState& camera, const LandmarkCounts& reobserved,
                                const ConsensusOptions& options) {
  if (reobserved.expected >= options.min_expected) camera.reobservation_ratio = reobserved.ratio();
}

void update_exclusion(CameraConsensusState& camera, const LandmarkCounts& view, double ratio_of_used, TimeNs time_ns,
                      const ConsensusOptions& options) {
  constexpr double kComparable = 0.25;  // fraction of the ratio of a camera in use
  camera.landmarks.clear();
  if (!std::exchange(camera.excluded, true)) camera.last_judged_ns = camera.excluded_since_ns = time_ns;
  const bool judged = view.expected >= options.min_expected;
  if (judged) {
    const double needed = std::min(options.readmission_ratio, kComparable * ratio_of_used);
    const bool consistent = view.found > 0 && view.ratio() >= needed;
    camera.consistent_frames = consistent ? camera.consistent_frames + 1 : 0;
    camera.last_judged_ns = time_ns;
  }
  const bool expired = to_seconds(time_ns - camera.last_judged_ns) >= options.forget_after_s;
  if (camera.consistent_frames >= options.readmit_after || expired) camera = readmitted(camera.established);
}

bool due_for_retry(const CameraConsensusState& camera, TimeNs time_ns, const ConsensusOptions& options) {
  return camera.excluded && to_seconds(time_ns - camera.excluded_since_ns) >= options.retry_after_s;
}

void retry(CameraConsensusState& camera, const LandmarkCounts& view, const LandmarkCounts& wide, TimeNs time_ns,
           const ConsensusOptions& options) {
  const bool many = wide.expected >= options.min_expected && wide.ratio() >= options.readmission_ratio;
  if (many && view.found < wide.found / 2) {
    camera.excluded_since_ns = time_ns;
  } else {
    camera = readmitted(camera.established);
  }
}

void remove_camera(const camera::Rig& rig, std::size_t camera, double min_parallax, double max_chi2,
                   frame::BundledFrame& frame) {
  std::vector<std::vector<frame::KeypointRef>> matched;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    const auto all = frame.bundled.keypoints(FeatureId(f));
    std::vector<frame::KeypointRef> rest;
    std::copy_if(all.begin(), all.end(), std::back_inserter(rest),
                 [&](const frame::KeypointRef& r) { return r.camera.index() != camera; });
    if (rest.size() >= 2) matched.push_back(std::move(rest));
  }
  frame::CameraFrame& out = frame.cameras[camera];
  out.state = image::ImageState::kMissing;
  out.keypoints = {};
  out.words = {};
  out.grid = frame::FeatureGrid(out.keypoints, rig.camera(camera).width, rig.camera(camera).height);
  frame.bundled = matching::make_bundled(frame::rig_of(rig, frame), frame.cameras, matched, min_parallax, max_chi2);
}

}  // namespace bslam::tracking
