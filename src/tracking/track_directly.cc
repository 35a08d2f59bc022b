#include "tracking/track_directly.h"

#include <algorithm>
#include <utility>

#include "tracking/keyframe_decision.h"
#include "tracking/motion_prediction.h"
#include "tracking/robust_pose.h"
#include "tracking/stamp_errors.h"
#include "tracking/track_output.h"
#include "tracking/visible_landmarks.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

// Minimum fraction of the aligned landmarks that agree with the pose. With fewer, the frame is tracked with features,
// which distinguish several motions. In a new map, most landmarks may be on a moving object.
constexpr double kMinInlierRatio = 0.5, kMinRatioAtStart = 0.8;

// Landmarks aligned in the images of a frame.
struct AlignedLandmarks {
  FrameMatches matches;    // keypoint i of a camera is its i-th aligned landmark
  AlignedMatches aligned;  // their positions
};

bool used(const frame::BundledFrame& frame, std::size_t c) {
  return frame.cameras[c].state == image::ImageState::kPresent;
}

AlignedLandmarks align(const TrackInput& input, const frame::BundledFrame& frame, const SE3& T_rig_world,
                       const Candidates& candidates, std::span<const matching::AlignmentOptions> options,
                       ThreadPool& pool) {
  const map::BundledMap& map = input.map;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  AlignedLandmarks out{FrameMatches(rig.size()), AlignedMatches(rig.size())};
  pool.for_each(rig.size(), [&](std::size_t c) {
    out.aligned[c].reserve(candidates[c].size());
    out.matches[c].reserve(candidates[c].size());
    for (const Candidate& candidate : candidates[c]) {
      const auto aligned =
          align_landmark(map, rig, c, T_rig_world, input.pyramids[c], candidate.landmark, candidate.pixel, options[c]);
      if (!aligned || (!input.masks.empty() && !image::allows(input.masks[c], aligned->pixel.x(), aligned->pixel.y())))
        continue;
      const auto bearing = rig.camera(c).unproject(aligned->pixel);
      if (!bearing) continue;
      out.matches[c].push_back({KeypointIndex(out.matches[c].size()), candidate.landmark, true});
      out.aligned[c].push_back({aligned->pixel.cast<float>(), *bearing, static_cast<float>(aligned->sigma)});
    }
  });
  return out;
}

// The frame with the aligned landmarks as keypoints.
frame::BundledFrame with_keypoints(frame::BundledFrame frame, const AlignedLandmarks& found) {
  std::vector<std::pair<LandmarkId, frame::KeypointRef>> all;
  std::vector<std::size_t> counts;
  for (std::size_t c = 0; c < found.matches.size(); ++c) {
    feature::Detections keypoints;
    for (const AlignedMatch& a : found.aligned[c]) {
      keypoints.pixel.push_back(a.pixel);
      keypoints.bearing.push_back(a.bearing);
      keypoints.sigma.push_back(a.sigma);
    }
    for (const Match& m : found.matches[c]) all.push_back({m.landmark, {CameraIndex(c), m.keypoint}});
    counts.push_back(keypoints.size());
    frame.cameras[c].keypoints = std::move(keypoints);
  }
  std::sort(all.begin(), all.end());
  std::vector<std::vector<frame::KeypointRef>> matched;
  for (std::size_t i = 0; i < all.size();) {
    const std::size_t begin = i;
    while (i < all.size() && all[i].first == all[begin].first) ++i;
    if (i - begin < 2) continue;
    std::vector<frame::KeypointRef>& feature = matched.emplace_back();
    for (std::size_t k = begin; k < i; ++k) feature.push_back(all[k].second);
  }
  const std::vector<std::optional<frame::BundledPoint>> points(matched.size());
  frame.bundled = frame::Bundled(counts, matched, points);
  return frame;
}

// Adds landmarks that are not among `landmarks`; all are in order of id.
void add_sorted(const std::vector<LandmarkId>& added, std::vector<LandmarkId>& landmarks) {
  const auto before = static_cast<std::ptrdiff_t>(landmarks.size());
  landmarks.insert(landmarks.end(), added.begin(), added.end());
  std::inplace_merge(landmarks.begin(), landmarks.begin() + before, landmarks.end());
}

bool enough(const solver::PoseSolution& solution, std::size_t num_matches, const TrackingOptions& options) {
  return supported(solution, num_matches, options.min_inliers, options) &&
         solution.num_inliers >= kMinInlierRatio * static_cast<double>(num_matches);
}

