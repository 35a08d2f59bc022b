// Merges maps of separate runs that contain common places.
#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "map/bundled_map.h"
#include "place/vocabulary.h"
#include "session/map_scales.h"
#include "storage/map_file.h"
#include "system/config.h"

namespace bslam::session {

struct MergedInput {
  std::string file;
  std::string data;           // name of the recording
  std::size_t keyframes = 0;  // its keyframes follow those of the previous input, in the same order
  std::size_t submap = 0;     // submap of most of its keyframes: index into the roots of the result
  std::string reason = {};    // reason why it is not in the submap of most inputs; empty if it is
  std::string warning = {};   // reason why its poses cannot be relied on; may be empty
};

struct MergeResult {
  map::BundledMap map;
  std::vector<MergedInput> inputs;  // the map with the most keyframes first; the order depends on contents only
  int joined = 0;                   // submaps that were merged into others
  int loops = 0;                    // further loop closures
  std::vector<ScaleComparison> scales = {};  // one per pair of inputs with common landmarks
  std::uint64_t vocabulary = 0;              // Vocabulary::id() of the words of the map; 0 if it has none
};

// Appends all maps to the one with the most keyframes, whose world frame is kept, and searches a loop closure for every
// keyframe of the others. Maps without a common place become separate submaps. The maps may be of different rigs. The
// result does not depend on the order of `maps`. Errors: two maps are the same, have a keyframe in common, because one
// continues the other or was merged into it, differ in pyramid or vocabulary, have no words, by which places are
// recognised, no metric scale or no keyframes, or have too many cameras together. A single map may have no words. That
// of not_interrupted.
Result<MergeResult> merge_maps(std::vector<storage::SavedMap> maps, const place::VocabularyPtr& vocabulary,
                               const system::Config& config, const std::stop_token& interrupted = {});

// In MergedInput::data of a merged map
inline constexpr std::string_view kBetweenRecordings = " + ";

// Reasons why the poses of the merged map cannot be relied on: those of the inputs, and scales that disagree. The maps
// are not scaled: metric maps whose scales differ contain a wrong calibration. `name`: how inputs are named, by `file`
// or, in what is stored, by `data`; the warnings of an input that was merged before name its recordings already.
std::vector<std::string> warnings_of(const MergeResult& merged, std::string MergedInput::*name);

// The global bundle adjustment that follows. After a stop request, it ends early.
void adjust_merged(map::BundledMap& map, const system::Config& config, const std::stop_token& interrupted = {});

}  // namespace bslam::session
