// Tracking in a map created from the ground truth.
#pragma once

#include "mapping/simulated_map.h"
#include "tracking/track.h"

namespace bslam::tracking {

constexpr double kDegree = 0.017453292519943295;

// A room of 5000 landmarks.
inline synthetic::FeatureSimulatorOptions room(std::uint64_t scene_seed = 1, double sigma_px = 0.7,
                                               double outlier_share = 0.05) {
  synthetic::FeatureSimulatorOptions options;
  options.scene_seed = scene_seed;
  options.landmarks = 5000;
  options.sigma_px = sigma_px;
  options.outlier_share = outlier_share;
  return options;
}

inline synthetic::FeatureSimulator simulator(camera::Rig rig,
                                             const synthetic::FeatureSimulatorOptions& options = room(),
                                             const synthetic::OrbitOptions& orbit = {}) {
  return synthetic::FeatureSimulator(std::move(rig), synthetic::make_orbit(orbit), options);
}

// Keyframes every `step_s` until `to_s`, numbered from 1000 so that tracked frames have different noise.
inline map::SimulatedMap true_map(synthetic::FeatureSimulator sim, double to_s, double step_s) {
  map::SimulatedMap out(std::move(sim));
  for (int i = 0; step_s * i <= to_s; ++i) out.add_keyframe(FrameId(1000 + i), step_s * i);
  return out;
}

// The state of a tracker that has just created keyframe 0.
inline TrackerState state_at_first(const map::SimulatedMap& world) {
  const KeyframeId first(0);
  std::vector<LandmarkId> seen;
  for (const LandmarkId l : world.map.keyframe(first).landmarks) {
    if (l.valid()) seen.push_back(l);
  }
  std::sort(seen.begin(), seen.end());
  return state_at_keyframe({}, world.frames[0].frame.time_ns, world.map, first, seen);
}

class SimulatedTracker {
 public:
  explicit SimulatedTracker(const map::SimulatedMap& world)
      : state(state_at_first(world)),
        world_(world),
        pyramids_(map::flat_pyramids(world.map.rig().size())),
        alignment_(pyramids_.size()),
        pool_(1) {}

  TrackOutput track(frame::BundledFrame frame) { return track(world_.map, std::move(frame)); }
  TrackOutput track(const map::BundledMap& map, frame::BundledFrame frame) {
    const TrackInput input{.map = map,
                           .pyramids = pyramids_,
                           .alignment = alignment_,
                           .state = state,
                           .features = {world_.sim.options().sigma_px}};
    TrackOutput out = tracking::track(input, frame, options, pool_);
    state = out.state;
    return out;
  }

  TrackerState state;
  TrackingOptions options;

 private:
  const map::SimulatedMap& world_;
  std::vector<image::Pyramid> pyramids_;
  std::vector<matching::AlignmentOptions> alignment_;
  ThreadPool pool_;
};

// Moves a fraction of the keypoints by up to 25 pixels without changing their descriptors.
inline void displace_keypoints(const camera::Rig& rig, double fraction, Random random, frame::BundledFrame& frame) {
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    feature::Refinement k = frame.cameras[c].keypoints.positions();
    for (std::size_t i = 0; i < k.pixel.size(); ++i) {
      if (random.uniform() >= fraction) continue;
      const Eigen::Vector2d moved =
          k.pixel[i].cast<double>() + Eigen::Vector2d(random.uniform(-25, 25), random.uniform(-25, 25));
      const auto bearing = rig.camera(c).unproject(moved);
      if (!bearing || !rig.camera(c).contains(moved)) continue;
      k.pixel[i] = moved.cast<float>();
      k.bearing[i] = *bearing;
    }
    frame.cameras[c] = frame::refined(frame.cameras[c], std::move(k), rig.camera(c));
  }
}

}  // namespace bslam::tracking
