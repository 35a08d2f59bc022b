#include "map/append_map.h"

#include <memory>
#include <utility>

#include "base/assert.h"
#include "map/rigs_of_map.h"

namespace bslam::map {
namespace {

// Converts frames with the cameras of one map to those of another one.
class CameraChange {
 public:
  CameraChange(BundledMap& onto, const BundledMap& other)
      : before_(other.shared_rig()), camera_(find_or_append_rigs(onto, other)), num_cameras_(onto.rig().size()) {
    std::vector<camera::RigCamera> calibration;
    for (const CameraIndex c : camera_)
      calibration.push_back({onto.rig().camera(c), onto.rig().body_from_cam(c.index())});
    after_ = std::make_shared<const camera::Rig>(std::move(calibration));
  }

  frame::KeypointRef operator()(frame::KeypointRef r) const { return {camera_[r.camera.index()], r.keypoint}; }

  std::shared_ptr<const frame::BundledFrame> operator()(const std::shared_ptr<const frame::BundledFrame>& frame) const {
    const bool recalibrate = frame::changes_frames(*before_, *after_);
    if (!recalibrate && is_identity()) return frame;
    frame::BundledFrame out = recalibrate ? frame::recalibrated(*frame, *before_, *after_) : *frame;
    std::vector<frame::CameraFrame> source(num_cameras_);
    source.swap(out.cameras);
    std::vector<std::size_t> counts(num_cameras_, 0);
    for (std::size_t c = 0; c < camera_.size(); ++c) {
      if (source[c].state == image::ImageState::kMissing && source[c].keypoints.empty()) continue;
      counts[camera_[c].index()] = source[c].keypoints.size();
      out.cameras[camera_[c].index()] = std::move(source[c]);
    }
    out.bundled = changed(out.bundled, counts);
    return std::make_shared<const frame::BundledFrame>(std::move(out));
  }

 private:
  bool is_identity() const {
    for (std::size_t c = 0; c < camera_.size(); ++c) {
      if (camera_[c] != CameraIndex(c)) return false;
    }
    return camera_.size() == num_cameras_;
  }

  frame::Bundled changed(const frame::Bundled& bundled, const std::vector<std::size_t>& counts) const {
    std::vector<std::vector<frame::KeypointRef>> matched(bundled.num_matched());
    std::vector<std::optional<frame::BundledPoint>> points;
    for (std::size_t f = 0; f < matched.size(); ++f) {
      for (const frame::KeypointRef r : bundled.keypoints(FeatureId(f))) matched[f].push_back((*this)(r));
      points.push_back(bundled.point(FeatureId(f)));
    }
    return {counts, matched, points};
  }

  std::shared_ptr<const camera::Rig> before_, after_;  // both with the cameras of the other map
  // For each camera of the appended map: its index in the map to which it is appended.
  std::vector<CameraIndex> camera_;
  std::size_t num_cameras_ = 0;
};

void append_keyframes(BundledMap& onto, const BundledMap& other, const CameraChange& change, AppendedIds& ids) {
  const KeyframeId first(onto.keyframe_slots());
  const std::vector<KeyframeId> sources = other.keyframe_ids();
  for (const KeyframeId k : sources) {
    const BundledKeyframe& source = other.keyframe(k);
    ids.keyframes[k.index()] = onto.add_keyframe(change(source.frame), source.T_rig_world, {}, {});
    onto.set_twist(ids.keyframes[k.index()], source.twist);
    onto.set_uncertainty(ids.keyframes[k.index()], source.uncertainty);
  }
  std::vector<KeyframeId> parents;
  for (const KeyframeId k : sources) {
    const KeyframeId parent = other.keyframe(k).parent;
    parents.push_back(parent.valid() ? ids.keyframes[parent.index()] : KeyframeId());
  }
  const bool attached = attach_keyframes(onto, first, parents);
  BSLAM_ASSERT(attached, "the parent links of a map must form trees");
}

// Returns the new id of `k` or, if `k` was removed, that of the newest older keyframe that is alive; if there is none,
// that of the oldest keyframe.
KeyframeId nearest_older(const AppendedIds& ids, KeyframeId k) {
  for (std::size_t i = k.index() + 1; i-- > 0;) {
    if (ids.keyframes[i].valid()) return ids.keyframes[i];
  }
  for (const KeyframeId id : ids.keyframes) {
    if (id.valid()) return id;
  }
  return {};
}

}  // namespace

bool attach_keyframes(BundledMap& map, KeyframeId first, std::span<const KeyframeId> parents) {
  std::vector<std::size_t> waiting_for(parents.size(), 0);  // number of children not attached yet
  for (const KeyframeId parent : parents) {
    if (parent.valid()) ++waiting_for[parent.index() - first.index()];
  }
  // Attach from the leaves up: every parent is still a root when its children are attached, so finding its root takes
  // one step.
  std::vector<std::size_t> ready;
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (waiting_for[i] == 0) ready.push_back(i);
  }
  for (std::size_t n = 0; n < ready.size(); ++n) {
    const KeyframeId parent = parents[ready[n]];
    if (!parent.valid()) continue;
    map.merge_submaps(KeyframeId(first.index() + ready[n]), parent);
    const std::size_t above = parent.index() - first.index();
    if (--waiting_for[above] == 0) ready.push_back(above);
  }
  return ready.size() == parents.size();
}

AppendedIds append_map(BundledMap& onto, const BundledMap& other) {
  BSLAM_ASSERT(
      onto.pyramid().levels == other.pyramid().levels && onto.pyramid().scale_factor == other.pyramid().scale_factor,
      "both maps must have the same pyramid");
  AppendedIds ids{std::vector<KeyframeId>(other.keyframe_slots()), std::vector<LandmarkId>(other.landmark_slots())};
  const CameraChange change(onto, other);
  append_keyframes(onto, other, change, ids);
  for (const LandmarkId l : other.landmark_ids()) {
    const Landmark& source = other.landmark(l);
    std::vector<Observation> observations;
    for (Observation o : other.observations(l)) {
      o.keyframe = ids.keyframes[o.keyframe.index()];
      observations.push_back(o);
    }
    const LandmarkReference reference{ids.keyframes[source.reference.keyframe.index()],
                                      change(source.reference.keypoint)};
    const LandmarkId added =
        onto.add_landmark(source.position, observations, reference, nearest_older(ids, source.born));
    onto.add_visibility_counts(added, source.expected, source.found);
    ids.landmarks[l.index()] = added;
  }
  return ids;
}

}  // namespace bslam::map
