#include "tracking/track.h"

#include <algorithm>

#include "frame/rig_at.h"
#include "tracking/keyframe_decision.h"
#include "tracking/motion_prediction.h"
#include "tracking/pose_confirmation.h"
#include "tracking/robust_pose.h"
#include "tracking/stamp_errors.h"
#include "tracking/track_output.h"
#include "tracking/view_rotation.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

struct Coarse {
  frame::BundledFrame frame;  // a copy; its twist is estimated together with the pose
  SE3 T_rig_world;
  FrameMatches matches;  // inliers
  LostReason reason = LostReason::kNone;
  std::vector<std::uint8_t> excluded = {};  // per camera: excluded before or now
  // Per camera: landmarks of the last frame that were re-observed; empty if only the wide search succeeded.
  std::vector<LandmarkCounts> reobserved = {};
  MotionContest contest{};
  // It was found in wide windows, and its inlier ratio is low: landmarks of the local view have to confirm it.
  bool unconfirmed = false;
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

// Excludes the flagged cameras and drops their matches, found in narrow windows. In a new map, whose calibration was
// not yet compared with the images, those whose view is merely rotated are not excluded: their calibration is wrong,
// and can only be estimated with their images.
void exclude(const TrackInput& input, const frame::BundledFrame& frame, const SE3& T_rig_world,
             const std::vector<std::uint8_t>& flagged, const ConsensusOptions& options, FrameMatches& found,
             std::vector<std::uint8_t>& excluded) {
  if (!any(flagged)) return;
  const bool new_map = newly_started(input, frame);
  for (std::size_t c = 0; c < flagged.size(); ++c) {
    if (!flagged[c]) continue;
    if (!new_map || !rotated_view(input.map, frame, c, T_rig_world, found[c], options)) excluded[c] = 1;
    found[c].clear();
  }
}

// If cameras contradict each other, excludes those that contradict the pose of the most consistent one, and estimates
// the pose without their matches. Returns flags of these cameras.
std::vector<std::uint8_t> exclude_contradicting(const TrackInput& input, const frame::BundledFrame& frame,
                                                const TrackingOptions& options, FrameMatches& found,
                                                std::vector<std::uint8_t>& excluded, solver::PoseSolution& solution) {
  const ConsensusOptions& consensus = options.consensus;
  const auto flagged = [&](const solver::PoseSolution& pose, const auto& flags) {
    return flags(count_agreeing(found, pose.inlier, consensus), input.state.cameras, consensus);
  };
  std::vector<std::uint8_t> none(excluded.size(), 0);
  if (!any(flagged(solution, conflicting_cameras))) return none;
  const auto observations = pose_observations(input.map, frame, found, input.features);
  const solver::PoseSolution consistent =
      pose_of_most_consistent_camera(frame::rig_of(input.map.rig(), frame), found, observations, solution,
                                     predict(input, frame.time_ns), consensus, options.pose);
  if (!consistent.ok) return none;
  const auto wrong = flagged(consistent, contradicting_cameras);
  exclude(input, frame, consistent.T_rig_world, wrong, consensus, found, excluded);
  const frame::RigAt resting(input.map.rig(), frame);
  solution = solver::solve_pose(*resting, pose_observations(input.map, frame, found, input.features),
                                consistent.T_rig_world, motion_model(input, frame), options.pose);
  return wrong;
}

// Pose from landmarks found near their projections at the current estimate. Returns false if there are too few; most of
// the matches of a pose found in wide windows may be wrong.
bool track_in_narrow_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                             const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = out.frame;
  const SE3 predicted = out.T_rig_world;
  FrameMatches found = find_landmarks(map, frame, predicted, landmarks, {},
                                      search_options(input, options.matching, options.matching.predicted_radius), pool)
                           .found;
  std::vector<std::uint8_t> excluded = out.excluded;
  drop(excluded, found);
  if (count(found) < static_cast<std::size_t>(options.min_inliers)) return false;
  const auto observations = pose_observations(map, frame, found, input.features);
  const std::vector<TimeNs> times = correct_capture_times(input, observations, predicted, out.frame);
  const solver::MotionModel motion = motion_model(input, frame);
  auto [solution, matches, contest] = robust_pose(input, frame, found, observations, predicted, motion, options.pose);
  const std::vector<std::uint8_t> contradicting =
      exclude_contradicting(input, frame, options, found, excluded, solution);
  const bool few = !supported(solution, std::min(matches, count(found)), options.min_inliers, options);
  if (few && !(out.unconfirmed && solution.ok && solution.num_inliers >= options.min_inliers_wide &&
               confirmed_by_matches(input, frame, found, options.matching.predicted_radius, solution.T_rig_world))) {
    restore_capture_times(times, out.frame);
    return false;
  }
  out.unconfirmed = few;
  out.contest.add(contest);
  out.frame.twist = motion.twist(solution.T_rig_world);
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(found, solution.inlier);
  out.reason = LostReason::kNone;
  out.reobserved = count_reobserved(map, frame, out.T_rig_world, input.state.cameras, out.matches);
  const std::span<const LandmarkCounts> aligned =
      input.estimate ? std::span(input.estimate->aligned) : std::span<const LandmarkCounts>();
  auto lost = cameras_losing_view(out.reobserved, aligned, input.state.cameras, options.consensus);
  for (std::size_t c = 0; c < lost.size(); ++c) lost[c] = lost[c] && !contradicting[c];  // has been judged
  exclude(input, frame, out.T_rig_world, lost, options.consensus, found, excluded);
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
  const auto [solution, matches, contest] =
      sampled_pose(input, frame, search.found, observations, out.T_rig_world, options.pose);
  out.reason = LostReason::kFewInliers;
  if (!solution.ok || solution.num_inliers < options.min_inliers_wide) return false;
  if (!supported(solution, matches, options.min_inliers_wide, options)) {
    Coarse confirmed = out;
    confirmed.T_rig_world = solution.T_rig_world;
    confirmed.unconfirmed = true;
    if (!track_in_narrow_windows(input, landmarks, options, pool, confirmed)) return false;
    out = std::move(confirmed);
    return true;
  }
  out.contest.add(contest);
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(search.found, solution.inlier);
  out.reason = LostReason::kNone;
  return true;
}

