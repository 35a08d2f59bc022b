// The stages of a run, as its executor calls them.
#pragma once

#include <functional>

#include "base/timestamp.h"
#include "execution/stage.h"
#include "looping/loop_closer.h"
#include "system/config.h"

namespace bslam::system {

// A loop closed, or two parts of the map joined.
struct LoopRecord {
  looping::LoopClosure closure;
  TimeNs time_ns = 0, with_time_ns = 0;  // of the frames of the two keyframes
};

// Told of every loop that went into the map, by whatever thread commits.
using LoopObserver = std::function<void(const LoopRecord&)>;

// `config` outlives them. Without a vocabulary no loops are closed.
execution::StageFunctions make_stages(const Config& config, const place::VocabularyPtr& vocabulary,
                                      LoopObserver observer);

}  // namespace bslam::system
