// The front end: initialises maps, tracks the rig from frame to frame, relocalises it after a loss, and decides which
// frames become keyframes. Its state is passed as a value. It reads an immutable version of the map and proposes edits
// of it.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "feature/extractor.h"
#include "map/map_store.h"
#include "tracking/camera_health.h"
#include "tracking/frame_record.h"
#include "tracking/initialise.h"
#include "tracking/observed_keypoints.h"
#include "tracking/pose_between.h"
#include "tracking/reduced_work.h"
#include "tracking/relocaliser.h"
#include "tracking/track_directly.h"

namespace bslam::tracking {

struct TrackerOptions {
  TrackingOptions tracking;
  feature::FeatureOptions features;
  std::uint64_t seed = 1;
  bool localize_only = false;  // never propose an edit of the map
  bool correct_rig = true;     // correct the rig before a map is started (tracking/start_correction.h)
  double sigma_focal = 0.0;    // relative standard deviation of its focal lengths
  // First and number of the cameras that belong to the run; number 0: all. The others belong to other rigs of the map
  // and never have images.
  std::size_t first_camera = 0, num_cameras = 0;
  int new_submap_after = 20;  // number of frames with features but without a pose after which a new submap is started
  // Seconds since the first of these frames after which a new submap is started, if there are a few of them.
  double new_submap_after_s = 2.0;
};

// Parameters for the extraction and bundling of the next frame, per camera.
struct FramePlan {
  std::vector<std::uint8_t> skipped;    // its image is not used
  std::vector<std::uint8_t> postponed;  // subset: working cameras that capture late while the motion is not known
  std::vector<int> budgets;             // target number of keypoints
  std::vector<matching::AlignmentOptions> alignment;
  geometry::Vector6d twist = geometry::Vector6d::Zero();  // predicted motion of the rig, zero if unknown
  bool motion_unknown = false;
};

// A pending keyframe is waited for in this number of frames, and at high frame rates in more, for this time.
inline constexpr int kMaxPendingFrames = 10;
inline constexpr double kMaxPending_s = 0.3;

// A keyframe that is being created from a frame that was tracked directly.
struct PendingKeyframe {
  FrameId frame;
  map::AnchoredPose pose;          // pose of the frame from direct tracking
  std::size_t first_keyframe = 0;  // number of keyframe slots of the map when it was requested; its id is not smaller
  TimeNs time_ns = 0;              // of the frame
  int frames = 0;                  // number of frames since the request
};

// A reference frame of a monocular initialisation. If not every frame has images of the same cameras, there are
// several: each has an image of a camera that the earlier ones do not have.
struct StartReference {
  std::shared_ptr<const StartCandidate> candidate;
  int frames_of_others = 0;  // consecutive frames without an image of any of its cameras
};

// State of the front end that is carried from frame to frame.
struct FrontEndState {
  TrackerState track;
  std::vector<std::uint8_t> blurred;       // cameras that were blurred in the last frame
  TimeNs planned_ns = 0;                   // time of the last frame
  std::vector<std::uint8_t> used;          // cameras that had a usable image
  std::optional<TimeNs> incomplete_ns;     // time of the last frame without a usable image of a camera that is in use
  std::vector<TimeNs> unused_ns;           // per camera, time since its last used image during which others were used
  std::vector<double> budget_fractions;    // per camera, fraction of the feature budget; empty: equal fractions
  std::vector<double> calibration_errors;  // per camera, px; empty: not estimated
  // During a monocular initialisation: the reference frames, oldest first, and all frames since the oldest.
  std::vector<StartReference> start_references;
  std::vector<std::shared_ptr<const frame::BundledFrame>> waiting;
  int start_attempts = 0;   // frames in which the start of a map was attempted
  bool at_rest = false;     // the rig did not move between the last two frames, before a map is started
  int direct_failures = 0;  // consecutive attempts of direct tracking that found no pose
  int direct_pause = 0;     // number of frames until the next attempt
  int direct_kept = 0;      // number of poses from direct tracking that were kept since features last gave a pose
  std::optional<PendingKeyframe> pending;
  // The last pending keyframe was not created. The next keyframe must come from a frame with features.
  bool keyframe_failed = false;
  int rig_checks = 0, rig_corrections = 0;  // before a map is started: frames since the last check, corrections so far
  int reduction = 0;                        // level of tracking/reduced_work.h
  bool stalled = false;      // the last frame had the images of an earlier one; see Tracker::note_repetition
  TimeNs new_images_ns = 0;  // time of the last frame with new images
  std::optional<double> speed_before_px_s;  // median speed of the landmarks in the images before they were repeated
  int frames_lost = 0;                      // consecutive lost frames with features
  TimeNs lost_since_ns = 0;                 // time of the first of them
  geometry::SE3 T_rig_odom, T_map_odom;

