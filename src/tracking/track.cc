#include "tracking/track.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "estimators/pose_ransac.h"
#include "tracking/keyframe_decision.h"
#include "tracking/motion_prediction.h"
#include "tracking/robust_pose.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

// Landmarks of the last frame, and of the last image of cameras without an image in that frame, that still exist in the
// map.
std::vector<LandmarkId> last_landmarks(const map::BundledMap& map, const TrackerState& state) {
  std::vector<LandmarkId> out;
  const auto add = [&](const std::vector<LandmarkId>& landmarks) {
    for (const LandmarkId l : landmarks) {
      const LandmarkId now = map.resolve(l);
      if (now.valid()) out.push_back(now);
    }
  };
  add(state.landmarks);
  for (const CameraConsensusState& camera : state.cameras) {
    if (camera.last_image_ns != state.time_ns) add(camera.landmarks);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool supported(const solver::PoseSolution& solution, std::size_t num_matches, int min_inliers,
               const TrackingOptions& options) {
  // Few inliers must be a sufficient fraction of the matches. More of them agree by chance with a smaller fraction.
  constexpr double kFew = 100;
  const double ratio = options.min_inlier_ratio * std::min(1.0, kFew / std::max(1, solution.num_inliers));
  return solution.ok && solution.num_inliers >= min_inliers &&
         solution.num_inliers >= ratio * static_cast<double>(num_matches);
}

struct Coarse {
  frame::BundledFrame frame;  // its twist is estimated together with the pose
  SE3 T_rig_world;
  FrameMatches matches;  // inliers
  LostReason reason = LostReason::kNone;
  std::vector<std::uint8_t> excluded = {};  // per camera: excluded before or now
  // Per camera: landmarks of the last frame that were re-observed; empty if only the wide search succeeded.
  std::vector<LandmarkCounts> reobserved = {};
};

bool any(const std::vector<std::uint8_t>& flags) { return std::ranges::find(flags, std::uint8_t{1}) != flags.end(); }

void drop(const std::vector<std::uint8_t>& cameras, FrameMatches& matches) {
  for (std::size_t c = 0; c < matches.size(); ++c) {
    if (cameras[c]) matches[c].clear();
  }
}

matching::ProjectionSearchOptions search_options(const TrackInput& input, const MatchingOptions& matching,
                                                 double radius) {
  return {.radius = radius,
          .max_hamming = matching.max_hamming,
          .ratio = matching.ratio,
          .scale_factor = input.features.pyramid.scale_factor};
}

// Pose from landmarks found near their projections at the current estimate. Returns false if there are too few.
bool track_in_narrow_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                             const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = out.frame;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  const SE3 predicted = out.T_rig_world;
  FrameMatches found = find_landmarks(map, frame, predicted, landmarks, {},
                                      search_options(input, options.matching, options.matching.predicted_radius), pool)
                           .found;
  std::vector<std::uint8_t> excluded = out.excluded;
  drop(excluded, found);
  auto observations = pose_observations(map, frame, found, input.features);
  if (count(found) < static_cast<std::size_t>(options.min_inliers)) return false;
  const solver::MotionModel motion = motion_model(input, frame);
  auto solution = robust_pose(map, found, observations, predicted, motion, options.pose);
  if (any(conflicting_cameras(found, solution.inliers_per_camera, input.state.cameras, options.consensus))) {
    const SE3 from_motion = predict(input, frame.time_ns);
    const auto consistent =
        pose_of_most_consistent_camera(rig, found, observations, from_motion, options.consensus, options.pose);
    if (consistent.ok) {
      const auto wrong =
          contradicting_cameras(found, consistent.inliers_per_camera, input.state.cameras, options.consensus);
      for (std::size_t c = 0; c < wrong.size(); ++c) excluded[c] |= wrong[c];
      drop(excluded, found);
      observations = pose_observations(map, frame, found, input.features);
      solution = solver::solve_pose(map.rig(), observations, consistent.T_rig_world, motion, options.pose);
    }
  }
  if (!supported(solution, observations.size(), options.min_inliers, options)) return false;
  out.frame.twist = motion.twist(solution.T_rig_world);
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(found, solution.inlier);
  out.reason = LostReason::kNone;
  out.reobserved = count_reobserved(map, frame, out.T_rig_world, input.state.cameras, out.matches);
  const auto lost = cameras_losing_view(out.reobserved, input.state.cameras, options.consensus);
  for (std::size_t c = 0; c < lost.size(); ++c) excluded[c] |= lost[c];
  out.excluded = std::move(excluded);
  drop(out.excluded, out.matches);
  return true;
}

// Pose by RANSAC from landmarks around those of the last frame, found in windows of this radius. Returns false if there
// are too few.
bool track_in_wide_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks, double radius,
                           const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = out.frame;
  const std::vector<LandmarkId> near =
      map::local_landmarks(map, landmarks, input.state.anchored.reference, options.local_view);
  auto wide = search_options(input, options.matching, radius);
  wide.level_slack = 2;
  wide.ratio = 0.8 * options.matching.ratio;
  MatchSearch search = find_landmarks(map, frame, out.T_rig_world, near, {}, wide, pool);
  drop(out.excluded, search.found);
  if (count(search.found) < static_cast<std::size_t>(options.min_inliers_wide)) return false;
  const auto observations = pose_observations(map, frame, search.found, input.features);
  const auto solution =
      estimators::ransac_pose(frame::rig_of(map.rig(), frame), observations, out.T_rig_world, options.pose, {},
                              Random(input.seed, "wide search", static_cast<std::uint64_t>(frame.id.value())));
  out.reason = LostReason::kFewInliers;
  if (!solution.ok || solution.num_inliers < options.min_inliers_wide) return false;
  if (!supported(solution, observations.size(), options.min_inliers_wide, options)) {
    Coarse confirmed = out;
    confirmed.T_rig_world = solution.T_rig_world;
    if (!track_in_narrow_windows(input, landmarks, options, pool, confirmed)) return false;
    out = std::move(confirmed);
    return true;
  }
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(search.found, solution.inlier);
  out.reason = LostReason::kNone;
  return true;
}

