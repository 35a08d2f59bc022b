// The paper's BundledMap: keyframes, landmarks, the covisibility graph, and one spanning tree per submap. Submaps are
// merged when a loop closure links them. The map is a value type: a copy shares all chunks and costs microseconds;
// changing a copy detaches only the chunks that are modified. Published versions are const, so a reader may keep one
// indefinitely. ARCHITECTURE.md describes who may change what. References and spans into a copy that is being modified
// are valid until its next change.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/id.h"
#include "base/thread_pool.h"
#include "camera/rig.h"
#include "feature/feature_model.h"
#include "map/bundled_keyframe.h"
#include "map/cow_vector.h"
#include "map/landmark.h"
#include "map/observation_column.h"

namespace bslam {
class MappedFile;
}

namespace bslam::map {

// kMetric: lengths are in metres. kUpToScale: the rig cannot observe the scale. kUnobservable: the rig can observe the
// metric scale, but its motion has not made it observable so far, or later motion has contradicted what it gave.
enum class Scale { kMetric, kUpToScale, kUnobservable };
std::string_view scale_name(Scale scale);  // "metric", "up-to-scale", "unobservable"

// The memory of a map in bytes.
struct MapMemory {
  std::size_t keyframes = 0;    // poses, spanning tree, and the tables of their landmarks
  std::size_t features = 0;     // positions and tables of their features
  std::size_t descriptors = 0;  // descriptors of their features
  std::size_t patches = 0;      // small images of their features
  std::size_t words = 0;        // visual words of their features
  std::size_t landmarks = 0, observations = 0, covisibility = 0;
  std::size_t total() const {
    return keyframes + features + descriptors + patches + words + landmarks + observations + covisibility;
  }
};

// The content of a saved map. The reader has only checked that the spans with one entry per landmark have equal
// lengths, those with one entry per observation as well, and that the sum of the counts is the number of observations.
// No other value is checked yet.
struct MapParts {
  std::span<const std::shared_ptr<const frame::BundledFrame>> frames;  // frames of keyframes 0, 1, ...
  std::span<const geometry::SE3> T_rig_world;
  std::span<const KeyframeId> parents;            // within range, invalid for roots
  std::span<const std::uint32_t> counts;          // observations of each landmark
  std::function<Landmark(std::size_t)> landmark;  // returns the landmark at an index of `counts`
  std::span<const KeyframeId> observing;          // keyframes of all observations, landmark by landmark
  std::span<const FeatureId> features;
  std::span<const std::uint8_t> aligned;  // 0 or 1
};
struct PartsError {
  std::optional<std::size_t> landmark;  // the landmark to which the problem belongs
  std::string found, expected;
};

class BundledMap {
 public:
  explicit BundledMap(std::shared_ptr<const camera::Rig> rig, feature::PyramidShape pyramid = {})
      : rig_(std::move(rig)), given_rig_(rig_), pyramid_(pyramid) {}

  // ---- Reading
  const camera::Rig& rig() const { return *rig_; }
  std::shared_ptr<const camera::Rig> shared_rig() const { return rig_; }
  // The same cameras with the calibration that runs were given, before any of them refined it.
  const camera::Rig& given_rig() const { return *given_rig_; }
  // Square root L of the covariance L L^T of the calibration: the extrinsics of cameras 1 to N-1 and the intrinsics of
  // all cameras (calibration::RigInformation). Null if the calibration is taken as exact.
  const std::shared_ptr<const Eigen::MatrixXd>& rig_deviation() const { return rig_deviation_; }
  // The pyramid on which keypoints were detected.
  const feature::PyramidShape& pyramid() const { return pyramid_; }
  MapVersion version() const { return version_; }
  Scale scale() const { return scale_; }
  // Relative standard deviation of the map scale: 0 if overlapping cameras observe it, infinite if nothing is known.
  double scale_deviation() const { return scale_deviation_; }
  // Number of corrections so far: loop closures, global adjustments and changes of the scale of a submap. Positions of
  // different epochs must not be mixed.
  int gauge_epoch() const { return gauge_epoch_; }

  // Slots include removed keyframes and landmarks. Ids are slot numbers and are never reused.
  std::size_t keyframe_slots() const { return keyframes_.size(); }
  std::size_t landmark_slots() const { return landmarks_.size(); }
  std::size_t num_keyframes() const { return alive_keyframes_; }
  std::size_t num_landmarks() const { return alive_landmarks_; }
  std::size_t num_observations() const { return observations_total_; }  // number of keypoints, not features
  bool alive(KeyframeId k) const { return k.valid() && k.index() < keyframes_.size() && keyframes_[k.index()].alive; }
  bool alive(LandmarkId l) const { return l.valid() && l.index() < landmarks_.size() && landmarks_[l.index()].alive; }

