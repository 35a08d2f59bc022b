// The paper's BundledMap: keyframes, landmarks, covisibility graph and spanning trees: one for every part that no place
// seen twice has joined to another yet. A value: copying it shares all
// chunks and costs microseconds; changing a copy detaches only the chunks it touches. Published versions are const, so
// a reader may keep one for as long as it likes. ARCHITECTURE.md tells who may change what. References and spans into a
// copy that is being changed are valid until its next change.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/id.h"
#include "camera/rig.h"
#include "feature/feature_model.h"
#include "map/bundled_keyframe.h"
#include "map/cow_vector.h"
#include "map/landmark.h"
#include "map/observation_column.h"

namespace bslam::map {

// kUnobservable: the rig could tell the length of the map's unit, and its motion has not allowed it so far.
enum class Scale { kMetric, kUpToScale, kUnobservable };

class BundledMap {
 public:
  explicit BundledMap(std::shared_ptr<const camera::Rig> rig, feature::PyramidShape pyramid = {})
      : rig_(std::move(rig)), pyramid_(pyramid) {}

  // ---- reading
  const camera::Rig& rig() const { return *rig_; }
  // The pyramid keypoints were found on.
  const feature::PyramidShape& pyramid() const { return pyramid_; }
  MapVersion version() const { return version_; }
  Scale scale() const { return scale_; }
  // Relative standard deviation of the length of the map's unit; 0 where cameras that overlap know it, infinite where
  // nothing is known.
  double scale_deviation() const { return scale_deviation_; }
  // Counts corrections (loops closed, global adjustments): positions of different epochs do not mix.
  int gauge_epoch() const { return gauge_epoch_; }

  // Slots include removed ones; ids are slot numbers and never reused.
  std::size_t keyframe_slots() const { return keyframes_.size(); }
  std::size_t landmark_slots() const { return landmarks_.size(); }
  std::size_t num_keyframes() const { return alive_keyframes_; }
  std::size_t num_landmarks() const { return alive_landmarks_; }
  std::size_t num_observations() const { return observations_total_; }  // keypoints, not features
  bool alive(KeyframeId k) const { return k.valid() && k.index() < keyframes_.size() && keyframes_[k.index()].alive; }
  bool alive(LandmarkId l) const { return l.valid() && l.index() < landmarks_.size() && landmarks_[l.index()].alive; }

  const BundledKeyframe& keyframe(KeyframeId k) const { return keyframes_[k.index()]; }  // also removed ones
  const Landmark& landmark(LandmarkId l) const {
    return landmarks_[l.index()];
  }  // of removed ones `alive` alone means something
  LandmarkId merged_into(LandmarkId l) const {
    return merged_into_[l.index()];
  }  // of removed ones; invalid where it was not
  std::span<const Observation> observations(LandmarkId l) const {
    return observations_[l.index()];
  }  // in order of keyframe
  LandmarkId landmark_of(KeyframeId k, FeatureId f) const { return keyframes_[k.index()].landmarks[f.index()]; }

  // Alive ids in ascending order.
  std::vector<KeyframeId> keyframe_ids() const;
  std::vector<LandmarkId> landmark_ids() const;
  KeyframeId newest_keyframe() const;  // invalid in an empty map
  // Roots of the parts of the map, in ascending order; and that of the part an alive keyframe belongs to.
  std::vector<KeyframeId> roots() const;
  KeyframeId root_of(KeyframeId k) const;
  // Alive keyframes of the part with this root, parents before children.
  std::vector<KeyframeId> part_of(KeyframeId root) const;
  // The keyframe or, where it was removed, the nearest ancestor that is alive; invalid where its part was removed.
  KeyframeId surviving(KeyframeId k) const;

  // Follows merges; invalid where the landmark was removed.
  LandmarkId resolve(LandmarkId l) const;
  // T_rig_world of a keyframe, alive or removed (then carried by its parent).
  geometry::SE3 resolved_pose(KeyframeId k) const;

  // The rig as it stood while a keyframe was taken, and how it moved from the time of the keyframe to that of camera
  // c's image (the identity where they are one).
  camera::Rig rig_of(KeyframeId k) const;
  geometry::SE3 motion_until(KeyframeId k, CameraIndex c) const;
  // Pose of a keyframe's camera at the time of its own image.
  geometry::SE3 cam_from_world(KeyframeId k, CameraIndex c) const;

  // Covisible keyframes by falling weight (ties: newer first), at most `limit` with at least `min_weight`.
  std::vector<Covisible> best_covisible(KeyframeId k, std::size_t limit, int min_weight = 1) const;

  // Pixel, level and patch owner of one keypoint of a keyframe.
  const feature::Keypoints& keypoints(KeyframeId k, CameraIndex c) const { return keyframe(k).frame->keypoints(c); }

  // First broken rule in words, or nothing. Rules: observations and keyframes' landmark tables mirror one another; no
  // alive landmark without observations or observed by a removed keyframe, no feature twice; the reference is one of
  // the landmark's observations; covisibility is symmetric, its weights are the shared landmarks; the spanning trees
  // hold all alive keyframes, parents alive or root; counters are right.
  std::optional<std::string> check_invariants() const;

