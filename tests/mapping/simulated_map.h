// Maps built from simulated frames together with the ground truth: poses, landmark positions and correspondences.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "image/pyramid.h"
#include "map/map_store.h"
#include "synthetic/feature_simulator.h"
#include "synthetic/rigs.h"

namespace bslam::map {

using synthetic::FeatureSimulator;
using synthetic::SimulatedFrame;

// The simulator's landmark that a feature belongs to, or -1.
inline int shown_by(const SimulatedFrame& frame, FeatureId f) {
  const frame::KeypointRef r = frame.frame.bundled.keypoints(f).front();
  return frame.landmark[r.camera.index()][r.keypoint.index()];
}

// Images without texture for a simulated frame, on which sub-pixel alignment has no effect.
inline std::vector<image::Pyramid> flat_pyramids(std::size_t cameras) {
  image::Pyramid pyramid;
  for (int l = 0; l < 8; ++l) {
    image::Image level(32, 32);
    for (int y = 0; y < 32; ++y) std::fill(level.row(y), level.row(y) + 32, std::uint8_t{0});
    pyramid.levels.push_back(std::move(level));
    pyramid.scale_x.push_back(std::pow(1.2, l));
    pyramid.scale_y.push_back(std::pow(1.2, l));
  }
  return std::vector<image::Pyramid>(cameras, pyramid);
}

class SimulatedMap {
 public:
  explicit SimulatedMap(FeatureSimulator simulator)
      : sim(std::move(simulator)), map(std::make_shared<const camera::Rig>(sim.rig())) {}

  // Adds a keyframe with the features at `time_s` at its true pose. Every feature of a simulated landmark gets a
  // landmark at its true position; if `all` is false, only matched features with a triangulated point do.
  KeyframeId add_keyframe(FrameId id, double time_s, bool all = true) {
    SimulatedFrame& seen = frames.emplace_back(sim.frame(id, time_s));
    if (change_frame) change_frame(seen.frame);
    if (knows_motion) seen.frame.twist = true_twist(time_s);
    const auto stored = std::make_shared<const frame::BundledFrame>(seen.frame);
    std::vector<std::pair<FeatureId, LandmarkId>> known;
    std::vector<std::pair<FeatureId, int>> unknown;
    std::vector<std::uint8_t> taken(sim.landmarks().size(), 0);
    for (std::size_t f = 0; f < stored->bundled.size(); ++f) {
      const int truth = shown_by(seen, FeatureId(f));
      if (truth < 0 || std::exchange(taken[static_cast<std::size_t>(truth)], std::uint8_t{1})) continue;
      const auto at = landmark_of.find(truth);
      if (at != landmark_of.end()) {
        known.emplace_back(f, at->second);
      } else if (all || stored->bundled.point(FeatureId(f))) {
        unknown.emplace_back(f, truth);
      }
    }
    const KeyframeId parent = std::exchange(new_submap_, false) ? KeyframeId() : map.newest_keyframe();
    const KeyframeId k = map.add_keyframe(stored, seen.T_world_rig.inverse(), known, parent);
    for (const auto& [f, truth] : unknown) {
      const Observation observation{k, f};
      const LandmarkId l = map.add_landmark(truth_of(truth), std::span(&observation, 1));
      landmark_of[truth] = l;
      truth_of_landmark[l.value()] = truth;
    }
    for (const auto& [f, l] : known) map.refresh_landmark(l);
    return k;
  }

  // The next keyframe is the root of a submap, which shares no landmarks with the others.
  void begin_submap() {
    new_submap_ = true;
    landmark_of.clear();
  }

  const Eigen::Vector3d& truth_of(int landmark) const {
    return sim.landmarks()[static_cast<std::size_t>(landmark)].position;
  }
  // Mean twist of the rig over the ten milliseconds after `time_s`, rad/s and m/s.
  geometry::Vector6d true_twist(double time_s) const {
    constexpr double kStep = 0.01;
    const auto T_rig_world = [&](double t) {
      return (sim.trajectory().T_world_body(t) * sim.rig().body_from_cam(0)).inverse();
    };
    return (T_rig_world(time_s + kStep) * T_rig_world(time_s).inverse()).log() / kStep;
  }
  geometry::SE3 true_pose(KeyframeId k) const { return frames[k.index()].T_world_rig.inverse(); }
  MapSnapshot snapshot() const { return std::make_shared<const BundledMap>(map); }
  MapDraft draft() const { return MapDraft(snapshot()); }

  FeatureSimulator sim;
  BundledMap map;
  std::function<void(frame::BundledFrame&)> change_frame;  // applied to the frames of keyframes; may be empty
  bool knows_motion = false;                               // keyframes are added with the true twist of the rig
  std::vector<SimulatedFrame> frames;                      // one per keyframe
  std::unordered_map<int, LandmarkId> landmark_of;
  std::unordered_map<int, int> truth_of_landmark;  // by id

 private:
  bool new_submap_ = false;  // the next keyframe is a root
};

// Distance in metres between the centres, and angle in radians between the orientations, of two poses T_rig_world.
inline double distance_m(const geometry::SE3& a, const geometry::SE3& b) {
  return (a.inverse().translation() - b.inverse().translation()).norm();
}
inline double angle_rad(const geometry::SE3& a, const geometry::SE3& b) {
  return a.rotation().angularDistance(b.rotation());
}

// Number of features of a keyframe that belong to a landmark.
inline std::ptrdiff_t num_observed(const BundledMap& map, KeyframeId keyframe) {
  return std::ranges::count_if(map.keyframe(keyframe).landmarks, &LandmarkId::valid);
}

}  // namespace bslam::map
