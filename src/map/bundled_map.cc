#include "map/bundled_map.h"

#include <algorithm>
#include <map>

#include "base/assert.h"

namespace bslam::map {
namespace {

// Motion of the rig from the keyframe's time to the capture time of camera c's image.
geometry::SE3 motion_of(const BundledKeyframe& k, CameraIndex c) {
  const double delay = k.frame->delay_s(c.index());
  return delay == 0.0 ? geometry::SE3() : geometry::SE3::exp(delay * k.twist);
}

}  // namespace

std::string_view scale_name(Scale scale) {
  switch (scale) {
    case Scale::kMetric:
      return "metric";
    case Scale::kUpToScale:
      return "up-to-scale";
    case Scale::kUnobservable:
      return "unobservable";
  }
  return "";
}

std::vector<KeyframeId> BundledMap::keyframe_ids() const {
  std::vector<KeyframeId> ids;
  ids.reserve(alive_keyframes_);
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (keyframes_[i].alive) ids.emplace_back(i);
  }
  return ids;
}

std::vector<LandmarkId> BundledMap::landmark_ids() const {
  std::vector<LandmarkId> ids;
  ids.reserve(alive_landmarks_);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (landmarks_[i].alive) ids.emplace_back(i);
  }
  return ids;
}

KeyframeId BundledMap::newest_keyframe() const {
  for (std::size_t i = keyframes_.size(); i-- > 0;) {
    if (keyframes_[i].alive) return KeyframeId(i);
  }
  return {};
}

std::vector<KeyframeId> BundledMap::roots() const {
  std::vector<KeyframeId> out;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (keyframes_[i].alive && !keyframes_[i].parent.valid()) out.emplace_back(i);
  }
  return out;
}

KeyframeId BundledMap::nearest_alive_ancestor(KeyframeId k) const {
  while (k.valid() && !keyframe(k).alive) k = keyframe(k).parent;
  return k;
}

LandmarkId BundledMap::resolve(LandmarkId l) const {
  while (l.valid() && l.index() < landmarks_.size()) {
    if (landmark(l).alive) return l;
    l = merged_into(l);
  }
  return {};
}

geometry::SE3 BundledMap::resolved_pose(KeyframeId k) const {
  const BundledKeyframe* entry = &keyframe(k);
  if (entry->alive) return entry->T_rig_world;
  geometry::SE3 T_rig_ancestor;
  for (; !entry->alive && entry->parent.valid(); entry = &keyframe(entry->parent))
    T_rig_ancestor = T_rig_ancestor * entry->T_rig_parent;
  return T_rig_ancestor * entry->T_rig_world;
}

geometry::SE3 BundledMap::rig_from_cam(const BundledKeyframe& k, CameraIndex c) const {
  const geometry::SE3 T_rig_cam = rig_->moves().empty() ? rig_->rig_from_cam(c.index()) : cam_from_rig(k, c).inverse();
  return k.frame->delay_s(c.index()) == 0.0 ? T_rig_cam : motion_of(k, c).inverse() * T_rig_cam;
}

geometry::SE3 BundledMap::cam_from_rig(const BundledKeyframe& k, CameraIndex c) const {
  return rig_->moves().empty() ? rig_->cam_from_rig(c) : rig_->cam_from_rig_at(c.index(), k.frame->time_ns);
}

camera::Rig BundledMap::rig_of(KeyframeId k) const {
  return frame::rig_of(*rig_, *keyframe(k).frame, keyframe(k).twist);
}

geometry::SE3 BundledMap::motion_until(KeyframeId k, CameraIndex c) const { return motion_of(keyframe(k), c); }

geometry::SE3 BundledMap::cam_from_world(KeyframeId k, CameraIndex c) const {
  const BundledKeyframe& entry = keyframe(k);
  const geometry::SE3 T_cam_rig = cam_from_rig(entry, c);
  if (entry.frame->delay_s(c.index()) == 0.0) return T_cam_rig * entry.T_rig_world;
  return T_cam_rig * motion_of(entry, c) * entry.T_rig_world;
}

