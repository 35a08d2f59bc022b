// When mapping runs: at once in the caller's thread, or in a thread of its own. Both call the same stage.
#pragma once

#include <functional>
#include <memory>

#include "map/map_store.h"
#include "system/config.h"
#include "system/frame_record.h"

namespace bslam::system {

// Told of every mapping run, from the thread it ran in, one at a time.
using MappingObserver = std::function<void(KeyframeId, double ms)>;

class MappingExecutor {
 public:
  virtual ~MappingExecutor() = default;

  // Mapping is due for a keyframe. May wait where too many are pending. Throws what a worker threw before.
  virtual void enqueue(KeyframeId keyframe) = 0;

  // Returns when everything enqueued has been committed. Throws what a worker threw.
  virtual void drain() = 0;
};

// `store` and `config` outlive the executor.
std::unique_ptr<MappingExecutor> make_mapping_executor(map::MapStore& store, const Config& config, MappingObserver observer);

}  // namespace bslam::system
