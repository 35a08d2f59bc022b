// A tracker with its map, for tests of its decisions.
#pragma once

#include "tracking/simulated_tracker.h"
#include "tracking/tracker.h"

namespace bslam::tracking {

// A relocaliser that returns a given place, and counts how often the tracker does not find it plausible.
class FixedPlaceRelocaliser : public Relocaliser {
 public:
  FixedPlaceRelocaliser(const std::optional<FoundPlace>& place, int& refused) : place_(place), refused_(refused) {}
  void describe(frame::BundledFrame&) const override {}
  std::optional<FoundPlace> verify_place(const map::BundledMap&, const frame::BundledFrame&,
                                         const std::function<bool(const FoundPlace&)>& plausible) override {
    if (!place_ || plausible(*place_)) return place_;
    ++refused_;
    return std::nullopt;
  }

 private:
  const std::optional<FoundPlace>& place_;
  int& refused_;
};

// A tracker and its map, fed with simulated frames of the orbit.
class TrackerRun {
 public:
  explicit TrackerRun(camera::Rig rig, const TrackerOptions& options = {})
      : TrackerRun(simulator(std::move(rig)), options) {}
  explicit TrackerRun(synthetic::FeatureSimulator simulator, const TrackerOptions& options = {})
      : TrackerRun(simulator, options, map::BundledMap(std::make_shared<const camera::Rig>(simulator.rig()))) {}
  TrackerRun(synthetic::FeatureSimulator simulator, const TrackerOptions& options, map::BundledMap map)
      : sim(std::move(simulator)),
        store(std::move(map)),
        tracker(sim.rig(), options, pool_, std::make_unique<FixedPlaceRelocaliser>(place, refused)),
        pyramids(map::flat_pyramids(sim.rig().size())) {}

  frame::BundledFrame frame(int i) const { return sim.frame(FrameId(i), time_s(i)).frame; }
  static double time_s(int i) { return 0.05 * i; }

  TrackOutcome propose(frame::BundledFrame frame, DirectAttempt direct = {}) {
    frame.twist = state.track.twist.value_or(geometry::Vector6d::Zero());
    return tracker.process(state, std::move(frame), pyramids, store.snapshot(), std::move(direct));
  }
  FrameRecord process(frame::BundledFrame frame, DirectAttempt direct = {}) {
    TrackOutcome outcome = propose(std::move(frame), std::move(direct));
    if (outcome.edit) tracker.committed(store.commit(std::move(outcome.edit->draft)), outcome);
    state = std::move(outcome.next);
    return outcome.record;
  }

  synthetic::FeatureSimulator sim;
  map::MapStore store;
  std::optional<FoundPlace> place;
  int refused = 0;
  FrontEndState state;

 private:
  ThreadPool pool_{1};

 public:
  Tracker tracker;
  std::vector<image::Pyramid> pyramids;
};

inline geometry::SE3 relative(const synthetic::FeatureSimulator& sim, int from, int to) {
  const auto T_world_rig = [&](int i) { return sim.frame(FrameId(i), TrackerRun::time_s(i)).T_world_rig; };
  return T_world_rig(to).inverse() * T_world_rig(from);
}

// A frame in which nothing can be recognised: every descriptor is replaced.
inline frame::BundledFrame elsewhere(frame::BundledFrame frame) {
  Random random(99);
  for (frame::CameraFrame& c : frame.cameras) {
    std::vector<feature::Descriptor> descriptors(c.keypoints.size());
    for (feature::Descriptor& d : descriptors) d = {random.next(), random.next(), random.next(), random.next()};
    c.keypoints.descriptor = std::move(descriptors);
  }
  return frame;
}

}  // namespace bslam::tracking
