// What does not earn its place in the map goes: new landmarks that tracking cannot find again, and keyframes whose
// landmarks others see as well.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

// Looks at landmarks made within the last keyframes before `newest`. Returns how many went.
int cull_landmarks(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

// Looks at the keyframes covisible with `newest`; neither the root nor the newest two go. Returns how many went.
int cull_keyframes(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

}  // namespace bslam::mapping
