// Merges maps of separate runs that contain common places.
#pragma once

#include "map/bundled_map.h"
#include "place/vocabulary.h"
#include "storage/map_file.h"
#include "system/config.h"

namespace bslam::session {

struct MergeResult {
  map::BundledMap map;
  int joined = 0;           // submaps that were merged into others
  int loops = 0;            // further loop closures
  std::size_t submaps = 0;  // remaining submaps; 1 if everything is in one world frame
};

// Adds the keyframes and landmarks of `b` to `a`, searches a loop closure for every keyframe of `b`, and finally runs a
// global bundle adjustment. Maps without a common place become separate submaps. Both maps must be of the same rig and
// vocabulary. Errors: the maps have different rigs or vocabularies, or a map has no metric scale.
Result<MergeResult> merge_maps(const storage::SavedMap& a, const storage::SavedMap& b,
                               const place::VocabularyPtr& vocabulary, const system::Config& config);

}  // namespace bslam::session