// The search in wide windows, and if it fails some time after the last pose, in wider ones: the rig may have turned the
// further the longer nothing is known of it.
bool track_in_wide_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                           const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  constexpr double kUsualInterval_s = 0.1;
  const double radius = options.matching.wide_radius;
  if (track_in_wide_windows(input, landmarks, radius, options, pool, out)) return true;
  const double intervals = to_seconds(out.frame.time_ns - input.state.time_ns) / kUsualInterval_s;
  const double wider = std::min(radius * intervals, options.matching.widest_radius);
  return wider > radius && track_in_wide_windows(input, landmarks, wider, options, pool, out);
}

// Pose from the landmarks of the last frame, searched for near the prediction of the motion model. If that finds too
// few or no motion is known, a search in wide windows precedes it. Narrow windows around an assumed motion would find
// matches that seem to confirm the assumption.
Coarse track_last_frame(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                        ThreadPool& pool) {
  const std::vector<LandmarkId> landmarks = last_landmarks(input.map, input.state);
  Coarse out{
      frame, predict(input, frame.time_ns), {}, LostReason::kFewMatches, excluded(input.state, input.map.rig().size())};
  const bool tracking = input.state.status == TrackStatus::kTracking;
  const bool predicted = tracking && motion_since_last(input.state, frame.time_ns);
  if (predicted && track_in_narrow_windows(input, landmarks, options, pool, out)) return out;
  const bool found = track_in_wide_windows(input, landmarks, options, pool, out);
  if (tracking && (found || !predicted)) track_in_narrow_windows(input, landmarks, options, pool, out);
  return out;
}

bool any_due_for_retry(const TrackerState& state, TimeNs time_ns, const ConsensusOptions& options) {
  return std::ranges::any_of(state.cameras,
                             [&](const CameraConsensusState& c) { return due_for_retry(c, time_ns, options); });
}

struct Fine {
  solver::PoseSolution solution;
  geometry::Vector6d twist;  // rad/s, m/s
  FrameMatches matches;      // all, inliers and outliers
  AlignedMatches aligned;    // of all matches
  std::vector<LandmarkId> visible;
  std::vector<LandmarkCounts> views;  // per camera, landmarks of the local view
  std::vector<LandmarkCounts> wide;   // the same in wide windows, if an excluded camera is due for a retry
};

// Per camera.
std::vector<LandmarkCounts> landmark_counts(const MatchSearch& search) {
  std::vector<LandmarkCounts> out;
  for (std::size_t c = 0; c < search.found.size(); ++c)
    out.push_back({search.visible_by_camera[c], static_cast<int>(search.found[c].size())});
  return out;
}

