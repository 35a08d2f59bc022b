// Writes and reads the sections of a saved map. Internal to this folder; see map_file.h.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "camera/rig.h"
#include "map/bundled_map.h"
#include "storage/map_bytes.h"
#include "storage/map_file.h"

namespace bslam::storage {

constexpr std::size_t kMaxCameras = 100;  // the cost of constructing a rig grows with its square

// Ids in the file: consecutive for keyframes that are not removed, invalid for the others.
struct FileIds {
  explicit FileIds(const map::BundledMap& map);
  // Returns the id of the keyframe or, if it was removed, of the newest remaining keyframe before it, or of the first
  // keyframe if there is none.
  KeyframeId nearest_older(KeyframeId k) const;

  std::vector<KeyframeId> keyframe;  // indexed by the keyframe ids of the map
};

// Functions that write sections.
void put_rigs(const map::BundledMap& map, ByteWriter& out);
void put_info(const map::BundledMap& map, const MapFileInfo& info, ByteWriter& out);
void put_keyframes(const map::BundledMap& map, const FileIds& ids, bool with_words, ByteWriter& out);
void put_landmarks(const map::BundledMap& map, const FileIds& ids, ByteWriter& out);

// Functions that read sections. Results are only valid if the reader is ok afterwards.
struct RigSection {
  std::shared_ptr<const camera::Rig> rig, given;  // BundledMap::rig and given_rig
};
// Files before version 3 do not contain the second rig, which is then the first one.
std::optional<RigSection> take_rigs(SectionReader& in, std::uint32_t version);

struct InfoSection {
  feature::PyramidShape pyramid;
  map::Scale scale = map::Scale::kMetric;
  MapFileInfo info;
};
InfoSection take_info(SectionReader& in);

// Adds the keyframes with their spanning trees to an empty map. Returns one more than the highest word id.
std::size_t take_keyframes(SectionReader& in, bool with_words, map::BundledMap& map);

void take_landmarks(SectionReader& in, map::BundledMap& map);

// Write and read the BundledFrame of a keyframe; implemented in map_frame_bytes.cc.
void put_frame(const frame::BundledFrame& frame, const geometry::Vector6d& twist, bool with_words, ByteWriter& out);
frame::BundledFrame take_frame(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                               bool with_words, std::size_t& words_end);

// Write and read a transform as seven numbers, quaternion x y z w and translation. It is read back exactly.
void put_transform(const geometry::SE3& transform, ByteWriter& out);
geometry::SE3 take_transform(SectionReader& in);
constexpr std::size_t kTransformBytes = 7 * sizeof(double);

// Returns true if the point is finite and small enough that computations with it do not overflow.
bool is_plausible(const Eigen::Vector3d& point);

}  // namespace bslam::storage
