// Creates keyframes from frames that were tracked directly: a background stage extracts, bundles and tracks their
// features while the next frames are tracked.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "base/thread_pool.h"
#include "execution/stage.h"
#include "matching/frame_builder.h"
#include "system/config.h"
#include "tracking/tracker.h"

namespace bslam::system {

// A frame that was tracked directly and is to become a keyframe.
struct DeferredKeyframe {
  tracking::KeyframeRequest request;  // its frame has no keypoints
  matching::ReleasedImages images;
  std::vector<int> budgets;                           // number of keypoints, per camera
  std::vector<matching::AlignmentOptions> alignment;  // per camera
  std::shared_ptr<const camera::Rig> rig;             // rig with which the frame was tracked
};

// Results of extracting and tracking the features of a frame.
struct FeatureEvidence {
  std::vector<double> budget_fractions;         // fraction of the feature budget, per camera
  std::vector<tracking::CameraCounts> cameras;  // per camera
};

// Called for every keyframe that was committed, with the time of its frame, in the committing thread.
using KeyframeObserver = std::function<void(const tracking::CreatedKeyframe&, TimeNs)>;

class KeyframeMaker {
 public:
  // `rig` and `config` must outlive the object.
  KeyframeMaker(const camera::Rig& rig, const Config& config, std::unique_ptr<tracking::Relocaliser> relocaliser,
                KeyframeObserver observer);

  // Accepts a frame from which `make` then creates the keyframe. Thread-safe.
  void request(DeferredKeyframe deferred);

  // Forgets a request. Thread-safe.
  void withdraw(FrameId frame) { take(frame); }

  // The function of the stage: returns a draft on `base` with the keyframe of a requested frame. No draft if its
  // features give no pose, or if the map has been emptied since the request. Must be called by one thread at a time.
  execution::StageResult make(FrameId frame, const map::MapSnapshot& base);

  // Returns these results for a frame; available once its keyframe is in the map. Thread-safe.
  FeatureEvidence take_evidence(FrameId frame);

  // As in pipeline.h. Not while `make` runs.
  void free_scratch_memory() { builder_.free_scratch_memory(); }
  std::size_t pyramid_bytes() const { return builder_.memory_bytes(); }
  std::size_t place_index_bytes() const { return tracker_.place_index_bytes(); }

 private:
  DeferredKeyframe take(FrameId frame);

  const Config& config_;
  const KeyframeObserver observer_;
  ThreadPool pool_;
  matching::FrameBuilder builder_;
  tracking::Tracker tracker_;
  std::mutex mutex_;
  std::map<FrameId, DeferredKeyframe> requests_;  // guarded by mutex_, as the next member
  std::map<FrameId, FeatureEvidence> evidence_;
};

}  // namespace bslam::system