// Pose from all landmarks of the local view, with keypoints aligned to their landmarks' patches.
Fine track_local_view(const TrackInput& input, const Coarse& coarse, const TrackingOptions& options, ThreadPool& pool) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = coarse.frame;
  const std::vector<LandmarkId> near =
      map::local_landmarks(map, landmarks_of(coarse.matches), input.state.anchored.reference, options.local_view);
  MatchSearch search = find_landmarks(map, frame, coarse.T_rig_world, near, coarse.matches,
                                      search_options(input, options.matching, options.matching.local_radius), pool);
  Fine out;
  out.views = landmark_counts(search);
  if (any_due_for_retry(input.state, frame.time_ns, options.consensus)) {
    auto windows = search_options(input, options.matching, options.matching.wide_radius);
    windows.ratio = 0.8 * options.matching.ratio;
    out.wide = landmark_counts(find_landmarks(map, frame, coarse.T_rig_world, near, {}, windows, pool));
  }
  drop(coarse.excluded, search.found);
  out.matches = merge(coarse.matches, search.found);
  out.visible = std::move(search.visible);
  out.aligned =
      align_matches(map, frame, coarse.T_rig_world, out.matches, input.pyramids, input.alignment, input.features, pool);
  const solver::MotionModel motion = motion_model(input, frame);
  out.solution = robust_pose(map, out.matches, pose_observations(map, out.matches, out.aligned), coarse.T_rig_world,
                             motion, options.pose);
  out.twist = motion.twist(out.solution.T_rig_world);
  return out;
}

// See TrackOutput::frame.
frame::BundledFrame refined_frame(const camera::Rig& rig, const Coarse& coarse, const Fine& fine,
                                  const InitialisationOptions& options) {
  frame::BundledFrame frame = refined(coarse.frame, fine.matches, fine.aligned, fine.solution.inlier, rig);
  frame.twist = fine.twist;
  for (std::size_t c = 0; c < coarse.excluded.size(); ++c) {
    if (coarse.excluded[c]) remove_camera(rig, c, options.min_parallax, options.max_chi2, frame);
  }
  return frame;
}

std::vector<CameraCounts> camera_counts(const frame::BundledFrame& frame, const FrameMatches& matched,
                                        const FrameMatches& inliers) {
  std::vector<CameraCounts> counts(frame.cameras.size());
  for (std::size_t c = 0; c < counts.size(); ++c) {
    counts[c].keypoints = static_cast<int>(frame.cameras[c].keypoints.size());
    if (c < matched.size()) counts[c].matched = static_cast<int>(matched[c].size());
    if (c < inliers.size()) counts[c].inliers = static_cast<int>(inliers[c].size());
  }
  return counts;
}

// Each landmark predicted visible counts once, even if it is visible in several cameras.
void count_visibility(const std::vector<LandmarkId>& visible, const std::vector<LandmarkId>& found,
                      TrackerState& state) {
  for (const LandmarkId l : found) state.visibility_counts.push_back({l, 1, 1});
  for (const LandmarkId l : visible) {
    if (!std::binary_search(found.begin(), found.end(), l)) state.visibility_counts.push_back({l, 1, 0});
  }
}

// Updates the states of the cameras for the next frame.
void update_cameras(const frame::BundledFrame& frame, const Coarse& coarse, const Fine& fine,
                    const FrameMatches& inliers, const TrackingOptions& options, TrackOutput& out) {
  std::vector<CameraConsensusState>& cameras = out.state.cameras;
  cameras.resize(inliers.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    CameraConsensusState& camera = cameras[c];
    out.result.cameras[c].excluded = coarse.excluded[c];
    if (coarse.excluded[c]) {
      update_exclusion(camera, fine.views[c], frame.time_ns, options.consensus);
      const bool tried = !fine.wide.empty() && fine.wide[c].expected > 0;
      if (tried && due_for_retry(camera, frame.time_ns, options.consensus))
        retry(camera, fine.wide[c], frame.time_ns, options.consensus);
      continue;
    }
    if (frame.cameras[c].state != image::ImageState::kPresent) {
      if (to_seconds(frame.time_ns - camera.last_image_ns) > kMaxPrediction_s)
        camera.landmarks.clear();  // too old: the view may have changed since
      continue;
    }
    if (!coarse.reobserved.empty()) update_reobservation_ratio(camera, coarse.reobserved[c], options.consensus);
    camera.last_image_ns = frame.time_ns;
    camera.established |= static_cast<int>(inliers[c].size()) >= options.consensus.min_expected;
    camera.landmarks.clear();
    for (const Match& m : inliers[c]) camera.landmarks.push_back(m.landmark);
  }
}

}  // namespace

