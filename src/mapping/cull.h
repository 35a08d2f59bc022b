// Culling: removes new landmarks that tracking does not match again, and redundant keyframes, whose landmarks are
// observed by enough other keyframes.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

// Checks the landmarks created within the last `probation` keyframes up to `newest`. For a landmark of a camera with a
// lower rate, only keyframes with an image of this camera count, which can observe it again, and those that have been
// removed; its probation ends after 4 * `probation` keyframes at the latest.
void cull_landmarks(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

// Checks the keyframes covisible with `newest`; never removes the root or the last two keyframes before `newest`.
void cull_keyframes(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

}  // namespace bslam::mapping