geometry::SE3 BundledMap::cam_from_world(KeyframeId k, frame::KeypointRef keypoint) const {
  const Eigen::Vector2f& pixel = keypoints(k, keypoint.camera).pixel[keypoint.keypoint.index()];
  return shutter(k, keypoint.camera).pose_at_row(cam_from_world(k, keypoint.camera), static_cast<double>(pixel.y()));
}

camera::Shutter BundledMap::shutter(KeyframeId k, CameraIndex c) const {
  const BundledKeyframe& entry = keyframe(k);
  return {rig_->camera(c), cam_from_rig(entry, c) * motion_of(entry, c), entry.twist};
}

std::vector<BundledMap::ReplacedFrame> BundledMap::set_rig(std::shared_ptr<const camera::Rig> rig,
                                                           std::shared_ptr<const Eigen::MatrixXd> deviation,
                                                           std::span<const ReplacedFrame> known) {
  std::vector<ReplacedFrame> out;
  rig_deviation_ = std::move(deviation);
  const std::shared_ptr<const camera::Rig> before = std::exchange(rig_, std::move(rig));
  if (!frame::changes_frames(*before, *rig_)) return out;
  if (!known.empty()) next_keyframe_to_release_ = 0;  // some of them may have what was released since
  std::map<KeyframeId, std::shared_ptr<const frame::BundledFrame>> frames(known.begin(), known.end());
  for (const KeyframeId k : keyframe_ids()) {
    std::shared_ptr<const frame::BundledFrame>& frame = frames[k];
    if (!frame) {
      frame = std::make_shared<const frame::BundledFrame>(frame::recalibrated(*keyframe(k).frame, *before, *rig_));
    }
    keyframes_.mutate(k.index(), owner_.tag()).frame = frame;
    out.emplace_back(k, frame);
  }
  return out;
}

KeyframeId BundledMap::add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                                    std::span<const std::pair<FeatureId, LandmarkId>> matches,
                                    KeyframeId fallback_parent) {
  const KeyframeId k(keyframes_.size());
  if (!alive(fallback_parent)) fallback_parent = KeyframeId();
  std::vector<LandmarkId> table(frame->bundled.size());
  BundledKeyframe entry;
  entry.twist = frame->twist;
  entry.frame = std::move(frame);
  entry.T_rig_world = T_rig_world;
  entry.alive = true;
  keyframes_.push_back(std::move(entry), owner_.tag());
  ++alive_keyframes_;

  for (const auto& [feature, l] : matches) {
    BSLAM_ASSERT(alive(l) && !table[feature.index()].valid(),
                 "the matches of a new keyframe must be alive and their features distinct");
    const auto list = observations(l);
    BSLAM_ASSERT(list.empty() || list.back().keyframe != k, "the matches of a new keyframe must be distinct landmarks");
    table[feature.index()] = l;
    observations_.insert(l.index(), {k, feature}, owner_.tag());
    observations_total_ += num_keypoints({k, feature});
  }
  edit(k).landmarks = CowArray<LandmarkId>(std::move(table), owner_.tag());
  connect_new_keyframe(k);
  const KeyframeId parent = choose_parent(k, fallback_parent);
  if (!parent.valid()) return k;
  attach(k, parent);
  edit(k).root = {root_of(parent), num_merges_};
  const geometry::SE3 T_rig_parent = keyframe(k).T_rig_world * keyframe(parent).T_rig_world.inverse();
  edit(k).uncertainty = geometry::transported(keyframe(parent).uncertainty, T_rig_parent);
  return k;
}

LandmarkId BundledMap::add_landmark(const Eigen::Vector3d& position, std::span<const Observation> observations,
                                    const LandmarkReference& reference, KeyframeId born) {
  BSLAM_ASSERT(!observations.empty(), "a landmark must have an observation");
  const LandmarkId l(landmarks_.size());
  Landmark entry;
  entry.position = position;
  entry.born = born.valid() ? born : newest_keyframe();
  entry.alive = true;
  entry.reference = reference;
  if (!reference.keyframe.valid()) {
    const Observation first = observations.front();
    entry.reference = {first.keyframe, keyframe(first.keyframe).frame->bundled.keypoints(first.feature).front()};
  }
  landmarks_.push_back(entry, owner_.tag());
  merged_into_.push_back({}, owner_.tag());
  observations_.push_back(owner_.tag());
  ++alive_landmarks_;
  for (const Observation& o : observations) {
    const bool added = add_observation(l, o);
    BSLAM_ASSERT(added, "the keyframes of a new landmark must be alive and distinct, and its features unused");
  }
  refresh_landmark(l);
  return l;
}