// Pose from the landmarks of the last frame with the largest patches, with which the others are predicted; all
// landmarks together decide whether it is right. Updates the pose and the motion of the frame.
bool track_coarsely(const TrackInput& input, const LastLandmarks& last, const TrackingOptions& options,
                    ThreadPool& pool, frame::BundledFrame& frame, SE3& T_rig_world) {
  const Candidates candidates = coarsest_landmarks(input, frame, T_rig_world, last, options.direct, pool);
  std::vector<matching::AlignmentOptions> alignment(input.alignment.begin(), input.alignment.end());
  for (auto& camera : alignment) camera.max_shift_px = options.direct.coarse_shift_px;
  const AlignedLandmarks found = align(input, frame, T_rig_world, candidates, alignment, pool);
  const auto observations = pose_observations(input.map, found.matches, found.aligned);
  correct_capture_times(input, observations, T_rig_world, frame);
  const solver::MotionModel motion = motion_model(input, frame);
  const auto [solution, matches, contest] =
      robust_pose(input, frame, found.matches, observations, T_rig_world, motion, options.pose);
  if (!supported(solution, matches, options.min_inliers, options)) return false;
  frame.twist = motion.twist(solution.T_rig_world);
  T_rig_world = solution.T_rig_world;
  return true;
}

// Updates the support of each camera. Returns true if some camera has lost a considerable part of it.
bool support_is_low(const frame::BundledFrame& frame, const FrameMatches& inliers, const TrackingOptions& options,
                    DirectState& state) {
  state.best_inliers.resize(inliers.size());
  bool low = false;
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    if (!used(frame, c)) continue;
    const auto found = static_cast<int>(inliers[c].size());
    int& best = state.best_inliers[c];
    best = std::max(best, found);
    low |= best >= options.consensus.min_expected && found < options.direct.min_support * best;
    // The camera may observe a new part of the scene.
    low |= found < options.keyframe.min_camera_inliers && state.frames >= kFewInliersInterval;
  }
  ++state.frames;
  return low;
}

bool needs_keyframe(const TrackInput& input, TrackingOptions options, TrackOutput& out) {
  options.keyframe.min_overlap = std::max(options.keyframe.min_overlap, options.direct.min_overlap);
  return keyframe_needed(input.map, options, true, out);
}

bool predictable(const TrackInput& input, const frame::BundledFrame& frame) {
  const TrackerState& state = input.state;
  return state.anchored.known_in(input.map) && motion_since_last(state, frame.time_ns).has_value();
}

// Completes the output for the pose, and decides whether the frame needs features nevertheless.
DirectOutput judged(const TrackInput& input, const LocalLandmarks& local, TrackedFrame found,
                    const TrackingOptions& options) {
  DirectOutput out{.failure = DirectFailure::kNone};
  TrackOutput& output = out.output.emplace(output_of(input, std::move(found)));
  TrackResult& result = output.result;
  TrackerState& state = output.state;
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    result.cameras[c].keypoints = static_cast<int>(local.candidates[c].size());
    update_used_camera(output.frame, c, output.matches[c], options.consensus, state.cameras[c]);
  }
  state.direct.view = local.view;
  const bool low = support_is_low(output.frame, output.matches, options, state.direct);
  out.all_cameras = !low;
  for (std::size_t c = 0; !low && c < state.cameras.size(); ++c) {
    if (!used(output.frame, c)) continue;
    const LandmarkCounts found_again{result.cameras[c].keypoints, result.cameras[c].inliers};
    update_reobservation_ratio(state.cameras[c], found_again, options.consensus);
  }
  if (low) out.failure = DirectFailure::kFewInliers;
  if (needs_keyframe(input, options, output)) out.failure = DirectFailure::kKeyframeDue;
  return out;
}

}  // namespace

DirectOutput track_directly(const TrackInput& input, frame::BundledFrame frame, const TrackingOptions& options,
                            ThreadPool& pool) {
  if (!predictable(input, frame)) return {.failure = DirectFailure::kNoPrediction};
  const LastLandmarks last = landmarks_of_last_frame(input);
  SE3 T_rig_world = predict(input, frame.time_ns);
  if (!track_coarsely(input, last, options, pool, frame, T_rig_world)) return {.failure = DirectFailure::kNoPose};
  const LocalLandmarks local = local_landmarks(input, frame, T_rig_world, last, options, pool);
  AlignedLandmarks found = align(input, frame, T_rig_world, local.candidates, input.alignment, pool);
  const auto observations = pose_observations(input.map, found.matches, found.aligned);
  correct_capture_times(input, observations, T_rig_world, frame);
  const solver::MotionModel motion = motion_model(input, frame);
  auto [solution, matches, contest] =
      robust_pose(input, frame, found.matches, observations, T_rig_world, motion, options.pose);
  if (!enough(solution, matches, options)) return {.failure = DirectFailure::kNoPose};
  const bool doubtful =
      newly_started(input, frame) && solution.num_inliers < kMinRatioAtStart * static_cast<double>(matches);
  frame.twist = motion.twist(solution.T_rig_world);
  frame = with_keypoints(std::move(frame), found);
  TrackedFrame tracked{std::move(frame), std::move(solution), std::move(found.matches), local.expected, contest};
  DirectOutput out = judged(input, local, std::move(tracked), options);
  if (doubtful) out.failure = DirectFailure::kDoubtful;
  // a search with features finds the others again
  add_sorted(local.others, out.output->state.landmarks);
  return out;
}

}  // namespace bslam::tracking
