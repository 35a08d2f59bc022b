#include "tracking/track.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "estimators/pose_ransac.h"
#include "tracking/keyframe_decision.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

// Motion from the last pose to `time_ns`, where it is known.
std::optional<SE3> motion_since_last(const TrackerState& state, TimeNs time_ns) {
  const double dt = to_seconds(time_ns - state.time_ns);
  if (dt == 0) return SE3();
  if (!state.twist || dt < 0 || dt > kMaxPrediction_s) return std::nullopt;
  return SE3::exp(dt * *state.twist);
}

// In the map as it is now.
SE3 last_pose(const TrackInput& input) { return input.state.anchored.resolve(input.map).value(); }

// The last pose moved on as far as the motion is known.
SE3 predict(const TrackInput& input, TimeNs time_ns) {
  return motion_since_last(input.state, time_ns).value_or(SE3()) * last_pose(input);
}

// What the last frame showed, and the last image of cameras that had none in it, as far as the present map still knows
// it.
std::vector<LandmarkId> seen_last(const map::BundledMap& map, const TrackerState& state) {
  std::vector<LandmarkId> out;
  const auto add = [&](const std::vector<LandmarkId>& landmarks) {
    for (const LandmarkId l : landmarks) {
      const LandmarkId now = map.resolve(l);
      if (now.valid()) out.push_back(now);
    }
  };
  add(state.landmarks);
  for (const CameraTrust& camera : state.cameras) {
    if (camera.seen_ns != state.time_ns) add(camera.landmarks);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool supported(const solver::PoseSolution& solution, std::size_t num_matches, int min_inliers,
               const TrackingOptions& options) {
  return solution.ok && solution.num_inliers >= min_inliers &&
         solution.num_inliers >= options.min_inlier_share * static_cast<double>(num_matches);
}

struct Coarse {
  frame::BundledFrame frame;  // its twist is estimated along with the pose
  SE3 T_rig_world;
  FrameMatches matches;  // inliers
  LostReason reason = LostReason::kNone;
  std::vector<std::uint8_t> left_out = {};  // per camera: doubted before or now
  // Per camera: what of the last frame was seen again; empty after a wide search alone.
  std::vector<Expectation> again = {};
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

// Motion while the cameras of a frame fire: that since the last frame, going on with the acceleration it had against
// the interval before. The poses say it, never the late cameras alone: what these see again they saw first with the
// same error.
solver::MotionModel motion_model(const TrackInput& input, const frame::BundledFrame& frame) {
  solver::MotionModel motion{.delay_s = frame::delays_of(frame), .T_before = last_pose(input)};
  const double dt = to_seconds(frame.time_ns - input.state.time_ns);
  if (dt <= 0 || dt > kMaxPrediction_s) {
    motion.offset = frame.twist;  // nothing newer is known
    return motion;
  }
  motion.gain = 1.0 / dt;
  if (!input.state.twist) return motion;
  const double ahead =
      0.5 * (dt + frame::farthest_delay_s(frame)) / dt;  // from the middle of the interval, in intervals
  motion.gain = (1.0 + ahead) / dt;
  motion.offset = -ahead * *input.state.twist;
  return motion;
}

// Pose from what is found near where the pose so far puts it. False where that is too little.
bool track_in_narrow_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                             const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = out.frame;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  const SE3 predicted = out.T_rig_world;
  FrameMatches found = find_landmarks(map, frame, predicted, landmarks, {},
                                      search_options(input, options.matching, options.matching.predicted_radius), pool)
                           .found;
  std::vector<std::uint8_t> left_out = out.left_out;
  drop(left_out, found);
  auto observations = pose_observations(map, frame, found, input.features);
  if (count(found) < static_cast<std::size_t>(options.min_inliers)) return false;
  const solver::MotionModel motion = motion_model(input, frame);
  auto solution = solver::solve_pose(map.rig(), observations, predicted, motion, options.pose);
  if (any(contradicting(found, solution.inliers_per_camera, input.state.cameras, options.consensus))) {
    const SE3 led_to = predict(input, frame.time_ns);
    const auto steadiest =
        pose_of_most_consistent_camera(rig, found, observations, led_to, options.consensus, options.pose);
    if (steadiest.ok) {
      const auto wrong = contradicting(found, steadiest.inliers_per_camera, input.state.cameras, options.consensus);
      for (std::size_t c = 0; c < wrong.size(); ++c) left_out[c] |= wrong[c];
      drop(left_out, found);
      observations = pose_observations(map, frame, found, input.features);
      solution = solver::solve_pose(map.rig(), observations, steadiest.T_rig_world, motion, options.pose);
    }
  }
  if (!supported(solution, observations.size(), options.min_inliers, options)) return false;
  out.frame.twist = motion.twist(solution.T_rig_world);
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(found, solution.inlier);
  out.reason = LostReason::kNone;
  out.again = continuity(map, frame, out.T_rig_world, input.state.cameras, out.matches);
  const auto lost = disagreeing(out.again, input.state.cameras, options.consensus);
  for (std::size_t c = 0; c < lost.size(); ++c) left_out[c] |= lost[c];
  out.left_out = std::move(left_out);
  drop(out.left_out, out.matches);
  return true;
}

// Pose from the landmarks about those of the last frame, looked for in wide windows, with a consensus. False where that
// is too little.
bool track_in_wide_windows(const TrackInput& input, const std::vector<LandmarkId>& landmarks,
                           const TrackingOptions& options, ThreadPool& pool, Coarse& out) {
  const map::BundledMap& map = input.map;
  const frame::BundledFrame& frame = out.frame;
  const std::vector<LandmarkId> near =
      map::local_landmarks(map, landmarks, input.state.anchored.reference, options.local_view);
  auto wide = search_options(input, options.matching, options.matching.wide_radius);
  wide.level_slack = 2;
  wide.ratio = 0.8 * options.matching.ratio;
  MatchSearch search = find_landmarks(map, frame, out.T_rig_world, near, {}, wide, pool);
  drop(out.left_out, search.found);
  if (count(search.found) < static_cast<std::size_t>(options.min_inliers_wide)) return false;
  const auto observations = pose_observations(map, frame, search.found, input.features);
  const auto solution =
      estimators::ransac_pose(frame::rig_of(map.rig(), frame), observations, out.T_rig_world, options.pose, {},
                              Random(input.seed, "wide search", static_cast<std::uint64_t>(frame.id.value())));
  out.reason = LostReason::kFewInliers;
  if (!supported(solution, observations.size(), options.min_inliers_wide, options)) return false;
  out.T_rig_world = solution.T_rig_world;
  out.matches = keep_inliers(search.found, solution.inlier);
  out.reason = LostReason::kNone;
  return true;
}

// Pose from the landmarks of the last frame: near where the motion model puts them, and where that finds too little or
// no motion is known, about where a search in wide windows does. Narrow windows about a motion that was only guessed
// would find what seems to confirm the guess.
Coarse track_last_frame(const TrackInput& input, const frame::BundledFrame& frame, const TrackingOptions& options,
                        ThreadPool& pool) {
  const std::vector<LandmarkId> landmarks = seen_last(input.map, input.state);
  Coarse out{
      frame, predict(input, frame.time_ns), {}, LostReason::kFewMatches, doubted(input.state, input.map.rig().size())};
  const bool tracking = input.state.status == TrackStatus::kTracking;
  const bool predicted = tracking && motion_since_last(input.state, frame.time_ns);
  if (predicted && track_in_narrow_windows(input, landmarks, options, pool, out)) return out;
  const bool found = track_in_wide_windows(input, landmarks, options, pool, out);
  if (tracking && (found || !predicted)) track_in_narrow_windows(input, landmarks, options, pool, out);
  return out;
}

bool any_due_for_retry(const TrackerState& state, TimeNs time_ns, const ConsensusOptions& options) {
  return std::ranges::any_of(state.cameras, [&](const CameraTrust& c) { return due_for_retry(c, time_ns, options); });
}

struct Fine {
  solver::PoseSolution solution;
  geometry::Vector6d twist;  // rad/s, m/s
  FrameMatches matches;      // all, inliers and outliers
  AlignedMatches aligned;    // of all matches
  std::vector<LandmarkId> visible;
  std::vector<Expectation> views;  // per camera, of the local view
  std::vector<Expectation> wide;   // the same in wide windows, where a doubted camera is due to be tried again
};

// Per camera.
std::vector<Expectation> expectations(const MatchSearch& search) {
  std::vector<Expectation> out;
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
  out.views = expectations(search);
  if (any_due_for_retry(input.state, frame.time_ns, options.consensus)) {
    auto windows = search_options(input, options.matching, options.matching.wide_radius);
    windows.ratio = 0.8 * options.matching.ratio;
    out.wide = expectations(find_landmarks(map, frame, coarse.T_rig_world, near, {}, windows, pool));
  }
  drop(coarse.left_out, search.found);
  out.matches = merge(coarse.matches, search.found);
  out.visible = std::move(search.visible);
  out.aligned =
      align_matches(map, frame, coarse.T_rig_world, out.matches, input.pyramids, input.alignment, input.features, pool);
  const solver::MotionModel motion = motion_model(input, frame);
  out.solution = solver::solve_pose(map.rig(), pose_observations(map, out.matches, out.aligned), coarse.T_rig_world,
                                    motion, options.pose);
  out.twist = motion.twist(out.solution.T_rig_world);
  return out;
}

// The frame as tracking leaves it.
frame::BundledFrame refined_frame(const camera::Rig& rig, const Coarse& coarse, const Fine& fine,
                                  const InitialisationOptions& options) {
  frame::BundledFrame frame = refined(coarse.frame, fine.matches, fine.aligned, fine.solution.inlier, rig);
  frame.twist = fine.twist;
  for (std::size_t c = 0; c < coarse.left_out.size(); ++c) {
    if (coarse.left_out[c]) leave_out(rig, c, options.min_parallax, options.max_chi2, frame);
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

// Each landmark that should have been seen counts once, also when several cameras should have.
void count_visibility(const std::vector<LandmarkId>& visible, const std::vector<LandmarkId>& found,
                      TrackerState& state) {
  for (const LandmarkId l : found) state.visibility_counts.push_back({l, 1, 1});
  for (const LandmarkId l : visible) {
    if (!std::binary_search(found.begin(), found.end(), l)) state.visibility_counts.push_back({l, 1, 0});
  }
}

// What the next frame should know about the cameras of this one.
void note_trust(const frame::BundledFrame& frame, const Coarse& coarse, const Fine& fine, const FrameMatches& inliers,
                const TrackingOptions& options, TrackOutput& out) {
  std::vector<CameraTrust>& cameras = out.state.cameras;
  cameras.resize(inliers.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    CameraTrust& camera = cameras[c];
    out.result.cameras[c].doubted = coarse.left_out[c];
    if (coarse.left_out[c]) {
      doubt(camera, fine.views[c], frame.time_ns, options.consensus);
      const bool tried = !fine.wide.empty() && fine.wide[c].expected > 0;
      if (tried && due_for_retry(camera, frame.time_ns, options.consensus))
        retry(camera, fine.wide[c], frame.time_ns, options.consensus);
      continue;
    }
    if (frame.cameras[c].state != image::ImageState::kPresent) {
      if (to_seconds(frame.time_ns - camera.seen_ns) > kMaxPrediction_s)
        camera.landmarks.clear();  // much may have come between
      continue;
    }
    if (!coarse.again.empty()) trust(camera, coarse.again[c], options.consensus);
    camera.seen_ns = frame.time_ns;
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
  out.state.twist.reset();
  return out;
}

namespace {

geometry::Matrix6d covariance_of(const solver::PoseSolution& solution) {
  const geometry::Matrix6d covariance = solution.information.ldlt().solve(geometry::Matrix6d::Identity());
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
  result.covariance = covariance_of(fine.solution);

  const double dt = to_seconds(frame.time_ns - input.state.time_ns);
  state.twist.reset();
  if (dt > 0 && dt <= kMaxPrediction_s) state.twist = (result.T_rig_world * last_pose(input).inverse()).log() / dt;
  state.status = TrackStatus::kTracking;
  state.time_ns = frame.time_ns;
  state.landmarks = landmarks_of(out.matches);
  count_visibility(fine.visible, state.landmarks, state);
  note_trust(frame, coarse, fine, out.matches, options, out);

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