  // The pending keyframe is in the map, or it is not waited for any more.
  void forget_pending();
  // The state for the initialisation of another map; the odometry pose is continued.
  FrontEndState restarted() const;
};

// An edit of the map that tracking proposes.
struct ProposedEdit {
  // kRig: another calibration of the rig, with which the frame is to be processed again. It is not proposed then.
  enum class Kind { kStart, kKeyframe, kRig };
  Kind kind = Kind::kKeyframe;
  map::MapDraft draft;
  std::vector<LandmarkId> landmarks;  // landmarks of the newest keyframe, with ids of the draft
  std::size_t base_landmarks = 0;     // landmark slots of the base version; ids from there on are provisional
};

// The images of a frame.
struct FrameImages {
  std::span<const image::Pyramid> pyramids;  // per camera
  std::span<const image::ImageView> masks;   // per camera
};

struct TrackOutcome {
  FrameRecord record;
  FrontEndState next;
  std::optional<ProposedEdit> edit;
  bool keyframe_wanted = false;         // a keyframe is to be created from the frame later (see create_keyframe)
  std::vector<BetweenKeyframes> early;  // frames of a monocular initialisation, once it succeeded
  std::vector<ObservedKeypoints> observed = {};  // per camera
};

// A frame that was tracked directly and is to become a keyframe.
struct KeyframeRequest {
  frame::BundledFrame frame;  // for Tracker::create_keyframe with extracted and bundled keypoints
  FrontEndState before;       // state before the frame
  map::AnchoredPose pose;     // pose from direct tracking
};

// The result of direct tracking of a frame.
struct DirectAttempt {
  DirectFailure failure = DirectFailure::kNotTried;
  std::optional<TrackOutcome> outcome = {};  // set if a pose was found; final if there is no failure
  bool all_cameras = false;                  // every camera supports the pose
};

class Tracker {
 public:
  // `rig` and `pool` must outlive the tracker. Without a relocaliser a lost rig is only searched for near its last
  // pose.
  Tracker(const camera::Rig& rig, const TrackerOptions& options, ThreadPool& pool,
          std::unique_ptr<Relocaliser> relocaliser = nullptr);

  // Called before extraction. Readmits excluded cameras in `state` that were blurred in the last frame and are not any
  // more.
  FramePlan plan(const image::ImageBundle& images, const ImageFaults& faults, FrontEndState& state) const;

  // Decides whether the images of a frame that repeats those of the frame before (`repeated`, see ImageFaults) are to
  // be ignored (FrontEndState::stalled). The landmarks moved in the images until then, so that they would have moved
  // visibly in the meantime: a driver delivers an earlier image again, or a video was converted to a higher frame rate.
  // If the rig was at rest, the images are used: simulated ones have no noise, and a video coder may remove it.
  void note_repetition(bool repeated, TimeNs time_ns, const map::BundledMap& map, FrontEndState& state) const;

  // Forgets the frames of a monocular initialisation, for example because they have bearings of another calibration.
  static void restart_monocular_start(FrontEndState& state);

  // Returns true if the next frame is to be tracked without features first.
  bool tracks_directly(const FrontEndState& state) const;
  // Tracks a frame without features. If that fails, the frame must be tracked again with features; the result of this
  // attempt is passed to that call.
  DirectAttempt process_directly(const FrontEndState& state, const frame::BundledFrame& frame,
                                 const FrameImages& images, const map::MapSnapshot& map) const;