  // also valid for removed keyframes
  const BundledKeyframe& keyframe(KeyframeId k) const { return keyframes_[k.index()]; }
  // for a removed landmark only `alive` is meaningful
  const Landmark& landmark(LandmarkId l) const { return landmarks_[l.index()]; }
  // for removed landmarks; invalid if it was not merged
  LandmarkId merged_into(LandmarkId l) const { return merged_into_[l.index()]; }
  // in order of keyframe
  std::span<const Observation> observations(LandmarkId l) const { return observations_[l.index()]; }
  LandmarkId landmark_of(KeyframeId k, FeatureId f) const { return keyframes_[k.index()].landmarks[f.index()]; }

  // Alive ids in ascending order.
  std::vector<KeyframeId> keyframe_ids() const;
  std::vector<LandmarkId> landmark_ids() const;
  KeyframeId newest_keyframe() const;  // invalid if the map is empty
  // Roots of all submaps in ascending order, and the root of the submap of an alive keyframe.
  std::vector<KeyframeId> roots() const;
  KeyframeId root_of(KeyframeId k) const;
  // The root of each keyframe slot, in one pass over all slots. After a merge of submaps this is faster than root_of()
  // for many keyframes that were there before.
  std::vector<KeyframeId> root_of_each() const;
  // Alive keyframes of the submap with this root, parents before children.
  std::vector<KeyframeId> keyframes_of_submap(KeyframeId root) const;
  // Returns the keyframe itself if it is alive, otherwise its nearest alive ancestor; invalid if its submap was
  // removed.
  KeyframeId nearest_alive_ancestor(KeyframeId k) const;

  // Follows merges; returns an invalid id if the landmark was removed.
  LandmarkId resolve(LandmarkId l) const;
  // T_rig_world of a keyframe. For a removed keyframe it follows from the pose of its parent.
  geometry::SE3 resolved_pose(KeyframeId k) const;

  // The rig at the capture times of a keyframe's images, and the motion of the rig from the keyframe's time to the
  // capture time of camera c's image (the identity if they are equal).
  camera::Rig rig_of(KeyframeId k) const;
  geometry::SE3 motion_until(KeyframeId k, CameraIndex c) const;
  // T_cam_world of a keyframe's camera at the capture time of its image.
  geometry::SE3 cam_from_world(KeyframeId k, CameraIndex c) const;
  // The pose of a camera of a keyframe when the row of a keypoint was exposed.
  geometry::SE3 cam_from_world(KeyframeId k, frame::KeypointRef keypoint) const;
  // The motion of a camera of a keyframe while its rows were exposed.
  camera::Shutter shutter(KeyframeId k, CameraIndex c) const;

  // Covisible keyframes with at least `min_weight`, by decreasing weight (newer first on ties), at most `limit`.
  std::vector<Covisible> best_covisible(KeyframeId k, std::size_t limit, int min_weight = 1) const;

  // The keypoints of one camera of a keyframe.
  const feature::Keypoints& keypoints(KeyframeId k, CameraIndex c) const { return keyframe(k).frame->keypoints(c); }

  // In map_memory.cc: memory of all parts that were not counted before.
  MapMemory memory(MemoryCount& count) const;

  // Returns a description of the first violated invariant, or nullopt. The invariants: observations and the landmark
  // tables of the keyframes match; an alive landmark has observations, none of them in a removed keyframe; no feature
  // observes two landmarks; the reference keypoint belongs to one of the landmark's observations; covisibility is
  // symmetric with the number of shared landmarks as weight; the spanning trees contain all alive keyframes, and every
  // parent is alive; the counters are correct.
  std::optional<std::string> check_invariants() const;

