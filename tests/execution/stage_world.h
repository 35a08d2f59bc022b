// A run without images: the caller adds keyframes frame by frame, and stages write a hash of their input to the map.
// Any difference of version, order or stage changes all later positions.
#pragma once

#include <bit>
#include <memory>
#include <vector>

#include "execution/stage_executor.h"
#include "map/synthetic_map.h"

namespace bslam::execution {

// Busy work; its result must be used, or the compiler would remove it.
inline double busy(std::uint64_t rounds) {
  double x = 1;
  for (std::uint64_t i = 0; i < rounds; ++i) x = x * 1.0000001 + 1e-9;
  return x;
}

// Order and content of a map as a number.
inline std::uint64_t hash_of(const map::BundledMap& map, std::uint64_t salt) {
  std::uint64_t hash = 14695981039346656037u ^ salt;
  const auto add = [&](std::uint64_t value) { hash = (hash ^ value) * 1099511628211u; };
  add(static_cast<std::uint64_t>(map.version().value()));
  for (std::size_t i = 0; i < map.landmark_slots(); ++i) {
    const Eigen::Vector3d& p = map.landmark(LandmarkId(i)).position;
    for (int axis = 0; axis < 3; ++axis) add(std::bit_cast<std::uint64_t>(p[axis]));
  }
  return hash;
}

inline Eigen::Vector3d point_of(std::uint64_t hash) {
  Random random(hash);
  return map::random_point(random);
}

class StageWorld {
 public:
  StageWorld() {
    Random random(5);
    frame_ = map::synthetic_frame(random, 2, 60, 15);
  }

  map::BundledMap empty_map() const { return map::BundledMap(rig_); }

  // A keyframe with two landmarks, whose positions depend on the version that the frame uses.
  map::MapDraft with_keyframe(FrameId frame, const map::MapSnapshot& seen) const {
    map::MapDraft draft(seen);
    const auto hash = hash_of(*seen, static_cast<std::uint64_t>(frame.value()));
    Random random(hash);
    const KeyframeId k = draft.add_keyframe(frame_, map::random_pose(random, 0.2), {}, KeyframeId());
    for (std::size_t f = 0; f < 2; ++f) draft.add_landmark(map::random_point(random), {{k, FeatureId(f)}});
    return draft;
  }
  KeyframeId add_keyframe(FrameId frame, const map::MapSnapshot& seen, execution::StageExecutor& executor) const {
    return executor.commit(execution::JournalStep::kTrack, with_keyframe(frame, seen)).keyframes.front();
  }

 private:
  std::shared_ptr<const camera::Rig> rig_ = map::synthetic_rig(2);
  std::shared_ptr<const frame::BundledFrame> frame_;
};

// Stages that change two landmarks depending on their input: one is new, one is moved. kKeyframe adds a keyframe. kLoop
// returns a result for every `loop_every`th keyframe only. A stage takes up to about 100 microseconds, depending on
// `delay_seed`; kGlobal four times as long.
inline execution::StageFunctions hashing_stages(std::uint64_t delay_seed, int loop_every = 3,
                                                std::uint64_t max_delay = 100'000) {
  const auto stage = [=](const execution::StageTask& task, const map::MapSnapshot& base,
                         const std::stop_token& stop) -> execution::StageResult {
    const auto number =
        static_cast<std::uint64_t>(task.stage) * 1000 + static_cast<std::uint64_t>(task.keyframe.value());
    Random delay(delay_seed, "delay", number);
    const auto rounds = max_delay == 0 ? 0 : delay.below(static_cast<std::uint32_t>(max_delay));
    for (int part = 0; part < (task.stage == execution::Stage::kGlobal ? 4 : 1); ++part) {
      if (busy(rounds) < 0 || stop.stop_requested()) return {};
    }
    if (task.stage == execution::Stage::kLoop && task.keyframe.value() % loop_every != 0) return {};
    map::MapDraft draft(base);
    const std::uint64_t hash = hash_of(*base, number);
    map::SetPoses poses;
    poses.landmarks.emplace_back(LandmarkId(hash % base->landmark_slots()), point_of(hash));
    draft.set_poses(std::move(poses));
    const FeatureId free(2 + static_cast<std::size_t>(task.stage));
    if (!base->landmark_of(task.keyframe, free).valid())
      draft.add_landmark(point_of(hash + 1), {{task.keyframe, free}});
    return {std::move(draft), {}};
  };
  execution::StageFunctions functions;
  for (const execution::Stage s : execution::kStages) functions[s] = stage;
  functions[execution::Stage::kKeyframe] = [world = StageWorld()](const execution::StageTask& task,
                                                                  const map::MapSnapshot& base, std::stop_token) {
    return execution::StageResult{world.with_keyframe(task.frame, base), {}};
  };
  return functions;
}

}  // namespace bslam::execution
