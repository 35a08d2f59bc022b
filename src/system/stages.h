// The stages of a run, as its executor calls them.
#pragma once

#include <functional>

#include "looping/loop_closer.h"
#include "system/config.h"
#include "system/stage.h"

namespace bslam::system {

// Told of every loop that went into the map, by whatever thread commits.
using LoopObserver = std::function<void(const looping::LoopClosure&)>;

// `config` outlives them. Without a vocabulary no loops are closed.
StageFunctions make_stages(const Config& config, const place::VocabularyPtr& vocabulary, LoopObserver observer);

}  // namespace bslam::system
