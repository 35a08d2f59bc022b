#include "map/rebase.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>

namespace bslam::map {
namespace {

using geometry::SE3;

// Motion of poses and points attached to a keyframe when its T_rig_world changes from `before` to `after` and lengths
// around it are multiplied by `scale_change`: they keep their pose or position relative to the keyframe.
struct Move {
  SE3 before, after;
  double scale_change = 1.0;
  SE3 pose(const SE3& T_rig_world) const {
    const SE3 T_rig_keyframe = T_rig_world * before.inverse();
    return geometry::scaled(T_rig_keyframe, scale_change) * after;
  }
  Eigen::Vector3d point(const Eigen::Vector3d& position) const {
    return after.inverse() * (scale_change * (before * position));
  }
};

// Empty if nothing moves, so that unmoved poses and points stay bit-identical.
using Motion = std::optional<Move>;

Motion motion_between(const SE3& before, const SE3& after, double scale_change = 1.0) {
  const bool still =
      before.rotation().coeffs() == after.rotation().coeffs() && before.translation() == after.translation();
  if (still && scale_change == 1.0) return {};
  return Move{before, after, scale_change};
}

class Rebase {
 public:
  Rebase(const MapEdit& edit, BundledMap& map)
      : base_(*edit.base),
        map_(map),
        others_keyframes_end_(map.keyframe_slots()),
        others_landmarks_end_(map.landmark_slots()),
        same_epoch_(edit.base->gauge_epoch() == map.gauge_epoch()) {}

  // Each overload applies one operation and returns false if it is dropped.
  bool operator()(const AddKeyframe& op);
  bool operator()(const AddLandmark& op);
  bool operator()(const AddObservation& op) {
    Observation observation = op.observation;
    observation.keyframe = map_id(observation.keyframe);
    return map_.add_observation(forward(op.landmark), observation);
  }
  bool operator()(const RemoveObservation& op) {
    return map_.remove_observation(map_id(op.landmark), map_id(op.keyframe));
  }
  bool operator()(const RemoveLandmark& op);
  bool operator()(const MergeLandmarks& op) { return map_.merge_landmarks(forward(op.from), forward(op.into)); }
  bool operator()(const RemoveKeyframe& op) { return map_.remove_keyframe(map_id(op.keyframe)); }
  bool operator()(const MergeSubmaps& op) {
    return map_.merge_submaps(map_.nearest_alive_ancestor(map_id(op.child)),
                              map_.nearest_alive_ancestor(map_id(op.parent)));
  }
  bool operator()(const RemoveSubmap& op) { return map_.remove_submap(map_id(op.root)); }
  bool operator()(const ScaleSubmap& op) { return map_.scale_submap(map_id(op.root), op.factor); }
  bool operator()(const SetPoses& op);
  bool operator()(const SetTwists& op);
  bool operator()(const CorrectTimes& op);
  bool operator()(const AddVisibilityCounts& op);
  bool operator()(const RefreshLandmarks& op);
  bool operator()(const SetScale& op);
  bool operator()(const SetRig& op) { return map_.set_rig(op.rig, op.deviation, op.frames), true; }

  RebaseReport take_report() && { return std::move(report_); }
  void count(bool was_applied) { ++(was_applied ? report_.applied : report_.dropped); }

 private:
  // Converts ids of the edit to ids of the map: things that the edit added may get other ids at commit, or none.
  KeyframeId map_id(KeyframeId k) const { return own(k) ? report_.keyframes[k.index() - base_.keyframe_slots()] : k; }
  LandmarkId map_id(LandmarkId l) const {
    if (!l.valid() || l.index() < base_.landmark_slots()) return l;
    return report_.landmarks[l.index() - base_.landmark_slots()];
  }
  LandmarkId forward(LandmarkId l) const { return map_.resolve(map_id(l)); }
  bool own(KeyframeId k) const { return k.valid() && k.index() >= base_.keyframe_slots(); }

  bool newer(KeyframeId k) const { return k.index() >= base_.keyframe_slots() && k.index() < others_keyframes_end_; }

  Motion motion_since_base(KeyframeId edit_id) const;
  // Moves newer keyframes and landmarks with the keyframes in `motions`. Returns the factors by which lengths about the
  // newer keyframes change.
  std::vector<std::pair<KeyframeId, double>> move_newer(const std::unordered_map<KeyframeId, Motion>& motions);

