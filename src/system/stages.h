// The background stages of a run, as functions for its executor.
#pragma once

#include <functional>

#include "base/timestamp.h"
#include "execution/stage.h"
#include "looping/loop_closer.h"
#include "system/config.h"
#include "system/keyframe_maker.h"

namespace bslam::system {

// A loop that was closed, or two submaps that were merged.
struct LoopRecord {
  looping::LoopClosure closure;
  TimeNs time_ns = 0, with_time_ns = 0;  // times of the two keyframes
};

// Called for every loop closure that was committed, in the committing thread.
using LoopObserver = std::function<void(const LoopRecord&)>;

// `config`, `keyframe_maker` and `calibrated`, the given calibration, must outlive the functions. Keyframes before
// `first` belong to a loaded map, whose world frame stays when the rig is calibrated. Without a vocabulary no loops are
// closed.
execution::StageFunctions make_stages(const Config& config, KeyframeMaker& keyframe_maker,
                                      const camera::Rig& calibrated, KeyframeId first,
                                      const place::VocabularyPtr& vocabulary, LoopObserver observer);

}  // namespace bslam::system
