// Maps of a large hall built from simulated frames together with the ground truth. The path returns to its start, where
// the landmarks seen before are mapped a second time at drifted positions.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "looping/place_recogniser.h"
#include "map/map_store.h"
#include "mapping/simulated_map.h"
#include "place/train.h"
#include "synthetic/feature_simulator.h"
#include "synthetic/rigs.h"

namespace bslam::looping {

using geometry::SE3;
using geometry::Sim3;
using map::angle_rad;
using map::distance_m;
using synthetic::FeatureSimulator;
using synthetic::SimulatedFrame;

constexpr double kDegree = std::numbers::pi / 180;

// 20 m x 20 m; landmarks are visible up to 4.5 m, so the opposite side is never seen.
inline synthetic::FeatureSimulatorOptions hall_options() {
  synthetic::FeatureSimulatorOptions options;
  options.room_low = {-10, -10, 0};
  options.room_high = {10, 10, 3};
  options.landmarks = 24000;
  options.nearest_base = 2.5;
  options.farthest_base = 4.5;
  options.max_keypoints = 400;
  options.flipped_bits = 4;  // random descriptors are close to word boundaries far more often than real ones
  return options;
}

const inline feature::FeatureModel kFeatures{.sigma_px = hall_options().sigma_px};

constexpr double kLapS = 48;       // duration of a lap of 44 m
constexpr double kStepS = 1.0;     // between two keyframes
constexpr int kLapKeyframes = 48;  // keyframes

// Laps with a radius of 7 m and slight sway; `view_yaw` is the angle between viewing and motion direction, radians.
inline synthetic::Trajectory laps(double view_yaw = 0.0) {
  std::vector<synthetic::ControlPose> control;
  for (int i = -1; i < 66; ++i) {
    const double angle = 2 * std::numbers::pi * i / kLapS;
    const double radius = 7.0 + 0.2 * std::sin(5 * angle);
    control.push_back({{radius * std::cos(angle), radius * std::sin(angle), 1.5 + 0.1 * std::sin(9 * angle)},
                       angle + 0.5 * std::numbers::pi + view_yaw,
                       0.05 * std::sin(7 * angle),
                       0.04 * std::sin(4 * angle)});
  }
  return synthetic::Trajectory(std::move(control), 1.0);
}

inline FeatureSimulator hall(camera::Rig rig, double view_yaw = 0.0) {
  return FeatureSimulator(std::move(rig), laps(view_yaw), hall_options());
}

// Rigs of 1, 2 and 4 cameras; the last one looks in all directions.
inline camera::Rig rig_of(int cameras) {
  return cameras == 4 ? synthetic::default_rig() : synthetic::ring_rig(cameras);
}

// The same landmarks for every rig.
inline const std::vector<synthetic::SimulatedLandmark>& hall_landmarks() {
  static const FeatureSimulator simulator = hall(rig_of(1));
  return simulator.landmarks();
}

inline place::VocabularyPtr small_vocabulary() {
  static const place::VocabularyPtr vocabulary = [] {
    std::vector<std::vector<feature::Descriptor>> images(100);
    std::size_t i = 0;
    for (const synthetic::SimulatedLandmark& l : hall_landmarks()) images[i++ % images.size()].push_back(l.descriptor);
    Random random(5, "vocabulary");
    ThreadPool pool(1);
    return place::train_vocabulary(images, {.branching = 10, .levels = 4, .iterations = 6}, random, pool).value();
  }();
  return vocabulary;
}

inline std::unique_ptr<BagOfWordsRecogniser> recogniser(const RecognitionOptions& options = {}) {
  return std::make_unique<BagOfWordsRecogniser>(small_vocabulary(), options);
}

// The hall with `fraction` of its landmarks replaced by different ones; the replacement depends on the seed
// only.
inline SimulatedFrame redecorated(SimulatedFrame seen, double fraction, std::uint64_t seed) {
  for (std::size_t c = 0; c < seen.landmark.size(); ++c) {
    std::vector<feature::Descriptor> descriptors = seen.frame.cameras[c].keypoints.descriptor.copy();
    for (std::size_t k = 0; k < seen.landmark[c].size(); ++k) {
      if (seen.landmark[c][k] < 0) continue;
      Random random(seed, "decoration", static_cast<std::uint64_t>(seen.landmark[c][k]));
      if (random.uniform() >= fraction) continue;
      for (std::uint64_t& word : descriptors[k]) word ^= random.next();
    }
    seen.frame.cameras[c].keypoints.descriptor = std::move(descriptors);
  }
  return seen;
}

class HallMap {
 public:
  using Shown = std::pair<int, int>;  // room, landmark of the simulator
  using Vector3d = Eigen::Vector3d;

  explicit HallMap(const camera::Rig& rig, int max_landmark_age = 8)
      : map(std::make_shared<const camera::Rig>(rig)), max_landmark_age_(max_landmark_age) {}