  // ---- Modification (of a private copy only). Functions that return bool return false and change nothing if a
  // keyframe or landmark they name is not alive, or for the reasons given.
  void set_scale(Scale scale) {
    set_scale(scale, scale == Scale::kMetric ? 0.0 : std::numeric_limits<double>::infinity());
  }
  void set_scale(Scale scale, double deviation) {
    scale_ = scale;
    scale_deviation_ = deviation;
  }
  void set_version(MapVersion v) { version_ = v; }
  // A keyframe and a frame that replaces its own: the same keypoints with other bearings.
  using ReplacedFrame = std::pair<KeyframeId, std::shared_ptr<const frame::BundledFrame>>;
  // Replaces the calibration and its deviation; the cameras must be the same. Poses and landmarks are not changed.
  // Bearings are computed again if the intrinsics differ: those of `known` are taken as they are, if their keyframe is
  // alive. Returns all frames that were replaced.
  std::vector<ReplacedFrame> set_rig(std::shared_ptr<const camera::Rig> rig,
                                     std::shared_ptr<const Eigen::MatrixXd> deviation = {},
                                     std::span<const ReplacedFrame> known = {});
  // The cameras must be those of rig(), in the same order.
  void set_given_rig(std::shared_ptr<const camera::Rig> given) { given_rig_ = std::move(given); }
  // Replaces the rig by one with the same cameras and further ones after them, of which no keyframe has images so far.
  // The deviation of the calibration is dropped.
  void append_cameras(std::shared_ptr<const camera::Rig> rig, std::shared_ptr<const camera::Rig> given);
  void begin_gauge_epoch() { ++gauge_epoch_; }

  // Appends a keyframe that observes the given landmarks (alive; distinct features, distinct landmarks). Its parent is
  // the keyframe with which it shares most landmarks (the newer one on ties), otherwise `fallback_parent`; if that is
  // not alive, the keyframe becomes the root of a new submap. Its uncertainty is that of its parent.
  KeyframeId add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                          std::span<const std::pair<FeatureId, LandmarkId>> matches, KeyframeId fallback_parent);
  // Appends a landmark with one or more observations (distinct, alive keyframes; features without a landmark). The
  // first keypoint of the first observation is the reference unless `reference` has a valid keyframe. `born` is the
  // newest keyframe unless given. Calls refresh_landmark.
  LandmarkId add_landmark(const Eigen::Vector3d& position, std::span<const Observation> observations,
                          const LandmarkReference& reference = {}, KeyframeId born = {});
  // Also returns false if the keyframe already observes the landmark or the feature already has one.
  bool add_observation(LandmarkId l, Observation o);
  // Removing the last observation removes the landmark. If the reference is removed, the first keypoint of the oldest
  // remaining observation that has a patch becomes the reference, or that of the oldest observation if none has a
  // patch. Also returns false if the keyframe does not observe the landmark.
  bool remove_observation(LandmarkId l, KeyframeId k);
  bool remove_landmark(LandmarkId l);
  // Merges `from` into `into`: observations are moved unless the keyframe already observes `into`, and visibility
  // counts are added. Also returns false if both are the same landmark.
  bool merge_landmarks(LandmarkId from, LandmarkId into);
  // Removes the keyframe and its observations. Each of its children is attached to the parent of the removed keyframe
  // or to a sibling that has been attached already, whichever shares most landmarks with it. Also returns false for a
  // root.
  bool remove_keyframe(KeyframeId k);
  // Joins two submaps: `child` becomes the root of its submap and is attached to `parent`. Also returns false if both
  // are in the same submap.
  bool merge_submaps(KeyframeId child, KeyframeId parent);
  // Removes all keyframes and landmarks of a submap. Returns false if `root` is not the root of a submap.
  bool remove_submap(KeyframeId root);
  // Scales a submap around the origin by `factor`, including the relative poses of its removed keyframes, and begins a
  // gauge epoch. Returns false if `root` is not the root of a submap.
  bool scale_submap(KeyframeId root, double factor);
  // Records that lengths near keyframes have changed by these factors. Everything that is stored relative to one of
  // these keyframes (frames, removed keyframes, its twist) and its uncertainty are rescaled. Poses and positions in the
  // world are set separately.
  void scale_keyframes(std::span<const std::pair<KeyframeId, double>> factors);
  bool set_pose(KeyframeId k, const geometry::SE3& T_rig_world);
  bool set_twist(KeyframeId k, const geometry::Vector6d& twist);
  bool correct_time(const CaptureTime& change);
  bool set_uncertainty(KeyframeId k, geometry::PoseUncertainty uncertainty);
  bool set_position(LandmarkId l, const Eigen::Vector3d& position);
  bool add_visibility_counts(LandmarkId l, std::uint32_t expected, std::uint32_t found);
  // Recomputes viewing direction, distance range and descriptor from the observations.
  bool refresh_landmark(LandmarkId l);