// Searches in wide windows. If that fails, searches once more in windows whose radius grows with the time since the
// last pose, because the rig may have rotated further in a longer time.
bool track_in_wide_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                           const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  constexpr double kUsualInterval_s = 0.1;
  const double radius = options.matching.wide_radius;
  if (track_in_wide_windows(input, landmarks, radius, options, pool, out)) return true;
  const double intervals = to_seconds(out.frame.time_ns - input.state.time_ns) / kUsualInterval_s;
  const double wider = std::min(radius * intervals, options.matching.widest_radius);
  return wider > radius && track_in_wide_windows(input, landmarks, wider, options, pool, out);
}

// Whether several cameras, and no fewer than are left, were excluded in this frame.
bool half_excluded(const Coarse& coarse, int min_expected) {
  int excluded = 0, checked = 0;
  for (std::size_t c = 0; c < coarse.reobserved.size(); ++c) {
    if (coarse.reobserved[c].expected < min_expected) continue;  // also of a camera that was excluded before
    ++checked;
    excluded += coarse.excluded[c];
  }
  return excluded >= 2 && 2 * excluded >= checked;
}

// Pose from the landmarks of the last frame, searched for near the prediction of the motion model. If that finds too
// few or no motion is known, a search in wide windows precedes it. Narrow windows around an assumed motion would find
// matches that seem to confirm the assumption. A pose other than the predicted one is wrong if half of the cameras do
// not see what they saw before: similar things elsewhere were taken for the landmarks of the others.
Coarse track_last_frame(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                        ThreadPool& pool) {
  const std::vector<LandmarkId> landmarks = last_landmarks(input.map, input.state);
  Coarse out{
      frame, predict(input, frame.time_ns), {}, LostReason::kFewMatches, excluded(input.state, input.map.rig().size())};
  const bool tracking = input.state.status == TrackStatus::kTracking;
  const bool predicted = tracking && motion_since_last(input.state, frame.time_ns);
  if (predicted && track_in_narrow_windows(input, landmarks, options, pool, out)) return out;
  bool found = track_in_wide_windows(input, landmarks, options, pool, out);
  if (predicted && !found) {  // wrong time stamps make the prediction wrong
    out.T_rig_world = last_pose(input);
    found = track_in_wide_windows(input, landmarks, options, pool, out);
  }
  if (tracking && (found || !predicted)) track_in_narrow_windows(input, landmarks, options, pool, out);
  if (half_excluded(out, options.consensus.min_expected)) out.reason = LostReason::kUnstablePose;
  return out;
}

