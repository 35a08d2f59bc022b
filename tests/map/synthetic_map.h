// Maps made of random keypoints without images, with plausible geometry, for tests and benchmarks of the map.
#pragma once

#include <algorithm>
#include <bit>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "map/map_store.h"

namespace bslam::map {

// `cameras` pinhole cameras of 640 x 480 pixels, 0.1 m apart, each rotated further than the previous one.
inline std::shared_ptr<const camera::Rig> synthetic_rig(std::size_t cameras) {
  std::vector<camera::RigCamera> list;
  for (std::size_t i = 0; i < cameras; ++i) {
    const double x = static_cast<double>(i);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.2 * x, Eigen::Vector3d::UnitY()));
    const camera::Camera camera{"cam" + std::to_string(i), camera::Pinhole({400, 400, 319.5, 239.5}), 640, 480, 0, {}};
    list.push_back({camera, geometry::SE3(turn, Eigen::Vector3d(0.1 * x, 0, 0))});
  }
  return std::make_shared<const camera::Rig>(std::move(list));
}

inline feature::Detections synthetic_keypoints(Random& random, std::size_t count) {
  feature::Detections keypoints;
  keypoints.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    keypoints.pixel.emplace_back(static_cast<float>(random.uniform(0, 639)),
                                 static_cast<float>(random.uniform(0, 479)));
    keypoints.level.push_back(static_cast<std::uint8_t>(random.below(8)));
    keypoints.angle.push_back(static_cast<float>(random.uniform(-3.14, 3.14)));
    keypoints.sigma.push_back(1.0f);
    const Eigen::Vector2f& p = keypoints.pixel.back();
    keypoints.bearing.push_back(Eigen::Vector3d((p.x() - 319.5) / 400, (p.y() - 239.5) / 400, 1).normalized());
    keypoints.descriptor.push_back({random.next(), random.next(), random.next(), random.next()});
    keypoints.patch.emplace_back();
  }
  return keypoints;
}

// Keypoints 0 ... matched - 1 of cameras 0 and 1 form matched features (with the same ids); all others are monocular.
inline std::shared_ptr<const frame::BundledFrame> synthetic_frame(Random& random, std::size_t cameras,
                                                                  std::size_t keypoints, std::size_t matched) {
  auto frame = std::make_shared<frame::BundledFrame>();
  frame->cameras.resize(cameras);
  for (frame::CameraFrame& c : frame->cameras) c.keypoints = synthetic_keypoints(random, keypoints);
  std::vector<std::vector<frame::KeypointRef>> groups;
  for (std::size_t f = 0; cameras > 1 && f < matched; ++f) {
    groups.push_back({{CameraIndex(0), KeypointIndex(f)}, {CameraIndex(1), KeypointIndex(f)}});
  }
  const std::vector<std::size_t> counts(cameras, keypoints);
  const std::vector<std::optional<frame::BundledPoint>> points(groups.size());
  frame->bundled = frame::Bundled(counts, groups, points);
  return frame;
}

inline geometry::SE3 random_pose(Random& random, double spread) {
  geometry::Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-spread, spread);
  return geometry::SE3::exp(xi);
}

inline Eigen::Vector3d random_point(Random& random) {
  return {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(4, 8)};
}

// Hash (FNV-1a) of the complete content of a map, so that maps with equal fingerprints are identical.
class Fingerprint {
 public:
  explicit Fingerprint(const BundledMap& map) {
    add(map.keyframe_slots(), map.landmark_slots(), map.num_keyframes(), map.num_landmarks(), map.num_observations());
    add(map.scale(), map.gauge_epoch());
    for (std::size_t i = 0; i < map.keyframe_slots(); ++i) {
      const BundledKeyframe& k = map.keyframe(KeyframeId(i));
      add(reinterpret_cast<std::uintptr_t>(k.frame.get()), k.alive, k.parent.value());
      add_pose(k.T_rig_world);
      add_pose(k.T_rig_parent);
      for (const LandmarkId l : k.landmarks) add(l.value());
      for (const Covisible& c : k.covisible) add(c.keyframe.value(), c.weight);
      for (const KeyframeId c : k.children) add(c.value());
    }
    for (std::size_t i = 0; i < map.landmark_slots(); ++i) {
      const Landmark& l = map.landmark(LandmarkId(i));
      add_point(l.position);
      add_point(l.view_direction);
      add(std::bit_cast<std::uint32_t>(l.min_distance), std::bit_cast<std::uint32_t>(l.max_distance));
      for (const std::uint64_t word : l.descriptor) add(word);
      add(l.reference.keyframe.value(), l.reference.keypoint.camera.value(), l.reference.keypoint.keypoint.value());
      add(l.born.value(), l.expected, l.found, l.alive, map.merged_into(LandmarkId(i)).value());
      for (const Observation& o : map.observations(LandmarkId(i)))
        add(o.keyframe.value(), o.feature.value(), o.aligned);
    }
  }
  friend bool operator==(const Fingerprint&, const Fingerprint&) = default;

