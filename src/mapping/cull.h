// Culling: removes new landmarks that tracking does not match again, and redundant keyframes, whose landmarks are
// observed by enough other keyframes.
#pragma once

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

// Checks the landmarks created within the last `probation` keyframes up to `newest` that have images of their camera,
// or within the last 4 * `probation` keyframes: only such keyframes can observe them again.
void cull_landmarks(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

// Checks the keyframes covisible with `newest`; never removes the root or the last two keyframes before `newest`.
void cull_keyframes(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft);

}  // namespace bslam::mapping
