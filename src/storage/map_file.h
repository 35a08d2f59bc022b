// Writes and reads saved maps. The format is described in docs/map_file.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "camera/rig.h"
#include "map/bundled_map.h"
#include "place/vocabulary.h"

namespace bslam::storage {

inline constexpr std::string_view kMapFileBegin = "BSLAMMAP";  // the first bytes of a map file

// Metadata of a saved map.
struct MapFileInfo {
  std::uint64_t vocabulary = 0;  // Vocabulary::id() of the visual words of its keyframes; 0 if they have none
  std::string version;           // version of the program that wrote the file
  std::string data;              // name of the recording
  // Reason why its poses cannot be relied on, as found by the run that wrote it; may be empty.
  std::string warning = {};
};

// The warning of a map that a run has continued: the one stored in it and that of the run, if it is another one.
std::string joined_warnings(const std::string& stored, const std::string& of_run);

struct SavedMap {
  std::string file;
  map::BundledMap map;
  MapFileInfo info;
  std::size_t words_end = 0;                    // one more than the highest word id of its keyframes
  std::array<std::uint32_t, 4> checksums = {};  // checksums of the sections of the file
};

// Writes the keyframes and landmarks that are not removed, with consecutive ids in the same order. Words are omitted
// if there is no vocabulary. The file is written completely or not at all.
Status write_map(const map::BundledMap& map, const MapFileInfo& info, const std::filesystem::path& file);

// Reads a map with exactly the same poses. Viewing direction, distance range and descriptor of landmarks are
// recomputed. Version and gauge epoch start at 0. Errors name the file, the section and the keyframe or landmark: a
// file that cannot be read, is not a map, has another format version or kind of features, is truncated or damaged
// (checksums), or is inconsistent.
Result<SavedMap> read_map(const std::filesystem::path& file);

// Checks that a run with this pyramid and vocabulary (null: none) can continue the map: equal vocabularies, if both
// have one. The Error names the difference.
Status fits(const SavedMap& saved, const feature::PyramidShape& pyramid, const place::Vocabulary* vocabulary);

// Checks that a run with this rig, which may be any rig, can continue the map. Errors: as for fits; the map has no
// keyframes; it would have too many cameras with those of the run; its scale is not metric, and it was not made by the
// cameras of the run, whose distances are in metres.
Status check_continued(const SavedMap& saved, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                       const place::Vocabulary* vocabulary);

// Reads the map that a run with this rig continues. Errors: as for read_map and check_continued.
Result<SavedMap> open_map(const std::filesystem::path& file, const camera::Rig& rig,
                          const feature::PyramidShape& pyramid, const place::Vocabulary* vocabulary);

// Convert a map to and from the content of a file. `file` is the name used in errors. The content may be damaged or
// malicious: counts are checked against the number of remaining bytes before memory is reserved.
std::string map_to_bytes(const map::BundledMap& map, const MapFileInfo& info);
Result<SavedMap> map_from_bytes(std::string_view bytes, std::string file);

}  // namespace bslam::storage
