// The front end: state and policy of tracking from frame to frame. It starts maps, follows the rig, locates it again
// after a loss, and decides which frames become keyframes. Its state is a value, it reads the map from an immutable
// version, and changes it only by proposing an edit.
#pragma once

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
#include "tracking/pose_between.h"
#include "tracking/relocaliser.h"

namespace bslam::tracking {

struct TrackerOptions {
  TrackingOptions tracking;
  feature::FeatureOptions features;
  std::uint64_t seed = 1;
  bool localize_only = false;  // never propose an edit of the map
  int new_submap_after = 50;   // frames with something to see but without a pose, after which a new submap is started
};

// How the next frame is to be extracted and bundled. Per camera.
struct FramePlan {
  std::vector<std::uint8_t> left_out;   // its image is not used
  std::vector<std::uint8_t> postponed;  // of these: sound cameras that fire late while the motion is not known
  std::vector<int> budgets;             // keypoints wanted
  std::vector<matching::AlignmentOptions> alignment;
  geometry::Vector6d twist = geometry::Vector6d::Zero();  // predicted motion of the rig, zero where unknown
};

// What tracking carries from one frame to the next.
struct FrontEndState {
  TrackerState track;
  std::vector<std::uint8_t> blurred;   // cameras that were blurred in the last frame
  std::vector<double> feature_shares;  // of the cameras in the feature budget; empty: even
  std::vector<double> error_floors;    // of the cameras, px; empty: nothing is known
  // Before a map is started up to scale: the frame that later ones are compared with, and all since, itself first.
  std::shared_ptr<const StartCandidate> start_reference;
  std::vector<std::shared_ptr<const frame::BundledFrame>> waiting;
  int frames_lost = 0;  // in a row, with something to see
  geometry::SE3 T_rig_odom, T_map_odom;

  // The state from which another map is started; the smooth pose goes on.
  FrontEndState restarted() const;
};

// An edit of the map that tracking proposes.
struct ProposedEdit {
  enum class Kind { kStart, kKeyframe };
  Kind kind = Kind::kKeyframe;
  map::MapDraft draft;
  std::vector<LandmarkId> landmarks;  // of the newest keyframe, with the ids of the draft
  std::size_t base_landmarks = 0;     // landmark slots of the version it is based on: ids from there on are provisional
};

struct TrackOutcome {
  FrameRecord record;
  FrontEndState next;
  std::optional<ProposedEdit> edit;
  std::vector<BetweenKeyframes> early;  // known after a start up to scale: the frames it was made from
};

class Tracker {
 public:
  // `rig` and `pool` outlive it. Without a relocaliser a lost rig is searched for only where it was lost.
  Tracker(const camera::Rig& rig, const TrackerOptions& options, ThreadPool& pool,
          std::unique_ptr<Relocaliser> relocaliser = nullptr);

  // Before extraction. A camera that was out of focus or smeared, and is not any longer, is trusted again in `state`.
  FramePlan plan(const image::ImageBundle& images, const PictureFaults& faults, FrontEndState& state) const;
  // For a frame by itself: every camera is used and gets an even share of the budget.
  FramePlan plan() const;

  // Tracks a frame in a version of the map, or tries to start a map with it. `pyramids`: per camera. Where there is an
  // edit in the outcome, commit it and call `committed`; record and next state are complete only then.
  TrackOutcome process(FrontEndState state, frame::BundledFrame frame, std::span<const image::Pyramid> pyramids,
                       const map::MapSnapshot& map);

  // Completes an outcome with the ids its edit was given. `report` is that of its commit.
  void committed(const map::CommitReport& report, TrackOutcome& outcome) const;

  // The pose of a frame from before the start of a map, in the map as it is now.
  std::optional<TrackResult> locate_early(const map::BundledMap& map, const BetweenKeyframes& early) const;

 private:
  struct Input {
    frame::BundledFrame& frame;
    std::span<const image::Pyramid> pyramids;
    const map::MapSnapshot& map;
  };
  std::vector<matching::AlignmentOptions> alignment(const FrontEndState& state) const;

  void track(const Input& input, TrackOutcome& outcome);
  TrackOutput follow(const Input& input, const FrontEndState& state) const;
  bool relocalise(const Input& input, TrackOutcome& outcome);
  void note_lost(const Input& input, const TrackerState& before, TrackOutcome& outcome);
  void propose_keyframe(const Input& input, const TrackOutput& output, TrackOutcome& outcome) const;
  void complete_keyframe(const map::CommitReport& report, TrackOutcome& outcome) const;

  // tracker_start.cc
  void start(const Input& input, TrackOutcome& outcome) const;
  std::optional<StartedMap> initialise(const Input& input, const FrontEndState& state, map::MapDraft& draft) const;
  void keep_reference_frame(const Input& input, FrontEndState& state) const;
  void complete_start(const map::CommitReport& report, TrackOutcome& outcome) const;

  const camera::Rig& rig_;
  const TrackerOptions options_;
  ThreadPool& pool_;
  const std::unique_ptr<Relocaliser> relocaliser_;
};

// Landmarks with the ids a commit gave them, alive, in order, each once. `base_landmarks` as in ProposedEdit.
std::vector<LandmarkId> committed_landmarks(const std::vector<LandmarkId>& proposed, std::size_t base_landmarks,
                                            const map::CommitReport& report);

}  // namespace bslam::tracking
