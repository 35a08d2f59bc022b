#include "tracking/track_output.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "tracking/motion_prediction.h"
#include "tracking/stamp_errors.h"

namespace bslam::tracking {
namespace {

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

// Adds the reprojection errors of the inliers. Landmarks behind a camera are not counted.
void add_errors(const map::BundledMap& map, const frame::BundledFrame& frame, const geometry::SE3& T_rig_world,
                const FrameMatches& inliers, std::vector<CameraCounts>& counts) {
  const auto errors = squared_errors(map, frame, T_rig_world, inliers);
  for (std::size_t c = 0; c < errors.size(); ++c) {
    for (const std::optional<double> error : errors[c]) counts[c].squared_error_px2 += error.value_or(0.0);
  }
}

// Adds the counts of a frame. Each landmark predicted visible counts once, even if it is visible in several cameras.
// `found` is sorted.
void count_visibility(const std::vector<LandmarkId>& visible, const std::vector<LandmarkId>& found,
                      std::vector<map::VisibilityCount>& counts) {
  const auto earlier = static_cast<std::ptrdiff_t>(counts.size());
  const auto add = [&](LandmarkId l, std::uint32_t times_found) {
    const auto end = counts.begin() + earlier;
    const auto known = std::lower_bound(counts.begin(), end, l,
                                        [](const map::VisibilityCount& c, LandmarkId id) { return c.landmark < id; });
    if (known == end || known->landmark != l) {
      counts.push_back({l, 1, times_found});
    } else {
      ++known->expected;
      known->found += times_found;
    }
  };
  for (const LandmarkId l : found) add(l, 1);
  for (const LandmarkId l : visible) {
    if (!std::binary_search(found.begin(), found.end(), l)) add(l, 0);
  }
  const auto order = [](const map::VisibilityCount& a, const map::VisibilityCount& b) {
    return a.landmark < b.landmark;
  };
  std::sort(counts.begin() + earlier, counts.end(), order);
  std::inplace_merge(counts.begin(), counts.begin() + earlier, counts.end(), order);
}

// The noise of the image relative to the map, and the error of the reference keyframe. The noise is the inverse of the
// information, corrected for the truncation of the inliers at the outlier bound.
geometry::Matrix6d covariance_of(const solver::PoseSolution& solution, const map::BundledMap& map,
                                 const map::AnchoredPose& anchored) {
  const geometry::Matrix6d noise =
      solver::kFractionLeft / solver::kVarianceLeft * solution.information.ldlt().solve(geometry::Matrix6d::Identity());
  const geometry::PoseUncertainty of_reference =
      geometry::transported(map.keyframe(anchored.reference).uncertainty, anchored.T_rig_reference);
  const geometry::Matrix6d covariance = noise + of_reference.covariance();
  return 0.5 * (covariance + covariance.transpose());
}

// The mean twist since the frame before.
void update_twist(const TrackInput& input, TimeNs time_ns, const geometry::SE3& T_rig_world, TrackerState& state) {
  state.twist_kept = keeps_twist(input.state, time_ns);
  if (state.twist_kept) return;
  const double dt = to_seconds(time_ns - input.state.time_ns);
  state.twist.reset();
  if (dt <= 0 || dt > kMaxPrediction_s) return;
  state.twist = (T_rig_world * last_pose(input).inverse()).log() / dt;
  state.twist_interval_s = dt;
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

TrackOutput output_of(const TrackInput& input, TrackedFrame found) {
  const map::BundledMap& map = input.map;
  TrackOutput out;
  out.matches = keep_inliers(found.matches, found.solution.inlier);
  out.frame = std::move(found.frame);
  const frame::BundledFrame& frame = out.frame;
  TrackResult& result = out.result;
  result.frame = frame.id;
  result.time_ns = frame.time_ns;
  result.status = TrackStatus::kTracking;
  result.reason = LostReason::kNone;
  result.T_rig_world = found.solution.T_rig_world;
  result.contest = found.contest;
  result.cameras = camera_counts(frame, found.matches, out.matches);
  add_errors(map, frame, result.T_rig_world, out.matches, result.cameras);
  out.matched = std::move(found.matches);

  TrackerState& state = out.state;
  state = input.state;
  state.anchored =
      map::AnchoredPose::at(map, map.nearest_alive_ancestor(input.state.anchored.reference), result.T_rig_world);
  result.anchored = state.anchored;
  result.covariance = covariance_of(found.solution, map, result.anchored);

  update_twist(input, frame.time_ns, result.T_rig_world, state);
  state.status = TrackStatus::kTracking;
  state.time_ns = frame.time_ns;
  state.landmarks = landmarks_of(out.matches);
  count_visibility(found.visible, state.landmarks, state.visibility_counts);
  state.cameras.resize(out.matches.size());
  update_stamp_errors(map, frame, result.T_rig_world, out.matches, state.stamps);
  for (std::size_t c = 0; c < state.references.size(); ++c) {
    ++state.references[c].frames;
    state.references[c].late |= frame.cameras[c].state != image::ImageState::kPresent;
  }
  return out;
}

void update_used_camera(const frame::BundledFrame& frame, std::size_t c, const std::vector<Match>& inliers,
                        const ConsensusOptions& options, CameraConsensusState& camera) {
  if (frame.cameras[c].state != image::ImageState::kPresent) {
    if (to_seconds(frame.time_ns - camera.last_image_ns) > kMaxPrediction_s)
      camera.landmarks.clear();  // too old: the view may have changed since
    return;
  }
  camera.last_image_ns = frame.time_ns;
  camera.established |= static_cast<int>(inliers.size()) >= options.min_expected;
  camera.landmarks.clear();
  for (const Match& m : inliers) camera.landmarks.push_back(m.landmark);
}

bool keyframe_needed(const map::BundledMap& map, const TrackingOptions& options, bool direct, TrackOutput& out) {
  TrackerState& state = out.state;
  state.references.resize(out.frame.cameras.size());
  for (CameraReference& r : state.references) {
    if (!r.keyframe.valid()) r.keyframe = state.anchored.reference;
  }
  const std::vector<KeyframeEvidence> evidence =
      evidence_by_reference(map, out.frame, out.matches, out.result.T_rig_world, options, direct, state.references);
  if (std::ranges::none_of(evidence, [&](const auto& e) { return keyframe_due(e, options.keyframe); })) return false;
  const auto new_view = [](const KeyframeEvidence& e) { return e.untracked_depth || e.camera_with_few_inliers; };
  if (std::ranges::any_of(evidence, new_view)) return true;
  const auto similar =
      similar_keyframe(map, out.frame, out.matches, state.anchored.reference, out.result.T_rig_world, options.keyframe);
  if (!similar) return true;
  state.anchored = map::AnchoredPose::at(map, *similar, out.result.T_rig_world);
  refer_to(*similar, *map.keyframe(*similar).frame, state.references);
  const std::vector<int> overlap = overlap_by_camera(map, out.matches, *similar);
  for (std::size_t c = 0; c < overlap.size(); ++c) {
    if (state.references[c].keyframe == *similar) state.references[c].best_direct_overlap = overlap[c];
  }
  out.at_similar_keyframe = true;
  return false;
}

}  // namespace bslam::tracking