// The pose from direct tracking (input.estimate), without matches.
Coarse estimated(const TrackInput& input, const frame::BundledFrame& frame) {
  Coarse out{frame, input.estimate->T_rig_world, {}, LostReason::kNone, excluded(input.state, input.map.rig().size())};
  out.matches.resize(frame.cameras.size());
  out.frame.twist = motion_model(input, frame).twist(out.T_rig_world);
  return out;
}

// Returns the pose from direct tracking if all cameras support it, otherwise the pose tracked from the last frame. If
// that fails, falls back to direct tracking.
Coarse coarse_pose(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                   ThreadPool& pool) {
  if (input.estimate && input.estimate->all_cameras) return estimated(input, frame);
  Coarse out = track_last_frame(input, frame, options, pool);
  return input.estimate && out.reason != LostReason::kNone ? estimated(input, frame) : out;
}

bool any_due_for_retry(const TrackerState& state, TimeNs time_ns, const ConsensusOptions& options) {
  return std::ranges::any_of(state.cameras,
                             [&](const CameraConsensusState& c) { return due_for_retry(c, time_ns, options); });
}

struct Fine {
  solver::PoseSolution solution;
  geometry::Vector6d twist;     // rad/s, map units/s
  FrameMatches matches;         // inliers and outliers
  std::size_t num_matches = 0;  // see ChosenPose::matches
  AlignedMatches aligned;       // for all of `matches`
  std::vector<LandmarkId> visible;
  std::vector<LandmarkCounts> views;  // per camera: landmarks of the local view that are expected and found
  std::vector<LandmarkCounts> own;    // of excluded cameras: the same, of landmarks that the camera itself has observed
  std::vector<LandmarkCounts> wide;   // `views` with wide windows; empty unless an excluded camera is due for a retry
  MotionContest contest{};            // also that of the coarse estimation
};

// Per camera.
std::vector<LandmarkCounts> landmark_counts(const MatchSearch& search) {
  std::vector<LandmarkCounts> out;
  for (std::size_t c = 0; c < search.found.size(); ++c)
    out.push_back({search.visible_by_camera[c], static_cast<int>(search.found[c].size())});
  return out;
}

// Pose from all landmarks of the local view, with keypoints aligned to their landmarks' patches. Corrects the capture
// times of the frame.
Fine track_local_view(const TrackInput& input, Coarse& coarse, const TrackingOptions& options, ThreadPool& pool) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = coarse.frame;
  const bool any_matches = count(coarse.matches) > 0;
  const std::vector<LandmarkId> seeds = any_matches ? landmarks_of(coarse.matches) : last_landmarks(map, input.state);
  const std::vector<LandmarkId> near =
      map::local_landmarks(map, seeds, input.state.anchored.reference, options.local_view);
  const auto narrow = search_options(input, options.matching, options.matching.local_radius);
  MatchSearch search = find_landmarks(map, frame, coarse.T_rig_world, near, coarse.matches, narrow, pool);
  Fine out;
  out.views = landmark_counts(search);
  out.own = count_own(map, frame, coarse.T_rig_world, coarse.excluded, near, narrow);
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
  const auto observations = pose_observations(map, out.matches, out.aligned);
  correct_capture_times(input, observations, coarse.T_rig_world, coarse.frame);
  const solver::MotionModel motion = motion_model(input, frame);
  auto chosen = robust_pose(input, frame, out.matches, observations, coarse.T_rig_world, motion, options.pose);
  out.solution = std::move(chosen.solution);
  out.num_matches = chosen.matches;
  out.contest = coarse.contest;
  out.contest.add(chosen.contest);
  out.twist = motion.twist(out.solution.T_rig_world);
  return out;
}