bool BundledMap::add_observation(LandmarkId l, Observation o) {
  if (!alive(l) || !alive(o.keyframe) || landmark_of(o.keyframe, o.feature).valid()) return false;
  const auto list = observations(l);
  if (std::ranges::find(list, o.keyframe, &Observation::keyframe) != list.end()) return false;
  link(l, o);
  return true;
}

bool BundledMap::remove_observation(LandmarkId l, KeyframeId k) {
  if (!alive(l)) return false;
  const auto list = observations(l);
  const auto at = std::ranges::find(list, k, &Observation::keyframe);
  if (at == list.end()) return false;
  unlink(l, Observation(*at));
  const auto rest = observations(l);
  if (rest.empty()) {
    mark_removed(l, {});
  } else if (landmark(l).reference.keyframe == k) {
    edit(l).reference = reference_among(rest);
  }
  return true;
}

bool BundledMap::remove_landmark(LandmarkId l) {
  if (!alive(l)) return false;
  while (!observations(l).empty()) unlink(l, Observation(observations(l).back()));
  mark_removed(l, {});
  return true;
}

bool BundledMap::merge_landmarks(LandmarkId from, LandmarkId into) {
  if (!alive(from) || !alive(into) || from == into) return false;
  const auto list = observations(from);
  const std::vector<Observation> moving(list.begin(), list.end());
  for (Observation o : moving) {
    unlink(from, o);
    o.aligned = false;  // it was aligned to the patch of another reference keypoint
    add_observation(into, o);
  }
  add_visibility_counts(into, landmark(from).expected, landmark(from).found);
  mark_removed(from, into);
  return true;
}

bool BundledMap::remove_keyframe(KeyframeId k) {
  if (!alive(k) || !keyframe(k).parent.valid()) return false;
  const CowArray<LandmarkId> table = keyframe(k).landmarks;
  for (const LandmarkId l : table) {
    if (l.valid()) remove_observation(l, k);
  }
  reassign_children(k);
  BundledKeyframe& entry = edit(k);
  const geometry::SE3& T_parent_world = keyframe(entry.parent).T_rig_world;
  entry.T_rig_parent = entry.T_rig_world * T_parent_world.inverse();
  mark_removed(k);
  return true;
}

bool BundledMap::merge_submaps(KeyframeId child, KeyframeId parent) {
  if (!alive(child) || !alive(parent) || root_of(child) == root_of(parent)) return false;
  make_root(child);
  attach(child, parent);
  ++num_merges_;
  return true;
}

bool BundledMap::remove_submap(KeyframeId root) {
  if (!alive(root) || keyframe(root).parent.valid()) return false;
  const std::vector<KeyframeId> submap = keyframes_of_submap(root);
  for (std::size_t i = submap.size(); i-- > 1;) remove_keyframe(submap[i]);  // leaves first
  const CowArray<LandmarkId> table = keyframe(root).landmarks;
  for (const LandmarkId l : table) {
    if (l.valid()) remove_observation(l, root);
  }
  mark_removed(root);
  return true;
}

bool BundledMap::scale_submap(KeyframeId root, double factor) {
  if (!alive(root) || keyframe(root).parent.valid()) return false;
  std::vector<std::uint8_t> inside(keyframes_.size(), 0);
  for (const KeyframeId k : keyframes_of_submap(root)) inside[k.index()] = 1;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const KeyframeId now = nearest_alive_ancestor(KeyframeId(i));
    if (!now.valid() || !inside[now.index()]) continue;
    BundledKeyframe& entry = edit(KeyframeId(i));
    entry.scale *= factor;
    geometry::SE3& T = entry.alive ? entry.T_rig_world : entry.T_rig_parent;
    T = geometry::scaled(T, factor);
    entry.twist = geometry::scaled(entry.twist, factor);
    entry.uncertainty = geometry::scaled(std::move(entry.uncertainty), factor);
  }
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (!landmarks_[i].alive || !inside[landmarks_[i].reference.keyframe.index()]) continue;
    Landmark& entry = edit(LandmarkId(i));
    entry.position *= factor;
    entry.min_distance *= static_cast<float>(factor);
    entry.max_distance *= static_cast<float>(factor);
  }
  begin_gauge_epoch();
  return true;
}