  // ---- changing (on a private copy only). Functions that return bool change nothing and return false where the
  // landmark or keyframe they name is not alive, or for the reason they give.
  void set_scale(Scale scale) {
    set_scale(scale, scale == Scale::kMetric ? 0.0 : std::numeric_limits<double>::infinity());
  }
  void set_scale(Scale scale, double deviation) {
    scale_ = scale;
    scale_deviation_ = deviation;
  }
  void set_version(MapVersion v) { version_ = v; }
  // The same cameras with other extrinsics; poses and landmarks stay where they are.
  void set_rig(std::shared_ptr<const camera::Rig> rig) { rig_ = std::move(rig); }
  void begin_gauge_epoch() { ++gauge_epoch_; }

  // Appends a keyframe observing the given landmarks (alive, distinct features, distinct landmarks); its parent becomes
  // the keyframe with which it shares most (ties: newer), else `fallback_parent`; where that is not alive it becomes
  // the root of a new part.
  KeyframeId add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                          std::span<const std::pair<FeatureId, LandmarkId>> matches, KeyframeId fallback_parent);
  // Appends a landmark with one or more observations (keyframes distinct and alive, features free); the first keypoint
  // of the first is the reference unless another is named (keyframe valid). It is born with the newest keyframe unless
  // another is named. Calls refresh_landmark.
  LandmarkId add_landmark(const Eigen::Vector3d& position, std::span<const Observation> observations,
                          const LandmarkReference& reference = {}, KeyframeId born = {});
  // False also where the keyframe observes the landmark already or the feature is taken.
  bool add_observation(LandmarkId l, Observation o);
  // Where the last observation goes, the landmark goes; where the reference goes, the first keypoint of the oldest
  // remaining observation follows it. False also where the keyframe does not observe the landmark.
  bool remove_observation(LandmarkId l, KeyframeId k);
  bool remove_landmark(LandmarkId l);
  // `from` ends in `into`: observations move (where the keyframe has none of `into` yet), counters add. False also
  // where the two are one.
  bool merge_landmarks(LandmarkId from, LandmarkId into);
  // Its observations go, children get the best of their covisible keyframes as parent that keeps a tree. False also for
  // the root.
  bool remove_keyframe(KeyframeId k);
  // Hangs the part of `child` under `parent`, `child` becoming the root of its part first. False also where both are of
  // one part already.
  bool join_parts(KeyframeId child, KeyframeId parent);
  // All keyframes and landmarks of a part go. False where `root` is none.
  bool remove_part(KeyframeId root);
  // All lengths of a part become `factor` times as long, about the origin, those of its removed keyframes too; begins a
  // gauge epoch. False where `root` is none.
  bool scale_part(KeyframeId root, double factor);
  bool set_pose(KeyframeId k, const geometry::SE3& T_rig_world);
  bool set_twist(KeyframeId k, const geometry::Vector6d& twist);
  bool set_position(LandmarkId l, const Eigen::Vector3d& position);
  bool add_sightings(LandmarkId l, std::uint32_t expected, std::uint32_t found);
  // Recomputes view direction, distance range and descriptor from the observations.
  bool refresh_landmark(LandmarkId l);
  // Gives up the memory of removed landmarks among the next `slots` of a round over all slots, where no neighbour that
  // shares it is alive.
  void free_removed(std::size_t slots);

 private:
  BundledKeyframe& edit(KeyframeId k) { return keyframes_.mutate(k.index(), owner_.tag()); }
  Landmark& edit(LandmarkId l) { return landmarks_.mutate(l.index(), owner_.tag()); }
  geometry::SE3 rig_from_cam(const BundledKeyframe& k, CameraIndex c) const;
  std::size_t num_keypoints(Observation o) const {
    return keyframe(o.keyframe).frame->bundled.keypoints(o.feature).size();
  }

  // bundled_map.cc. `link` and `unlink` keep list, table, counter and covisibility in step; nothing else does.
  void link(LandmarkId l, Observation o);
  void unlink(LandmarkId l, Observation o);
  void let_go(KeyframeId k);                        // without observations and children left
  void bury(LandmarkId l, LandmarkId merged_into);  // without observations left

  // covisibility.cc
  void change_weight(KeyframeId a, KeyframeId b, int change);
  void change_half_weight(KeyframeId at, KeyframeId neighbour, int change);
  void connect_new_keyframe(KeyframeId k);  // the newest: weights from its landmark table, on both sides
  KeyframeId choose_parent(KeyframeId k, KeyframeId fallback) const;
  void attach(KeyframeId child, KeyframeId parent);
  void hand_over_children(KeyframeId removed);
  void make_root(KeyframeId k);  // of its part

  std::shared_ptr<const camera::Rig> rig_;
  feature::PyramidShape pyramid_;
  MapVersion version_{0};
  Scale scale_ = Scale::kMetric;
  double scale_deviation_ = 0;
  int gauge_epoch_ = 0;
  CowOwner owner_;
  CowVector<BundledKeyframe, 1> keyframes_;
  static constexpr std::size_t kGroup = ObservationColumn::kBlock;  // landmarks that share a chunk
  CowVector<Landmark, kGroup> landmarks_;
  CowVector<LandmarkId, 64> merged_into_;
  ObservationColumn observations_;
  std::size_t alive_keyframes_ = 0, alive_landmarks_ = 0, observations_total_ = 0;
  std::size_t freed_up_to_ = 0;  // group of landmarks free_removed goes on with
};

using MapSnapshot = std::shared_ptr<const BundledMap>;

}  // namespace bslam::map