 private:
  template <class... Values>
  void add(Values... values) {
    ((hash_ = (hash_ ^ static_cast<std::uint64_t>(values)) * 1099511628211u), ...);
  }
  void add_point(const Eigen::Vector3d& p) {
    for (int i = 0; i < 3; ++i) add(std::bit_cast<std::uint64_t>(p[i]));
  }
  void add_pose(const geometry::SE3& T) {
    add_point(T.translation());
    for (int i = 0; i < 4; ++i) add(std::bit_cast<std::uint64_t>(T.rotation().coeffs()[i]));
  }
  std::uint64_t hash_ = 14695981039346656037u;
};

// Makes random changes of every kind in a draft.
class RandomEditor {
 public:
  explicit RandomEditor(std::uint64_t seed) : random_(seed, "random editor") {
    for (int i = 0; i < 8; ++i) frames_.push_back(synthetic_frame(random_, 2, 40, 15));
  }

  void change(MapDraft& draft) {
    if (draft.map().num_keyframes() < 3) return add_keyframe(draft);
    switch (random_.below(18)) {
      case 0:
        return draft.map().num_keyframes() < 25 ? add_keyframe(draft) : remove_keyframe(draft);
      case 1:
        return draft.map().num_keyframes() > 12 ? remove_keyframe(draft) : add_keyframe(draft);
      case 2:
      case 3:
      case 4:
      case 5:
        return add_landmark(draft);
      case 6:
      case 7:
      case 8:
      case 9:
        draft.add_observation(landmark(draft), {keyframe(draft), feature(), random_.below(2) == 0});
        return;
      case 10:
      case 11:
        return remove_observation(draft);
      case 12:
        draft.remove_landmark(landmark(draft));
        return;
      case 13:
        draft.merge_landmarks(landmark(draft), landmark(draft));
        return;
      case 14:
        return set_poses(draft);
      case 15:
        draft.merge_submaps(keyframe(draft), keyframe(draft));
        return;
      case 16:
        return remove_submap(draft);
      default:
        draft.add_visibility_counts({{landmark(draft), 3, 2}, {landmark(draft), 1, 1}});
        draft.refresh_landmarks({landmark(draft), landmark(draft)});
        draft.set_twists({{keyframe(draft), random_.normal() * geometry::Vector6d::Ones()}});
        return;
    }
  }

 private:
  KeyframeId keyframe(const MapDraft& draft) {
    return KeyframeId(std::size_t{random_.below(static_cast<std::uint32_t>(draft.map().keyframe_slots()))});
  }
  // Mostly recent ones, since most old ones were removed; invalid if there is none.
  LandmarkId landmark(const MapDraft& draft) {
    const std::size_t slots = draft.map().landmark_slots();
    if (slots == 0) return {};
    return LandmarkId(slots - 1 - random_.below(static_cast<std::uint32_t>(std::min<std::size_t>(slots, 150))));
  }
  FeatureId feature() { return FeatureId(std::size_t{random_.below(65)}); }

  void add_keyframe(MapDraft& draft) {
    std::vector<std::pair<FeatureId, LandmarkId>> matches;
    for (int i = 0; i < 20; ++i) matches.emplace_back(feature(), landmark(draft));
    KeyframeId fallback = draft.map().newest_keyframe();
    if (random_.below(4) == 0) {  // often the first of a new submap; its parent may be removed
      matches.clear();
      fallback = random_.below(2) == 0 && fallback.valid() ? keyframe(draft) : KeyframeId();
    }
    draft.add_keyframe(frames_[random_.below(8)], random_pose(random_, 1), std::move(matches), fallback);
  }
  void remove_keyframe(MapDraft& draft) { draft.remove_keyframe(keyframe(draft)); }
  void remove_submap(MapDraft& draft) {  // the newest one, if there are several
    const std::vector<KeyframeId> roots = draft.map().roots();
    if (roots.size() > 1) draft.remove_submap(roots.back());
  }
  void add_landmark(MapDraft& draft) {
    std::vector<Observation> observations;
    for (int i = 0; i < 4; ++i) {
      const Observation o{keyframe(draft), feature()};
      bool usable = draft.map().alive(o.keyframe) && !draft.map().landmark_of(o.keyframe, o.feature).valid();
      for (const Observation& other : observations) usable &= other.keyframe != o.keyframe;
      if (usable) observations.push_back(o);
    }
    if (!observations.empty()) draft.add_landmark(random_point(random_), observations);
  }
  void remove_observation(MapDraft& draft) {
    const LandmarkId l = landmark(draft);
    if (!draft.map().alive(l)) return;
    const auto list = draft.map().observations(l);
    draft.remove_observation(l, list[random_.below(static_cast<std::uint32_t>(list.size()))].keyframe);
  }
  void set_poses(MapDraft& draft) {
    SetPoses poses;
    for (int i = 0; i < 4; ++i) {
      poses.keyframes.emplace_back(keyframe(draft), random_pose(random_, 1));
      poses.landmarks.emplace_back(landmark(draft), random_point(random_));
    }
    poses.correction = random_.below(4) == 0;
    draft.set_poses(std::move(poses));
  }

  Random random_;
  std::vector<std::shared_ptr<const frame::BundledFrame>> frames_;
};

}  // namespace bslam::map