void BundledMap::scale_keyframes(std::span<const std::pair<KeyframeId, double>> factors) {
  std::vector<double> factor_of(keyframes_.size(), 1.0);
  for (const auto& [k, factor] : factors) factor_of[k.index()] = factor;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const KeyframeId now = nearest_alive_ancestor(KeyframeId(i));
    if (!now.valid() || factor_of[now.index()] == 1.0) continue;
    BundledKeyframe& entry = edit(KeyframeId(i));
    entry.scale *= factor_of[now.index()];
    entry.twist = geometry::scaled(entry.twist, factor_of[now.index()]);
    entry.uncertainty = geometry::scaled(std::move(entry.uncertainty), factor_of[now.index()]);
    if (!entry.alive) entry.T_rig_parent = geometry::scaled(entry.T_rig_parent, factor_of[now.index()]);
  }
}

bool BundledMap::set_twist(KeyframeId k, const geometry::Vector6d& twist) {
  if (!alive(k)) return false;
  edit(k).twist = twist;
  return true;
}

bool BundledMap::set_uncertainty(KeyframeId k, geometry::PoseUncertainty uncertainty) {
  if (!alive(k)) return false;
  edit(k).uncertainty = std::move(uncertainty);
  return true;
}

bool BundledMap::set_pose(KeyframeId k, const geometry::SE3& T_rig_world) {
  if (!alive(k)) return false;
  edit(k).T_rig_world = T_rig_world;
  return true;
}

bool BundledMap::set_position(LandmarkId l, const Eigen::Vector3d& position) {
  if (!alive(l)) return false;
  edit(l).position = position;
  return true;
}

bool BundledMap::add_visibility_counts(LandmarkId l, std::uint32_t expected, std::uint32_t found) {
  if (!alive(l)) return false;
  Landmark& entry = edit(l);
  entry.expected += expected;
  entry.found += found;
  return true;
}

void BundledMap::link(LandmarkId l, Observation o) {
  for (const Observation& other : observations(l)) change_weight(o.keyframe, other.keyframe, +1);
  edit(o.keyframe).landmarks.mutate(owner_.tag())[o.feature.index()] = l;
  observations_.insert(l.index(), o, owner_.tag());
  observations_total_ += num_keypoints(o);
}

void BundledMap::unlink(LandmarkId l, Observation o) {
  observations_.erase(l.index(), o, owner_.tag());
  edit(o.keyframe).landmarks.mutate(owner_.tag())[o.feature.index()] = LandmarkId();
  observations_total_ -= num_keypoints(o);
  for (const Observation& other : observations(l)) change_weight(o.keyframe, other.keyframe, -1);
}

std::vector<KeyframeId> BundledMap::keyframes_of_submap(KeyframeId root) const {
  std::vector<KeyframeId> submap = {root};
  for (std::size_t i = 0; i < submap.size(); ++i) {
    const std::vector<KeyframeId>& children = keyframe(submap[i]).children;
    submap.insert(submap.end(), children.begin(), children.end());
  }
  return submap;
}

void BundledMap::mark_removed(KeyframeId k) {
  BundledKeyframe& entry = edit(k);
  entry.frame.reset();
  entry.landmarks.clear();
  entry.covisible.clear();
  entry.alive = false;
  --alive_keyframes_;
}

void BundledMap::mark_removed(LandmarkId l, LandmarkId merged_into) {
  edit(l).alive = false;
  if (merged_into.valid()) merged_into_.mutate(l.index(), owner_.tag()) = merged_into;
  --alive_landmarks_;
}

}  // namespace bslam::map
