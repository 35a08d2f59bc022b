// The versioned map at the size of a long run: 1,000 keyframes of 4 cameras with 600 keypoints each, 100,000 landmarks
// with 8 observations each. Keyframe k and landmark l are close if l / 100 is close to k, so that edits are local.
#include <benchmark/benchmark.h>

#include "../tests/map/synthetic_map.h"

namespace bslam::map {
namespace {

constexpr std::size_t kKeyframes = 1000, kLandmarks = 100000, kObservations = 8, kCameras = 4, kPerCamera = 600;
constexpr std::size_t kPerKeyframe = kLandmarks / kKeyframes;  // landmarks first observed by a keyframe

// Frames are shared between keyframes, since only their descriptors are used here.
std::vector<std::shared_ptr<const frame::BundledFrame>> make_frames() {
  Random random(1, "map bench");
  std::vector<std::shared_ptr<const frame::BundledFrame>> frames;
  for (int i = 0; i < 32; ++i) frames.push_back(synthetic_frame(random, kCameras, kPerCamera, 300));
  return frames;
}
const auto& frames() {
  static const auto kFrames = make_frames();
  return kFrames;
}

// Landmark l is observed by kObservations of the 16 keyframes from l / 100 on, with the next free feature of each.
BundledMap make_map() {
  Random random(2, "map bench");
  BundledMap map(synthetic_rig(kCameras));
  for (std::size_t k = 0; k < kKeyframes; ++k) map.add_keyframe(frames()[k % 32], random_pose(random, 1), {}, {});
  std::vector<std::size_t> next_feature(kKeyframes, 0);
  for (std::size_t l = 0; l < kLandmarks; ++l) {
    const std::size_t first = std::min(l / kPerKeyframe, kKeyframes - 16);
    std::vector<Observation> observations;
    for (std::size_t i = 0; i < 16 && observations.size() < kObservations; ++i) {
      const std::size_t k = first + i;
      const bool must = 16 - i <= kObservations - observations.size();
      if (next_feature[k] >= 2100 || !(must || random.below(2) == 0)) continue;
      observations.push_back({KeyframeId(k), FeatureId(next_feature[k]++)});
    }
    if (!observations.empty()) map.add_landmark(random_point(random), observations);
  }
  return map;
}

MapStore& store() {
  static MapStore store(make_map());
  return store;
}
// Benchmarks do not modify the shared store.
BundledMap fresh() { return *store().snapshot(); }

void report(benchmark::State& state) {
  const MapSnapshot map = store().snapshot();
  double covisible = 0;
  for (const KeyframeId k : map->keyframe_ids()) covisible += static_cast<double>(map->keyframe(k).covisible.size());
  state.counters["landmarks"] = static_cast<double>(map->num_landmarks());
  state.counters["keypoints"] = static_cast<double>(map->num_observations());
  state.counters["neighbours"] = covisible / kKeyframes;
}

void Snapshot(benchmark::State& state) {
  MapStore& from = store();
  for (auto _ : state) benchmark::DoNotOptimize(from.snapshot());
  report(state);
}
BENCHMARK(Snapshot);

void EmptyDraft(benchmark::State& state) {
  MapStore copy(fresh());
  for (auto _ : state) copy.commit(MapDraft(copy.snapshot()));
}
BENCHMARK(EmptyDraft)->Unit(benchmark::kMicrosecond);

// The 600 matches are distributed evenly over the landmarks of `spread` keyframes; 1000 is the whole map.
void CommitKeyframe(benchmark::State& state) {
  const auto spread = static_cast<std::size_t>(state.range(0));
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  for (std::size_t i = 0; i < 600; ++i) {
    matches.emplace_back(FeatureId(i),
                         LandmarkId((kKeyframes - spread) * kPerKeyframe / 2 + i * spread * kPerKeyframe / 600));
  }
  for (auto _ : state) {
    state.PauseTiming();
    MapStore copy(fresh());
    state.ResumeTiming();
    MapDraft draft(copy.snapshot());
    draft.add_keyframe(frames()[0], {}, matches, {});
    copy.commit(std::move(draft));
  }
}
BENCHMARK(CommitKeyframe)->Arg(10)->Arg(30)->Arg(1000)->Unit(benchmark::kMicrosecond);

void CommitPoses(benchmark::State& state) {
  const auto keyframes = static_cast<std::size_t>(state.range(0)), landmarks = static_cast<std::size_t>(state.range(1));
  Random random(3, "map bench");
  SetPoses poses;
  const std::size_t first = (kKeyframes - keyframes) / 2;
  for (std::size_t i = 0; i < keyframes; ++i)
    poses.keyframes.emplace_back(KeyframeId(first + i), random_pose(random, 1));
  for (std::size_t i = 0; i < landmarks; ++i) {
    poses.landmarks.emplace_back(LandmarkId(first * kPerKeyframe + i * keyframes * kPerKeyframe / landmarks),
                                 random_point(random));
  }
  MapStore copy(fresh());
  for (auto _ : state) {
    MapDraft draft(copy.snapshot());
    draft.set_poses(poses);
    copy.commit(std::move(draft));
  }
}
BENCHMARK(CommitPoses)->Args({30, 3000})->Args({1000, 3000})->Args({1000, 100000})->Unit(benchmark::kMicrosecond);

void CommitVisibilityCounts(benchmark::State& state) {
  std::vector<VisibilityCount> visibility_counts;
  for (std::size_t i = 0; i < 1000; ++i) visibility_counts.push_back({LandmarkId(50000 + 2 * i), 1, 1});
  MapStore copy(fresh());
  for (auto _ : state) {
    MapDraft draft(copy.snapshot());
    draft.add_visibility_counts(visibility_counts);
    copy.commit(std::move(draft));
  }
}
BENCHMARK(CommitVisibilityCounts)->Unit(benchmark::kMicrosecond);

// The edit of mapping at keyframe 500: 1,000 new landmarks with 3 observations each, 2,000 observations added, 1,000
// removed, 100 merges, and an update of all modified landmarks.
void CommitMappingRun(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    MapStore copy(fresh());
    Random random(4, "map bench");
    state.ResumeTiming();
    MapDraft draft(copy.snapshot());
    std::vector<LandmarkId> touched;
    for (std::size_t i = 0; i < 1000; ++i) {  // the last features of each keyframe are free
      std::vector<Observation> observations;
      for (std::size_t j = 0; j < 3; ++j)
        observations.push_back({KeyframeId(500 + (i + 3 * j) % 20), FeatureId(2099 - i)});
      draft.add_landmark(random_point(random), observations);
    }
    for (std::size_t i = 0; i < 2000; ++i) {
      const LandmarkId l(50000 + i);
      const KeyframeId k(std::size_t{500 + random.below(20)});
      if (draft.add_observation(l, {k, FeatureId(std::size_t{900 + random.below(300)})})) touched.push_back(l);
    }
    for (std::size_t i = 0; i < 1000; ++i) {
      const LandmarkId l(50500 + i);
      draft.remove_observation(l, draft.map().observations(l).front().keyframe);
    }
    for (std::size_t i = 0; i < 100; ++i) draft.merge_landmarks(LandmarkId(50000 + 2 * i), LandmarkId(50001 + 2 * i));
    draft.refresh_landmarks(touched);
    const CommitReport done = copy.commit(std::move(draft));
    state.PauseTiming();
    state.counters["operations"] = static_cast<double>(done.applied);
    state.counters["refreshed"] = static_cast<double>(touched.size());
    state.ResumeTiming();
  }
}
BENCHMARK(CommitMappingRun)->Unit(benchmark::kMicrosecond);

void RemoveKeyframe(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    MapStore copy(fresh());
    state.ResumeTiming();
    MapDraft draft(copy.snapshot());
    draft.remove_keyframe(KeyframeId(500));
    copy.commit(std::move(draft));
  }
}
BENCHMARK(RemoveKeyframe)->Unit(benchmark::kMicrosecond);

void CheckInvariants(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(store().snapshot()->check_invariants());
}
BENCHMARK(CheckInvariants)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace bslam::map
