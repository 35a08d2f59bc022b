// Saved maps. The format: docs/map_file.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "camera/rig.h"
#include "map/bundled_map.h"
#include "place/vocabulary.h"

namespace bslam::storage {

// What a file tells besides the map itself.
struct MapFileInfo {
  std::uint64_t vocabulary = 0;  // Vocabulary::id() of the words of its keyframes; 0 = they have none
  std::string version;           // of the program that wrote it
  std::string data;              // name of the recording it was made of
};

struct SavedMap {
  std::string file;
  map::BundledMap map;
  MapFileInfo info;
  std::size_t words_end = 0;  // one more than the highest word its keyframes name
};

// What is alive in the map, its ids renumbered without gaps in their order. Without a vocabulary the words are left
// out. The file appears whole or not at all.
Status write_map(const map::BundledMap& map, const MapFileInfo& info, const std::filesystem::path& file);

// The map as it was, poses to the bit; view direction, distance range and descriptor of landmarks are computed anew.
// Version and gauge epoch begin at 0. Errors name the file, the section and the keyframe or landmark: not readable, no
// map file, of another format version or feature kind, cut or damaged (checksums), contents that contradict one
// another.
Result<SavedMap> read_map(const std::filesystem::path& file);

// Whether a run with this rig, pyramid and vocabulary (null = none) can go on with the map: as many cameras, of the
// same models, resolutions, intrinsics and distortion, and at the same place in the rig, numbers to 1e-9; its words
// those of the vocabulary, where both have some. The Error names the camera and what differs of it.
Status fits(const SavedMap& saved, const camera::Rig& rig, const map::PyramidShape& pyramid,
            const place::Vocabulary* vocabulary);

// The map of a file for a run that goes on in it: it fits, and has keyframes.
Result<map::BundledMap> open_map(const std::filesystem::path& file, const camera::Rig& rig,
                                 const map::PyramidShape& pyramid, const place::Vocabulary* vocabulary);

// The bytes of a file, and back; `file` is for errors. Nothing is trusted: counts are checked against the bytes that
// are there before room is made for them.
std::string map_to_bytes(const map::BundledMap& map, const MapFileInfo& info);
Result<SavedMap> map_from_bytes(std::string_view bytes, std::string file);

}  // namespace bslam::storage
