// Creates keyframes of frames that were tracked directly: extracts, bundles and tracks their features, in a background
// stage beside the tracking of the next frames.
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
  std::shared_ptr<const camera::Rig> rig;             // with which the frame was tracked
};

// What the features of a frame have shown.
struct FeatureEvidence {
  std::vector<double> budget_fractions;         // of the feature budget, per camera
  std::vector<tracking::CameraCounts> cameras;  // per camera
};

// Called for every keyframe that was committed, with the time of its frame, in the committing thread.
using KeyframeObserver = std::function<void(const tracking::CreatedKeyframe&, TimeNs)>;

class KeyframeMaker {
 public:
  // `rig` and `config` must outlive the object.
  KeyframeMaker(const camera::Rig& rig, const Config& config, std::unique_ptr<tracking::Relocaliser> relocaliser,
                KeyframeObserver observer);

  // Accepts a frame, of which `make` then creates the keyframe. Thread-safe.
  void request(DeferredKeyframe deferred);

  // Forgets a request. Thread-safe.
  void withdraw(FrameId frame) { take(frame); }

  // The stage: the draft of the keyframe of a frame that was requested, in `base`. No draft if its features give no
  // pose, or the map was emptied since. To be called by one thread at a time.
  execution::StageResult make(FrameId frame, const map::MapSnapshot& base);

  // What the features of a frame have shown; known once its keyframe is in the map. Thread-safe.
  FeatureEvidence take_evidence(FrameId frame);

  // As in pipeline.h. Not while `make` runs.
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
