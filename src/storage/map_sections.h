// The sections of a saved map. Internal to io; see map_file.h.
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

constexpr std::size_t kMaxCameras = 100;  // making a rig costs the square of it

// Ids in the file: those of what is alive, without gaps. Invalid for what was removed.
struct FileIds {
  explicit FileIds(const map::BundledMap& map);
  // The keyframe or, where it was removed, the newest one before it; else the first.
  KeyframeId nearest_older(KeyframeId k) const;

  std::vector<KeyframeId> keyframe;  // per slot of the map
};

// ---- out
void put_rig(const camera::Rig& rig, ByteWriter& out);
void put_info(const map::BundledMap& map, const MapFileInfo& info, ByteWriter& out);
void put_keyframes(const map::BundledMap& map, const FileIds& ids, bool with_words, ByteWriter& out);
void put_landmarks(const map::BundledMap& map, const FileIds& ids, ByteWriter& out);

// ---- in. What is read is meaningful where the reader is ok afterwards.
std::optional<camera::Rig> take_rig(ByteReader& in);

struct InfoSection {
  feature::PyramidShape pyramid;
  map::Scale scale = map::Scale::kMetric;
  MapFileInfo info;
};
InfoSection take_info(ByteReader& in);

// Adds the keyframes to an empty map, with their spanning trees. Returns one more than the highest word.
std::size_t take_keyframes(ByteReader& in, bool with_words, map::BundledMap& map);

void take_landmarks(ByteReader& in, map::BundledMap& map);

// One BundledFrame, as part of a keyframe; map_frame_bytes.cc.
void put_frame(const frame::BundledFrame& frame, const geometry::Vector6d& twist, bool with_words, ByteWriter& out);
frame::BundledFrame take_frame(ByteReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                               bool with_words, std::size_t& words_end);

// A transform as seven numbers: quaternion x y z w, translation; to the bit.
void put_transform(const geometry::SE3& transform, ByteWriter& out);
geometry::SE3 take_transform(ByteReader& in);
constexpr std::size_t kTransformBytes = 7 * sizeof(double);

// Finite, and so small that nothing computed from it overflows.
bool is_plausible(const Eigen::Vector3d& point);

}  // namespace bslam::storage