// Returns true if more landmarks of the local view agree with the coarse pose than chance explains, and most of them
// are inliers of the fine pose. In very noisy images most matches are wrong although the pose is right, so that the
// inlier ratio alone would reject it. Landmarks that the coarse pose was computed from are not counted; a coarse pose
// from direct tracking has no such matches.
bool coarse_pose_confirmed(const TrackInput& input, const Coarse& coarse, const Fine& fine,
                           const TrackingOptions& options) {
  constexpr double kMost = 0.5;
  const std::vector<LandmarkId> known = landmarks_of(coarse.matches);
  const auto all = pose_observations(input.map, fine.matches, fine.aligned);
  const std::vector<double> all_windows_px = search_windows_px(
      input.map.rig(), coarse.frame, fine.matches, options.matching.local_radius, input.features.pyramid.scale_factor);
  std::vector<solver::PoseObservation> observations;
  std::vector<double> windows_px;
  std::vector<std::size_t> index;
  std::size_t i = 0;
  for (const auto& of_camera : fine.matches) {
    for (const Match& m : of_camera) {
      const std::size_t at = i++;
      if (std::ranges::binary_search(known, m.landmark)) continue;
      observations.push_back(all[at]);
      windows_px.push_back(all_windows_px[at]);
      index.push_back(at);
    }
  }
  const frame::RigAt resting(input.map.rig(), coarse.frame);
  const auto agrees =
      agreeing_beyond_chance(*resting, observations, windows_px, coarse.T_rig_world, motion_model(input, coarse.frame));
  int agreeing = 0, of_fine = 0;
  for (std::size_t k = 0; k < agrees.size(); ++k) {
    agreeing += agrees[k];
    of_fine += agrees[k] != 0 && fine.solution.inlier[index[k]] != 0;
  }
  return agreeing > 0 && of_fine >= kMost * agreeing;
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

// The largest fraction of the landmarks in view that a camera in use matched. Of the landmarks of the local view, those
// that the coarse pose was estimated from are not part of `fine.views`.
double largest_ratio_of_used(const Coarse& coarse, const Fine& fine, int min_expected) {
  double largest = 0;
  for (std::size_t c = 0; c < fine.views.size(); ++c) {
    const int known = c < coarse.matches.size() ? static_cast<int>(coarse.matches[c].size()) : 0;
    const LandmarkCounts all{fine.views[c].expected + known, fine.views[c].found + known};
    if (!coarse.excluded[c] && all.expected >= min_expected) largest = std::max(largest, all.ratio());
  }
  return largest;
}

// Updates the states of the cameras for the next frame.
void update_cameras(const Coarse& coarse, const Fine& fine, const ConsensusOptions& options, TrackOutput& out) {
  const frame::BundledFrame& frame = out.frame;
  const double ratio_of_used = largest_ratio_of_used(coarse, fine, options.min_expected);
  for (std::size_t c = 0; c < out.state.cameras.size(); ++c) {
    CameraConsensusState& camera = out.state.cameras[c];
    out.result.cameras[c].excluded = coarse.excluded[c];
    if (coarse.excluded[c]) {
      // Landmarks of other cameras may look different in its image.
      const bool enough = fine.own[c].expected >= options.min_expected;
      update_exclusion(camera, enough ? fine.own[c] : fine.views[c], ratio_of_used, frame.time_ns, options);
      const bool tried = !fine.wide.empty() && fine.wide[c].expected > 0;
      if (tried && due_for_retry(camera, frame.time_ns, options))
        retry(camera, fine.views[c], fine.wide[c], frame.time_ns, options);
      continue;
    }
    const bool present = frame.cameras[c].state == image::ImageState::kPresent;
    if (present && !coarse.reobserved.empty()) update_reobservation_ratio(camera, coarse.reobserved[c], options);
    update_used_camera(frame, c, out.matches[c], options, camera);
  }
}

TrackOutput tracked(const TrackInput& input, const Coarse& coarse, Fine&& fine, const TrackingOptions& options) {
  frame::BundledFrame refined = refined_frame(input.map.rig(), coarse, fine, options.initialisation);
  TrackOutput out = output_of(input, {std::move(refined), std::move(fine.solution), std::move(fine.matches),
                                      std::move(fine.visible), fine.contest});
  update_cameras(coarse, fine, options.consensus, out);
  out.keyframe_due = keyframe_needed(input.map, options, false, out);
  out.state.direct = {};
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
  Coarse coarse = coarse_pose(input, frame, options, pool);
  if (coarse.reason != LostReason::kNone) return lost(input.state, frame, coarse.reason);
  Fine fine = track_local_view(input, coarse, options, pool);
  if (fine.solution.num_inliers < options.min_inliers) return lost(input.state, frame, LostReason::kFewInliers);
  const bool enough = supported(fine.solution, fine.num_matches, options.min_inliers, options);
  if ((!enough || coarse.unconfirmed) && !(fine.solution.ok && coarse_pose_confirmed(input, coarse, fine, options)))
    return lost(input.state, frame, LostReason::kUnstablePose);
  const bool after_gap = to_seconds(frame.time_ns - input.state.time_ns) > kMaxPrediction_s;
  if (after_gap && !lasting_landmarks_found(input.map, fine.visible, fine.matches, fine.solution.inlier))
    return lost(input.state, frame, LostReason::kUnstablePose);
  return tracked(input, coarse, std::move(fine), options);
}

}  // namespace bslam::tracking
