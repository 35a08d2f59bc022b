// The background stages of a run, as functions for its executor.
#pragma once

#include <functional>
#include <memory>

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

// Called for every committed loop closure, in the committing thread.
using LoopObserver = std::function<void(const LoopRecord&)>;

// Returns null if no loops are closed: without a vocabulary, or if the settings say so.
std::shared_ptr<looping::LoopCloser> make_loop_closer(const Config& config, const place::VocabularyPtr& vocabulary);

// `config`, `keyframe_maker` and `given_rig` must outlive the functions. Keyframes before `first` belong to a loaded
// map, whose world frame stays when the rig is calibrated. Without a `closer` no loops are closed.
execution::StageFunctions make_stages(const Config& config, KeyframeMaker& keyframe_maker, const camera::Rig& given_rig,
                                      KeyframeId first, std::shared_ptr<looping::LoopCloser> closer,
                                      LoopObserver observer);

}  // namespace bslam::system
