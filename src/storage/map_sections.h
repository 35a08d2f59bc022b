// Writes and reads the sections of a saved map. Internal to this folder; see map_file.h.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/thread_pool.h"
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
InfoSection take_info(SectionReader& in, std::uint32_t version);

// The keyframes of a map.
struct KeyframeSection {
  std::vector<std::shared_ptr<const frame::BundledFrame>> frames;
  std::vector<geometry::SE3> T_rig_world;
  std::vector<KeyframeId> parents;
  std::size_t words_end = 0;  // one more than the highest word id
};
// The keyframes must belong to the rig and pyramid of `map`.
KeyframeSection take_keyframes(SectionReader& in, bool with_words, const map::BundledMap& map, ThreadPool& pool);

// The landmarks of a map, one array for each of their properties.
struct LandmarkSection {
  SharedArray<Eigen::Vector3d> position, view_direction;  // the latter only since version 5, as the next two
  SharedArray<feature::Descriptor> descriptor;
  SharedArray<Eigen::Vector2f> distances;  // smallest and largest
  SharedArray<KeyframeId> reference, born;
  SharedArray<frame::KeypointRef> keypoint;  // reference keypoint
  SharedArray<std::uint32_t> expected, found;
  SharedArray<std::uint32_t> counts;  // numbers of observations
  SharedArray<KeyframeId> observing;  // the keyframes of all observations, landmark by landmark
  SharedArray<FeatureId> features;    // the features of all observations
  SharedArray<std::uint8_t> aligned;

  map::Landmark landmark(std::size_t i) const;
};
LandmarkSection take_landmarks(SectionReader& in);

// In map_version_4.cc: the same for files before version 5.
KeyframeSection take_keyframes_4(SectionReader& in, bool with_words, const map::BundledMap& map);
LandmarkSection take_landmarks_4(SectionReader& in);
frame::BundledFrame take_frame_4(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                                 bool with_words, std::size_t& words_end);

// Checks that files of any version need, after the state and the time of a camera, its keypoints, or its words were
// read.
bool check_image(SectionReader& in, std::uint32_t state, frame::CameraFrame& camera);
bool check_keypoints(SectionReader& in, const feature::Keypoints& k, const camera::Camera& camera, int levels);
bool check_words(SectionReader& in, const SharedArray<WordId>& words, std::size_t& words_end);
// Reads the parent of one of so many keyframes.
KeyframeId take_parent(SectionReader& in, std::size_t keyframes);
// Reads a frame, of which these functions read the parts that depend on the version.
using TakeCamera = void(SectionReader& in, const camera::Camera& calibration, int levels, bool with_words,
                        std::size_t& words_end, frame::CameraFrame& camera);
using TakeBundled = void(SectionReader& in, frame::BundledFrame& frame);
frame::BundledFrame take_frame_of(SectionReader& in, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                                  bool with_words, std::size_t& words_end, TakeCamera& take_camera,
                                  TakeBundled& take_bundled);

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