  // Adds a keyframe of the features of hall number `room`, whose pose is `T_world_room`; its parent is the newest
  // keyframe, or it becomes the root of a submap. `error` is the drift of the estimate, from the true world to the
  // world of the map. Landmarks last seen more than `max_landmark_age` keyframes ago, or in another submap, are not
  // matched again and are therefore duplicated.
  KeyframeId add(const SimulatedFrame& seen, const Sim3& error = {}, int room = 0, const SE3& T_world_room = {},
                 bool new_submap = false) {
    if (new_submap) known_.clear();
    auto stored = std::make_shared<frame::BundledFrame>(seen.frame);
    describe.describe(*stored);
    const KeyframeId k(map.keyframe_slots());
    std::vector<std::pair<FeatureId, LandmarkId>> matches;
    std::vector<std::pair<FeatureId, Shown>> unknown;
    std::map<Shown, bool> taken;
    for (std::size_t f = 0; f < stored->bundled.size(); ++f) {
      const Shown shown{room, map::shown_by(seen, FeatureId(f))};
      if (shown.second < 0 || std::exchange(taken[shown], true)) continue;
      const auto at = known_.find(shown);
      if (at != known_.end() && k.value() - at->second.last.value() <= max_landmark_age_) {
        matches.emplace_back(f, at->second.landmark);
        at->second.last = k;
      } else {
        unknown.emplace_back(f, shown);
      }
    }
    const SE3 T_world_rig = T_world_room * seen.T_world_rig;
    map.add_keyframe(stored, error.apply_to_pose(T_world_rig).inverse(), matches,
                     new_submap ? KeyframeId() : map.newest_keyframe());
    for (const auto& [feature, shown] : unknown) {
      const Vector3d place = T_world_room * hall_landmarks()[static_cast<std::size_t>(shown.second)].position;
      const map::Observation observation{k, feature};
      const LandmarkId l = map.add_landmark(error * place, std::span(&observation, 1));
      known_[shown] = {l, k};
      true_place.push_back(place);
      shown_by_landmark.push_back(shown);
    }
    for (const auto& [feature, l] : matches) map.refresh_landmark(l);
    T_rig_world.push_back(T_world_rig.inverse());
    return k;
  }

  map::MapSnapshot snapshot() const { return std::make_shared<const map::BundledMap>(map); }
  map::MapDraft draft() const { return map::MapDraft(snapshot()); }
  const SE3& truth(KeyframeId k) const { return T_rig_world[k.index()]; }
  const Vector3d& truth(LandmarkId l) const { return true_place[l.index()]; }

  map::BundledMap map;
  std::vector<SE3> T_rig_world;      // ground truth, by keyframe
  std::vector<Vector3d> true_place;  // ground truth, by landmark
  std::vector<Shown> shown_by_landmark;
  BagOfWordsRecogniser describe{small_vocabulary(), {}};

 private:
  struct Known {
    LandmarkId landmark;
    KeyframeId last;
  };
  int max_landmark_age_;
  std::map<Shown, Known> known_;
};

// Returns the similarity whose logarithm is `fraction` times the logarithm of `whole`.
inline Sim3 fraction_of(const Sim3& whole, double fraction) { return Sim3::exp(fraction * whole.log()); }

// Drift at the end of a lap.
inline Sim3 rigid_drift() {
  return Sim3::exp((geometry::Vector7d() << 0.01, -0.012, 0.03, 0.35, -0.3, 0.25, 0).finished());
}
inline Sim3 scale_drift() {
  return Sim3::exp((geometry::Vector7d() << 0.005, -0.006, 0.015, 0.2, -0.15, 0.1, std::log(0.9)).finished());
}

// One lap and `more` keyframes, whose drift grows to `drift` at the end. `after_each` is called with the growing map
// and stops the simulation by returning false.
inline HallMap simulate_lap(const FeatureSimulator& simulator, int more, const Sim3& drift,
                            const std::function<bool(const HallMap&, KeyframeId)>& after_each = {}) {
  HallMap out(simulator.rig());
  if (std::abs(drift.scale() - 1) > 1e-9) out.map.set_scale(map::Scale::kUpToScale);
  const int count = kLapKeyframes + more;
  for (int i = 0; i < count; ++i) {
    const KeyframeId k =
        out.add(simulator.frame(FrameId(i), kStepS * i), fraction_of(drift, static_cast<double>(i) / (count - 1)));
    if (after_each && !after_each(out, k)) break;
  }
  return out;
}

// Two thirds of a lap without drift; created once per rig.
inline const HallMap& map_without_drift(int cameras) {
  static std::map<int, HallMap> made;
  const auto at = made.find(cameras);
  if (at != made.end()) return at->second;
  const FeatureSimulator simulator = hall(rig_of(cameras));
  HallMap& out = made.emplace(cameras, HallMap(simulator.rig())).first->second;
  for (int i = 0; i < 2 * kLapKeyframes / 3; ++i) out.add(simulator.frame(FrameId(i), kStepS * i));
  return out;
}

// A little more than one lap, so that the last keyframe observes the place of the first one; created once per rig and
// drift.
inline const HallMap& map_with_drift(int cameras) {
  static std::map<int, HallMap> made;
  const auto at = made.find(cameras);
  return at != made.end() ? at->second
                          : made.emplace(cameras, simulate_lap(hall(rig_of(cameras)), 2, rigid_drift())).first->second;
}

// The frame as prepared by the tracker for relocalisation.
inline frame::BundledFrame described(const SimulatedFrame& seen) {
  frame::BundledFrame frame = seen.frame;
  recogniser()->describe(frame);
  return frame;
}

inline Random seeded(std::uint64_t seed) { return Random(seed, "test"); }

}  // namespace bslam::looping
