// Maps for tests of saved maps, built from simulated frames: two submaps, removed keyframes and landmarks, words.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "mapping/simulated_map.h"
#include "storage/map_file.h"

namespace bslam::storage {

struct SmallMapOptions {
  int keyframes = 8;
  int max_keypoints = 60;  // per camera
  int landmarks = 1500;
  std::uint64_t seed = 1;
};

// Adds words to all keypoints; they belong to no vocabulary.
inline std::shared_ptr<const frame::BundledFrame> with_words(frame::BundledFrame frame) {
  for (frame::CameraFrame& c : frame.cameras) {
    std::vector<WordId> words;
    for (const feature::Descriptor& d : c.keypoints.descriptor)
      words.emplace_back(static_cast<std::int32_t>(d[0] % 1000));
    c.words = std::move(words);
  }
  return std::make_shared<const frame::BundledFrame>(std::move(frame));
}

// The last two keyframes are a separate submap, in which camera 1 has no image.
inline map::BundledMap small_map(camera::Rig rig, const SmallMapOptions& options = {}) {
  synthetic::FeatureSimulatorOptions simulation;
  simulation.landmarks = options.landmarks;
  simulation.max_keypoints = options.max_keypoints;
  simulation.scene_seed = simulation.noise_seed = options.seed;
  map::SimulatedMap world(
      synthetic::FeatureSimulator(std::move(rig), synthetic::make_orbit({.period_s = 12.0}), simulation));
  for (int i = 0; i < options.keyframes; ++i) world.add_keyframe(FrameId(3 * i), 0.25 * i);
  map::BundledMap& map = world.map;

  const std::vector<LandmarkId> landmarks = map.landmark_ids();
  for (std::size_t i = 0; i + 1 < landmarks.size(); i += 9) map.merge_landmarks(landmarks[i], landmarks[i + 1]);
  for (std::size_t i = 4; i < landmarks.size(); i += 7) map.remove_landmark(landmarks[i]);
  for (std::size_t i = 0; i < landmarks.size(); i += 3) map.add_visibility_counts(landmarks[i], 7, 5);
  map.remove_keyframe(KeyframeId(2));

  const std::vector<int> missing = {1};
  const auto alone = [&](int i) {
    return world.sim.frame(FrameId(100 + i), 6.0 + i, std::span(missing).first(map.rig().size() > 1));
  };
  const synthetic::SimulatedFrame first = alone(0), second = alone(1);
  const KeyframeId root = map.add_keyframe(with_words(first.frame), first.T_world_rig.inverse(), {}, {});
  const KeyframeId child = map.add_keyframe(with_words(second.frame), second.T_world_rig.inverse(), {}, root);
  const std::size_t features = std::min(map.keyframe(root).landmarks.size(), map.keyframe(child).landmarks.size());
  for (std::size_t f = 0; f < features; f += 2) {
    const std::vector<map::Observation> both = {{root, FeatureId(f)}, {child, FeatureId(f), f % 4 == 0}};
    map.add_landmark({1.0 * static_cast<double>(f), 2, 3}, both);
  }
  for (const LandmarkId l : map.landmark_ids()) map.refresh_landmark(l);
  map.set_scale(map::Scale::kUpToScale);
  return map;
}

inline MapFileInfo small_info() { return {0x123456789abcdef0u, "0.1.0", "a recording"}; }

}  // namespace bslam::storage