  // Tracks a frame in a version of the map, or attempts to initialise a map with it. `pyramids`: one per camera. If the
  // outcome contains an edit, the caller must commit it and call `committed`, which completes the record and the next
  // state.
  TrackOutcome process(FrontEndState state, frame::BundledFrame frame, std::span<const image::Pyramid> pyramids,
                       const map::MapSnapshot& map, DirectAttempt direct = {});

  // Tracks a frame with features, beginning with the pose found directly, and proposes the keyframe. `map` is the
  // version in which the frame was tracked directly or a later one. Returns nullopt if the features give no pose.
  std::optional<TrackOutcome> create_keyframe(KeyframeRequest request, std::span<const image::Pyramid> pyramids,
                                              const map::MapSnapshot& map) const;

  // Continues from the pending keyframe if it is in the map, as if its frame had become a keyframe when it was tracked.
  // Gives up waiting for it after kMaxPendingFrames and kMaxPending_s.
  std::optional<CreatedKeyframe> adopt_keyframe(const map::BundledMap& map, FrontEndState& state) const;

  // Completes an outcome with the ids assigned by the commit of its edit.
  void committed(const map::CommitReport& report, TrackOutcome& outcome) const;

  // The pose in the current map of a frame captured during a monocular initialisation (see pose_between).
  std::optional<TrackResult> locate_early(const map::BundledMap& map, const BetweenKeyframes& early) const;

  // Memory of the index of places of its relocaliser, in bytes.
  std::size_t place_index_bytes() const { return relocaliser_ ? relocaliser_->memory_bytes() : 0; }

 private:
  // Options at a level of reduction.
  struct Level {
    feature::FeatureOptions features;
    TrackingOptions tracking;
  };
  const Level& level_of(const FrontEndState& state) const { return levels_[static_cast<std::size_t>(state.reduction)]; }
  std::vector<int> budgets(const FrontEndState& state, std::span<const std::uint8_t> skipped,
                           std::span<const std::uint8_t> failing) const;
  struct Input {
    frame::BundledFrame frame;  // described and refined while it is processed
    std::span<const image::Pyramid> pyramids;
    const map::MapSnapshot& map;
    DirectAttempt direct = {};
  };
  std::vector<matching::AlignmentOptions> alignment(const FrontEndState& state) const;

  void track(Input& input, TrackOutcome& outcome);
  TrackInput input_of(const map::BundledMap& map, std::span<const image::Pyramid> pyramids,
                      std::span<const matching::AlignmentOptions> alignment, const FrontEndState& state) const;
  TrackOutput follow(const Input& input, const FrontEndState& state,
                     const std::optional<EstimatedPose>& estimate) const;
  bool relocalise(Input& input, TrackOutcome& outcome);
  bool keep_direct_pose(const Input& input, TrackOutcome& outcome) const;
  bool gives_up(const FrontEndState& state, TimeNs time_ns) const;
  void handle_lost(Input& input, const TrackerState& before, TrackOutcome& outcome);

  // tracker_keyframe.cc
  void propose_keyframe(Input& input, const TrackOutput& output, TrackOutcome& outcome) const;
  void want_keyframe(const map::BundledMap& map, TrackOutcome& outcome) const;
  void complete_keyframe(const map::CommitReport& report, TrackOutcome& outcome) const;

  // tracker_start.cc
  void start(Input& input, TrackOutcome& outcome) const;
  std::optional<StartedMap> initialise(const Input& input, const FrontEndState& state, map::MapDraft& draft) const;
  std::vector<std::uint8_t> gone_cameras(const FrontEndState& state) const;
  void keep_reference_frame(Input& input, FrontEndState& state) const;
  bool correct_rig(const Input& input, TrackOutcome& outcome) const;
  void complete_start(const map::CommitReport& report, TrackOutcome& outcome) const;

  const camera::Rig& rig_;
  const TrackerOptions options_;
  std::array<Level, kMaxReduction + 1> levels_;
  ThreadPool& pool_;
  const std::unique_ptr<Relocaliser> relocaliser_;
};

// The landmarks that are alive, with the ids assigned by a commit, in order, each once. `base_landmarks`: see
// ProposedEdit.
std::vector<LandmarkId> committed_landmarks(const std::vector<LandmarkId>& proposed, std::size_t base_landmarks,
                                            const map::CommitReport& report);

}  // namespace bslam::tracking