TrackOutput lost(const TrackerState& state, const frame::BundledFrame& frame, LostReason reason) {
  TrackOutput out;
  out.result.frame = frame.id;
  out.result.time_ns = frame.time_ns;
  out.result.status = TrackStatus::kLost;
  out.result.reason = reason;
  out.result.cameras = camera_counts(frame, {}, {});
  out.state = state;
  out.state.status = TrackStatus::kLost;
  return out;
}

namespace {

// The noise of the image relative to the map, and the error of the reference keyframe. The noise is the inverse of the
// information, corrected for the inliers that the bound on their errors has cut off.
geometry::Matrix6d covariance_of(const solver::PoseSolution& solution, const map::BundledMap& map,
                                 const map::AnchoredPose& anchored) {
  const geometry::Matrix6d noise =
      solver::kFractionLeft / solver::kVarianceLeft * solution.information.ldlt().solve(geometry::Matrix6d::Identity());
  const geometry::PoseUncertainty of_reference =
      geometry::transported(map.keyframe(anchored.reference).uncertainty, anchored.T_rig_reference);
  const geometry::Matrix6d covariance = noise + of_reference.covariance();
  return 0.5 * (covariance + covariance.transpose());
}

TrackOutput tracked(const TrackInput& input, const Coarse& coarse, const Fine& fine, const TrackingOptions& options) {
  const map::BundledMap& map = input.map;
  TrackOutput out;
  out.frame = refined_frame(map.rig(), coarse, fine, options.initialisation);
  const frame::BundledFrame& frame = out.frame;
  out.matches = keep_inliers(fine.matches, fine.solution.inlier);
  TrackResult& result = out.result;
  result.frame = frame.id;
  result.time_ns = frame.time_ns;
  result.status = TrackStatus::kTracking;
  result.reason = LostReason::kNone;
  result.T_rig_world = fine.solution.T_rig_world;
  result.cameras = camera_counts(frame, fine.matches, out.matches);

  TrackerState& state = out.state;
  state = input.state;
  state.anchored =
      map::AnchoredPose::at(map, map.nearest_alive_ancestor(input.state.anchored.reference), result.T_rig_world);
  result.anchored = state.anchored;
  result.covariance = covariance_of(fine.solution, map, result.anchored);

  const double dt = to_seconds(frame.time_ns - input.state.time_ns);
  state.twist.reset();
  if (dt > 0 && dt <= kMaxPrediction_s) {
    state.twist = (result.T_rig_world * last_pose(input).inverse()).log() / dt;
    state.twist_interval_s = dt;
  }
  state.status = TrackStatus::kTracking;
  state.time_ns = frame.time_ns;
  state.landmarks = landmarks_of(out.matches);
  count_visibility(fine.visible, state.landmarks, state);
  update_cameras(frame, coarse, fine, out.matches, options, out);

  ++state.frames_since_keyframe;
  KeyframeEvidence evidence =
      keyframe_evidence(map, frame, out.matches, state.anchored.reference, result.T_rig_world, options);
  state.best_overlap = std::max(state.best_overlap, evidence.overlap);
  evidence.best_overlap = state.best_overlap;
  evidence.frames_since_keyframe = state.frames_since_keyframe;
  out.keyframe_due = keyframe_due(evidence, options.keyframe);
  return out;
}

}  // namespace

TrackOutput track(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                  ThreadPool& pool) {
  const bool any_image = std::any_of(frame.cameras.begin(), frame.cameras.end(), [](const frame::CameraFrame& c) {
    return c.state == image::ImageState::kPresent;
  });
  if (!any_image) return lost(input.state, frame, LostReason::kNoImages);
  if (frame.num_keypoints() < static_cast<std::size_t>(options.min_inliers))
    return lost(input.state, frame, LostReason::kFewFeatures);
  const Coarse coarse = track_last_frame(input, frame, options, pool);
  if (coarse.reason != LostReason::kNone) return lost(input.state, frame, coarse.reason);
  const Fine fine = track_local_view(input, coarse, options, pool);
  if (!supported(fine.solution, count(fine.matches), options.min_inliers, options)) {
    const bool few = fine.solution.num_inliers < options.min_inliers;
    return lost(input.state, frame, few ? LostReason::kFewInliers : LostReason::kUnstablePose);
  }
  return tracked(input, coarse, fine, options);
}

}  // namespace bslam::tracking