  // ---- In release_memory.cc
  // Releases the memory of removed landmarks. Each call visits the next `slots` landmarks in turn, and releases a block
  // of landmarks if none of them is alive.
  void free_removed(std::size_t slots);
  // Releases data that keyframes need only while they are new. Each call visits at most `count` keyframes that have not
  // been visited yet; the newest kNewKeyframes are skipped. A visited keyframe keeps the patches that are or can become
  // references of landmarks: those of the first keypoints of features with a landmark. It releases the triangulated
  // points of its features, from which landmarks were created when it was new, and the cells of its grids, which the
  // next search fills again.
  void release_unused(std::size_t count);
  static constexpr std::size_t kNewKeyframes = 64;

  // Tells the operating system that the pages of the map's file are not needed soon, after all keyframes were visited.
  // Does nothing if no keyframe has arrays in a mapped file.
  void release_pages() const;
  void set_file(std::shared_ptr<const MappedFile> file) { file_ = std::move(file); }

  // ---- In fill_map.cc
  // Fills an empty map. The viewing direction, distances and descriptor of the landmarks are taken as they are. Returns
  // a description of the first problem in the parts, after which the map must not be used, or nullopt; then all
  // invariants hold.
  std::optional<PartsError> fill(const MapParts& parts, ThreadPool& pool);

 private:
  BundledKeyframe& edit(KeyframeId k) { return keyframes_.mutate(k.index(), owner_.tag()); }
  Landmark& edit(LandmarkId l) { return landmarks_.mutate(l.index(), owner_.tag()); }
  void refresh_descriptor(LandmarkId l);  // does nothing if the observations have not changed since its last call
  geometry::SE3 rig_from_cam(const BundledKeyframe& k, CameraIndex c) const;
  geometry::SE3 cam_from_rig(const BundledKeyframe& k, CameraIndex c) const;  // without the motion of the rig
  std::size_t num_keypoints(Observation o) const {
    return keyframe(o.keyframe).frame->bundled.keypoints(o.feature).size();
  }

  // In bundled_map.cc. Only `link` and `unlink` change observations; they keep the observation lists, landmark tables,
  // counters and covisibility consistent.
  void link(LandmarkId l, Observation o);
  void unlink(LandmarkId l, Observation o);
  void mark_removed(KeyframeId k);                          // must have no observations or children left
  void mark_removed(LandmarkId l, LandmarkId merged_into);  // must have no observations left

  // In release_memory.cc.
  LandmarkReference reference_among(std::span<const Observation> observations) const;
  void release_unused(KeyframeId k);

  // In fill_map.cc.
  std::optional<PartsError> fill_landmarks(const MapParts& parts, std::vector<std::vector<LandmarkId>>& tables);
  void fill_tables(std::vector<std::vector<LandmarkId>> tables, ThreadPool& pool);

  // In covisibility.cc.
  void change_weight(KeyframeId a, KeyframeId b, int change);
  void change_half_weight(KeyframeId at, KeyframeId neighbour, int change);
  // computes the weights of the newest keyframe from its landmark table, in both directions
  void connect_new_keyframe(KeyframeId k);
  KeyframeId choose_parent(KeyframeId k, KeyframeId fallback) const;
  void attach(KeyframeId child, KeyframeId parent);
  void reassign_children(KeyframeId removed);
  void note_roots();             // that of each keyframe
  void make_root(KeyframeId k);  // makes k the root of its submap

  std::shared_ptr<const camera::Rig> rig_, given_rig_;
  std::shared_ptr<const Eigen::MatrixXd> rig_deviation_;
  feature::PyramidShape pyramid_;
  MapVersion version_{0};
  Scale scale_ = Scale::kMetric;
  double scale_deviation_ = 0;
  int gauge_epoch_ = 0;
  std::uint64_t num_merges_ = 0;  // of submaps
  CowOwner owner_;
  CowVector<BundledKeyframe, 1> keyframes_;
  static constexpr std::size_t kLandmarksPerChunk = ObservationColumn::kBlock;  // number of landmarks per chunk
  CowVector<Landmark, kLandmarksPerChunk> landmarks_;
  CowVector<LandmarkId, 64> merged_into_;
  ObservationColumn observations_;
  std::size_t alive_keyframes_ = 0, alive_landmarks_ = 0, observations_total_ = 0;
  std::shared_ptr<const MappedFile> file_;
  std::size_t next_chunk_to_free_ = 0;        // next block of landmarks that free_removed visits
  std::size_t next_keyframe_to_release_ = 0;  // next keyframe that release_unused visits
};

using MapSnapshot = std::shared_ptr<const BundledMap>;

}  // namespace bslam::map
