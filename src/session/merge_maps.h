// Maps of separate runs made one over the places they share.
#pragma once

#include "map/bundled_map.h"
#include "place/vocabulary.h"
#include "storage/map_file.h"
#include "system/config.h"

namespace bslam::session {

struct MergeResult {
  map::BundledMap map;
  int joined = 0;         // parts hung below others
  int loops = 0;          // further places recognised, and fused
  std::size_t parts = 0;  // that are left: 1 where all of it lies in one world
};

// Everything of `b` goes into `a`; every keyframe of `b` is asked which place of the rest it shows, as loop closing
// asks in a run; in the end all is adjusted together. Maps without a common place lie side by side as parts. Both are
// of one rig and of the vocabulary's words. Errors: scales that are not metric, whose units differ.
Result<MergeResult> merge_maps(const storage::SavedMap& a, const storage::SavedMap& b,
                               const place::VocabularyPtr& vocabulary, const system::Config& config);

}  // namespace bslam::session