  const BundledMap& base_;
  BundledMap& map_;
  // number of slots before the edit; higher ids were added by the edit itself
  const std::size_t others_keyframes_end_, others_landmarks_end_;
  const bool same_epoch_;                   // no correction by others since the base
  std::vector<Motion> own_motions_;         // motion of each keyframe the edit added, computed at its addition
  std::unordered_set<KeyframeId> written_;  // keyframes whose pose the edit has set; ids of the edit
  RebaseReport report_;
};

// Returns the motion of a keyframe by other edits since the edit's base. Poses set by the edit itself have not moved.
Motion Rebase::motion_since_base(KeyframeId edit_id) const {
  if (!edit_id.valid() || written_.contains(edit_id)) return {};
  if (own(edit_id)) return own_motions_[edit_id.index() - base_.keyframe_slots()];
  const double scale_change = map_.keyframe(edit_id).scale / base_.keyframe(edit_id).scale;
  return motion_between(base_.resolved_pose(edit_id), map_.resolved_pose(edit_id), scale_change);
}

bool Rebase::operator()(const SetScale& op) {
  for (std::size_t k = base_.keyframe_slots(); op.scale == Scale::kMetric && k < others_keyframes_end_; ++k) {
    if (map_.alive(KeyframeId(k)) && !map_.keyframe(KeyframeId(k)).parent.valid()) return false;
  }
  map_.set_scale(op.scale, op.deviation);
  return true;
}

bool Rebase::operator()(const AddKeyframe& op) {
  std::vector<std::pair<FeatureId, LandmarkId>> matches = op.matches;
  for (auto& [feature, l] : matches) l = map_id(l);
  const Motion motion = motion_since_base(op.parent);
  const SE3 T_rig_world = motion ? motion->pose(op.T_rig_world) : op.T_rig_world;
  const KeyframeId parent = map_.nearest_alive_ancestor(map_id(op.parent));
  auto frame = op.frame;
  if (frame::changes_frames(base_.rig(), map_.rig()))
    frame = std::make_shared<const frame::BundledFrame>(frame::recalibrated(*frame, base_.rig(), map_.rig()));
  const KeyframeId added = map_.add_keyframe(std::move(frame), T_rig_world, usable_matches(map_, matches), parent);
  if (motion) map_.set_twist(added, geometry::scaled(op.frame->twist, motion->scale_change));
  report_.keyframes.push_back(added);
  own_motions_.push_back(motion);
  return true;
}

bool Rebase::operator()(const AddLandmark& op) {
  std::vector<Observation> observations;
  LandmarkReference reference;
  for (Observation o : op.observations) {
    const bool has_reference = o.keyframe == op.reference.keyframe;
    o.keyframe = map_id(o.keyframe);
    if (!map_.alive(o.keyframe) || map_.landmark_of(o.keyframe, o.feature).valid()) continue;
    observations.push_back(o);
    if (has_reference) reference = {o.keyframe, op.reference.keypoint};
  }
  if (observations.empty()) {
    report_.landmarks.emplace_back();
    return false;
  }
  const Motion motion = motion_since_base(op.reference.keyframe);
  const Eigen::Vector3d position = motion ? motion->point(op.position) : op.position;
  report_.landmarks.push_back(map_.add_landmark(position, observations, reference));
  return true;
}

bool Rebase::operator()(const RemoveLandmark& op) {
  const LandmarkId l = map_id(op.landmark);
  if (!map_.alive(l)) return false;
  for (const Observation& o : map_.observations(l)) {
    if (newer(o.keyframe)) return false;
  }
  return map_.remove_landmark(l);
}

bool Rebase::operator()(const SetPoses& op) {
  if (!same_epoch_) return false;
  bool any = false;
  std::unordered_map<KeyframeId, double> scale_changes;  // by id of the map, like `motions`
  for (const auto& [edit_id, factor] : op.scale_changes) scale_changes[map_id(edit_id)] = factor;
  std::unordered_map<KeyframeId, Motion> motions;
  for (const auto& [edit_id, T_rig_world] : op.keyframes) {
    const KeyframeId k = map_id(edit_id);
    if (!map_.alive(k)) continue;
    const auto scale_change = scale_changes.find(k);
    motions[k] = motion_between(map_.keyframe(k).T_rig_world, T_rig_world,
                                scale_change == scale_changes.end() ? 1.0 : scale_change->second);
    written_.insert(edit_id);
    any |= map_.set_pose(k, T_rig_world);
  }
  for (const auto& [edit_id, factor] : op.scale_changes) {  // keyframes that are rescaled where they are
    const KeyframeId k = map_id(edit_id);
    if (!map_.alive(k) || motions.contains(k)) continue;
    motions[k] = motion_between(map_.keyframe(k).T_rig_world, map_.keyframe(k).T_rig_world, factor);
    written_.insert(edit_id);
  }
  for (const auto& [edit_id, position] : op.landmarks) any |= map_.set_position(map_id(edit_id), position);
  for (const auto& [edit_id, uncertainty] : op.uncertainties) map_.set_uncertainty(map_id(edit_id), uncertainty);
  if (op.correction && any) map_.begin_gauge_epoch();
  std::vector<std::pair<KeyframeId, double>> scaled = move_newer(motions);
  for (const auto& [k, factor] : scale_changes) {
    if (map_.alive(k)) scaled.emplace_back(k, factor);
  }
  if (!scaled.empty()) map_.scale_keyframes(scaled);
  return any;
}

// Newer keyframes inherit the motion of their nearest ancestor that is not newer: since each one keeps its pose
// relative to its parent, T_rig_world_new = T_rig_parent * T_parent_world_new, the motion is the same along the whole
// chain. Newer landmarks inherit the motion of the keyframe of their reference.
std::vector<std::pair<KeyframeId, double>> Rebase::move_newer(const std::unordered_map<KeyframeId, Motion>& motions) {
  const auto motion_of = [&](KeyframeId k) -> Motion {
    while (newer(k)) k = map_.keyframe(k).parent;
    const auto entry = motions.find(k);
    return entry == motions.end() ? Motion() : entry->second;
  };
  std::vector<std::pair<KeyframeId, double>> scaled;
  for (std::size_t i = base_.keyframe_slots(); i < others_keyframes_end_; ++i) {
    const KeyframeId k(i);
    if (!map_.alive(k)) continue;
    const Motion motion = motion_of(k);
    if (!motion) continue;
    map_.set_pose(k, motion->pose(map_.keyframe(k).T_rig_world));
    if (motion->scale_change != 1.0) scaled.emplace_back(k, motion->scale_change);
  }
  for (std::size_t i = base_.landmark_slots(); i < others_landmarks_end_; ++i) {
    const LandmarkId l(i);
    if (!map_.alive(l)) continue;
    const Motion motion = motion_of(map_.landmark(l).reference.keyframe);
    if (!motion) continue;
    map_.set_position(l, motion->point(map_.landmark(l).position));
    map_.refresh_landmark(l);
  }
  return scaled;
}

bool Rebase::operator()(const SetTwists& op) {
  bool any = false;
  for (const auto& [edit_id, twist] : op.keyframes) {
    const Motion motion = motion_since_base(edit_id);
    any |= map_.set_twist(map_id(edit_id), geometry::scaled(twist, motion ? motion->scale_change : 1.0));
  }
  return any;
}

bool Rebase::operator()(const CorrectTimes& op) {
  if (!same_epoch_) return false;  // like the poses with which the times were estimated
  bool any = false;
  for (CaptureTime change : op.changes) {
    change.keyframe = map_id(change.keyframe);
    any |= map_.correct_time(change);
  }
  return any;
}

bool Rebase::operator()(const AddVisibilityCounts& op) {
  bool any = false;
  for (const VisibilityCount& s : op.visibility_counts)
    any |= map_.add_visibility_counts(forward(s.landmark), s.expected, s.found);
  return any;
}

bool Rebase::operator()(const RefreshLandmarks& op) {
  bool any = false;
  for (const LandmarkId l : op.landmarks) any |= map_.refresh_landmark(forward(l));
  return any;
}

}  // namespace

std::vector<std::pair<FeatureId, LandmarkId>> usable_matches(
    const BundledMap& map, std::span<const std::pair<FeatureId, LandmarkId>> matches) {
  std::vector<std::pair<FeatureId, LandmarkId>> usable;
  std::unordered_set<FeatureId> features;
  std::unordered_set<LandmarkId> landmarks;
  for (const auto& [feature, l] : matches) {
    const LandmarkId resolved = map.resolve(l);
    if (!resolved.valid() || features.contains(feature) || landmarks.contains(resolved)) continue;
    features.insert(feature);
    landmarks.insert(resolved);
    usable.emplace_back(feature, resolved);
  }
  return usable;
}

RebaseReport rebase(const MapEdit& edit, BundledMap& onto) {
  Rebase step(edit, onto);
  for (const Operation& operation : edit.operations) step.count(std::visit(step, operation));
  return std::move(step).take_report();
}

}  // namespace bslam::map
